"""Points of the robot's trade: one estimator through one converter, over all whisks of a speed and
push, and the front of those that no other beats."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bench.analyses.pooling import grouped, mean, rms
from bench.base.drawing import label_of
from bench.base.tables import TRUTH_SOURCE, WHISKS_KNOWN, WHISKS_WITHOUT, Column, Kind, Table, alike
from bench.workflows.expected_error import ExpectedRms
from bench.workflows.pareto import worth_waiting_for
from bench.workflows.robot_answers import Answer, Converter
from vision.geometry import counted

# [1] Least share of all whisks that an estimator on the front has a distance for: with fewer its
# error is that of other whisks. Stated.
_LEAST_SHARE = 0.9


@dataclass(frozen=True)
class Point:
    """One estimator through one converter, at one speed and push, over its whisks.

    cutoff_Hz, bits: NaN as recorded. time_ms: from touch to the estimate. whisks, none: how many
    have a distance, and have none. The errors are mean, standard deviation and RMS, % of d_x.
    expected_low_percent, expected_high_percent: 95 % of the RMS errors of so many whisks.
    """

    estimator: str
    truth_source: str
    speed_deg_s: float
    cutoff_Hz: float
    rate_Hz: float
    bits: float
    push_deg: float
    time_ms: float
    whisks: int
    none: int
    error_mean_percent: float
    error_sd_percent: float
    error_rms_percent: float
    expected_mean_percent: float
    expected_sd_percent: float
    expected_rms_percent: float
    expected_low_percent: float
    expected_high_percent: float

    @property
    def ranked_percent(self) -> float:
        """Return the error that the point is ranked by (`ExpectedRms.to_rank`)."""
        return self.expected.to_rank(self.error_rms_percent)

    @property
    def expected(self) -> ExpectedRms:
        """Return the expected RMS error and its range."""
        return ExpectedRms(
            self.expected_rms_percent, self.expected_low_percent, self.expected_high_percent
        )

    @property
    def is_unfiltered_and_unrounded(self) -> bool:
        """Return whether neither filter nor bits were changed; the rate may be."""
        return bool(np.isnan(self.cutoff_Hz) and np.isnan(self.bits))


ROBOT_TRADE = Table(
    "robot_trade",
    "A row an estimator, converter, speed and push of `whisker-bench robot`, over the measured "
    "whisks whose truth is sound.",
    (
        Column(
            "on_front",
            "1 where each faster row errs by 5 % more, of those that answer about nearly all whisks, else "
            "0; by expected_rms_percent, or a measured RMS above expected_high_percent",
        ),
        Column("estimator", "as in estimates.csv", Kind.TEXT),
        TRUTH_SOURCE,
        Column("speed_deg_s", "speed of the motor, to two digits"),
        Column("cutoff_Hz", "of a causal low-pass (fourth order); empty as recorded"),
        Column("rate_Hz", "samples a second"),
        Column("bits", "over the range that the session's signals fill; empty as recorded"),
        Column(
            "push_deg",
            "from touch seen to where the motor is when it answers; the estimate's θ is half a "
            "window less",
        ),
        Column("time_ms", "from touch to answer: the push, the filter's delay, and a sample"),
        WHISKS_KNOWN,
        WHISKS_WITHOUT,
        *alike(
            ("error_mean_percent", "error_sd_percent", "error_rms_percent"),
            "measured: mean, scatter and RMS of the errors over the whisks, % of d_x",
        ),
        *alike(
            ("expected_mean_percent", "expected_sd_percent", "expected_rms_percent"),
            "expected: the same by (13), (14) and docs/maps.md at the slope and friction seen, "
            "with the noise as stated",
        ),
        *alike(
            ("expected_low_percent", "expected_high_percent"),
            "range of 95 % of the RMS errors of so many whisks",
        ),
    ),
)


def pool_answers(answers: Sequence[Answer]) -> list[Point]:
    """Return a point for each estimator, speed (to two digits), converter and push."""
    groups = grouped(answers, _conditions)
    return [_point(group, speed_deg_s) for (speed_deg_s, *_), group in groups.items()]


def _conditions(answer: Answer) -> tuple[float, str, Converter, float]:
    """Return speed, to two digits, estimator, converter and push."""
    speed_deg_s = float(f"{answer.speed_deg_s:.2g}")
    return speed_deg_s, answer.estimator, answer.converter, answer.push_deg


def _point(answers: Sequence[Answer], speed_deg_s: float) -> Point:
    """Return the point of answers of one estimator, converter and push."""
    first = answers[0]
    error, expected, noise = _known_percent(answers)
    expected_rms = ExpectedRms.of_errors(expected, noise)
    return Point(
        estimator=first.estimator,
        truth_source=first.truth_source,
        speed_deg_s=speed_deg_s,
        cutoff_Hz=first.converter.cutoff_Hz or np.nan,
        rate_Hz=float(np.median([one.rate_Hz for one in answers])),
        bits=first.converter.bits or np.nan,
        push_deg=first.push_deg,
        time_ms=1e3 * float(np.median([one.time_s for one in answers])),
        whisks=len(error),
        none=len(answers) - len(error),
        error_mean_percent=mean(error),
        error_sd_percent=rms(error - mean(error)),
        error_rms_percent=rms(error),
        expected_mean_percent=mean(expected),
        expected_sd_percent=math.hypot(rms(expected - mean(expected)), rms(noise)),
        expected_rms_percent=expected_rms.rms,
        expected_low_percent=expected_rms.low,
        expected_high_percent=expected_rms.high,
    )


def _known_percent(answers: Sequence[Answer]) -> np.ndarray:
    """Return error, expected error and noise (3, n), per cent, of the answers that have all of them."""
    rows = [(one.error_percent, one.expected_percent, one.noise_percent) for one in answers]
    table = np.array(rows)  # (answers, 3)
    return table[np.isfinite(table).all(axis=1)].T


def front(points: Sequence[Point]) -> np.ndarray:
    """Return the mask (n,) of the points that are expected to err clearly less than any faster one.

    Of points of the same time that with the recorded converter comes first. Points with a distance
    for too few whisks are not on it.
    """
    most = max(point.whisks + point.none for point in points)
    by_time = sorted(range(len(points)), key=lambda number: _haste(points[number]))
    errors_percent = []
    for number in by_time:
        has_few = points[number].whisks < _LEAST_SHARE * most
        errors_percent.append(np.inf if has_few else points[number].ranked_percent)
    is_on_front = np.zeros(len(points), dtype=bool)
    is_on_front[by_time] = worth_waiting_for(errors_percent)
    return is_on_front


def _haste(point: Point) -> tuple[float, bool, float]:
    """Return what points are sorted by: time, whether a filter or bits were changed, and the error."""
    return point.time_ms, not point.is_unfiltered_and_unrounded, point.ranked_percent


def trade_lines(points: Sequence[Point]) -> Iterator[str]:
    """Yield the front as text, the fastest first, and how the measured errors are to be read."""
    yield f"{'ms':>8}{'expected':>10}{'95 % by chance':>18}{'measured':>10}   estimator, push, converter"
    on_front = [point for point, is_on_front in zip(points, front(points)) if is_on_front]
    for point in sorted(on_front, key=lambda point: point.time_ms):
        chance = f"{point.expected_low_percent:.2g} to {point.expected_high_percent:.2g} %"
        errors = f"{point.expected_rms_percent:8.2f} %{chance:>18}{point.error_rms_percent:8.2f} %"
        yield f"{point.time_ms:8.0f}{errors}   {_choice(point)}"
    if on_front:
        most = counted(max(point.whisks for point in on_front), "whisk")
        yield (
            f"RMS errors of d_x, ranked by what is expected at the slopes and friction seen. Measured on {most}: "
            f"of {len(points)} choices the one that measures best is the luckiest."
        )


def _choice(point: Point) -> str:
    """Return the estimator, the push and the converter of a point, in words."""
    converter = [f"{point.rate_Hz:.0f} Hz"]
    if np.isfinite(point.cutoff_Hz):
        converter.append(f"low-pass {point.cutoff_Hz:g} Hz")
    if np.isfinite(point.bits):
        converter.append(f"{point.bits:.0f} bits")
    push = f"{point.push_deg:g}° at {point.speed_deg_s:g}°/s"
    return f"{label_of(point.estimator)}, {push}, {', '.join(converter)}"
