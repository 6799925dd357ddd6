"""What Matplotlib draws, inside the page: each point of a whisk links to the whisk's card."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import unquote

from markupsafe import Markup, escape

from bench.analyses.friction_tables import SurfaceFriction
from bench.base.drawing import style, svg_of
from bench.records.trial_result import TrialResult
from bench.report.page.words import Row
from bench.report.run_facts import RunRecord

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDE_IN = 7.0  # a figure that is wider takes the whole width of the page
_TITLES = {
    "fig8": (
        "Fig. 8: moment and slip angle against slope",
        "What was felt, |m| scaled to one d_x. Lines: (13), (14) with the α that fits the surface.",
    ),
    "error_against_slope": (
        "Error against slope",
        "Error of d_x, estimate less truth, in per cent of the truth, ± one sigma. Lines: as (13), (14) predict "
        "with the α that fits each surface. A hollow point is in doubt and not in the verdict.",
    ),
    "error_against_friction": (
        "Error against friction",
        "Against the friction angle that the pictures show, of whisks that slip: where α_est is not α, (10) errs.",
    ),
    "against_theta": (
        "Error and sigma against θ",
        "RMS over the sound whisks: solid the error, dashed the stated sigma. Small θ: noise; large: bending.",
    ),
    "explained": (
        "The error of (10) explained",
        "In per cent of d_x: what the error changes by when felt touch, moments and α_est become those seen, in "
        "this order.",
    ),
    "error_map": (
        "Error of (10) over slope and friction",
        "Points: measured. Colours: as (13), (14) predict.",
    ),
}


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


def draw(
    record: RunRecord,
    rows: Sequence[Row],
    results: Sequence[TrialResult],
    friction: Sequence[SurfaceFriction],
) -> Drawings:
    """Return all drawings that the results allow."""
    from bench.report.figures import gauge_residuals, variance_of_truth  # with all of matplotlib
    from bench.report.paper import session_figures

    figures = []
    variance = residuals = None
    with style():
        drawn = session_figures(results, friction, record.whisker, record.settings)
        for name, figure in drawn.items():
            title, caption = _TITLES[name]
            is_broad = figure.get_size_inches()[0] > _WIDE_IN
            figures.append(PageFigure(title, caption, inside(figure, name, title, rows), is_broad))
        bars = variance_of_truth(results)
        if bars is not None:
            variance = inside(bars, "budget", "Shares of each whisk's variance of d_x", rows)
        if record.gauges is not None and record.gauges.points:
            figure = gauge_residuals(record.gauges.points)
            alt = "Residuals of the gauges over the moments known"
            residuals = inside(figure, "gauge_residuals", alt, rows)
    return Drawings(tuple(figures), variance, residuals)


def inside(figure: "Figure", name: str, alt: str, rows: Sequence[Row]) -> Markup:
    """Return a figure as SVG inside the page. alt: for readers who do not see it."""
    at = {(row.trial, row.seen.whisk): row for row in rows}

    def link(found: re.Match) -> str:
        row = at[unquote(found[1]), int(found[2])]
        which = f'href="#{row.key}" class="mark" data-w="{row.key}"'
        return f"<a {which}><title>{escape(row.name)}</title>"

    drawing = re.sub(r'<a xlink:href="whisk:([^/"]*)/(\d+)"[^>]*>', link, svg_of(figure, name))
    opening = f'<svg class="plot" role="group" aria-label="{escape(alt)}" '
    return Markup(drawing.replace("<svg ", opening, 1))
