"""signals.csv of a trial: the one place where degrees become radians and units are questioned."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from bench.base.errors import BadInput
from bench.session import strokes
from bench.session.angle_source import EXACT, TIME, TURN_DEG, AngleSigma, angle_source
from bench.session.daq import read_daq
from bench.session.file_names import TRIAL_TOML
from bench.session.plausible import (
    DEGREES_PER_RADIAN,
    MICROSECONDS,
    MILLISECONDS,
    MILLIVOLTS,
    PlausibleRange,
)
from bench.session.table import (
    NumberTable,
    column_names,
    forward_in_time,
    read_table,
    require_columns,
)
from bench.session.trial import Trial
from vision.geometry import Reason

VOLTS = ("y_V", "z_V")
MOMENTS = ("m_y_Nmm", "m_z_Nmm")
FORCES = ("f_x_N", "f_y_N", "f_z_N")
PRESSURE = "p_Pa"

# [s] 1 MHz to 20 Hz.
SAMPLING_STEP = PlausibleRange(1e-6, 0.05, (MILLISECONDS, MICROSECONDS))
# [V] What a DAQ's input takes.
VOLTAGE = PlausibleRange(-30.0, 30.0, (MILLIVOLTS,))
# [N] A whisker of 1 mm gives way at a hundredth of it.
FORCE = PlausibleRange(-20.0, 20.0, (("millinewtons", 1e-3),))
MOMENT = PlausibleRange(-1e5, 1e5, (("N um", 1e-3), ("nN m", 1e-3)))
# [°] Less is an encoder that stands still.
_STILL_DEG = 0.02
# [°] No whisk is so short, and any usual one is, in radians.
_SMALL_RANGE_DEG = 0.5
# [1] Steps of a stroke of whose speeds the median is taken. Stated.
_SPEED_STEPS = 10
# A motor's mean speed over a stroke may differ from the nominal one by this factor without a warning.
_SPEED_FACTOR = 1.6


@dataclass(frozen=True)
class Signals:
    """The recording of a trial's DAQ, all (n,): time_s, increasing, motor_rad, two gauge channels.

    kind: "V" where y and z are the gauges' volts, "Nmm" where they are m_y and m_z, N·mm.
    dropped: rows or wraps mended, by cause. warnings: lines that the user should read.
    forces_N (n, 3): of the base on the whisker in the hub's axes, None without a load cell.
    angle_sigma: how well motor_rad is known.
    pressure_Pa (n,): of a microphone at the base, None without one.
    """

    time_s: np.ndarray
    motor_rad: np.ndarray
    y: np.ndarray
    z: np.ndarray
    kind: str
    dropped: Mapping[str, int] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    forces_N: np.ndarray | None = None
    angle_sigma: AngleSigma = EXACT
    pressure_Pa: np.ndarray | None = None

    @property
    def channels(self) -> np.ndarray:
        """Return the two gauge channels (n, 2)."""
        return np.stack([self.y, self.z], axis=1)

    @property
    def rate_Hz(self) -> float:
        """Return the sampling rate: one over the median step."""
        return 1.0 / float(np.median(np.diff(self.time_s)))

    def motor_at(self, time_s: np.ndarray) -> np.ndarray:
        """Interpolate the motor angle at other times, rad; NaN where nothing was recorded."""
        return np.interp(time_s, self.time_s, self.motor_rad, left=np.nan, right=np.nan)

    def motor_nearest(self, time_s: np.ndarray) -> np.ndarray:
        """Interpolate the motor angle at other times, rad; that of the nearest sample where nothing was recorded.

        No whisk is there.
        """
        return np.interp(time_s, self.time_s, self.motor_rad)

    def motor_sigma_at(self, time_s: np.ndarray) -> np.ndarray:
        """Interpolate the sigma of the motor angle's own error at other times, rad; 0 without one."""
        own_rad = self.angle_sigma.own_rad
        return np.zeros(len(time_s)) if own_rad is None else np.interp(time_s, self.time_s, own_rad)


def forward_strokes(signals: Signals) -> tuple[slice, ...]:
    """Return slices of samples, one a forward stroke: the whisks of the recording, from 0."""
    return strokes.forward_strokes(signals.motor_rad)


