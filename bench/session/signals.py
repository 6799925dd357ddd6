"""signals.csv of a trial: the one place where degrees become radians and a recording's units are doubted."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bench.base.errors import BadInput
from bench.session import strokes
from bench.session.daq import read_daq
from bench.session.plausible import (
    DEGREES_PER_RADIAN,
    MICROSECONDS,
    MILLISECONDS,
    MILLIVOLTS,
    Window,
)
from bench.session.table import NumberTable, forward_in_time, read_table, require_columns
from bench.session.trial import Trial
from vision.geometry.reasons import Reason

TIME, MOTOR = "time_s", "motor_deg"
VOLTS, MOMENTS = ("y_V", "z_V"), ("m_y_Nmm", "m_z_Nmm")
FORCES = ("f_x_N", "f_y_N", "f_z_N")

SAMPLING_STEP = Window(1e-6, 0.05, (MILLISECONDS, MICROSECONDS))  # s: 1 MHz to 20 Hz
VOLTAGE = Window(-30.0, 30.0, (MILLIVOLTS,))  # V: what a DAQ's input takes
FORCE = Window(
    -20.0, 20.0, (("millinewtons", 1e-3),)
)  # N: a whisker of 1 mm gives way at a hundredth of it
MOMENT = Window(-1e5, 1e5, (("N um", 1e-3), ("nN m", 1e-3)))
_TURN_DEG = 360.0  # °: an encoder that wraps does so by a turn
_STILL_DEG = 0.02  # less is an encoder that stands still
_SMALL_RANGE_DEG = 0.5  # no whisk is so short, and any usual one is, in radians
# A motor's mean speed over a stroke may differ from the nominal one by this factor without raising a doubt.
_SPEED_FACTOR = 1.6


@dataclass(frozen=True)
class Signals:
    """What the DAQ recorded in one trial, all (n,): time_s, increasing, motor_rad, and two gauge channels.

    kind: "V", y and z are the gauges' volts; "Nmm", they are m_y and m_z, N·mm. dropped: rows or wraps
    mended, by cause. doubts: lines that the user should read. forces_N (n, 3): of the base on the whisker in the hub's
    axes, None where no load cell was recorded.
    """

    time_s: np.ndarray
    motor_rad: np.ndarray
    y: np.ndarray
    z: np.ndarray
    kind: str
    dropped: Mapping[str, int] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()
    forces_N: np.ndarray | None = None

    @property
    def rate_Hz(self) -> float:
        """Sampling rate: one over the median step."""
        return 1.0 / float(np.median(np.diff(self.time_s)))

    def motor_at(self, time_s: np.ndarray) -> np.ndarray:
        """Motor angle at other times, rad; NaN where nothing was recorded."""
        return np.interp(time_s, self.time_s, self.motor_rad, left=np.nan, right=np.nan)


def forward_strokes(signals: Signals) -> tuple[slice, ...]:
    """Slices of samples, one a forward stroke: the whisks of the recording, from 0."""
    return strokes.forward_strokes(signals.motor_rad)


def back_stroke(signals: Signals) -> slice | None:
    """Samples of the first back stroke that follows a forward one; None where none was recorded."""
    return next(iter(ways_back(signals)[:1]), None)


def ways_back(signals: Signals) -> tuple[slice | None, ...]:
    """Samples of the back stroke that follows each forward one; None where none was recorded before the next."""
    forward = forward_strokes(signals)
    back = strokes.forward_strokes(-signals.motor_rad)
    ends = [*(where.start for where in forward[1:]), len(signals.motor_rad)]
    return tuple(
        next((where for where in back if there.stop - 1 <= where.start < end), None)
        for there, end in zip(forward, ends)
    )


def read_signals(trial: Trial) -> Signals:
    """Read and check a trial's signals.csv.

    Raises BadInput naming file and row: what `read_table` refuses, missing columns, times that stand still or
    go back, and values that look like another unit (milliseconds, radians, millivolts).
    """
    path, shown = trial.signals_path, trial.shown(trial.signals_path.name)
    table = read_table(path, shown) if trial.daq is None else read_daq(path, trial.daq, shown)
    kind, channels = _columns(table, shown)
    forces = _force_columns(table, shown)
    table, duplicates = forward_in_time(table, TIME, shown)
    motor_deg, wraps = _unwrapped(table[MOTOR])
    _check_units(table, kind, channels, shown)
    for name in forces:
        FORCE.check(_extreme(table[name]), f"the largest {name}", shown)
    doubts = () if trial.purpose == "weight" else _check_motor(table[TIME], motor_deg, trial, shown)
    return Signals(
        time_s=table[TIME],
        motor_rad=np.radians(motor_deg),
        y=table[channels[0]],
        z=table[channels[1]],
        kind=kind,
        dropped={
            cause: n for cause, n in (("duplicate rows", duplicates), ("encoder wraps", wraps)) if n
        },
        doubts=doubts,
        forces_N=np.column_stack([table[name] for name in forces]) if forces else None,
    )


def _columns(table: NumberTable, shown: str) -> tuple[str, tuple[str, str]]:
    """("V" or "Nmm", its two columns)."""
    has_volts, has_moments = (
        any(name in table.columns for name in pair) for pair in (VOLTS, MOMENTS)
    )
    if has_volts and has_moments:
        raise BadInput("has volts and moments; keep y_V,z_V or m_y_Nmm,m_z_Nmm", file=shown, row=1)
    kind, channels = ("Nmm", MOMENTS) if has_moments else ("V", VOLTS)
    require_columns(table, (TIME, MOTOR, *channels), shown)
    return kind, channels


def _force_columns(table: NumberTable, shown: str) -> tuple[str, ...]:
    """The load cell's columns, all three or none."""
    found = tuple(name for name in FORCES if name in table.columns)
    if found:
        require_columns(table, FORCES, shown)
    return found


