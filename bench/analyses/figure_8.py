"""Fig. 8 of the paper: |m| in EI/metre and φ against β, whisks of a surface and speed together, and the α that fits."""

from collections.abc import Iterator, Sequence
from math import degrees
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun
from bench.analyses.cells import angle_text, value_cells
from bench.analyses.pooling import column
from bench.analyses.surfaces import FittedSurface, SlopePoint
from bench.base.drawing import SLOPES_DEG, add_legend, blank, colour_of, whisk_url
from bench.base.tables import SPEED, SURFACE, Column, Kind, Table, alike, with_sigma
from bench.records.trial_result import WITH_FRICTION
from estimator.beam import moment_in_EI_per_metre
from estimator.friction import curves

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FIGURE_8 = Table(
    "figure_8",
    "A row a slope of a surface and speed.",
    (
        Column("panel", "where it is drawn", Kind.TEXT),
        SURFACE,
        SPEED,
        Column("theta_deg", "pushing angle"),
        Column("d_x_mm", "the distance that all whisks are brought to"),
        *with_sigma("alpha_deg", "the friction angle that fits"),
        Column("beta_deg", "slope"),
        Column("whisks", "how many whisks at that slope", Kind.WHOLE),
        *alike(
            ("m_EI_per_metre", "m_sd_EI_per_metre"),
            "magnitude of the moment, mean and standard deviation",
        ),
        *alike(("phi_deg", "phi_sd_deg"), "φ, mean and standard deviation"),
        *alike(("m_fit_EI_per_metre", "phi_fit_deg"), "the fit there"),
    ),
)
_MOST_COLUMNS = 4  # panels beside each other that can still be read on a page
_LETTERS = "abcdefghijklmnopqrstuvwxyz"
# Hollow points no larger than caps: bars of half a degree are seen.
_BARS = {
    "fmt": "o",
    "ms": 3,
    "mfc": "white",
    "mew": 0.7,
    "color": "black",
    "capsize": 3.5,
    "elinewidth": 1.0,
    "lw": 0,
    "zorder": 3,
}
# Text at a panel's foot.
_NOTE = {
    "xycoords": "axes fraction",
    "fontsize": 7,
    "color": "0.25",
    "va": "bottom",
    "linespacing": 1.5,
}


class Figure8(Analysis):
    """Moments and slip angles against the slope, and the friction angle that fits them."""

    figure_name = "fig8"
    figure_title = "Fig. 8: moment and slip angle against slope"
    figure_caption = (
        "What was felt, |m| scaled to one d_x. Lines: (13), (14) with the α that fits the surface."
    )

    def compute(self, run: EvaluatedRun) -> list[FittedSurface]:
        """Return a panel for each surface and speed."""
        return [friction.surface for friction in run.friction]

    def figure(self, found: Sequence[FittedSurface]) -> "Figure | None":
        """Draw a column for each surface and speed."""
        return figure_8(found) if found else None


