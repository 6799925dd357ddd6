"""`whisker-bench figures 8`: several evaluated runs, days of one whisker, pooled into one Fig. 8."""

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from bench.analyses.figure_8 import FIGURE_8, figure_8, rows
from bench.analyses.surfaces import FittedSurface, friction_lines, surfaces
from bench.base.drawing import publish, style
from bench.base.errors import BadInput
from bench.records.trial_result import TrialResult, WhiskerFacts
from bench.report.run_folder import read_results
from estimator.beam import Beam
from estimator.profiled_beam import ProfiledBeam

# [1] A whisker's length, diameter and stiffness are written down alike on all days: rounding. Stated.
_SAME_WHISKER = 1e-3
Fact: TypeAlias = float | str | tuple[float, ...] | None
# [1] Fig. 8 is of one distance: |m| is scaled to it as 1/d_x, which takes out the error of a ruler,
# not another set-up. Stated.
_SAME_DISTANCE = 0.1


def write_figure_8(outs: Sequence[Path], folder: Path) -> tuple[list[Path], list[str]]:
    """Write figure_8.png, .svg and .csv of pooled runs, each whole.

    Returns the paths, and a line on α a panel. Raises BadInput where a folder is no evaluated run, is
    given twice, cannot be pooled with the first, or none of them holds a whisk.
    """
    fitted = pooled(outs)
    stem = Path(folder) / "figure_8"
    with style():
        paths = publish(figure_8(fitted), stem)
    FIGURE_8.write(Path(folder), rows(fitted))
    return [*paths, stem.with_suffix(".csv")], list(friction_lines(fitted))


def pooled(outs: Sequence[Path]) -> list[FittedSurface]:
    """Return a panel for each surface and speed, of the whisks of all runs.

    Raises BadInput as `write_figure_8` does.
    """
    runs = [(Path(out), read_results(Path(out))) for out in outs]
    first, reference = runs[0]
    _check_given_once(runs)
    for out, results in runs[1:]:
        _check_alike(out, results[0], first, reference[0])
    beam = _beam(reference[0].whisker)
    _check_distances([(out, surfaces(results, beam)) for out, results in runs])
    every = []
    for _, results in runs:
        every += results
    fitted = surfaces(every, beam)
    if not fitted:
        found = "no whisk has moments with a slope and a distance, seen or nominal (beta_deg, d_x_mm in trial.toml)"
        raise BadInput(found, file=first)
    return fitted


def _beam(whisker: WhiskerFacts) -> Beam:
    """Return the whisker as a beam."""
    if whisker.widths:
        return ProfiledBeam.of_widths(3.0 * whisker.EI_Nmm2, whisker.length_mm, whisker.widths)
    tip = None
    if whisker.tip_diameter_mm is not None:
        tip = whisker.tip_diameter_mm / whisker.diameter_mm
    return Beam.from_rigidity(whisker.EI_Nmm2, whisker.length_mm, whisker.shape, tip)


def _check_given_once(runs: Sequence[tuple[Path, list[TrialResult]]]) -> None:
    """Raise BadInput where two runs hold the same recording.

    A recording that is counted twice would pass for two that agree.
    """
    run_of: dict[str, Path] = {}  # by hash
    for out, results in runs:
        for result in results:
            if result.hash in run_of:
                found = f"holds the same recording as {run_of[result.hash]} ({result.trial.name})"
                raise BadInput(f"{found}; give each run once", file=out)
        for result in results:
            run_of[result.hash] = out


def _check_alike(out: Path, result: TrialResult, first: Path, reference: TrialResult) -> None:
    """Raise BadInput unless two runs are of one whisker, at one pushing angle."""
    if result.theta_deg != reference.theta_deg:
        found = f"was evaluated at θ = {result.theta_deg:g}°, {first} at {reference.theta_deg:g}°"
        raise BadInput(f"{found}; evaluate both at one --theta-deg", file=out)
    for name, ours in vars(result.whisker).items():
        theirs = getattr(reference.whisker, name)
        if not _is_alike(ours, theirs):
            found = f"is of another whisker: {name} is {_text(ours)}, in {first} {_text(theirs)}"
            raise BadInput(f"{found}; whisks of different whiskers cannot be pooled", file=out)


def _is_alike(ours: Fact, theirs: Fact) -> bool:
    """Return whether a fact on two whiskers is the same, apart from rounding."""
    if isinstance(ours, tuple):
        return len(ours) == len(theirs) and np.allclose(ours, theirs, rtol=0.0, atol=_SAME_WHISKER)
    if isinstance(ours, str) or ours is None or theirs is None:
        return ours == theirs
    return abs(ours / theirs - 1.0) <= _SAME_WHISKER


def _text(fact: Fact) -> str:
    """Return a fact on a whisker in words."""
    return f"{fact:.6g}" if isinstance(fact, float) else str(fact)


def _check_distances(runs: Sequence[tuple[Path, list[FittedSurface]]]) -> None:
    """Raise BadInput where the whisks of a panel are at different distances."""
    known: dict[tuple[str, float | None], tuple[Path, float]] = {}
    for out, fitted in runs:
        for surface in fitted:
            d_x = surface.common_d_x_mm
            first, reference = known.setdefault(surface.panel, (out, d_x))
            if abs(d_x / reference - 1.0) > _SAME_DISTANCE:
                found = f"{surface.title}: d_x is {d_x:.1f} mm, in {first} {reference:.1f} mm"
                apart = f"whisks at distances {_SAME_DISTANCE:.0%} apart cannot be pooled"
                raise BadInput(f"{found}; {apart}", file=out)
