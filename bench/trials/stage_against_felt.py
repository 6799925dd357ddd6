"""What a stage states against what is felt, over all whisks: a place, or the stage's origin, that is off.

A recording without pictures holds the contact twice. Touch is stated by the object's place, and felt:

    touch felt − by the stage = zero + late · speed + what all whisks share of place and whisker + their own

zero: of the motor's angle in the stage's frame. late: the gauges' filter. The distance is stated, and follows from the
moments by (6), for the slope is stated, too, so that friction need not be known. What the moments' scale (stiffness,
gauges) is off by, all whisks share. Both are compared as they are known, so that whisks are held against each other
where a scale or a zero is not. No truth is moved by what is felt: a whisk that is off has a status.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import ndtri

from bench.base.statuses import reason
from bench.records.trial_result import SeenWhisk, StageContact, TrialResult, whisks
from bench.session.whisker import Whisker
from bench.trials.differences import LEAST_CHANCE
from bench.trials.felt_contact import FeltContact, felt_contact
from bench.trials.stage_contact import SLOPE, X, Y, Z
from vision import UNKNOWN, Value
from vision.geometry import NO_REASON, Reason

# [rad] One sigma of the zero: wider than any bench has it. Stated.
_ZERO_RAD = np.radians(10.0)
# [whisks] Fewer do not say which of them is off. Derived.
_FEWEST_TO_NAME = 3
# [sigma] More is no chance. Derived.
MOST_SIGMAS = -float(ndtri(0.5 * LEAST_CHANCE))
# [1] Of χ²: causes that explain less well by as much, two sigma, are named, too. Stated.
_AS_GOOD = 4.0
# [mm] Errors up to which touch and distance go in proportion to them, to a third. Stated.
_LARGEST_MM = 20.0
# [°] The same of a slope. Stated.
_LARGEST_DEG = 20.0
# [%] The same of the moments' scale. Stated.
_LARGEST_PERCENT = 50.0
# Where none of these would do.
_UNEXPLAINED = "neither place nor slope were to blame: look at the moments and their gauges"
_TOUCH, _DISTANCE = range(2)


@dataclass(frozen=True, eq=False)
class HeldWhisk:
    """A whisk of a trial as a stage states it and as it is felt."""

    trial: str
    seen: SeenWhisk
    felt: FeltContact

    @property
    def key(self) -> tuple[str, int]:
        """Return trial and number."""
        return self.trial, self.seen.whisk

    @property
    def stage(self) -> StageContact:
        """Return the contact as it is stated."""
        return self.seen.stage_contact

    @property
    def apart(self) -> np.ndarray:
        """Return felt less stated (2,): touch, rad, and logarithm of d_x; NaN where unknown."""
        return self.felt.values - [self.stage.motor_rad, math.log(self.seen.d_x_mm.value)]

    @cached_property
    def by_offset(self) -> np.ndarray:
        """Return the change (2, p) of that with each offset of what is stated."""
        touch, d_x, slope = self.stage.by_offset
        by_distance = self.felt.by_slope * slope - d_x / self.seen.d_x_mm.value
        return np.stack([-touch, by_distance])

    @cached_property
    def own(self) -> np.ndarray:
        """Return the covariance (2, 2) by what is this whisk's own."""
        by_stage = self.by_offset * self.stage.own
        return self.felt.own + by_stage @ by_stage.T

    @cached_property
    def shared(self) -> np.ndarray:
        """Return the changes (2, q) by one sigma of each error that all whisks share."""
        zero = np.array([[_ZERO_RAD], [0.0]])
        return np.hstack([self.by_offset * self.stage.shared, self.felt.shared, zero])

    @property
    def is_known(self) -> np.ndarray:
        """Return which of touch and distance (2,) are known, with all their errors."""
        variances = np.diag(self.own)
        errors = np.column_stack([self.apart, variances, self.shared, self.by_offset])
        return np.isfinite(errors).all(axis=1)


@dataclass(frozen=True, eq=False)
class Suspect:
    """An error that would explain differences. text: with a place for its size. trace (n,): of a unit of it.

    largest: beyond it differences are no longer in proportion, and nothing is explained.
    """

    text: str
    trace: np.ndarray
    largest: float