def figure_8(fitted: Sequence[FittedSurface]) -> "Figure":
    """Draw a column for each surface and speed: |m| above, φ below."""
    columns = min(len(fitted), _MOST_COLUMNS)
    blocks = -(-len(fitted) // columns)
    figure = blank(1.2 + 3.2 * columns, 5.2 * blocks)
    grid = figure.subplots(2 * blocks, columns, sharex=True, sharey="row", squeeze=False)
    tops = grid[::2].ravel()
    bottoms = grid[1::2].ravel()
    for number, surface in enumerate(fitted):
        _draw_panel(tops[number], bottoms[number], surface, f"({_letter(number)})")
    for axes in (*tops[len(fitted) :], *bottoms[len(fitted) :]):
        axes.set_visible(False)
    for axes in grid[::2, 0]:  # once all panels of the row are drawn, which share their limits
        axes.set_ylabel("|m|  [EI/m]")
        axes.set_ylim(bottom=0)
    for axes in grid[1::2, 0]:
        axes.set_ylabel("slip angle φ  [°]")
    add_legend(figure, 2)
    return figure


def rows(fitted: Sequence[FittedSurface]) -> Iterator[dict]:
    """Yield the rows of FIGURE_8, one a point; |m| at the panel's common d_x. Fits are NaN where there is none.

    With one whisk a point, m_sd and phi_sd are its stated sigmas.
    """
    for number, surface in enumerate(fitted):
        points = surface.points()
        EI = surface.beam.rigidity_Nmm2
        m_fit, phi_fit_deg = _fitted_curves(surface, column(points, "beta_deg"))
        for k, point in enumerate(points):
            yield {
                "panel": _letter(number),
                "surface": surface.name,
                "speed_deg_s": surface.speed_deg_s,
                "theta_deg": degrees(surface.theta_rad),
                "d_x_mm": surface.common_d_x_mm,
                **value_cells("alpha_deg", surface.alpha),
                "beta_deg": point.beta_deg,
                "whisks": point.whisks,
                "m_EI_per_metre": moment_in_EI_per_metre(point.m_Nmm, EI),
                "m_sd_EI_per_metre": moment_in_EI_per_metre(point.m_sd_Nmm, EI),
                "phi_deg": point.phi_deg,
                "phi_sd_deg": point.phi_sd_deg,
                "m_fit_EI_per_metre": float(m_fit[k]),
                "phi_fit_deg": float(phi_fit_deg[k]),
            }


def _letter(number: int) -> str:
    """Return the letter of a panel."""
    return _LETTERS[number % len(_LETTERS)]


def _fitted_curves(surface: FittedSurface, beta_deg: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return |m| [EI/m] and φ [°] of (13), (14) at the fitted α over slopes (n,).

    NaN where there is no fit.
    """
    if surface.fit is None:
        nothing = np.full(len(beta_deg), np.nan)
        return nothing, nothing
    beam = surface.beam
    d_x_mm = beam.as_cylinder_mm(surface.common_d_x_mm)
    beta_rad = np.radians(beta_deg)
    m, phi = curves(surface.alpha_rad, beta_rad, d_x_mm, surface.theta_rad, beam.C_Nmm2)
    return moment_in_EI_per_metre(m, beam.rigidity_Nmm2), np.degrees(phi)


def _draw_whisks(top: "Axes", bottom: "Axes", surface: FittedSurface, edge_colour: str) -> None:
    """Draw each whisk as a small point that links to it, |m| at the panel's common d_x."""
    felt = surface.felt
    beam = surface.beam
    distances_mm = beam.as_cylinder_mm(column(felt, "d_x_mm"))
    scale = distances_mm / beam.as_cylinder_mm(surface.common_d_x_mm)
    m = moment_in_EI_per_metre(scale * column(felt, "m_Nmm"), beam.rigidity_Nmm2)
    beta_deg = np.abs(column(felt, "beta_deg"))
    urls = [whisk_url(one.trial, one.whisk) for one in felt]
    for axes, values in ((top, m), (bottom, np.abs(column(felt, "phi_deg")))):
        dots = axes.scatter(
            beta_deg, values, s=9, facecolors="white", edgecolors=edge_colour, lw=0.7, zorder=4
        )
        dots.set_urls(urls)


def _draw_panel(top: "Axes", bottom: "Axes", surface: FittedSurface, letter: str) -> None:
    """Draw |m| above, φ below; negative slopes stand at their mirror image's place."""
    points = surface.points()
    EI = surface.beam.rigidity_Nmm2
    beta_deg = np.abs(column(points, "beta_deg"))
    m_Nmm = column(points, "m_Nmm")
    m_sd_Nmm = column(points, "m_sd_Nmm")
    m = moment_in_EI_per_metre(m_Nmm, EI)
    m_sd = moment_in_EI_per_metre(m_sd_Nmm, EI)
    top.errorbar(beta_deg, m, m_sd, **_BARS, label=_meaning(points))
    phi_deg = np.abs(column(points, "phi_deg"))
    bottom.errorbar(beta_deg, phi_deg, column(points, "phi_sd_deg"), **_BARS)
    _draw_whisks(top, bottom, surface, "black" if len(points) == len(surface.felt) else "0.65")
    fitted = ""
    if surface.fit is not None:
        fitted = _draw_fit(top, bottom, surface)
    top.annotate(fitted + _scale(surface), (0.04, 0.04), **_NOTE)
    _label_panel(top, bottom, surface, letter)


def _scale(surface: FittedSurface) -> str:
    """Return the note on the distance that |m| is scaled to, and on the spread that this leaves."""
    points = surface.points()
    spread = 100.0 * float(np.median(column(points, "m_sd_Nmm") / column(points, "m_Nmm")))
    return f"|m| at d$_x$ = {surface.common_d_x_mm:.1f} mm, ± {spread:.2g} % (median)"


def _label_panel(top: "Axes", bottom: "Axes", surface: FittedSurface, letter: str) -> None:
    """Write the title of a panel above, and the slopes below."""
    top.set_title(f"{letter} {surface.title}", loc="left")
    nominal = " (nominal)" if surface.felt[0].nominal else ""
    bottom.set(xlabel=f"slope β  [°]{nominal}", xlim=(-2, 82), ylim=(-3, 82))


def _draw_fit(top: "Axes", bottom: "Axes", surface: FittedSurface) -> str:
    """Draw |m| and φ of (13), (14) at the fitted α; return a line with that α."""
    m_fit, phi_fit_deg = _fitted_curves(surface, SLOPES_DEG)
    colour = colour_of(WITH_FRICTION)
    top.plot(SLOPES_DEG, m_fit, color=colour, lw=1.4, label="(13), (14) with the fitted α")
    bottom.plot(SLOPES_DEG, phi_fit_deg, color=colour, lw=1.4)
    return f"α = {angle_text(surface.alpha)}\n"


def _meaning(points: Sequence[SlopePoint]) -> str:
    """Return what points and their bars are."""
    most = max(point.whisks for point in points)
    return "one whisk each, ± its sigma" if most == 1 else f"mean ± SD of up to {most} whisks"
