"""Several whiskers, each on its own base, pushed against one object: the mechanics of one, for each.

A column's whiskers sit on one motor. All motors start together and go equally far at one speed,
each from before the first touch of its column. No whisker touches another.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from bench.base.errors import BadInput
from bench.rig import build
from bench.rig.bar import UnloadedTouch, find_first_touch, unloaded_curve
from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.protocol import Protocol, ProtocolRun
from bench.rig.protocol_tables import ColumnTable
from bench.rig.recording import (
    Exposures,
    GaugedWhisker,
    Recording,
    channel_names,
    place_object,
    plan_stroke,
    sample_signals,
)
from bench.rig.stroke import Stroke
from bench.rig.touched_object import TouchedObject

# rad: a protocol's largest push, for the whisker that touches first
_FARTHEST_RAD = math.radians(25.0)
# rad: where a whisker's first touch is searched, about the direction in which one at the rig's
# origin would touch
_SWEPT_RAD = np.radians(np.arange(-60.0, 60.0, 0.25))
_ARCS = 200  # points of a whisker in that search; a bar is thicker than their distance


@dataclass(frozen=True, eq=False)
class MountedWhisker(GaugedWhisker):
    """A whisker of an array: its name, its column's table, and its pose (3, 4), T_rig_base, mm."""

    name: str
    column: ColumnTable
    pose: np.ndarray


def mount_whiskers(protocol: Protocol, rng: np.random.Generator) -> list[MountedWhisker]:
    """Return the whiskers of a protocol's columns; rng draws their gauges' coefficients."""
    whiskers = []
    for column in protocol.columns:
        rotation = build.column_pose(column)[:, :3]
        for number, height in enumerate(column.heights_mm):
            scatter = np.exp(column.gauge_scatter * rng.standard_normal((2, 2)))
            matrix = protocol.gauges.matrix_Nmm_per_V * scatter
            gauges = msgspec.structs.replace(protocol.gauges, matrix_Nmm_per_V=matrix.tolist())
            base_mm = np.round(np.array(column.base_mm) + height * rotation[:, 2], 9)
            pose = np.column_stack([rotation, base_mm])
            name = f"{column.name}{number + 1}"
            rod = _column_rod(protocol, column, number)
            whiskers.append(MountedWhisker(rod, gauges, name, column, pose))
    return whiskers


def _column_rod(protocol, column, number) -> Rod:
    """Build one of a column's rods, with its own length and diameter where the column gives
    them."""
    sizes = {}
    for key in ("length_mm", "diameter_mm"):
        given = getattr(column, key)
        size = given[number] if isinstance(given, list) else given
        sizes[key] = size or getattr(protocol.whisker, key)
    whisker = protocol.whisker
    rest = RestShape(sizes["length_mm"], whisker.sag_mm, whisker.set_y_mm, whisker.set_z_mm)
    return replace(build.rod(protocol), rest=rest, **sizes)


@dataclass(frozen=True, eq=False)
class ArrayRecording:
    """A trial of an array.

    bar: in the rig frame. recordings: by whisker, each in its own base frame, None of one that
    touches nothing. strokes: by column. channels: by column of signals.csv, each (n,).
    frame_times_s: of each whisk.
    """

    run: ProtocolRun
    bar: TouchedObject
    recordings: dict[str, Recording | None]
    strokes: dict[str, Stroke]
    channels: dict[str, np.ndarray]
    frame_times_s: list[np.ndarray]

    @classmethod
    def make(
        cls,
        run: ProtocolRun,
        whiskers: Sequence[MountedWhisker],
        rngs: Sequence[np.random.Generator],
    ) -> "ArrayRecording":
        """Simulate a run; the first generator is for where the object stands, then one a whisker.

        Raises ArithmeticError, naming the whisker, where one cannot go on, BadInput where one
        cannot begin.
        """
        bar, near_rad, _ = place_object(run, build.rod(run.protocol), rngs[0])
        touches = {}
        for whisker in whiskers:
            touches[whisker.name] = _find_touch(whisker, bar, near_rad)
        strokes = _plan_strokes(run, whiskers, touches, near_rad)
        frame_times_s = _frame_times_s(run, next(iter(strokes.values())))
        recordings = {}
        channels = {}
        for whisker, rng in zip(whiskers, rngs[1:]):
            stroke = strokes[whisker.column.name]
            recording, signals = _record(
                run, whisker, bar, touches[whisker.name], stroke, frame_times_s, rng
            )
            recordings[whisker.name] = recording
            columns = dict(zip(channel_names(run.protocol), signals.T))
            _add_channels(channels, whisker, columns, len(strokes) > 1)
        return cls(run, bar, recordings, strokes, channels, frame_times_s)


def _record(
    run, whisker, bar, touch, stroke, frame_times_s, rng
) -> tuple[Recording | None, np.ndarray]:
    """Simulate one whisker; return its recording, None where it touches nothing, and its signals.

    Raises ArithmeticError, naming it, where it cannot go on.
    """
    if touch is None or touch.motor_rad >= stroke.angles_rad.max():
        return None, sample_signals(run, stroke, (), whisker.gauges, rng)
    exposures = _exposures(stroke, frame_times_s)
    own_bar = bar.in_frame(whisker.pose)
    try:
        recording = Recording.record(run, whisker, own_bar, touch, stroke, exposures, rng)
    except ArithmeticError as problem:
        raise ArithmeticError(f"whisker {whisker.name}: {problem}") from None
    return recording, recording.signals