def _unwrapped(motor_deg: np.ndarray) -> tuple[np.ndarray, int]:
    """The angle without the encoder's jumps by a full turn, and how many there were."""
    wraps = int((np.abs(np.diff(motor_deg)) > _TURN_DEG / 2).sum())
    return (np.unwrap(motor_deg, period=_TURN_DEG), wraps) if wraps else (motor_deg, 0)


def _check_units(table: NumberTable, kind: str, channels: tuple[str, str], shown: str) -> None:
    if len(table) < 2:
        raise BadInput("has one row; a recording has many", file=shown)
    SAMPLING_STEP.check(float(np.median(np.diff(table[TIME]))), f"the usual step of {TIME}", shown)
    window = VOLTAGE if kind == "V" else MOMENT
    for name in channels:
        window.check(_extreme(table[name]), f"the largest {name}", shown)


def _extreme(values: np.ndarray) -> float:
    return float(values[np.argmax(np.abs(values))])


def _check_motor(
    time_s: np.ndarray, motor_deg: np.ndarray, trial: Trial, shown: str
) -> tuple[str, ...]:
    """Doubts about angle and speed. Raises BadInput where the angle is in radians or encoder counts."""
    range_deg = float(np.ptp(strokes.without_spikes(motor_deg)[0]))
    if range_deg < _STILL_DEG:
        return (f"{shown}: the motor stands still ({range_deg:.3g}°): no whisk",)
    if range_deg > _TURN_DEG:
        raise BadInput(
            f"motor_deg spans {range_deg:.6g}, more than a turn. Is it in encoder counts?",
            file=shown,
        )
    speed_deg_s = _measured_speed(time_s, motor_deg)
    too_small = range_deg < _SMALL_RANGE_DEG and not _is(speed_deg_s, trial.speed_deg_s)
    if too_small or _is(DEGREES_PER_RADIAN * speed_deg_s, trial.speed_deg_s):
        raise BadInput(
            f"motor_deg spans {range_deg:.3g}. Is it in radians? Then write degrees: it would span "
            f"{range_deg * DEGREES_PER_RADIAN:.3g}",
            file=shown,
        )
    return _speed_doubts(speed_deg_s, trial, shown)


def _speed_doubts(speed_deg_s: float, trial: Trial, shown: str) -> tuple[str, ...]:
    """Whether the stated speed is the motor's. Raises BadInput where it is in rad/s."""
    if trial.speed_deg_s is None or not speed_deg_s > 0:
        return ()
    if _is(speed_deg_s / DEGREES_PER_RADIAN, trial.speed_deg_s):
        found = f"speed_deg_s is {trial.speed_deg_s:g}, but the motor goes at {speed_deg_s:.3g}°/s"
        raise BadInput(
            f"{found}. Is it in rad/s? Then write {speed_deg_s:.3g}.",
            file=trial.shown("trial.toml"),
        )
    if _is(speed_deg_s, trial.speed_deg_s):
        return ()
    found = f"the motor goes at {speed_deg_s:.3g}°/s, speed_deg_s says {trial.speed_deg_s:g}"
    return (Reason("speed_unlike_stated", f"{shown}: {found}"),)


def _measured_speed(time_s: np.ndarray, motor_deg: np.ndarray) -> float:
    """Mean speed of the largest forward stroke, in the angle's unit per second; 0 where there is none."""
    rises = [
        (motor_deg[s.stop - 1] - motor_deg[s.start], time_s[s.stop - 1] - time_s[s.start])
        for s in strokes.forward_strokes(motor_deg, smallest_rad=0.0)
    ]
    rise, duration_s = max(rises, default=(0.0, 1.0))
    return float(rise / duration_s)


def _is(measured: float, stated: float | None) -> bool:
    """Whether the two agree to within the factor that a start, a stop or a pause may cost."""
    return stated is not None and stated / _SPEED_FACTOR < measured < stated * _SPEED_FACTOR
