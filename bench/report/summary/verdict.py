"""The verdict: how wrong each estimator is, over the measured whisks."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bench.base.drawing import label_of
from bench.base.settings import Settings
from bench.friction.runs import FITTED, RUNS, SEEN
from bench.gauges.matrix import FROM_ALL, Gauges
from bench.records.trial import TrialResult, whisks
from bench.session.session import Session
from bench.trials.compare import Judged

_SIGNIFICANT = 2.0  # sigmas: no whisk beyond this, and the estimator may be right in all


def verdict(
    session: Session, results: Iterable[TrialResult], judged: Sequence[Judged], settings: Settings, doubtful: int
) -> Iterator[str]:
    """How wrong each estimator is, and of how many whisks the truth is known. doubtful: how many lines are."""
    measured = _measured(judged)
    seen = [s for result, s, _ in whisks(results) if result.trial.purpose == "measure"]
    known = sum(s.has_truth for s in seen)
    told = [j for j in judged if j.purpose == "measure" and not j.one_factor and np.isfinite(j.d_x_mm)]
    asked = [j for j in told if not j.apart]
    for name in dict.fromkeys(j.estimator for j in asked if j.estimator not in RUNS):
        mine = [j for j in measured if j.estimator == name]
        missing = _told([j for j in asked if j.estimator == name])
        yield (_verdict_on(name, mine, settings) if mine else f"{label_of(name)} gave no distance.") + missing
    yield from _left_out([j for j in told if j.apart])
    if not measured:
        yield "No verdict on the estimators: no whisk free of doubt has both a truth and an estimate."
    pictures = any(trial.camera_sources for trial in session.trials)
    yield (
        f"{session.name}: truth for {known} of {len(seen)} measured whisks"
        if pictures
        else f"{session.name}: no pictures, so no truth; {len(seen)} measured whisks felt"
    ) + (f"; {doubtful} doubtful, see below." if doubtful else "; nothing doubtful.")


def _left_out(apart: Sequence[Judged]) -> Iterator[str]:
    """Which whisks the verdict does not rest on."""
    names = list(dict.fromkeys((j.trial, j.whisk) for j in apart))
    if names:
        which = ", ".join(dict.fromkeys(trial for trial, _ in names))
        count = f"{len(names)} whisks are" if len(names) > 1 else "1 whisk is"
        yield f"{count} doubtful and in no verdict ({which})."


def _told(asked: Sequence[Judged]) -> str:
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


def _measured(judged: Sequence[Judged]) -> list[Judged]:
    usual = (j for j in judged if j.purpose == "measure" and not j.one_factor and not j.apart)
    return [j for j in usual if np.isfinite(j.error_percent)]


def run_lines(judged: Sequence[Judged], settings: Settings) -> Iterator[str]:
    """(10) once more with what is known of the friction, where that is anything."""
    for name, what in ((FITTED, "to the other whisks of the surface"), (SEEN, "which no robot has; what is left then")):
        mine = [j for j in _measured(judged) if j.estimator == name]
        if mine:
            yield _verdict_on(name, mine, settings).replace(label_of(name), f"{label_of(name)} ({what}),", 1)


def _verdict_on(name: str, judged: Sequence[Judged], settings: Settings) -> str:
    errors = np.array([j.error_percent for j in judged])
    sigmas = np.array([j.error_sigma_percent for j in judged])
    worst = judged[int(np.argmax(np.abs(errors)))]
    assumed = f", α_est = {settings.alpha_est_deg:g}°," if name == "with_friction" else ""
    ends = dict.fromkeys(int(k) for k in (np.argmin(errors), np.argmax(errors)))
    spread = " to ".join(f"{errors[k]:+.1f} ± {sigmas[k]:.1f}" for k in ends)
    count = f"{len(errors)} whisks" if len(errors) > 1 else "1 whisk"
    significant = np.any(np.abs(errors) > _SIGNIFICANT * sigmas)
    return (
        f"{label_of(name)}{assumed} is wrong by {spread} % of d_x over {count}, most at β = {worst.beta_deg:.1f}° "
        f"({worst.trial})" + ("." if significant else ": not significant.")
    )