def _find_touch(
    whisker: MountedWhisker, bar: TouchedObject, near_rad: float
) -> UnloadedTouch | None:
    """Find a whisker's first touch; raise BadInput where it lies within the object."""
    try:
        own_bar = bar.in_frame(whisker.pose)
        return find_touch_from_afar(whisker.rod, own_bar, _motor_towards(whisker, near_rad))
    except ValueError as problem:
        raise BadInput(
            f"whisker {whisker.name} {problem}; its base_mm or the trial's d_x_mm is another"
        ) from None


def _motor_towards(whisker: MountedWhisker, angle_rad: float) -> float:
    """Return the motor angle that its column states, else that at which a whisker points as one at
    the rig's origin does at `angle_rad`."""
    if whisker.column.near_deg is not msgspec.UNSET:
        return math.radians(whisker.column.near_deg)
    x, y, _ = whisker.pose[:, :3].T @ [math.cos(angle_rad), math.sin(angle_rad), 0.0]
    return math.atan2(y, x)


def find_touch_from_afar(rod: Rod, bar: TouchedObject, towards_rad: float) -> UnloadedTouch | None:
    """Find the first touch of a whisker that comes from lower motor angles, within 60° of a
    direction; None where it meets nothing there.

    Raises ValueError where it lies within the object from the beginning.
    """
    arcs = np.linspace(0.0, rod.length_mm, _ARCS)
    for number, angle in enumerate(towards_rad + _SWEPT_RAD):
        points, _ = unloaded_curve(rod, angle, arcs)
        gaps = bar.outside_mm(points) - rod.radius_mm(arcs)
        if gaps.min() <= 0.0:
            if number == 0:
                raise ValueError("stands in the bar before it moves")
            return find_first_touch(rod, bar, angle, float(arcs[gaps.argmin()]))
    return None


def _plan_strokes(run, whiskers, touches, near_rad) -> dict[str, Stroke]:
    """Return each column's stroke, from before its first touch; all go as far as the one that
    goes farthest."""
    before_rad = math.radians(run.before_deg)
    after_rad = math.radians(run.after_deg)
    starts = {}
    spans = []
    for name, angles in _touch_angles_rad(whiskers, touches, near_rad).items():
        starts[name] = min(angles) - before_rad
        last = min(max(angles), min(angles) + _FARTHEST_RAD - after_rad)
        spans.append(last + after_rad - starts[name])
    span = max(spans)
    return {name: plan_stroke(run, low, low + span) for name, low in starts.items()}


def _touch_angles_rad(whiskers, touches, near_rad) -> dict[str, list[float]]:
    """Return the motor angles of first touch by column; of one that touches nothing, that at which
    its first whisker points to where one at the rig's origin would touch."""
    columns = {}
    for whisker in whiskers:
        columns.setdefault(whisker.column.name, []).append(whisker)
    angles = {}
    for name, members in columns.items():
        known = [touches[whisker.name] for whisker in members if touches[whisker.name]]
        angles[name] = [touch.motor_rad for touch in known]
        angles[name] = angles[name] or [_motor_towards(members[0], near_rad)]
    return angles


def _frame_times_s(run, stroke) -> list[np.ndarray]:
    """Return the middles of the exposures of each forward stroke, from end to end of it."""
    pictures = run.protocol.pictures
    step_s = 1.0 / pictures.rate_Hz if pictures.rate_Hz else pictures.step_deg / run.speed_deg_s
    return [np.arange(start, end, step_s) for start, end in stroke.forward]


def _exposures(stroke, frame_times_s) -> Exposures:
    """Return the frames of all whisks; none is on a way back."""
    times = np.concatenate(frame_times_s)
    whisk = np.repeat(np.arange(len(frame_times_s)), [len(some) for some in frame_times_s])
    return Exposures(times, stroke.angle_rad(times), whisk, np.zeros(len(times), bool))


def _add_channels(channels, whisker, columns, several_motors):
    """Add a whisker's columns of signals.csv, by name; time and its motor's, where they are not there
    yet."""
    for name, column in columns.items():
        if name == "time_s":
            channels.setdefault(name, column)
        elif name == "motor_deg":
            channels.setdefault(motor_channel(whisker, several_motors), column)
        else:
            channels[f"{name}@{whisker.name}"] = column


def motor_channel(whisker: MountedWhisker, several_motors: bool) -> str:
    """Return the name of the whisker's motor column in signals.csv."""
    return f"motor_deg@{whisker.column.name}" if several_motors else "motor_deg"


def base_keys(whisker: MountedWhisker, several_motors: bool, *, states_gauges: bool) -> dict:
    """Return the keys of [[whiskers]] of session.toml for a whisker."""
    rod = whisker.rod
    keys = {
        "name": whisker.name,
        "base_mm": whisker.pose[:, 3].tolist(),
        "base_deg": list(whisker.column.base_deg),
        "shape": rod.shape,
        "length_mm": rod.length_mm,
        "diameter_mm": rod.diameter_mm,
        "youngs_modulus_GPa": rod.youngs_modulus_GPa,
    }
    if rod.tip_diameter_mm:
        keys["tip_diameter_mm"] = rod.tip_diameter_mm
    if several_motors:
        keys["channels"] = {"motor_deg": motor_channel(whisker, several_motors)}
    if states_gauges:
        gauges = whisker.gauges
        matrix = np.round(gauges.matrix_Nmm_per_V, 9).tolist()
        keys["gauges"] = {"offset_V": list(gauges.offset_V), "matrix_Nmm_per_V": matrix}
    return keys
