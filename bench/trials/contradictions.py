"""What a session contradicts of itself as a whole, in the status of each whisk that rests on it.

A warning of the session, or of a trial, whose code speaks against truth or estimates
(`bench.base.statuses.Status.reaches`) is no mere remark: each whisk that has them has
it, and no verdict takes a whisk with a warning.
"""

from dataclasses import replace

from bench.base.input_problems import InputProblems
from bench.base.statuses import ESTIMATES, TRUTH, reaching
from bench.gauges.matrix import GaugeCalibration
from bench.records.trial_result import SeenTrial, SeenWhisk
from vision.geometry import Reason, as_reason


def contradictions_of(problems: InputProblems, trial: str) -> Reason:
    """Return the warnings about the session and a trial that question truth or estimates."""
    return reaching((TRUTH, ESTIMATES), problems.about(trial))


def contradictions_alone(problems: InputProblems) -> InputProblems:
    """Return the warnings that question numbers, for the run of one whisker of an array."""
    kept = InputProblems()
    for line in problems.warnings:
        if reaching((TRUTH, ESTIMATES), as_reason(line)):
            kept.warn(line, problems.trials_of.get(line, ()))
    return kept


def contradicted(seen: SeenTrial, said: Reason) -> SeenTrial:
    """Return the seen half with what speaks against the truth in the status of each whisk with one."""
    found = reaching((TRUTH,), said)
    if not found:
        return seen
    return replace(
        seen,
        whisks=tuple(_contradicted(whisk, found) for whisk in seen.whisks),
        ways_back=tuple(_contradicted(whisk, found) for whisk in seen.ways_back),
    )


def _contradicted(whisk: SeenWhisk, found: Reason) -> SeenWhisk:
    """Return a whisk with what speaks against its truth; one of which nothing is seen as it is."""
    if not whisk.has_truth and whisk.deflection is None:
        return whisk
    return whisk.with_contradiction(found)


def against_estimates(said: Reason, gauges: GaugeCalibration | None, seen: SeenWhisk) -> Reason:
    """Return what speaks against a whisk's estimates and is not in the status of its seen half.

    Gauges that were calibrated by the session's pictures rest on what its truth rests on.
    """
    is_by_pictures = gauges is not None and gauges.of_wire
    found = reaching((TRUTH, ESTIMATES) if is_by_pictures else (ESTIMATES,), said)
    return Reason.of_parts(part for part in found.parts if part not in seen.status.parts)
