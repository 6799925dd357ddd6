"""Warnings of each whisk, what the light hides, and what was taken as exact."""

from collections.abc import Iterable, Iterator

from bench.analyses.runs import RUNS
from bench.base.input_problems import in_one_status
from bench.base.statuses import reason
from bench.records.trial_result import TrialResult, whisks
from bench.session.session import Session
from vision.geometry import Reason, as_reason, counted

# Codes of statuses that are as they should be: of a session without pictures, of a gauge trial.
SILENT = {"no_pictures", "own_gauges"}
# (10) run again repeats what it said first; what the others miss is the result, no fault of the run.
_EXPECTED = ("no_slip", "frictionless", *RUNS)


def is_silent(status: Reason) -> bool:
    """Return whether a status is as it should be, and no warning."""
    return SILENT.issuperset(status.codes)


def whisk_warnings(results: Iterable[TrialResult]) -> Iterator[Reason]:
    """Yield a line for each whisk that has a warning.

    A gauge trial that cannot be judged is as it should be.
    """
    for result, seen, felt in whisks(results):
        name = f"{result.trial.name}, whisk {seen.whisk}"
        statuses = [as_reason(status) for status in (seen.status, felt.status)]
        status = in_one_status(*(one for one in statuses if not is_silent(one)))
        if status:
            yield status.about(name)
        if felt.saturated:
            samples = counted(felt.saturated, "saturated sample")
            yield reason("samples_saturated", samples=samples).about(name)
        for answer in felt.estimates:
            if answer.status and answer.estimator not in _EXPECTED:
                yield as_reason(answer.status).about(f"{name}, {answer.estimator}")


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


def taken_as_exact(session: Session) -> Iterator[str]:
    """Yield one line that names what was given without a sigma; none where all has one."""
    whisker = session.whisker
    given = {
        "whisker length": whisker.length_sigma_mm,
        "whisker diameter": whisker.diameter_sigma_mm,
        "bar diameter": session.bar_diameter_sigma_mm,
        "stiffness C": whisker.C_sigma_Nmm2,
    }
    if session.T_rig_board is not None:
        given["T_rig_board"] = session.T_rig_board_sigma_mm + session.T_rig_board_sigma_rad
    if session.board is not None:
        given["board square"] = session.board.square_sigma_mm
    exact = [name for name, sigma in given.items() if not sigma]
    if exact:
        yield ", ".join(exact)
