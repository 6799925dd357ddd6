"""The verdict, for a reader who does not know the paper.

First how well the truth is known; then, for each estimator, what it assumes, how far off it is and
what it states of that; of the best one, on which surfaces and slopes, and what so many whisks allow
to say of others; last, which one to use here.
"""

from bisect import bisect
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from bench.analyses.accuracy_line import accuracy_line
from bench.analyses.cells import panel_title
from bench.analyses.estimates_again import EVALUATED_AGAIN, FITTED
from bench.analyses.estimator_accuracy import Accuracy, RunAccuracy, TruthUncertainty
from bench.analyses.pooling import grouped, rms
from bench.base.settings import Seeing, Settings
from bench.base.statuses import cure_of
from bench.gauges.matrix import FROM_ALL, GaugeCalibration
from bench.records.trial_result import BY_STAGE, TrialResult, whisks
from bench.trials.estimate_errors import Judged
from vision.geometry import counted

# [°] Where slopes are steeper by a group: between those that a protractor sets every 5°. Stated.
_STEEPER_DEG = (27.5, 57.5)
# [surfaces and speeds] At most, so that a verdict stays short: the paper's. Stated.
_MOST_PANELS = 4


def verdict(
    session: str,
    is_seen: bool,
    accuracy: RunAccuracy,
    settings: Settings,
    warnings: int,
) -> Iterator[str]:
    """Yield the lines of the verdict.

    session: its name. is_seen: whether it has pictures or traces. warnings: how many there are.
    """
    yield _truth_line(session, is_seen, accuracy.truth, warnings)
    compared = [one for one in accuracy.estimators if one.estimator not in EVALUATED_AGAIN]
    fitted = [one for one in accuracy.estimators if one.estimator == FITTED and one.judged]
    for one in (*compared, *fitted):
        yield accuracy_line(one, settings)
    judged = [one for one in compared if one.judged]
    if judged:
        complete = _most_complete(judged)
        best = min(complete, key=lambda one: one.rms_mm)
        yield from _slope_lines(best)
        yield _sample_line(best)
        yield _recommendation(best, complete, fitted, settings.theta_deg)
    else:
        yield _withheld(accuracy.truth, compared)


def _withheld(truth: TruthUncertainty, compared: Sequence[Accuracy]) -> str:
    """Return why there is no verdict on the estimators, and what would allow one."""
    left_out = []
    for one in compared:
        left_out += one.left_out
    if not left_out:
        return "No verdict on the estimators: no whisk has both a truth and an estimate."
    # What speaks against the truth of many comes before what a single whisk has.
    why = truth.contradiction or left_out[0].whisk_status
    return f"No verdict on the estimators: all whisks have warnings ({why}). To have one: {cure_of(why.codes)}."


def _truth_line(session: str, is_seen: bool, truth: TruthUncertainty, warnings: int) -> str:
    """Return of how many whisks the truth is known, and how well."""
    count = counted(truth.measured, "measured whisk")
    if truth.known:
        by = " by a stage" if truth.source == BY_STAGE else ""
        known = f"the true distance is known{by} for {truth.known} of {count}, to {truth.d_x_text}"
        if truth.questioned:
            known += _questioned(truth)
    elif not is_seen:
        known = f"no pictures, so the true distance is not known; {count} felt"
    else:
        known = f"the true distance is known for none of {count}"
    warned = f"{counted(warnings, 'warning')}, see below" if warnings else "no warning"
    return f"{session}: {known}; {warned}."


def _questioned(truth: TruthUncertainty) -> str:
    """Return against the truth of how many whisks warnings speak, and which where the others have a verdict."""
    if truth.questioned == truth.known:
        return ", but warnings speak against it"
    return f", but warnings speak against {truth.questioned} of these ({truth.contradiction})"


def _most_complete(judged: Sequence[Accuracy]) -> list[Accuracy]:
    """Return the estimators that give a distance for as many whisks as any other."""
    most = max(len(one.judged) for one in judged)
    return [one for one in judged if len(one.judged) == most]


def _slope_lines(accuracy: Accuracy) -> Iterator[str]:
    """Yield RMS and worst error by surface and slope, a line a surface and speed.

    There is none where all whisks are of one surface and of alike slopes. Of many surfaces those of
    the largest error are named.
    """
    panels = list(grouped(accuracy.judged, lambda one: (one.surface, one.speed_deg_s)).items())
    if len(panels) == 1 and len(_by_steepness(panels[0][1])) == 1:
        return
    shown = panels
    if len(panels) > _MOST_PANELS:
        largest = sorted(panels, key=lambda panel: -rms(_errors_percent(panel[1])))
        shown = [panel for panel in panels if panel in largest[:_MOST_PANELS]]
        yield f"The {_MOST_PANELS} of {len(panels)} surfaces and speeds with the largest errors:"
    for panel, judged in shown:
        parts = [_slope_part(group) for group in _by_steepness(judged)]
        yield f"{accuracy.label} on {panel_title(*panel)}, by slope: {'; '.join(parts)}."


