"""Several whiskers, each on its own base, pushed against one bar: the exact mechanics of one, once a whisker.

A column's whiskers sit on one motor. All motors start together and go equally far at one speed, each from before the
first touch of its column. No whisker touches another.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.base.errors import BadInput
from bench.rig import build
from bench.rig.bar import Bar, Touch, first_touch, unloaded
from bench.rig.elastic_rod import Rest, Rod
from bench.rig.protocol import ColumnTable, Protocol, Run
from bench.rig.recording import Frames, Recording, placed_bar, signals
from bench.rig.strain_gauges import Gauges
from bench.rig.stroke import Stroke

_FARTHEST_RAD = math.radians(
    25.0
)  # rad: a protocol's largest push, for the whisker that touches first
_SWEPT_RAD = np.radians(
    np.arange(-60.0, 60.0, 0.25)
)  # rad: where a whisker's first touch is looked for, about the
# direction in which one at the rig's origin would touch
_SIZES = ("length_mm", "diameter_mm")
_ARCS = 200  # points of a whisker in that look; a bar is thicker than their distance


@dataclass(frozen=True, eq=False)
class Mounted:
    """A whisker of an array: its table as a whisker's, rod, gauges, and pose (3, 4), T_rig_base, mm."""

    name: str
    column: ColumnTable
    base_mm: tuple[float, ...]
    rod: Rod
    gauges: Gauges
    pose: np.ndarray


def mounted(protocol: Protocol, rng: np.random.Generator) -> list[Mounted]:
    """The whiskers of a protocol's columns; rng draws their gauges' coefficients."""
    return [whisker for column in protocol.columns for whisker in _of_column(protocol, column, rng)]


def _of_column(protocol, column, rng) -> Iterator[Mounted]:
    whisker, turn = protocol.whisker, build.column_pose(column)[:, :3]
    for number, height in enumerate(column.heights_mm):
        sizes = {key: _one(getattr(column, key), number) or getattr(whisker, key) for key in _SIZES}
        rest = Rest(sizes["length_mm"], whisker.sag_mm, whisker.set_y_mm, whisker.set_z_mm)
        rod = replace(build.rod(protocol), **sizes, rest=rest)
        gauges = build.gauges(protocol)
        matrix = gauges.matrix_Nmm_per_V * np.exp(
            column.gauge_scatter * rng.standard_normal((2, 2))
        )
        base = np.array(column.base_mm) + height * turn[:, 2]
        place = tuple(np.round(base, 9).tolist())
        pose = np.column_stack([turn, place])
        yield Mounted(
            f"{column.name}{number + 1}",
            column,
            place,
            rod,
            replace(gauges, matrix_Nmm_per_V=matrix),
            pose,
        )


def _one(given, number):
    return given[number] if isinstance(given, list) else given


@dataclass(frozen=True, eq=False)
class ArrayRecording:
    """A trial of an array. recordings: by whisker, None of one that touches nothing, each in its own base frame;
    strokes: by column; channels: by column of signals.csv, each (n,); bar: in the rig frame."""

    run: Run
    bar: Bar
    recordings: dict[str, Recording | None]
    strokes: dict[str, Stroke]
    channels: dict[str, np.ndarray]
    frame_times_s: np.ndarray

    @classmethod
    def make(
        cls,
        protocol: Protocol,
        run: Run,
        whiskers: Sequence[Mounted],
        rngs: Sequence[np.random.Generator],
    ) -> "ArrayRecording":
        """The trial that seeded generators make of a run: the first of where the bar stands, then one a whisker.
        Raises ArithmeticError, naming the whisker, where one cannot go on, BadInput where one cannot begin."""
        bar, near_rad, _ = placed_bar(protocol, run, build.rod(protocol), rngs[0])
        bars = {w.name: bar.seen_from(w.pose) for w in whiskers}
        touches = {w.name: _touch(w, bars[w.name], near_rad) for w in whiskers}
        strokes = _strokes(protocol, run, whiskers, touches, near_rad)
        times = _frame_times_s(protocol, run, next(iter(strokes.values())))
        channels, recordings = {}, {}
        for whisker, rng in zip(whiskers, rngs[1:]):
            stroke, touch = strokes[whisker.column.name], touches[whisker.name]
            if touch is not None and touch.motor_rad >= stroke.angles_rad.max():
                touch = None
            made = None
            if touch is not None:
                made = _pushed(
                    protocol, run, whisker, bars[whisker.name], touch, stroke, times, rng
                )
            recordings[whisker.name] = made
            free = made is None and signals(protocol, run, stroke, (), whisker.gauges, rng)
            _add_channels(
                channels, whisker, free if made is None else made.signals, len(strokes) > 1
            )
        return cls(run, bar, recordings, strokes, channels, times)


