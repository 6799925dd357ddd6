"""Hubs and whiskers at the instants of one exposure, as many instants as motion blur requires."""

from collections.abc import Sequence

import numpy as np

from bench.rig.array_rig import ArrayRecording, MountedWhisker
from bench.rig.bar import unloaded_curve
from bench.rig.elastic_rod import Rod
from bench.rig.light import Material
from bench.rig.mirror import MirrorStudio
from bench.rig.painted_scene import HUB_FRONT_MM
from bench.rig.recording import Recording
from bench.rig.studio import Instant, Studio
from bench.rig.tube import Tube
from bench.rig.whisk_mechanics import WhiskMechanics

_STATIONS = 257  # of a whisker's axis
_LEAST_RADIUS_MM = 0.01  # of a whisker in pictures


def exposure_instants(
    studio: Studio | MirrorStudio,
    recording: Recording,
    whisk: WhiskMechanics,
    motor_rad: float,
    back: bool,
) -> list[Instant]:
    """Return the instants of one exposure: as many as keep the whisker's tip within half a pixel
    from one to the next."""
    rod = recording.rod
    near_mm = recording.touch.point_mm
    arc = _drawn_arcs_mm(rod)
    instants = []
    for turn in _exposure_turns_rad(recording.run, studio, rod.length_mm, near_mm):
        state = whisk.path(back).state_between(motor_rad + turn)
        points = whisk.centreline_mm(motor_rad + turn, state, arc)
        tube = _tube(rod, arc, points, studio.scene.appearance.wire)
        instants.append(Instant.alone(motor_rad + turn, tube))
    return instants


def array_exposure_instants(
    studio: Studio | MirrorStudio,
    recording: ArrayRecording,
    whiskers: Sequence[MountedWhisker],
    time_s: float,
    whisk: int,
) -> list[Instant]:
    """Return the instants of one exposure of an array, about a time of one of its whisks."""
    length_mm = max(whisker.rod.length_mm for whisker in whiskers)
    near_mm = recording.bar.point_mm
    instants = []
    for turn in _exposure_turns_rad(recording.run, studio, length_mm, near_mm):
        motor = {}  # rad, by column
        hubs = []
        for stand, (name, stroke) in zip(studio.scene.stands, recording.strokes.items()):
            motor[name] = float(stroke.angle_rad(time_s)) + turn
            hubs.append(stand.hub(motor[name]))
        tubes = []
        for whisker in whiskers:
            at_rad = motor[whisker.column.name]
            tubes.append(
                _array_tube(whisker, recording, whisk, at_rad, studio.scene.appearance.wire)
            )
        instants.append(Instant(tuple(hubs), tuple(tubes)))
    return instants


def _exposure_turns_rad(run, studio, length_mm, near_mm) -> list[float]:
    """Return by how much the motor has turned since the middle of the exposure, at each
    instant."""
    pictures = run.protocol.pictures
    swept = np.radians(run.speed_deg_s) * pictures.exposure_s if pictures.motion_blur else 0.0
    near = np.linalg.norm(studio.camera.centre_mm - near_mm)
    count = 1 + int(2 * swept * length_mm * studio.camera.matrix[0, 0] / near)
    return (swept * ((np.arange(count) + 0.5) / count - 0.5)).tolist()


def _array_tube(
    whisker: MountedWhisker,
    recording: ArrayRecording,
    whisk: int,
    motor_rad: float,
    material: Material,
) -> Tube:
    """Return a whisker of an array in the rig frame; unloaded where it touches nothing in its
    trial."""
    arc = _drawn_arcs_mm(whisker.rod)
    own = recording.recordings[whisker.name]
    if own is None:
        points, _ = unloaded_curve(whisker.rod, motor_rad, arc)
    else:
        mechanics = own.whisks[whisk]
        state = mechanics.forward.state_between(motor_rad)
        points = mechanics.centreline_mm(motor_rad, state, arc)
    points = points @ whisker.pose[:, :3].T + whisker.pose[:, 3]
    return _tube(whisker.rod, arc, points, material)


def _drawn_arcs_mm(rod: Rod) -> np.ndarray:
    """Return the arc lengths of a whisker that are drawn: those in front of the hub."""
    return np.linspace(HUB_FRONT_MM, rod.length_mm, _STATIONS)


def _tube(rod: Rod, arc: np.ndarray, points: np.ndarray, material: Material) -> Tube:
    """Return the tube about points (n, 3) at arc lengths (n,)."""
    return Tube(points, np.maximum(rod.radius_mm(arc), _LEAST_RADIUS_MM), material)
