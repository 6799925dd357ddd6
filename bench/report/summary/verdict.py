"""The verdict, for a reader who does not know the paper.

First how well the truth is known; then, for each estimator, what it assumes, how far off it is and
whether its stated uncertainty covers that; last, which one to use here.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from bench.analyses.accuracy_line import accuracy_line
from bench.analyses.estimator_accuracy import Accuracy, RunAccuracy, TruthUncertainty
from bench.analyses.runs import RUNS
from bench.base.settings import Seeing, Settings
from bench.base.statuses import cure_of
from bench.gauges.matrix import FROM_ALL, GaugeCalibration
from bench.records.trial_result import TrialResult, whisks
from vision.geometry import counted


def verdict(
    session: str,
    has_pictures: bool,
    accuracy: RunAccuracy,
    settings: Settings,
    warnings: int,
) -> Iterator[str]:
    """Yield the lines of the verdict.

    session: its name. has_pictures: whether it has any. warnings: how many there are.
    """
    yield _truth_line(session, has_pictures, accuracy.truth, warnings)
    compared = [one for one in accuracy.estimators if one.estimator not in RUNS]
    for one in compared:
        yield accuracy_line(one, settings)
    judged = [one for one in compared if one.judged]
    if judged:
        yield _recommendation(judged, settings.theta_deg)
    else:
        yield _withheld(accuracy.truth, compared)


def _withheld(truth: TruthUncertainty, compared: Sequence[Accuracy]) -> str:
    """Return why there is no verdict on the estimators, and what would allow one."""
    left_out = [judged for one in compared for judged in one.left_out]
    if not left_out:
        return "No verdict on the estimators: no whisk has both a truth and an estimate."
    # What speaks against the truth of many comes before what a single whisk has.
    why = truth.contradiction or left_out[0].whisk_status
    return f"No verdict on the estimators: all whisks are doubtful ({why}). To have one: {cure_of(why.codes)}."


def _truth_line(session: str, has_pictures: bool, truth: TruthUncertainty, warnings: int) -> str:
    """Return of how many whisks the truth is known, and how well."""
    count = counted(truth.measured, "measured whisk")
    if not has_pictures:
        known = f"no pictures, so the true distance is not known; {count} felt"
    elif truth.known:
        known = f"the true distance is known for {truth.known} of {count}, to {truth.d_x_text}"
        if truth.in_doubt:
            known += _in_doubt(truth)
    else:
        known = f"the true distance is known for none of {count}"
    warned = f"{counted(warnings, 'doubt')}, see below" if warnings else "nothing doubtful"
    return f"{session}: {known}; {warned}."


def _in_doubt(truth: TruthUncertainty) -> str:
    """Return of how many whisks the truth is in doubt, and by what where the others have a verdict."""
    if truth.in_doubt == truth.known:
        return ", but in doubt"
    return f", but in doubt for {truth.in_doubt} of these ({truth.contradiction})"


def _recommendation(judged: Sequence[Accuracy], theta_deg: float) -> str:
    """Return which estimator to use, and which others these whisks cannot distinguish from it.

    Only estimators that give a distance for as many whisks as any other are compared.
    """
    most = max(len(one.judged) for one in judged)
    complete = [one for one in judged if len(one.judged) == most]
    best = min(complete, key=lambda one: one.rms_mm)
    alike = [one.label for one in complete if one is not best and not one.is_worse_than(best)]
    text = f"Use {best.label} here, at a pushing angle of {theta_deg:g}°"
    if alike:
        text += f"; {counted(most, 'whisk')} cannot tell {' or '.join(alike)} from it"
    if not best.is_covered:
        text += "; but take its stated uncertainty as too small"
    return f"{text}."


def gauge_source_lines(gauges: GaugeCalibration | None) -> Iterator[str]:
    """Yield what the verdict rests on where measured trials calibrated the gauges."""
    if gauges is not None and gauges.source == FROM_ALL:
        judged = sum(matrix is not None for matrix in gauges.without.values())
        yield (
            f"Gauges from {FROM_ALL}: {judged} of {len(gauges.without)} trials that served are judged, each by gauges "
            "fitted without it; no estimate by gauges that its own trial calibrated is in the verdict."
        )


def preset_lines(results: Iterable[TrialResult], settings: Settings) -> Iterator[str]:
    """Yield by which preset the pictures were measured, where that is not the standard one."""
    if settings.accuracy_mm is not None:
        measured = [seen for _, seen, _ in whisks(results) if seen.looked]
        counts = Counter(seen.looked for seen in measured)
        above = sum(not seen.d_x_mm.sigma <= settings.accuracy_mm for seen in measured)
        presets = ", ".join(f"{name} {count}" for name, count in counts.items())
        yield (
            f"Looked at until d_x's sigma is {settings.accuracy_mm:g} mm or less: {presets}; "
            f"{above} of {len(measured)} whisks are above."
        )
    elif settings.seeing != Seeing():
        cameras = ", ".join(settings.seeing.cameras)
        chosen = f", cameras {cameras}" if cameras else ""
        yield f"Pictures were looked at by the settings {settings.seeing.name}{chosen}."