def _towards(whisker: Mounted, angle_rad: float) -> float:
    """Motor angle at which a whisker points as one at the rig's origin does at `angle_rad`."""
    x, y, _ = whisker.pose[:, :3].T @ [math.cos(angle_rad), math.sin(angle_rad), 0.0]
    return math.atan2(y, x)


def _touch(whisker: Mounted, bar: Bar, near_rad: float) -> Touch | None:
    try:
        return touch_from_afar(whisker.rod, bar, _towards(whisker, near_rad))
    except ValueError as problem:
        raise BadInput(
            f"whisker {whisker.name} {problem}; its base_mm or the trial's d_x_mm is another"
        ) from None


def touch_from_afar(rod: Rod, bar: Bar, towards_rad: float) -> Touch | None:
    """First touch of a whisker that comes from lower motor angles, looked for within 60° of a direction; None where it
    meets nothing there. Raises ValueError where it lies within the bar from the beginning."""
    arcs = np.linspace(0.0, rod.length_mm, _ARCS)
    for angle in towards_rad + _SWEPT_RAD:
        points = unloaded(rod, angle, arcs)[0]
        gaps = bar.outside_mm(points) - rod.radius_mm(arcs)
        if gaps.min() <= 0.0:
            if angle == towards_rad + _SWEPT_RAD[0]:
                raise ValueError("stands in the bar before it moves")
            return first_touch(rod, bar, angle, float(arcs[gaps.argmin()]))
    return None


def _strokes(protocol, run, whiskers, touches, near_rad) -> dict[str, Stroke]:
    """Each column's stroke, from before its first touch; all go as far as the one that goes farthest."""
    motor, ends = protocol.motor, {}
    for name in dict.fromkeys(w.column.name for w in whiskers):
        mine = [w for w in whiskers if w.column.name == name]
        angles = [touches[w.name].motor_rad for w in mine if touches[w.name] is not None]
        angles = angles or [_towards(mine[0], near_rad)]
        last = min(max(angles), min(angles) + _FARTHEST_RAD - math.radians(run.after_deg))
        ends[name] = min(angles) - math.radians(run.before_deg), last + math.radians(run.after_deg)
    span = max(high - low for low, high in ends.values())
    return {
        name: Stroke.plan(
            low,
            low + span,
            math.radians(run.speed_deg_s),
            whisks=run.table.whisks,
            ramp_s=motor.ramp_s,
            pause_s=motor.pause_s,
            back=protocol.goes_back(run),
        )
        for name, (low, _) in ends.items()
    }


def _frame_times_s(protocol, run, stroke) -> list[np.ndarray]:
    """Middles of the exposures of each forward stroke, from end to end of it."""
    pictures = protocol.pictures
    step_s = 1.0 / pictures.rate_Hz if pictures.rate_Hz else pictures.step_deg / run.speed_deg_s
    return [np.arange(start, end, step_s) for start, end in stroke.forward]


def _pushed(protocol, run, whisker, bar, touch, stroke, times, rng) -> Recording:
    every, whisk = np.concatenate(times), np.repeat(np.arange(len(times)), [len(t) for t in times])
    frames = Frames(every, stroke.angle_rad(every), whisk, np.zeros(len(every), bool))
    try:
        return Recording.pushed(
            protocol, run, whisker.rod, bar, touch, stroke, frames, whisker.gauges, rng
        )
    except ArithmeticError as problem:
        raise ArithmeticError(f"whisker {whisker.name}: {problem}") from None


def _add_channels(
    channels: dict, whisker: Mounted, recorded: np.ndarray, several_motors: bool
) -> None:
    """A whisker's columns of signals.csv; its motor's, where that is not there yet."""
    channels.setdefault("time_s", recorded[:, 0])
    channels.setdefault(motor_channel(whisker, several_motors), recorded[:, 1])
    names = ("y_V", "z_V", "f_x_N", "f_y_N", "f_z_N")
    channels.update(
        {f"{name}@{whisker.name}": column for name, column in zip(names, recorded[:, 2:].T)}
    )


def motor_channel(whisker: Mounted, several_motors: bool) -> str:
    """Name of its motor's column."""
    return f"motor_deg@{whisker.column.name}" if several_motors else "motor_deg"


def base_keys(whisker: Mounted, several_motors: bool) -> dict:
    """What session.toml says of a whisker of the array."""
    rod, gauges = whisker.rod, whisker.gauges
    keys = {
        "name": whisker.name,
        "base_mm": list(whisker.base_mm),
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
    matrix = np.round(gauges.matrix_Nmm_per_V, 9).tolist()
    return keys | {
        "gauges": {"offset_V": list(map(float, gauges.offset_V)), "matrix_Nmm_per_V": matrix}
    }
