"""The session's figures as Matplotlib has them, and at the width of a journal's column (`--figure-format`)."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.collections import Collection
from matplotlib.figure import Figure

from bench.analyses.against_theta import against_theta, figure
from bench.analyses.error_map import draw_error_map, measured_cells, typical_taper
from bench.analyses.explained import draw_explained, explained_rows, mean_row
from bench.analyses.figure_8 import figure_8
from bench.analyses.friction_tables import SurfaceFriction
from bench.base.drawing import paper_style, publish
from bench.base.settings import Settings
from bench.records.trial_result import TrialResult
from bench.report.figures import (
    error_against_friction,
    error_against_slope,
    friction_of_errors,
    measured,
)
from bench.session.whisker import Whisker

FOLDER = "figures"
# IEEE's journals: one column is 3.5 in wide, both are 7.16 in.
_COLUMN_IN, _BOTH_IN = 3.5, 7.16
_DPI = 600
_BESIDE = 2  # panels side by side take both columns


def session_figures(
    results: Sequence[TrialResult],
    friction: Sequence[SurfaceFriction],
    whisker: Whisker,
    settings: Settings,
) -> dict[str, Figure]:
    """All figures of the session that the results allow, by the names of their files."""
    fitted, figures = [f.surface for f in friction], {}
    if fitted:
        figures["fig8"] = figure_8(fitted)
    judged = measured(results)
    if judged:
        figures["error_against_slope"] = error_against_slope(judged, fitted, settings)
    if friction_of_errors(results):
        figures["error_against_friction"] = error_against_friction(results)
    rows = list(explained_rows(results, whisker))
    if rows:
        figures["explained"] = draw_explained([*rows, mean_row(rows)])
    cells = measured_cells(results, friction, settings.alpha_est_rad)
    if cells:
        figures["error_map"] = draw_error_map(
            cells, settings.alpha_est_rad, typical_taper(friction)
        )
    by_theta = against_theta(results)
    if any(row.whisks for row in by_theta):
        figures["against_theta"] = figure(by_theta)
    return figures


def write_paper_figures(
    out: Path,
    results: Sequence[TrialResult],
    friction: Sequence[SurfaceFriction],
    whisker: Whisker,
    settings: Settings,
    formats: Sequence[str],
) -> list[Path]:
    """The figures in out/figures, as wide as one column or both of a journal. formats: of `drawing.FORMATS`. The paths
    written."""
    paths = []
    with paper_style():
        for name, figure in (
            session_figures(results, friction, whisker, settings).items() if formats else ()
        ):
            _remove_links(figure)
            width, height = figure.get_size_inches()
            wide = _BOTH_IN if _columns(figure) >= _BESIDE else _COLUMN_IN
            figure.set_size_inches(wide, wide * max(height / width, 0.45))
            paths += publish(figure, out / FOLDER / name, list(dict.fromkeys(formats)), _DPI)
    return paths


def _remove_links(figure: Figure) -> None:
    """Remove the links to whisks, which lead nowhere outside the report."""
    for artist in figure.findobj():
        artist.set_url(None)
        if isinstance(artist, Collection):
            artist.set_urls(None)


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