class Comparison:
    """All whisks of a session that are both stated and felt, and how well they can be compared."""

    def __init__(self, held: Sequence[HeldWhisk]):
        """Take the whisks."""
        self.held = tuple(held)
        apart = np.array([one.apart for one in held]).reshape(-1, 2)
        known = np.array([one.is_known for one in held], dtype=bool).reshape(-1, 2)
        self._whisk, self._kind = np.nonzero(known)  # (n,) of each row
        self.apart = apart[known]
        of_all = [one.by_offset for one in held]
        self._by_offset = self._rows(of_all)  # (n, p)
        shared = self._rows([one.shared for one in held])
        covariance = shared @ shared.T
        for number, one in enumerate(held):
            rows = self._of(number)
            kinds = self._kind[rows]
            covariance[np.ix_(rows, rows)] += one.own[np.ix_(kinds, kinds)]
        self._information = np.linalg.inv(covariance)
        self._weighted = self._information @ self.apart

    def _rows(self, of_whisks: Sequence[np.ndarray]) -> np.ndarray:
        """Return the rows (n, p) of arrays (2, p) of all whisks."""
        rows = [of_whisks[whisk][kind] for whisk, kind in zip(self._whisk, self._kind)]
        return np.array(rows) if rows else np.zeros((0, 0))

    def _of(self, number: int) -> np.ndarray:
        """Return which rows are a whisk's."""
        return np.flatnonzero(self._whisk == number)

    def size(self, trace: np.ndarray) -> Value:
        """Return how much of an error of this trace (n,) there is, per unit; UNKNOWN where none would show."""
        rows = np.flatnonzero(trace)
        of_rows = trace[rows]
        information = float(of_rows @ self._information[np.ix_(rows, rows)] @ of_rows)
        if information <= 0.0:
            return UNKNOWN
        return Value(float(of_rows @ self._weighted[rows]) / information, information**-0.5)

    def apart_from_others(self, number: int) -> tuple[Value, Value]:
        """Return felt less stated of a whisk less what the others predict: touch, rad, and d_x, mm."""
        rows = self._of(number)
        covariance = np.linalg.inv(self._information[np.ix_(rows, rows)])
        values = covariance @ self._weighted[rows]
        found = [UNKNOWN, UNKNOWN]
        for kind, value, variance in zip(self._kind[rows], values, np.diag(covariance)):
            found[kind] = Value(float(value), math.sqrt(variance))
        d_x_mm = self.held[number].seen.d_x_mm.value
        log = found[_DISTANCE]
        return found[_TOUCH], Value(log.value * d_x_mm, log.sigma * d_x_mm)

    def of_place(self, axis: int, number: int | None = None) -> np.ndarray:
        """Return the trace (n,) of an offset by `axis` of one whisk's place or direction, or of all."""
        trace = self._by_offset[:, axis]
        return trace if number is None else trace * (self._whisk == number)

    def least_noticed(self, axis: int, number: int | None = None) -> float:
        """Return the least offset that is no chance: mm, or rad of SLOPE; infinite where none would show."""
        sigma = self.size(self.of_place(axis, number)).sigma
        return MOST_SIGMAS * sigma if math.isfinite(sigma) else math.inf

    def suspects_of_all(self) -> list[Suspect]:
        """Return the errors that all whisks would share."""
        by_percent = -0.01 * (self._kind == _DISTANCE)
        return [
            *self._suspects_of_place("the stage's origin"),
            Suspect("the moments' scale {:+.1f} % off", by_percent, _LARGEST_PERCENT),
        ]

    def suspects_of(self, number: int) -> list[Suspect]:
        """Return the errors of one whisk's own."""
        per_degree = math.radians(1.0) * self.of_place(SLOPE, number)
        return [
            *self._suspects_of_place("its place", number),
            Suspect("its slope {:+.1f}° off", per_degree, _LARGEST_DEG),
        ]

    def _suspects_of_place(self, what: str, number: int | None = None) -> list[Suspect]:
        """Return the errors along x, y and z of one whisk's place, or of all."""
        found = []
        for name, axis in (("x", X), ("y", Y), ("z", Z)):
            text = f"{what} {{:+.2f}} mm off along {name}"
            found.append(Suspect(text, self.of_place(axis, number), _LARGEST_MM))
        return found

    def likeliest(self, suspects: Iterable[Suspect]) -> tuple[float, str]:
        """Return by how many sigmas the likeliest suspect is there, and those that explain as much, in words."""
        found = []
        for suspect in suspects:
            size = self.size(suspect.trace)
            if size.is_known:
                text = suspect.text.format(size.value)
                is_small = abs(size.value) <= suspect.largest
                found.append((abs(size.value) / size.sigma, text if is_small else ""))
        found.sort(reverse=True)
        most, _ = found[0] if found else (0.0, "")
        texts = [text for sigmas, text in found if text and sigmas**2 > most**2 - _AS_GOOD]
        return most, " or ".join(texts) or _UNEXPLAINED


