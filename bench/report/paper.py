"""The session's figures as Matplotlib has them, and at the width of a journal's column (`--figure-format`)."""

import math
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from bench.analyses.analysis import Run
from bench.analyses.catalogue import ANALYSES
from bench.base.drawing import paper_style, publish
from bench.report.figures import error_against_slope
from bench.trials.estimate_errors import judge

FOLDER = "figures"
# IEEE's journals: one column is 3.5 in wide, both are 7.16 in.
_COLUMN_IN, _BOTH_IN = 3.5, 7.16
_DPI = 600
_BESIDE = 2  # panels side by side take both columns


def session_figures(run: Run) -> dict[str, Figure]:
    """Draw all figures that results without a session allow, by the names of their files."""
    figures = {}
    for analysis in ANALYSES:
        if analysis.figure_name and not analysis.needs_session:
            figures[analysis.figure_name] = analysis.figure(analysis.compute(run))
    judged = [
        j for j in judge(run.results) if j.purpose == "measure" and math.isfinite(j.error_percent)
    ]
    if judged:
        fitted = [friction.surface for friction in run.friction]
        figures["error_against_slope"] = error_against_slope(judged, fitted, run.settings)
    return {name: figure for name, figure in figures.items() if figure is not None}


def write_paper_figures(out: Path, run: Run, formats: Sequence[str]) -> list[Path]:
    """Write the figures into out/figures, as wide as one column or both of a journal.

    formats: of `drawing.FORMATS`. Returns the paths written.
    """
    if not formats:
        return []
    paths = []
    with paper_style():
        for name, figure in session_figures(run).items():
            width, height = figure.get_size_inches()
            wide = _BOTH_IN if _columns(figure) >= _BESIDE else _COLUMN_IN
            figure.set_size_inches(wide, wide * max(height / width, 0.45))
            paths += publish(figure, out / FOLDER / name, list(dict.fromkeys(formats)), _DPI)
    return paths


def _columns(figure: Figure) -> int:
    """Panels side by side."""
    return max(
        (
            axes.get_subplotspec().get_gridspec().ncols
            for axes in figure.axes
            if axes.get_subplotspec()
        ),
        default=1,
    )
