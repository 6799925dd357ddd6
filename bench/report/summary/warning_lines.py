"""Warnings of each whisk, and what the light hides."""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from bench.analyses.estimates_again import EVALUATED_AGAIN
from bench.base.input_problems import in_one_status
from bench.base.statuses import reason
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from vision.geometry import Reason, as_reason, counted

# Codes of statuses that are as they should be: of a session without pictures, of a gauge trial.
SILENT = {"no_pictures", "slip_not_seen", "own_gauges"}
# (10) run again repeats what it said first; what the others miss is the result, no fault of the run.
_EXPECTED = ("no_slip", "frictionless", *EVALUATED_AGAIN)

# Codes of estimates that are a fault of the estimator's code, not a limit of its model.
FAILURES = {"estimator_raised", "no_distance_given", "distance_impossible", "sigma_impossible"}


def is_silent(status: Reason) -> bool:
    """Return whether a status is as it should be, and no warning."""
    return SILENT.issuperset(status.codes)


@dataclass(frozen=True)
class _Warned:
    """A whisk by name with a status. sigma_mm: of its true distance, infinite without a truth."""

    whisk: str
    status: Reason
    sigma_mm: float


def whisk_warnings(
    results: Iterable[TrialResult], of_session: Iterable[str] = ()
) -> Iterator[Reason]:
    """Yield a line for each cause of warnings of whisks, and of estimators that failed.

    of_session: warnings that have a line of their own, whichever whisks they reach. A gauge trial
    that cannot be judged is as it should be; limits of estimators are in `estimator_limits`.
    """
    said: set[tuple[str, str]] = set()
    for line in of_session:
        said.update(as_reason(line).parts)
    results = list(results)
    by_cause: dict[tuple[str, ...], list[_Warned]] = {}
    for result, seen, felt in whisks(results):
        name = f"{result.trial.name}, whisk {seen.whisk}"
        for one in _warnings_of(seen, felt, said):
            warned = _Warned(name, one, _sigma_mm(seen))
            by_cause.setdefault(one.codes, []).append(warned)
    yield from map(_cause_line, by_cause.values())
    for estimator, warned in _warned_estimates(results):
        if FAILURES.intersection(warned[0].status.codes):
            yield _cause_line(warned, f", {estimator}")


def _warnings_of(
    seen: SeenWhisk, felt: FeltWhisk, said: Collection[tuple[str, str]]
) -> Iterator[Reason]:
    """Yield the status of a whisk, without what is said elsewhere, and its saturated samples."""
    statuses = [_without(said, status) for status in (seen.status, felt.status)]
    status = in_one_status(*(one for one in statuses if not is_silent(one)))
    if status:
        yield status
    if felt.saturated:
        samples = counted(felt.saturated, "saturated sample")
        yield reason("samples_saturated", samples=samples)


def _without(said: Collection[tuple[str, str]], status: Reason) -> Reason:
    """Return a status without those sentences that are said elsewhere."""
    return Reason.of_parts(part for part in as_reason(status).parts if part not in said)


def estimator_limits(results: Iterable[TrialResult]) -> Iterator[Reason]:
    """Yield a line for each limit that estimators met: they question neither the truth nor the recording."""
    for estimator, warned in _warned_estimates(results):
        if not FAILURES.intersection(warned[0].status.codes):
            yield _cause_line(warned, f", {estimator}")


def _warned_estimates(results: Iterable[TrialResult]) -> Iterator[tuple[str, list[_Warned]]]:
    """Yield estimator and whisks of alike status of its estimates, where that is not the result itself."""
    alike: dict[tuple[str, ...], list[_Warned]] = {}
    for result, seen, felt in whisks(results):
        name = f"{result.trial.name}, whisk {seen.whisk}"
        for estimate in felt.estimates:
            if estimate.status and estimate.estimator not in _EXPECTED:
                status = as_reason(estimate.status)
                warned = _Warned(name, status, _sigma_mm(seen))
                alike.setdefault((estimate.estimator, *status.codes), []).append(warned)
    for (estimator, *_), warned in alike.items():
        yield estimator, warned


def _sigma_mm(seen: SeenWhisk) -> float:
    """Return the sigma of the true distance, mm; infinite without a truth."""
    sigma_mm = float(seen.d_x_mm.sigma)
    return sigma_mm if math.isfinite(sigma_mm) else math.inf


def _cause_line(warned: Sequence[_Warned], whose: str = "") -> Reason:
    """Return one line on whisks of one cause: how many, and the one whose truth is known least.

    whose: what stands behind the whisk's name.
    """
    worst = max(warned, key=lambda one: one.sigma_mm)
    if len(warned) == 1:
        return worst.status.about(f"{worst.whisk}{whose}")
    return worst.status.about(f"{len(warned)} whisks{whose}; worst is {worst.whisk}")


def damage_warnings(results: Iterable[TrialResult]) -> Iterator[Reason]:
    """Yield a line for each trial with frames that cannot be read."""
    for result in results:
        if result.seen.damaged:
            yield as_reason(result.seen.damaged).about(result.trial.name)


def light_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """Yield a line a camera that saw the wire lit from one side: the first trial's, and how many more."""
    lines: dict[str, list[str]] = {}  # by camera
    for result in results:
        for camera, width in result.seen.one_sided_light.items():
            line = f"{result.trial.name}: {width.line(camera)}"
            lines.setdefault(camera, []).append(line)
    for first, *others in lines.values():
        more = f" (and so in {counted(len(others), 'more trial')})" if others else ""
        yield first + more


def frame_lines(results: Iterable[TrialResult]) -> Iterator[str]:
    """Yield a line for frames that were dropped, made good or left out."""
    for result in results:
        for note in result.seen.notes:
            yield f"{result.trial.name}: {note}"
