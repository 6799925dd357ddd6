"""Where a trial's motor angle is from: `angle_from` of [trial], one implementation of `AngleSource` each."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bench.base.errors import BadInput
from bench.session.angles_file import angles_file, read_angles
from bench.session.file_names import TRIAL_TOML
from bench.session.stated_speed import by_stated_speed
from bench.session.strict_toml import is_sigma
from bench.session.table import NumberTable, require_columns
from bench.session.trial import Trial

TIME = "time_s"
MOTOR = "motor_deg"
# [°] An encoder that wraps does so by a turn.
TURN_DEG = 360.0


@dataclass(frozen=True, eq=False)
class AngleSigma:
    """How well the angles of samples are known. share: relative sigma of their differences. own_rad (n,):
    one sigma of each sample's own error; None where there is none.
    """

    share: float = 0.0
    own_rad: np.ndarray | None = None

    def part(self, which: slice | np.ndarray) -> "AngleSigma":
        """Return the sigmas of some samples."""
        return self if self.own_rad is None else AngleSigma(self.share, self.own_rad[which])

    def of_push(self, motor_rad: np.ndarray, touch_rad: float, theta_rad: float) -> float:
        """Return the sigma of a pushing angle: by the errors at touch, and theta_rad past it.

        motor_rad (n,): of the samples, increasing but for noise.
        """
        of_share = self.share * theta_rad
        if self.own_rad is None:
            return of_share
        rising = np.maximum.accumulate(motor_rad)
        ends = np.interp([touch_rad, touch_rad + theta_rad], rising, self.own_rad)
        return float(np.linalg.norm([of_share, *ends]))


EXACT = AngleSigma()


@dataclass(frozen=True, eq=False)
class MotorAngle:
    """The samples that have an angle, motor_deg (n,) at each, and wraps: how often the encoder did."""

    table: NumberTable
    motor_deg: np.ndarray
    sigma: AngleSigma = EXACT
    wraps: int = 0


class AngleSource(ABC):
    """One way to the motor's angle at each sample.

    by: how tables say where the angle is from. has_zero: pictures and angle have one zero, so that
    pictures give truth. is_seen: it is from the trial's own pictures, and so is θ of its estimates.
    is_one_way: the way back has none. unknown: what cannot be known then, for `check`. keys: of
    [trial], without which it gives no angle.
    """

    by: str
    has_zero = True
    is_seen = False
    is_one_way = False
    unknown = ""
    keys: tuple[str, ...] = ()

    def check_keys(self, trial: Trial) -> None:
        """Raise BadInput where the trial lacks a key, or asks for the way back of one that has none."""
        label = trial.label(TRIAL_TOML)
        for key in self.keys:
            value = getattr(trial, key)
            if value is None or (is_sigma(key) and not value > 0):
                raise BadInput(missing_key(key, trial.angle_from), file=label)
        if trial.both_ways and self.is_one_way:
            cure = f'angle_from = "{trial.angle_from}" knows the way there alone'
            raise BadInput(f"both_ways needs motor_deg: {cure}", file=label)

    def lacks(self, trial: Trial) -> str:
        """Return what is to be done before the angle is known; '' where nothing is."""
        return ""

    @abstractmethod
    def of_samples(
        self, table: NumberTable, channels: np.ndarray, trial: Trial, label: str
    ) -> MotorAngle:
        """Return the angle at the samples of a table, with channels (n, 2). Raises BadInput."""


class Logged(AngleSource):
    """The signals' own column motor_deg."""

    by = "a motor log"

    def of_samples(
        self, table: NumberTable, channels: np.ndarray, trial: Trial, label: str
    ) -> MotorAngle:
        """Return motor_deg without the encoder's jumps by a full turn. Raises BadInput without it."""
        if any(name.startswith("motor") for name in table.columns):
            require_columns(table, (MOTOR,), label)
        else:
            cure = 'without a motor log write angle_from = "speed", "marker" or "whisker"'
            raise BadInput(f"has no column {MOTOR}; {cure}", file=label, row=1)
        motor_deg = table[MOTOR]
        wraps = int((np.abs(np.diff(motor_deg)) > TURN_DEG / 2).sum())
        if wraps:
            motor_deg = np.unwrap(motor_deg, period=TURN_DEG)
        return MotorAngle(table, motor_deg, wraps=wraps)


