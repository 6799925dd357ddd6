"""Whisker, cameras, board, scene and sensor, built from a protocol's tables."""

import math

import cv2
import numpy as np

from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.light import Light, Material
from bench.rig.linear import compose, rotation_about_z
from bench.rig.mirror import MirrorStudio, Part, direct_part, mirrored_part
from bench.rig.other_boards import (
    AnyBoard,
    PrintedAprilGrid,
    PrintedCheckerboard,
    PrintedCircles,
)
from bench.rig.painted_scene import Appearance, Scene, Stand
from bench.rig.pinhole import PinholeCamera
from bench.rig.printed_board import Ink, PrintedBoard
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import CameraTable, ColumnTable
from bench.rig.sensor import Sensor
from bench.rig.studio import Studio


def rod(protocol: Protocol) -> Rod:
    """Build the whisker."""
    table = protocol.whisker
    rest = RestShape(table.length_mm, table.sag_mm, table.set_y_mm, table.set_z_mm)
    tip_mm = sum(table.widths) * table.diameter_mm if table.widths else table.tip_diameter_mm
    return Rod(
        "tapered" if table.widths else table.shape,
        table.length_mm,
        table.diameter_mm,
        table.youngs_modulus_GPa,
        table.density_kg_m3,
        rest,
        tip_mm,
        table.widths or (),
    )


def cameras(protocol: Protocol) -> list[PinholeCamera]:
    """Build the cameras in the protocol's order, one that a mirror makes after that before it.

    Raises ValueError where one has no place.
    """
    return [part.camera for table in protocol.cameras for part in _parts(table)]


def studios(protocol: Protocol) -> list[Studio | MirrorStudio]:
    """Build the cameras that take pictures, with their scene. Raises ValueError where one has no place."""
    before = scene(protocol)
    own_sensor = sensor(protocol)
    built: list[Studio | MirrorStudio] = []
    for table in protocol.cameras:
        camera = _camera(table)
        if table.mirror:
            built.append(MirrorStudio(camera, _parts(table), before, own_sensor))
        else:
            built.append(Studio(camera, before, own_sensor))
    return built


def _parts(table: CameraTable) -> list[Part]:
    """Build the parts of a camera's picture, the whole one where there is no mirror."""
    camera = _camera(table)
    mirror = table.mirror
    if not mirror:
        return [Part(camera, 0, 0, False)]
    seen = mirrored_part(camera, mirror.name, mirror.crop, mirror.point_mm, mirror.normal)
    return [direct_part(camera, mirror.crop), seen]


def _camera(table: CameraTable) -> PinholeCamera:
    """Build a camera, of its whole picture. Raises ValueError where it has no place."""
    if table.position_mm is None:
        raise ValueError(f"camera {table.name} has no position_mm; `whisker-bench plan` finds one")
    return PinholeCamera.aim(
        table.name,
        size_px=table.size_px,
        focal_px=table.focal,
        aspect=table.aspect,
        distortion=table.distortion,
        position_mm=np.array(table.position_mm),
        target_mm=np.array(table.target_mm),
        roll_rad=math.radians(table.roll_deg),
        centre_px=table.centre_px,
    )


def board(protocol: Protocol) -> AnyBoard:
    """Build the board."""
    table = protocol.board
    squares = tuple(table.squares)
    if table.kind == "checkerboard":
        return PrintedCheckerboard(squares, table.square_mm, table.dictionary)
    if table.kind == "aprilgrid":
        return PrintedAprilGrid(squares, table.square_mm, table.marker_mm, table.dictionary)
    if table.kind in ("circles", "asymmetric_circles"):
        is_shifted = table.kind == "asymmetric_circles"
        return PrintedCircles(
            squares, table.square_mm, table.marker_mm, table.dictionary, is_shifted
        )
    return PrintedBoard(
        squares,
        table.square_mm,
        table.marker_mm,
        table.dictionary,
        table.legacy,
        table.inverted,
    )


def T_rig_board(protocol: Protocol) -> np.ndarray:
    """Return the pose (3, 4) of the board's frame."""
    return compose(_T_rig_print(protocol), board(protocol).T_print_board)


def _T_rig_print(protocol):
    """Return the pose (3, 4) of the board's print: lying face up, turned about the rig's z and tilted a
    little."""
    table = protocol.board
    tilt = cv2.Rodrigues(np.radians([*table.tilt_deg, 0.0]))[0]
    face_up = np.diag([1.0, -1.0, -1.0])
    rotation = rotation_about_z(math.radians(table.turn_deg)) @ face_up @ tilt
    return np.column_stack([rotation, table.origin_mm])


def stated_T_rig_board(protocol: Protocol, rng: np.random.Generator) -> np.ndarray:
    """Draw the pose (3, 4) that session.toml states of the board: the true one, wrong by the
    protocol's sigmas about the board's middle."""
    table = protocol.board
    pose = _T_rig_print(protocol)
    error = cv2.Rodrigues(math.radians(table.pose_sigma_deg) * rng.standard_normal(3))[0]
    shift = table.pose_sigma_mm * rng.standard_normal(3)
    own = board(protocol)
    middle = pose @ np.append(0.5 * np.array(own.size_mm), [0.0, 1.0])
    origin = error @ (pose[:, 3] - middle) + middle + shift
    return compose(np.column_stack([error @ pose[:, :3], origin]), own.T_print_board)


def scene(protocol: Protocol) -> Scene:
    """Build the scene: its light and the appearance of what is in it."""
    table = protocol.light
    direction = np.array(table.towards) / np.linalg.norm(table.towards)
    appearance = Appearance(
        Light(direction, table.lamp, table.soft),
        Ink(table.paper, table.ink),
        Material(table.wire_matt, table.wire_shiny, table.wire_gloss, table.wire_rim),
        Material(table.bar_matt, table.bar_shiny, table.bar_gloss, table.bar_rim),
        Material(0.03),
        table.floor,
        table.wall,
    )
    stands = []
    for column in protocol.columns or ():
        stands.append(Stand.of_column(column_pose(column), column.heights_mm))
    stands = tuple(stands) or (Stand.alone(),)
    return Scene(board(protocol), _T_rig_print(protocol), appearance, stands)


def column_pose(column: ColumnTable) -> np.ndarray:
    """Return the pose (3, 4) of a column's height 0 in the rig frame: turned about the rig's x,
    then y, then z."""
    rotation = np.eye(3)
    for turn in np.diag(np.radians(column.base_deg)):
        rotation = cv2.Rodrigues(turn)[0] @ rotation
    return np.column_stack([rotation, column.base_mm])


def sensor(protocol: Protocol) -> Sensor:
    """Build the sensor of the cameras."""
    table = protocol.pictures
    return Sensor(
        table.blur_px,
        table.vignetting,
        table.read_noise,
        table.shot_noise,
        table.grain,
        table.bits,
    )
