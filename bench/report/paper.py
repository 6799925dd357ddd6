"""The session's figures as Matplotlib has them, and at the width of a journal's column (`--figure-format`)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.collections import Collection
from matplotlib.figure import Figure

from bench.analyses.analysis import Analysis, EvaluatedRun
from bench.analyses.catalogue import ANALYSES
from bench.base.drawing import paper_style, publish

FOLDER = "figures"
# IEEE's journals: one column is 3.5 in wide, both are 7.16 in.
_COLUMN_IN, _BOTH_IN = 3.5, 7.16
_DPI = 600
_BESIDE = 2  # panels side by side take both columns


@dataclass(frozen=True, eq=False)
class SessionFigure:
    """A figure of a session: the name of its file, its heading, what stands below it, the drawing."""

    name: str
    title: str
    caption: str
    drawing: Figure


def session_figures(
    run: EvaluatedRun, draw: Callable[[Analysis], Figure | None] | None = None
) -> list[SessionFigure]:
    """Return all figures that results without a session allow.

    draw: returns the figure of an analysis; without it each is drawn anew.
    """
    figures = []
    for analysis in ANALYSES:
        if not analysis.figure_name or analysis.needs_session:
            continue
        drawing = draw(analysis) if draw else analysis.figure_of(run)
        if drawing is not None:
            title = analysis.figure_title
            caption = analysis.caption_of(run)
            figures.append(SessionFigure(analysis.figure_name, title, caption, drawing))
    return figures


def write_paper_figures(out: Path, run: EvaluatedRun, formats: Sequence[str]) -> list[Path]:
    """Write the figures into out/figures, as wide as one column or both of a journal.

    formats: "png", "pdf", "svg". Returns the paths written.
    """
    if not formats:
        return []
    paths = []
    with paper_style():
        for one in session_figures(run):
            figure = one.drawing
            _remove_links(figure)
            width, height = figure.get_size_inches()
            wide = _BOTH_IN if _columns(figure) >= _BESIDE else _COLUMN_IN
            figure.set_size_inches(wide, wide * max(height / width, 0.45))
            paths += publish(figure, out / FOLDER / one.name, list(dict.fromkeys(formats)), _DPI)
    return paths


def _remove_links(figure: Figure) -> None:
    """Remove the links to whisks, which lead nowhere outside the report."""
    for artist in figure.findobj():
        artist.set_url(None)
        if isinstance(artist, Collection):
            artist.set_urls(None)


def _columns(figure: Figure) -> int:
    """Return how many panels are side by side."""
    counts = []
    for axes in figure.axes:
        place = axes.get_subplotspec()
        if place is not None:
            counts.append(place.get_gridspec().ncols)
    return max(counts, default=1)
