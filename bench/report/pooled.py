"""`whisker-bench figures 8`: several evaluated runs, days of one whisker, pooled into one Fig. 8."""

import csv
from collections.abc import Sequence
from pathlib import Path

from bench.analyses.figure_8 import FIGURE_8, figure_8, rows
from bench.analyses.surfaces import FittedSurface, friction_lines, surfaces
from bench.base.drawing import publish, style
from bench.base.errors import BadInput
from bench.base.results import read_result
from bench.records.plain import from_plain
from bench.records.trial_result import TrialResult, WhiskerFacts
from estimator.beam import Beam

TABLE = "whisks.csv"
_AGAIN = "evaluate the session again into this folder"
# A whisker's length, diameter and stiffness are written down alike on all days; this allows for rounding.
_SAME_WHISKER = 1e-3
# Fig. 8 is of one distance. |m| is scaled to it as 1/d_x, which takes out what a ruler leaves, not another set-up.
_SAME_DISTANCE = 0.1


def write_figure_8(outs: Sequence[Path], folder: Path) -> tuple[list[Path], list[str]]:
    """Pool evaluated runs; write figure_8.png, .svg and .csv, each whole. The paths, and a line on α a panel.

    Raises BadInput where a folder is no evaluated run, is given twice, cannot be pooled with the first, or none of them
    holds a whisk.
    """
    fitted = pooled(outs)
    stem = Path(folder) / "figure_8"
    with style():
        paths = publish(figure_8(fitted), stem)
    FIGURE_8.write(Path(folder), rows(fitted))
    return [*paths, stem.with_suffix(".csv")], list(friction_lines(fitted))


def pooled(outs: Sequence[Path]) -> list[FittedSurface]:
    """A FittedSurface for each surface and speed, of the whisks of all runs. Raises BadInput as `write_figure_8` does."""
    runs = [(Path(out), read_run(Path(out))) for out in outs]
    (first, reference), *others = runs
    _check_given_once(runs)
    for out, results in others:
        _check_alike(out, results[0], first, reference[0])
    beam = _beam(reference[0].whisker)
    _check_distances([(out, surfaces(results, beam)) for out, results in runs])
    fitted = surfaces([result for _, results in runs for result in results], beam)
    if not fitted:
        found = "no whisk has moments with a slope and a distance, seen or nominal (beta_deg, d_x_mm in trial.toml)"
        raise BadInput(found, file=first)
    return fitted


def _beam(whisker: WhiskerFacts) -> Beam:
    tip = None if whisker.tip_diameter_mm is None else whisker.tip_diameter_mm / whisker.diameter_mm
    return Beam.from_rigidity(whisker.EI_Nmm2, whisker.length_mm, whisker.shape, tip)


def read_run(out: Path) -> list[TrialResult]:
    """The results of a run's trials, in the order of its whisks.csv. Raises BadInput where it is no finished run, or
    another one was stopped half-way in the same folder."""
    if not (out / TABLE).is_file():
        raise BadInput(
            f"is no evaluated run (there is no {TABLE} in it); give the OUT of `evaluate`", file=out
        )
    results = [_result(out, trial) for trial in _trials(out / TABLE)]
    if not results:
        raise BadInput(f"holds no whisk ({TABLE} has no rows)", file=out)
    said = (read_result(out / "run.json") or {}).get("results", {})
    other = next((r.trial.name for r in results if r.hash != said.get(r.trial.name, r.hash)), None)
    if other is not None:
        found = f"trials/{other}.json is of a later run, which was not finished"
        raise BadInput(f"{found}; {_AGAIN}", file=out)
    return results


def _trials(table: Path) -> list[str | None]:
    try:
        with table.open(newline="", encoding="utf-8") as file:
            return list(dict.fromkeys(row.get("trial") for row in csv.DictReader(file)))
    except (UnicodeDecodeError, csv.Error) as problem:
        raise BadInput(f"is damaged ({problem}); {_AGAIN}", file=table) from None


def _result(out: Path, trial: str | None) -> TrialResult:
    path = out / "trials" / f"{trial}.json"
    kept = read_result(path)
    if not kept:
        raise BadInput(f"{path.relative_to(out)} is not there or damaged; {_AGAIN}", file=out)
    try:
        return from_plain(TrialResult, kept)
    except ValueError:
        raise BadInput(
            f"{path.relative_to(out)} is of an older version; {_AGAIN}", file=out
        ) from None


def _check_given_once(runs: Sequence[tuple[Path, list[TrialResult]]]) -> None:
    """A recording that is counted twice would look like two that agree. Raises BadInput."""
    seen: dict[str, Path] = {}
    for out, results in runs:
        for result in results:
            if result.hash in seen:
                found = f"holds the same recording as {seen[result.hash]} ({result.trial.name})"
                raise BadInput(f"{found}; give each run once", file=out)
        seen |= {result.hash: out for result in results}


def _check_alike(out: Path, result: TrialResult, first: Path, reference: TrialResult) -> None:
    """One whisker, one pushing angle. Raises BadInput."""
    if result.theta_deg != reference.theta_deg:
        found = f"was evaluated at θ = {result.theta_deg:g}°, {first} at {reference.theta_deg:g}°"
        raise BadInput(f"{found}; evaluate both at one --theta-deg", file=out)
    for name, ours in vars(result.whisker).items():
        theirs = getattr(reference.whisker, name)
        exactly = isinstance(ours, str) or None in (ours, theirs)
        alike = ours == theirs if exactly else abs(ours / theirs - 1.0) <= _SAME_WHISKER
        if not alike:
            ours, theirs = (f"{v:.6g}" if isinstance(v, float) else v for v in (ours, theirs))
            found = f"is of another whisker: {name} is {ours}, in {first} {theirs}"
            raise BadInput(f"{found}; whisks of different whiskers cannot be pooled", file=out)


def _check_distances(runs: Sequence[tuple[Path, list[FittedSurface]]]) -> None:
    """One distance a panel. Raises BadInput."""
    known: dict[tuple[str, float | None], tuple[Path, float]] = {}
    for out, fitted in runs:
        for surface in fitted:
            d_x = surface.common_d_x_mm
            first, reference = known.setdefault(surface.panel, (out, d_x))
            if abs(d_x / reference - 1.0) > _SAME_DISTANCE:
                found = f"{surface.title}: d_x is {d_x:.1f} mm, in {first} {reference:.1f} mm"
                raise BadInput(
                    f"{found}; whisks at distances {_SAME_DISTANCE:.0%} apart cannot be pooled",
                    file=out,
                )
