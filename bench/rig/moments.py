"""What moves at the instants of one exposure: hubs and whiskers, as many instants as the blur of motion asks for."""

from collections.abc import Sequence

import numpy as np

from bench.rig.array_rig import ArrayRecording, Mounted
from bench.rig.bar import unloaded
from bench.rig.elastic_rod import Rod
from bench.rig.light import Material
from bench.rig.marched import MarchedWhisk
from bench.rig.painted_scene import HUB_FRONT_MM
from bench.rig.protocol import Protocol
from bench.rig.recording import Recording
from bench.rig.studio import Moment, Studio
from bench.rig.tube import Tube

_STATIONS = 257  # of a whisker's axis


def moments_of(
    protocol: Protocol,
    studio: Studio,
    recording: Recording,
    whisk: MarchedWhisk,
    motor: float,
    back: bool,
) -> list[Moment]:
    """Instants of one exposure: as many as keep the whisker's tip within half a pixel from one to the next."""
    turns = _turns(
        protocol,
        studio,
        recording.run.speed_deg_s,
        recording.rod.length_mm,
        recording.touch.point_mm,
    )
    return [
        Moment.alone(m, _whisker(whisk, m, back, studio.scene.appearance.wire))
        for m in (motor + turns).tolist()
    ]


def moments_of_array(
    protocol: Protocol,
    studio: Studio,
    recording: ArrayRecording,
    whiskers: Sequence[Mounted],
    time_s: float,
    whisk: int,
) -> list[Moment]:
    """The same of an array, about a time of one of its whisks; `whiskers`: those that were recorded."""
    longest = max(whisker.rod.length_mm for whisker in whiskers)
    turns = _turns(protocol, studio, recording.run.speed_deg_s, longest, recording.bar.point_mm)
    motor = {name: float(stroke.angle_rad(time_s)) for name, stroke in recording.strokes.items()}
    columns = dict(zip(motor, studio.scene.stands))
    return [
        Moment(
            tuple(stand.hub(motor[name] + turn) for name, stand in columns.items()),
            tuple(
                _mounted(
                    one,
                    recording,
                    whisk,
                    motor[one.column.name] + turn,
                    studio.scene.appearance.wire,
                )
                for one in whiskers
            ),
        )
        for turn in turns.tolist()
    ]


def _turns(protocol, studio, speed_deg_s, length_mm, near_mm) -> np.ndarray:
    """By how much the motor has turned, rad, from the middle of an exposure."""
    pictures = protocol.pictures
    swept = np.radians(speed_deg_s) * pictures.exposure_s if pictures.motion_blur else 0.0
    near = np.linalg.norm(studio.camera.centre_mm - near_mm)
    count = 1 + int(2 * swept * length_mm * studio.camera.matrix[0, 0] / near)
    return swept * ((np.arange(count) + 0.5) / count - 0.5)


def _whisker(whisk: MarchedWhisk, motor: float, back: bool, material: Material) -> Tube:
    arc = _arcs(whisk.rod)
    return _tube(
        whisk.rod,
        arc,
        whisk.centreline_mm(motor, whisk.way(back).state_between(motor), arc),
        material,
    )


def _mounted(
    whisker: Mounted, recording: ArrayRecording, whisk: int, motor: float, material: Material
) -> Tube:
    """A whisker of an array in the rig frame; straight where it touches nothing in its trial."""
    one, arc = recording.recordings[whisker.name], _arcs(whisker.rod)
    if one is None:
        points = unloaded(whisker.rod, motor, arc)[0]
    else:
        marched = one.whisks[whisk]
        points = marched.centreline_mm(motor, marched.forward.state_between(motor), arc)
    return _tube(whisker.rod, arc, points @ whisker.pose[:, :3].T + whisker.pose[:, 3], material)


def _arcs(rod: Rod) -> np.ndarray:
    return np.linspace(HUB_FRONT_MM, rod.length_mm, _STATIONS)


def _tube(rod: Rod, arc: np.ndarray, points: np.ndarray, material: Material) -> Tube:
    return Tube(points, np.maximum(rod.radius_mm(arc), 0.01), material)
