"""From a protocol's tables to the rig's parts."""

import math

import cv2
import msgspec
import numpy as np

from bench.rig.elastic_rod import Rest, Rod
from bench.rig.force_sensor import LoadCell
from bench.rig.light import Light, Material
from bench.rig.painted_scene import Appearance, Scene, Stand
from bench.rig.pinhole import Camera
from bench.rig.printed_board import Board, Ink
from bench.rig.protocol import ColumnTable, Protocol
from bench.rig.sensor import Sensor
from bench.rig.strain_gauges import Gauges


def rod(protocol: Protocol) -> Rod:
    """The whisker of a protocol."""
    w = protocol.whisker
    rest = Rest(w.length_mm, w.sag_mm, w.set_y_mm, w.set_z_mm)
    return Rod(
        w.shape,
        w.length_mm,
        w.diameter_mm,
        w.youngs_modulus_GPa,
        w.density_kg_m3,
        rest,
        w.tip_diameter_mm,
    )


def gauges(protocol: Protocol) -> Gauges:
    """The gauges of a protocol."""
    g = protocol.gauges
    return Gauges(
        np.array(g.matrix_Nmm_per_V),
        np.array(g.offset_V),
        g.noise_V,
        g.hum_V,
        g.hum_Hz,
        g.drift_V_per_s,
        g.filter_Hz,
        g.rate_Hz,
        g.adc_bits,
        g.range_V,
    )


def load_cell(protocol: Protocol) -> LoadCell | None:
    """The load cell of a protocol; None where it has none."""
    c, g = protocol.load_cell, protocol.gauges
    if c is msgspec.UNSET:
        return None
    return LoadCell(c.noise_N, c.hum_N, c.hum_Hz, c.drift_N_per_s, c.step_N, g.filter_Hz, g.rate_Hz)


def cameras(protocol: Protocol) -> list[Camera]:
    """The cameras of a protocol, in its order. Raises ValueError where one has no place."""
    nowhere = [c.name for c in protocol.cameras if c.position_mm is None]
    if nowhere:
        raise ValueError(f"camera {nowhere[0]} has no position_mm; `whisker-bench plan` finds one")
    return [
        Camera.aim(
            c.name,
            size_px=c.size_px,
            focal_px=c.focal,
            aspect=c.aspect,
            distortion=c.distortion,
            position_mm=np.array(c.position_mm),
            target_mm=np.array(c.target_mm),
            roll_rad=math.radians(c.roll_deg),
            centre_px=c.centre_px,
        )
        for c in protocol.cameras
    ]


def board(protocol: Protocol) -> Board:
    """The board of a protocol."""
    b = protocol.board
    return Board(tuple(b.squares), b.square_mm, b.marker_mm, b.dictionary, b.legacy, b.inverted)


def T_rig_board(protocol: Protocol) -> np.ndarray:
    """Where the board stands, (3, 4): lying face up, turned about the rig's z and tilted a little."""
    b = protocol.board
    tilt = cv2.Rodrigues(np.radians([*b.tilt_deg, 0.0]))[0]
    turn = cv2.Rodrigues(np.radians([0.0, 0.0, b.turn_deg]))[0]
    return np.column_stack([turn @ np.diag([1.0, -1.0, -1.0]) @ tilt, b.origin_mm])


def stated_T_rig_board(protocol: Protocol, rng: np.random.Generator) -> np.ndarray:
    """What session.toml says of the board's pose: the true one, wrong by the protocol's sigmas about the board's
    middle.
    """
    true, b = T_rig_board(protocol), protocol.board
    turn = cv2.Rodrigues(math.radians(b.pose_sigma_deg) * rng.standard_normal(3))[0]
    shift = b.pose_sigma_mm * rng.standard_normal(3)
    middle = true[:, :3] @ [*(0.5 * s for s in board(protocol).size_mm), 0] + true[:, 3]
    return np.column_stack([turn @ true[:, :3], turn @ (true[:, 3] - middle) + middle + shift])


def scene(protocol: Protocol) -> Scene:
    """The scene of a protocol: its light and what things look like in it."""
    table = protocol.light
    towards = np.array(table.towards) / np.linalg.norm(table.towards)
    appearance = Appearance(
        Light(towards, table.lamp, table.soft),
        Ink(table.paper, table.ink),
        Material(table.wire_matt, table.wire_shiny, table.wire_gloss, table.wire_rim),
        Material(table.bar_matt, table.bar_shiny, table.bar_gloss, table.bar_rim),
        Material(0.03),
        table.floor,
        table.wall,
    )
    return Scene(board(protocol), T_rig_board(protocol), appearance, _stands(protocol))


def _stands(protocol: Protocol) -> tuple[Stand, ...]:
    if not protocol.columns:
        return (Stand.alone(),)
    return tuple(
        Stand.of_column(column_pose(column), column.heights_mm) for column in protocol.columns
    )


def column_pose(column: ColumnTable) -> np.ndarray:
    """Of a column's height 0 in the rig frame, (3, 4): turned about the rig's x, then y, then z."""
    about_x, about_y, about_z = (
        cv2.Rodrigues(turn)[0] for turn in np.diag(np.radians(column.base_deg))
    )
    return np.column_stack([about_z @ about_y @ about_x, column.base_mm])


def sensor(protocol: Protocol) -> Sensor:
    """The sensor of the protocol's cameras."""
    p = protocol.pictures
    return Sensor(p.blur_px, p.vignetting, p.read_noise, p.shot_noise, p.grain, p.bits)