def compare(results: Iterable[TrialResult], whisker: Whisker) -> Comparison:
    """Compare all whisks of a session that are both stated and felt."""
    held = []
    for result, seen, felt in whisks(results):
        if seen.stage_contact is None or not seen.has_truth:
            continue
        contact = felt_contact(result, seen, felt, whisker)
        one = HeldWhisk(result.trial.name, seen, contact)
        if one.is_known.any():
            held.append(one)
    return Comparison(held)


def with_stage_against_felt(
    results: Iterable[TrialResult], whisker: Whisker
) -> tuple[TrialResult, ...]:
    """Return the results, in which a whisk that is felt elsewhere than its stage says has a status."""
    results = tuple(results)
    elsewhere = dict(_elsewhere(compare(results, whisker)))
    if not elsewhere:
        return results
    named = []
    for result in results:
        of_trial = []
        for whisk in result.seen.whisks:
            found = elsewhere.get((result.trial.name, whisk.whisk), NO_REASON)
            of_trial.append(whisk.with_contradiction(found))
        named.append(replace(result, seen=replace(result.seen, whisks=tuple(of_trial))))
    return tuple(named)


def _elsewhere(comparison: Comparison) -> Iterator[tuple[tuple[str, int], Reason]]:
    """Yield the whisks that are felt elsewhere than is stated: all by what they share, or one after another."""
    while comparison.held:
        held = comparison.held
        of_all, causes_of_all = comparison.likeliest(comparison.suspects_of_all())
        worst, of_worst, causes = _worst_alone(comparison)
        if max(of_all, of_worst) <= MOST_SIGMAS:
            return
        if len(held) < _FEWEST_TO_NAME:
            causes = f"{causes} in {held[worst].trial}, or {causes_of_all}"
            yield from _all_elsewhere(held, causes)
            return
        if of_all >= of_worst:
            yield from _all_elsewhere(held, causes_of_all)
            return
        yield held[worst].key, _reason_of(comparison, worst, causes)
        comparison = Comparison([one for one in held if one is not held[worst]])


def _worst_alone(comparison: Comparison) -> tuple[int, float, str]:
    """Return the whisk whose own likeliest suspect is surest, by how many sigmas that is there, and its causes."""
    alone = []
    for number in range(len(comparison.held)):
        sigmas, causes = comparison.likeliest(comparison.suspects_of(number))
        alone.append((number, sigmas, causes))
    return max(alone, key=lambda one: one[1])


def _all_elsewhere(
    held: Sequence[HeldWhisk], causes: str
) -> Iterator[tuple[tuple[str, int], Reason]]:
    """Yield all whisks, with causes that they share."""
    for one in held:
        yield one.key, reason("stage_unlike_all_felt", causes=causes)


def _reason_of(comparison: Comparison, number: int, causes: str) -> Reason:
    """Return how a whisk differs from what its stage states, as the others have it."""
    touch, d_x_mm = comparison.apart_from_others(number)
    parts = []
    if touch.is_known:
        parts.append(f"touch by {touch.in_degrees().value:+.2f} ± {touch.in_degrees().sigma:.2f}°")
    if d_x_mm.is_known:
        parts.append(f"d_x by {d_x_mm.value:+.2f} ± {d_x_mm.sigma:.2f} mm")
    return reason("stage_unlike_felt", apart=", ".join(parts), causes=causes)
