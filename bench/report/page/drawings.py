"""What Matplotlib draws, inside the page: each point of a whisk links to the whisk's card."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import unquote

from markupsafe import Markup, escape

from bench.analyses.analysis import EvaluatedRun
from bench.base.drawing import style, svg_of
from bench.report.page.words import WhiskRow, by_whisk, whisk_name
from bench.report.run_facts import RunRecord

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDE_IN = 7.0  # a figure that is wider takes the whole width of the page


@dataclass(frozen=True)
class PageFigure:
    """A figure of the page: its heading, what stands below it, the drawing, and whether it is wide."""

    title: str
    caption: str
    drawing: Markup
    is_broad: bool


@dataclass(frozen=True)
class Drawings:
    """All drawings of a page. Of a run without figures there are none.

    variance: where the truth's variance comes from. gauge_residuals: of gauges that the session's
    own trials calibrated.
    """

    figures: tuple[PageFigure, ...] = ()
    variance: Markup | None = None
    gauge_residuals: Markup | None = None


def draw(record: RunRecord, rows: Sequence[WhiskRow], run: EvaluatedRun) -> Drawings:
    """Return all drawings that the results allow."""
    from bench.report.paper import session_figures
    from bench.report.trial_figures import (
        gauge_residuals,
        variance_of_truth,
    )  # with all of matplotlib

    figures = []
    variance = residuals = None
    with style():
        for one in session_figures(run, run.figure):
            is_broad = one.drawing.get_size_inches()[0] > _WIDE_IN
            drawing = inside(one.drawing, one.name, one.title, rows)
            figures.append(PageFigure(one.title, one.caption, drawing, is_broad))
        bars = variance_of_truth(run.results)
        if bars is not None:
            variance = inside(bars, "budget", "Shares of each whisk's variance of d_x", rows)
        if record.gauges is not None and record.gauges.points:
            figure = gauge_residuals(record.gauges.points)
            alt = "Residuals of the gauges over the moments known"
            residuals = inside(figure, "gauge_residuals", alt, rows)
    return Drawings(tuple(figures), variance, residuals)


def inside(figure: "Figure", name: str, alt: str, rows: Sequence[WhiskRow]) -> Markup:
    """Return a figure as SVG inside the page. alt: for readers who do not see it."""
    at = by_whisk(rows)

    def link(found: re.Match) -> str:
        """Return the page's own link to the whisk that a link of the drawing names.

        A gauge trial that the run has not evaluated has a name and no link.
        """
        trial = unquote(found[1])
        number = int(found[2])
        row = at.get((trial, number))
        if row is None:
            return f"<a><title>{escape(whisk_name(trial, number))}</title>"
        which = f'href="#{row.key}" class="mark" data-w="{row.key}"'
        return f"<a {which}><title>{escape(row.name)}</title>"

    drawing = re.sub(r'<a xlink:href="whisk:([^/"]*)/(\d+)"[^>]*>', link, svg_of(figure, name))
    opening = f'<svg class="plot" role="group" aria-label="{escape(alt)}" '
    return Markup(drawing.replace("<svg ", opening, 1))