def _by_steepness(judged: Iterable[Judged]) -> list[list[Judged]]:
    """Return the whisks in groups of flat, middle and steep slopes, those that there are."""
    groups = grouped(judged, lambda one: bisect(_STEEPER_DEG, abs(one.beta_deg)))
    return [groups[number] for number in sorted(groups)]


def _slope_part(judged: Sequence[Judged]) -> str:
    """Return RMS and worst error of whisks, and from what slope to what slope they are."""
    slopes_deg = [abs(one.beta_deg) for one in judged]
    least = f"{min(slopes_deg):.0f}"
    most = f"{max(slopes_deg):.0f}"
    errors = _errors_percent(judged)
    worst = max(errors, key=abs)
    slopes = f"{least}°" if least == most else f"{least} to {most}°"
    if len(errors) == 1:
        return f"{slopes} {worst:+.1f} %"
    return f"{slopes} {rms(errors):.1f} % RMS (worst {worst:+.1f} %)"


def _errors_percent(judged: Iterable[Judged]) -> list[float]:
    """Return the errors of whisks, per cent of the truth."""
    return [one.error_percent for one in judged]


def _sample_line(accuracy: Accuracy) -> str:
    """Return what so many whisks allow to say of further ones."""
    low, high = accuracy.rms_range_percent
    text = (
        f"By {counted(len(accuracy.judged), 'whisk')} at {counted(accuracy.settings, 'setting')} (a slope of a surface "
        f"at a speed), with 95 % confidence: over others like these {accuracy.label} errs by {low:.2g} to "
        f"{high:.2g} % RMS"
    )
    if accuracy.intervals:
        least, most = accuracy.holding_range_percent
        text += f", and its interval holds the truth in {least:.0f} to {most:.0f} % of them"
    return f"{text}."


def _recommendation(
    best: Accuracy, complete: Sequence[Accuracy], fitted: Sequence[Accuracy], theta_deg: float
) -> str:
    """Return which estimator to use, which others these whisks cannot distinguish from it, and whether
    a fitted friction angle is better.

    complete: all that are compared. fitted: (10) with the friction angle fitted, where that is known.
    """
    alike = [one.label for one in complete if one is not best and not one.is_worse_than(best)]
    text = f"Use {best.label} here, at a pushing angle of {theta_deg:g}°"
    if alike:
        whisks_text = counted(len(best.judged), "whisk")
        text += f"; {whisks_text} cannot show whether {' or '.join(alike)} is better or worse"
    if not best.is_covered:
        text += "; but its stated uncertainty is too small"
    for one in fitted:
        if len(one.judged) == len(best.judged) and best.is_worse_than(one):
            text += f"; where α can be fitted to the surface first, {one.rms_percent:.1f} % RMS are left"
    return f"{text}."


def gauge_source_lines(gauges: GaugeCalibration | None) -> Iterator[str]:
    """Yield what the verdict rests on where measured trials calibrated the gauges."""
    if gauges is not None and gauges.source == FROM_ALL:
        judged = sum(matrix is not None for matrix in gauges.without.values())
        yield (
            f"Gauges from {FROM_ALL}: of {len(gauges.without)} trials that served, {judged} are judged, each by gauges "
            "fitted without it; the others are not in the verdict."
        )


def preset_lines(results: Iterable[TrialResult], settings: Settings) -> Iterator[str]:
    """Yield by which preset the pictures were measured, where that is not the standard one."""
    if settings.accuracy_mm is not None:
        measured = [seen for _, seen, _ in whisks(results) if seen.looked]
        counts = Counter(seen.looked for seen in measured)
        above = sum(not seen.d_x_mm.sigma <= settings.accuracy_mm for seen in measured)
        presets = ", ".join(f"{name} {count}" for name, count in counts.items())
        yield (
            f"Pictures were evaluated until d_x's sigma is {settings.accuracy_mm:g} mm or less: {presets}; "
            f"{above} of {len(measured)} whisks are above."
        )
    elif settings.seeing != Seeing():
        cameras = ", ".join(settings.seeing.cameras)
        chosen = f", cameras {cameras}" if cameras else ""
        yield f"Pictures were evaluated by the settings {settings.seeing.name}{chosen}."
