"""The verdict: how wrong each estimator is, over the measured whisks."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bench.analyses.runs import FITTED, KINETIC, RUNS, SEEN
from bench.base.drawing import label_of
from bench.base.settings import Seeing, Settings
from bench.gauges.matrix import FROM_ALL, Gauges
from bench.records.trial_result import TrialResult, whisks
from bench.trials.estimate_errors import Judged
from vision.geometry.counted import counted

_SIGNIFICANT = 2.0  # sigmas: no whisk beyond this, and the estimator may be right in all


def verdict(
    session: str,
    pictures: bool,
    results: Iterable[TrialResult],
    judged: Sequence[Judged],
    settings: Settings,
    doubtful: int,
) -> Iterator[str]:
    """How wrong each estimator is, and of how many whisks the truth is known. session: its name; pictures: whether it
    has any; doubtful: how many lines are."""
    measured = _measured(judged)
    seen = [s for result, s, _ in whisks(results) if result.trial.purpose == "measure"]
    with_truth = sum(s.has_truth for s in seen)
    asked = [
        j for j in judged if j.purpose == "measure" and not j.one_factor and np.isfinite(j.d_x_mm)
    ]
    for name in dict.fromkeys(j.estimator for j in asked if j.estimator not in RUNS):
        mine = [j for j in measured if j.estimator == name]
        missing = _without_or_doubted([j for j in asked if j.estimator == name])
        yield (
            _verdict_on(name, mine, settings) if mine else f"{label_of(name)} gave no distance."
        ) + missing
    if not measured:
        yield "No verdict on the estimators: no whisk has both a truth and an estimate."
    yield (
        f"{session}: truth for {with_truth} of {counted(len(seen), 'measured whisk')}"
        if pictures
        else f"{session}: no pictures, so no truth; {counted(len(seen), 'measured whisk')} felt"
    ) + (f"; {counted(doubtful, 'doubt')}, see below." if doubtful else "; nothing doubtful.")


def _without_or_doubted(asked: Sequence[Judged]) -> str:
    """How many of an estimator's answers are none, and how many more come with a status."""
    none = [j for j in asked if not np.isfinite(j.error_percent)]
    doubted = [j for j in asked if j.status and np.isfinite(j.error_percent)]
    parts = [f"{len(none)} of {len(asked)} without a distance ({none[0].status})"] if none else []
    parts += [f"{len(doubted)} with a status ({doubted[0].status})"] if doubted else []
    return f" {'; '.join(parts)}." if parts else ""


def gauges_of_all(gauges: Gauges | None) -> Iterator[str]:
    """What the verdict rests on where measured trials calibrated the gauges."""
    if gauges is not None and gauges.source == FROM_ALL:
        judged = sum(matrix is not None for matrix in gauges.without.values())
        yield (
            f"Gauges from {FROM_ALL}: {judged} of {len(gauges.without)} trials that served are judged, each by gauges "
            "fitted without it; no estimate by gauges that its own trial calibrated is in the verdict."
        )


def looked_at(results: Iterable[TrialResult], settings: Settings) -> Iterator[str]:
    """How hard pictures were looked at, where that is not the standard."""
    seeing, looked = settings.seeing, [seen for _, seen, _ in whisks(results) if seen.looked]
    if settings.accuracy_mm is not None:
        counts = Counter(seen.looked for seen in looked)
        above = sum(not seen.d_x_mm.sigma <= settings.accuracy_mm for seen in looked)
        by = ", ".join(f"{name} {count}" for name, count in counts.items())
        above_it = f"{above} of {len(looked)} whisks are above."
        yield f"Looked at until d_x's sigma is {settings.accuracy_mm:g} mm or less: {by}; {above_it}"
    elif seeing != Seeing():
        asked = f", cameras {', '.join(seeing.cameras)}" if seeing.cameras else ""
        yield f"Pictures were looked at by the settings {seeing.name}{asked}."


def _measured(judged: Sequence[Judged]) -> list[Judged]:
    return [
        j
        for j in judged
        if j.purpose == "measure" and not j.one_factor and np.isfinite(j.error_percent)
    ]


def run_lines(judged: Sequence[Judged], settings: Settings) -> Iterator[str]:
    """(10) once more with what is known of the friction, where that is anything."""
    for name, what in (
        (FITTED, "to the other whisks of the surface"),
        (SEEN, "which no robot has; what is left then"),
        (KINETIC, "where moments alone show stick–slip"),
    ):
        mine = [j for j in _measured(judged) if j.estimator == name]
        if mine:
            yield _verdict_on(name, mine, settings).replace(
                label_of(name), f"{label_of(name)} ({what}),", 1
            )


def _verdict_on(name: str, judged: Sequence[Judged], settings: Settings) -> str:
    """The range of the errors of the whisks of which nothing is doubtful; of the others how many, and theirs."""
    sound, doubtful = ([j for j in judged if j.doubtful == doubt] for doubt in (False, True))
    assumed = f", α_est = {settings.alpha_est_deg:g}°," if name == "with_friction" else ""
    if not sound:
        all_of_them = f"{_all_of(len(judged))} doubtful ({_range(judged)})"
        return f"{label_of(name)}{assumed} has no verdict: {all_of_them}."
    worst = max(sound, key=lambda j: abs(j.error_percent))
    is_significant = any(abs(j.error_percent) > _SIGNIFICANT * j.error_sigma_percent for j in sound)
    not_significant = "" if is_significant else ", not significant"
    left_out = f"; {len(doubtful)} doubtful left out ({_range(doubtful)})" if doubtful else ""
    return (
        f"{label_of(name)}{assumed} is wrong by {_range(sound)} of d_x over {counted(len(sound), 'whisk')}, "
        f"most at β = {worst.beta_deg:.1f}° ({worst.trial}){not_significant}{left_out}."
    )


def _all_of(count: int) -> str:
    return "its one whisk is" if count == 1 else f"all of its {count} whisks are"


def _range(judged: Sequence[Judged]) -> str:
    """From the least to the largest error, each with its sigma; one where there is one."""
    ends = dict.fromkeys(pick(judged, key=lambda j: j.error_percent) for pick in (min, max))
    return " to ".join(f"{j.error_percent:+.1f} ± {j.error_sigma_percent:.1f}" for j in ends) + " %"