def stroke_speed_rad_s(signals: Signals) -> float:
    """Return the motor's speed in the middle of its longest forward stroke; NaN without one.

    The median of the steps between tenths of its time leaves out how it starts and stops.
    """
    strokes_found = forward_strokes(signals)
    if not strokes_found:
        return float("nan")
    longest = max(strokes_found, key=lambda stroke: np.ptp(signals.motor_rad[stroke]))
    times_s = np.linspace(*signals.time_s[longest][[0, -1]], _SPEED_STEPS + 1)
    return float(np.median(np.diff(signals.motor_at(times_s)) / np.diff(times_s)))


def stroke_ends(signals: Signals) -> list[int]:
    """Return for each forward stroke the sample at which the next begins, or the recording ends."""
    starts = [stroke.start for stroke in forward_strokes(signals)]
    return [*starts[1:], len(signals.motor_rad)]


def back_stroke(signals: Signals) -> slice | None:
    """Return the samples of the first forward stroke's way back; None where none was recorded."""
    return next(iter(ways_back(signals)), None)


def ways_back(signals: Signals) -> tuple[slice | None, ...]:
    """Return the samples of the back stroke that follows each forward one, before the next.

    None stands where none was recorded.
    """
    found = []
    back = strokes.forward_strokes(-signals.motor_rad)
    for forward, end in zip(forward_strokes(signals), stroke_ends(signals)):
        following = (stroke for stroke in back if forward.stop - 1 <= stroke.start < end)
        found.append(next(following, None))
    return tuple(found)


def read_signals(trial: Trial) -> Signals:
    """Read and check a trial's signals.csv.

    Raises BadInput naming file and row: what `read_table` refuses, missing columns, times that
    stand still or go back, and values of another unit (milliseconds, radians,
    millivolts).
    """
    label = trial.label(trial.signals_path.name)
    table = _read_samples(trial, label)
    kind, channels = _kind_and_channels(table, label)
    forces = _force_columns(table, label)
    table, duplicates = forward_in_time(table, TIME, label)
    _check_units(table, kind, channels, label)
    pair = np.column_stack([table[name] for name in channels])
    angle = angle_source(trial).of_samples(table, pair, trial, label)
    table = angle.table
    mended = {"duplicate rows": duplicates, "encoder wraps": angle.wraps}
    return Signals(
        time_s=table[TIME],
        motor_rad=np.radians(angle.motor_deg),
        y=table[channels[0]],
        z=table[channels[1]],
        kind=kind,
        dropped={cause: count for cause, count in mended.items() if count},
        warnings=_motor_warnings(table[TIME], angle.motor_deg, trial, label),
        forces_N=_forces_N(table, forces, label),
        angle_sigma=angle.sigma,
        pressure_Pa=table.columns.get(PRESSURE),
    )


def _read_samples(trial: Trial, label: str) -> NumberTable:
    """Read the columns of a trial's signals.csv, or of its own DAQ's file. Raises BadInput."""
    if trial.daq is None:
        return read_table(trial.signals_path, label)
    return read_daq(trial.signals_path, trial.daq, label)


def has_moments(trial: Trial) -> bool:
    """Return whether a trial's signals are moments; only the head of its file is read."""
    return has_column(trial, MOMENTS[0])


def has_column(trial: Trial, name: str) -> bool:
    """Return whether a trial's signals have a column; only the head of its file is read."""
    path = trial.signals_path
    if trial.daq is not None:
        return name in trial.daq.channels
    return name in column_names(path, trial.label(path.name))


def _kind_and_channels(table: NumberTable, label: str) -> tuple[str, tuple[str, str]]:
    """Return "V" or "Nmm", and the names of its two columns. Raise BadInput where not both are there."""
    has_volts = any(name in table.columns for name in VOLTS)
    has_moments = any(name in table.columns for name in MOMENTS)
    if has_volts and has_moments:
        raise BadInput("has volts and moments; keep y_V,z_V or m_y_Nmm,m_z_Nmm", file=label, row=1)
    kind, channels = ("Nmm", MOMENTS) if has_moments else ("V", VOLTS)
    require_columns(table, (TIME, *channels), label)
    return kind, channels


