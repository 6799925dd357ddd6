"""The verdict, for a reader who does not know the paper.

First how well the truth is known; then, for each estimator, what it assumes, how far off it is and
whether its stated uncertainty covers that; last, which one to use here.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from bench.analyses.runs import FITTED, KINETIC, RUNS, SEEN
from bench.base.settings import Seeing, Settings
from bench.gauges.matrix import FROM_ALL, GaugeCalibration
from bench.records.trial_result import TrialResult, whisks
from bench.report.estimator_accuracy import Accuracy, RunAccuracy, TruthUncertainty
from bench.trials.estimate_errors import Judged
from vision.geometry import counted

_ASSUMPTIONS = {
    "no_slip": "that the contact does not slip sideways",
    "with_friction": "a friction angle of {alpha_est_deg:g}°",
    "frictionless": "a surface without friction",
    "corrected": "a friction angle of {alpha_est_deg:g}°, and corrects for the object's thickness",
    FITTED: "the friction angle fitted to the other whisks of the surface",
    SEEN: "the friction angle that the cameras saw, which no robot has",
    KINETIC: "a friction angle of {alpha_est_deg:g}° where the moments show that the contact slides",
}


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
        yield "No verdict on the estimators: no whisk has both a truth and an estimate."


def _truth_line(session: str, has_pictures: bool, truth: TruthUncertainty, warnings: int) -> str:
    """Return of how many whisks the truth is known, and how well."""
    count = counted(truth.measured, "measured whisk")
    if not has_pictures:
        known = f"no pictures, so the true distance is not known; {count} felt"
    elif truth.known:
        known = (
            f"the true distance is known for {truth.known} of {count}, to ± {truth.d_x_mm:.2g} mm"
        )
    else:
        known = f"the true distance is known for none of {count}"
    warned = f"{counted(warnings, 'doubt')}, see below" if warnings else "nothing doubtful"
    return f"{session}: {known}; {warned}."


def accuracy_line(accuracy: Accuracy, settings: Settings) -> str:
    """Return what an estimator assumes, how far off it is, and whether its uncertainty covers that."""
    name = f"Equation {accuracy.label}" if accuracy.label.startswith("(") else accuracy.label
    if accuracy.estimator in _ASSUMPTIONS:
        assumed = _ASSUMPTIONS[accuracy.estimator].format(alpha_est_deg=settings.alpha_est_deg)
        name = f"{name} assumes {assumed}"
    missing = _missing(accuracy)
    if accuracy.judged:
        return f"{name}: {_errors(accuracy)} {_coverage(accuracy)}{missing}"
    if accuracy.left_out:
        errors = _error_range(accuracy.left_out)
        return f"{name}: no verdict, all {len(accuracy.left_out)} whisks are doubtful ({errors}).{missing}"
    return f"{name}: it gave no distance.{missing}"


def _errors(accuracy: Accuracy) -> str:
    """Return RMS and worst error in per cent and mm, and where the worst is."""
    worst = accuracy.worst
    text = f"off by {accuracy.rms_percent:.1f} % ({accuracy.rms_mm:.2f} mm) RMS"
    if len(accuracy.judged) == 1:
        text = "off by"
    else:
        text += f" over {len(accuracy.judged)} whisks, at worst"
    return (
        f"{text} {worst.error_percent:+.1f} ± {worst.error_sigma_percent:.1f} % "
        f"({worst.error_mm:+.2f} mm) on a slope of {worst.beta_deg:.1f}° ({worst.trial})."
    )


def _coverage(accuracy: Accuracy) -> str:
    """Return whether the stated 95 % intervals hold the truth as often as they should."""
    if not accuracy.intervals:
        return "It states no interval."
    covers = "covers" if accuracy.is_covered else "does not cover"
    held = f"{accuracy.intervals_holding} of {accuracy.intervals}"
    return f"Its stated uncertainty {covers} that: the 95 % interval holds the truth in {held}."


def _missing(accuracy: Accuracy) -> str:
    """Return how many whisks have no distance, a warning, or are left out for one."""
    parts = []
    if accuracy.without_distance:
        why = accuracy.without_distance[0].status
        parts.append(f"no distance for {len(accuracy.without_distance)} ({why})")
    if accuracy.warned:
        parts.append(f"a warning for {len(accuracy.warned)} ({accuracy.warned[0].status})")
    if accuracy.judged and accuracy.left_out:
        errors = _error_range(accuracy.left_out)
        parts.append(f"{len(accuracy.left_out)} doubtful left out ({errors})")
    if not parts:
        return ""
    return f" Of {counted(accuracy.with_truth, 'whisk')}: {'; '.join(parts)}."


def _error_range(judged: Sequence[Judged]) -> str:
    """Return the least and the largest error in per cent, each with its standard deviation."""
    least = min(judged, key=lambda one: one.error_percent)
    largest = max(judged, key=lambda one: one.error_percent)
    ends = [least] if least is largest else [least, largest]
    texts = [f"{one.error_percent:+.1f} ± {one.error_sigma_percent:.1f}" for one in ends]
    return f"{' to '.join(texts)} %"


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


def known_friction_lines(accuracy: RunAccuracy, settings: Settings) -> Iterator[str]:
    """Yield the accuracy of (10) with what is known of the friction, where anything is."""
    for one in accuracy.estimators:
        if one.estimator in (FITTED, SEEN, KINETIC) and one.judged:
            yield accuracy_line(one, settings)