class StatedSpeed(AngleSource):
    """The stated speed times the time, of one forward stroke."""

    by = "the stated speed"
    has_zero = False
    is_one_way = True
    unknown = "touch as pictures have it, changes of speed, and the way back"
    keys = ("speed_deg_s", "speed_sigma_deg_s")

    def of_samples(
        self, table: NumberTable, channels: np.ndarray, trial: Trial, label: str
    ) -> MotorAngle:
        """Return the angle from the recording's start. Raises BadInput as `by_stated_speed`, and where a
        key is missing."""
        if trial.purpose == "weight":
            return MotorAngle(table, np.zeros(len(table)))
        self.check_keys(trial)
        motor_deg = by_stated_speed(table[TIME], channels, trial.speed_deg_s, label)
        return MotorAngle(table, motor_deg, AngleSigma(trial.speed_sigma_deg_s / trial.speed_deg_s))


class Seen(AngleSource):
    """The angles that `calibrate angles` has found in the trial's pictures, and keeps beside them."""

    is_seen = True
    unknown = (
        "the motor between frames and outside them, a lag of motor or encoder behind the pictures"
    )

    def __init__(self, by: str, key: str, *, is_one_way: bool = False):
        """Take how tables say where the angle is from, and the key without which there is none."""
        self.by = by
        self.keys = (key,)
        self.is_one_way = is_one_way

    def lacks(self, trial: Trial) -> str:
        """Return the verb that makes the file of angles, where it is missing."""
        return "" if angles_file(trial).is_file() else "whisker-bench calibrate angles"

    def of_samples(
        self, table: NumberTable, channels: np.ndarray, trial: Trial, label: str
    ) -> MotorAngle:
        """Interpolate the angles of frames. Samples before the first and after the last frame have
        none and are left out. Raises BadInput as `read_angles`, and where no sample is left.
        """
        if trial.purpose == "weight":
            return MotorAngle(table, np.zeros(len(table)))
        angles = read_angles(trial)
        first_s, last_s = angles.time_s[[0, -1]]
        table = table.keep((table[TIME] >= first_s) & (table[TIME] <= last_s))
        if len(table) < 2:
            found = f"has no samples while frames were taken, {first_s:.6g} to {last_s:.6g} s"
            raise BadInput(found, file=label)
        motor_deg = np.interp(table[TIME], angles.time_s, angles.motor_deg)
        own_rad = np.radians(np.interp(table[TIME], angles.time_s, angles.sigma_deg))
        return MotorAngle(table, motor_deg, AngleSigma(angles.share_sigma, own_rad))


# By `angle_from` of [trial].
SOURCES: dict[str, AngleSource] = {
    "log": Logged(),
    "speed": StatedSpeed(),
    "marker": Seen("the hub's marker, seen in pictures of the same trial", "hub_marker"),
    "whisker": Seen(
        "the whisker's base, seen in pictures of the same trial", "speed_deg_s", is_one_way=True
    ),
}


def missing_key(key: str, angle_from: str) -> str:
    """Return what is said where a key of [trial] is missing that an angle's source needs."""
    return f'{key} is missing: angle_from = "{angle_from}" needs it'


def angle_source(trial: Trial) -> AngleSource:
    """Return where a trial's motor angle is from."""
    return SOURCES[trial.angle_from]


def without_motor_log(trials: Sequence[Trial]) -> Iterator[tuple[AngleSource, int]]:
    """Yield each source but a log that trials have their motor angle from, and how many of them."""
    for name, source in SOURCES.items():
        count = sum(trial.angle_from == name for trial in trials)
        if count and source.unknown:
            yield source, count