def _forces_N(table: NumberTable, names: Sequence[str], label: str) -> np.ndarray | None:
    """Return the forces (n, 3); None of no names. Raise BadInput for what seems another unit."""
    if not names:
        return None
    for name in names:
        FORCE.check(_extreme(table[name]), f"the largest {name}", label)
    return np.column_stack([table[name] for name in names])


def _force_columns(table: NumberTable, label: str) -> tuple[str, ...]:
    """Return the load cell's columns, all three or none. Raise BadInput where some are missing."""
    if not any(name in table.columns for name in FORCES):
        return ()
    require_columns(table, FORCES, label)
    return FORCES


def _check_units(table: NumberTable, kind: str, channels: tuple[str, str], label: str) -> None:
    """Raise BadInput where times or channels, of a kind "V" or "Nmm", seem to be in another unit."""
    if len(table) < 2:
        raise BadInput("has one row; a recording has many", file=label)
    SAMPLING_STEP.check(float(np.median(np.diff(table[TIME]))), f"the usual step of {TIME}", label)
    channel_range = VOLTAGE if kind == "V" else MOMENT
    for name in channels:
        channel_range.check(_extreme(table[name]), f"the largest {name}", label)


def _extreme(values: np.ndarray) -> float:
    """Return the value of largest magnitude."""
    return float(values[np.argmax(np.abs(values))])


def _motor_warnings(
    time_s: np.ndarray, motor_deg: np.ndarray, trial: Trial, label: str
) -> tuple[str, ...]:
    """Return warnings about angle and speed of the motor, none where a weight hangs.

    Raises BadInput where the angle is in radians or encoder counts.
    """
    if trial.purpose == "weight":
        return ()
    range_deg = float(np.ptp(strokes.without_spikes(motor_deg)[0]))
    if range_deg < _STILL_DEG:
        return (f"{label}: the motor stands still ({range_deg:.3g}°): no whisk",)
    if range_deg > TURN_DEG:
        found = f"motor_deg spans {range_deg:.6g}, more than a turn. Is it in encoder counts?"
        raise BadInput(found, file=label)
    speed_deg_s = _measured_speed(time_s, motor_deg)
    is_small = range_deg < _SMALL_RANGE_DEG and not _agree(speed_deg_s, trial.speed_deg_s)
    if is_small or _agree(DEGREES_PER_RADIAN * speed_deg_s, trial.speed_deg_s):
        in_degrees = range_deg * DEGREES_PER_RADIAN
        raise BadInput(
            f"motor_deg spans {range_deg:.3g}. Is it in radians? Then write degrees: it would span "
            f"{in_degrees:.3g}",
            file=label,
        )
    return _speed_warnings(speed_deg_s, trial, label)


def _speed_warnings(speed_deg_s: float, trial: Trial, label: str) -> tuple[str, ...]:
    """Return a warning where the stated speed is not the motor's. Raise BadInput for rad/s."""
    stated = trial.speed_deg_s
    if stated is None or not speed_deg_s > 0 or _agree(speed_deg_s, stated):
        return ()
    if _agree(speed_deg_s / DEGREES_PER_RADIAN, stated):
        found = f"speed_deg_s is {stated:g}, but the motor goes at {speed_deg_s:.3g}°/s"
        cure = f"Is it in rad/s? Then write {speed_deg_s:.3g}."
        raise BadInput(f"{found}. {cure}", file=trial.label(TRIAL_TOML))
    found = f"the motor goes at {speed_deg_s:.3g}°/s, speed_deg_s says {stated:g}"
    return (Reason("speed_unlike_stated", f"{label}: {found}"),)


def _measured_speed(time_s: np.ndarray, motor_deg: np.ndarray) -> float:
    """Return the mean speed of the largest forward stroke, in the angle's unit per second.

    Returns 0 where there is none.
    """
    largest = (0.0, 1.0)  # rise, duration in s
    for stroke in strokes.forward_strokes(motor_deg, smallest_rad=0.0):
        last = stroke.stop - 1
        rise = motor_deg[last] - motor_deg[stroke.start]
        largest = max(largest, (rise, time_s[last] - time_s[stroke.start]))
    return float(largest[0] / largest[1])


def _agree(measured: float, stated: float | None) -> bool:
    """Return whether two speeds agree to within what a start, a stop or a pause may cost."""
    return stated is not None and stated / _SPEED_FACTOR < measured < stated * _SPEED_FACTOR
