"""Points of the robot's trade: one estimator through one converter, over all whisks of a speed and
push, and the front of those that no other beats."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bench.base.drawing import label_of
from bench.base.tables import WHISKS_KNOWN, WHISKS_WITHOUT, Column, Kind, Table, alike
from bench.workflows.pareto import pareto_front
from bench.workflows.robot_answers import Answer

# [1] Least share of all whisks that an estimator on the front has a distance for: with fewer its
# error is that of other whisks. Stated.
_LEAST_SHARE = 0.9


@dataclass(frozen=True)
class Point:
    """One estimator through one converter, at one speed and push, over its whisks.

    cutoff_Hz, bits: NaN as recorded. time_ms: from touch to the estimate. whisks, none: how many
    have a distance, and have none. The errors are mean, standard deviation and RMS, % of d_x.
    """

    estimator: str
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
            "1 where no other row is better in milliseconds and in RMS error, of those that answer "
            "about nearly all whisks, else 0",
        ),
        Column("estimator", "as in estimates.csv", Kind.TEXT),
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
    ),
)


def pool_answers(answers: Sequence[Answer]) -> list[Point]:
    """Return a point for each estimator, speed (to two digits), converter and push."""
    groups: dict[tuple, list[Answer]] = {}
    for one in answers:
        speed_deg_s = float(f"{one.speed_deg_s:.2g}")
        key = (one.estimator, speed_deg_s, one.converter, one.push_deg)
        groups.setdefault(key, []).append(one)
    return [_point(group, key[1]) for key, group in groups.items()]


def _point(answers: Sequence[Answer], speed_deg_s: float) -> Point:
    """Return the point of answers of one estimator, converter and push."""
    first = answers[0]
    rows = [(one.error_percent, one.expected_percent, one.noise_percent) for one in answers]
    table = np.array(rows)  # (answers, 3) %
    known = table[np.isfinite(table).all(axis=1)]
    error, expected, noise = known.T
    error_mean, error_sd, error_rms = _moments(error, np.zeros(len(known)))
    expected_mean, expected_sd, expected_rms = _moments(expected, noise)
    return Point(
        estimator=first.estimator,
        speed_deg_s=speed_deg_s,
        cutoff_Hz=first.converter.cutoff_Hz or np.nan,
        rate_Hz=float(np.median([one.rate_Hz for one in answers])),
        bits=first.converter.bits or np.nan,
        push_deg=first.push_deg,
        time_ms=1e3 * float(np.median([one.time_s for one in answers])),
        whisks=len(known),
        none=len(answers) - len(known),
        error_mean_percent=error_mean,
        error_sd_percent=error_sd,
        error_rms_percent=error_rms,
        expected_mean_percent=expected_mean,
        expected_sd_percent=expected_sd,
        expected_rms_percent=expected_rms,
    )


def _moments(values: np.ndarray, noise: np.ndarray) -> tuple[float, float, float]:
    """Return mean, standard deviation and RMS of values (n,) that noise of these sigmas (n,) is
    added to; NaN of no values."""
    if not len(values):
        return np.nan, np.nan, np.nan
    added = np.mean(noise**2)
    deviation = np.sqrt(values.var() + added)
    rms = np.sqrt(np.mean(values**2) + added)
    return float(values.mean()), float(deviation), float(rms)


def front(points: Sequence[Point]) -> np.ndarray:
    """Return the mask (n,) of the points that no other beats in both milliseconds and RMS error.

    Points with a distance for too few whisks are not on it.
    """
    whisks = np.array([point.whisks for point in points])
    without = np.array([point.none for point in points])
    costs = np.array([[point.time_ms, point.error_rms_percent] for point in points])
    has_few = whisks < _LEAST_SHARE * np.max(whisks + without)
    costs[has_few] = np.inf
    return pareto_front(costs) & np.isfinite(costs).all(axis=1)


def trade_lines(points: Sequence[Point]) -> Iterator[str]:
    """Yield the front as text, the fastest first."""
    yield f"{'ms':>8}{'error RMS':>11}{'mean':>9}{'expected':>10}   estimator, push, converter"
    on_front = [point for point, is_on_front in zip(points, front(points)) if is_on_front]
    for point in sorted(on_front, key=lambda point: point.time_ms):
        converter = [f"{point.rate_Hz:.0f} Hz"]
        if np.isfinite(point.cutoff_Hz):
            converter.append(f"low-pass {point.cutoff_Hz:g} Hz")
        if np.isfinite(point.bits):
            converter.append(f"{point.bits:.0f} bits")
        errors = (
            f"{point.error_rms_percent:9.2f} %{point.error_mean_percent:+7.2f} %"
            f"{point.expected_rms_percent:8.2f} %"
        )
        push = f"{point.push_deg:g}° at {point.speed_deg_s:g}°/s"
        whose = f"{label_of(point.estimator)}, {push}, {', '.join(converter)}"
        yield f"{point.time_ms:8.0f}{errors}   {whose}"
