"""Fig. 8 of the paper: |m| in EI/metre and φ against β, whisks of a surface and speed together, and the α that fits."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.surfaces import Point, Surface
from bench.base.drawing import SLOPES_DEG, blank, colour_of
from bench.base.tables import SPEED, SURFACE, Column, Kind, Table, alike, with_sigma
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


def figure_8(fitted: Sequence[Surface]) -> "Figure":
    """A column for each surface and speed: |m| above, φ below."""
    columns = min(len(fitted), _MOST_COLUMNS)
    blocks = -(-len(fitted) // columns)
    figure = blank(1.2 + 3.2 * columns, 5.2 * blocks)
    grid = figure.subplots(2 * blocks, columns, sharex=True, sharey="row", squeeze=False)
    for number in range(blocks * columns):
        block, column = divmod(number, columns)
        pair = grid[2 * block : 2 * block + 2, column]
        if number < len(fitted):
            _panel(*pair, fitted[number], f"({_letter(number)})")
        else:
            for axes in pair:
                axes.set_visible(False)
    for axes in grid[::2, 0]:  # once all panels of the row are drawn, which share their limits
        axes.set_ylabel("|m|  [EI/m]")
        axes.set_ylim(bottom=0)
    for axes in grid[1::2, 0]:
        axes.set_ylabel("slip angle φ  [°]")
    named = {
        label: line for axes in grid.flat for line, label in zip(*axes.get_legend_handles_labels())
    }
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=2)
    return figure


def rows(fitted: Sequence[Surface]) -> Iterator[dict]:
    """Yield the rows of FIGURE_8, one a point; |m| at the panel's common d_x. Fits are NaN where there is none.

    With one whisk a point, m_sd and phi_sd are its stated sigmas.
    """
    for number, surface in enumerate(fitted):
        points, EI = surface.points(), surface.beam.rigidity_Nmm2
        panel = {
            "panel": _letter(number),
            "surface": surface.name,
            "speed_deg_s": surface.speed_deg_s,
            "theta_deg": float(np.degrees(surface.theta_rad)),
            "d_x_mm": surface.common_d_x_mm,
            "alpha_deg": float(np.degrees(surface.alpha_rad)),
            "alpha_sigma_deg": float(np.degrees(surface.fit.sigma_rad))
            if surface.fit is not None
            else float("nan"),
        }
        for p, m_fit, phi_fit in zip(
            points, *_fitted(surface, np.array([p.beta_deg for p in points]))
        ):
            yield panel | {
                "beta_deg": p.beta_deg,
                "whisks": p.whisks,
                "m_EI_per_metre": moment_in_EI_per_metre(p.m_Nmm, EI),
                "m_sd_EI_per_metre": moment_in_EI_per_metre(p.m_sd_Nmm, EI),
                "phi_deg": p.phi_deg,
                "phi_sd_deg": p.phi_sd_deg,
                "m_fit_EI_per_metre": float(m_fit),
                "phi_fit_deg": float(phi_fit),
            }


def _letter(number: int) -> str:
    return _LETTERS[number % len(_LETTERS)]


def _fitted(surface: Surface, beta_deg) -> tuple[np.ndarray, np.ndarray]:
    """|m| [EI/m] and φ [°] of (13), (14) at the fitted α over slopes (n,); NaN where there is no fit."""
    if surface.fit is None:
        return np.full(len(beta_deg), np.nan), np.full(len(beta_deg), np.nan)
    beam = surface.beam
    as_cylinder = beam.as_cylinder_mm(surface.common_d_x_mm)
    m, phi = curves(
        surface.alpha_rad, np.radians(beta_deg), as_cylinder, surface.theta_rad, beam.C_Nmm2
    )
    return moment_in_EI_per_metre(m, beam.rigidity_Nmm2), np.degrees(phi)


def _panel(top: "Axes", bottom: "Axes", surface: Surface, letter: str) -> None:
    """|m| above, φ below; negative slopes are drawn at their mirror image's place."""
    points, EI = surface.points(), surface.beam.rigidity_Nmm2
    beta = [abs(p.beta_deg) for p in points]
    # Hollow points no larger than caps: bars of half a degree are seen.
    look = {
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
    top.errorbar(
        beta,
        [moment_in_EI_per_metre(p.m_Nmm, EI) for p in points],
        [moment_in_EI_per_metre(p.m_sd_Nmm, EI) for p in points],
        **look,
        label=_what(points),
    )
    bottom.errorbar(beta, [abs(p.phi_deg) for p in points], [p.phi_sd_deg for p in points], **look)
    if surface.fit is not None:
        m, phi = _fitted(surface, SLOPES_DEG)
        alpha, sigma = np.degrees([surface.fit.alpha_rad, surface.fit.sigma_rad])
        line = {"color": colour_of("with_friction"), "lw": 1.4}
        top.plot(SLOPES_DEG, m, **line, label="(13), (14) with the fitted α")
        bottom.plot(SLOPES_DEG, phi, **line)
        held = f"α = {alpha:.2f} ± {sigma:.2f}°\n"
    else:
        held = ""
    top.set_title(f"{letter} {surface.title}", loc="left")
    bottom.set(
        xlabel="slope β  [°]" + (" (nominal)" if surface.felt[0].nominal else ""),
        xlim=(-2, 82),
        ylim=(-3, 82),
    )
    spread = 100.0 * float(np.median([p.m_sd_Nmm / p.m_Nmm for p in points]))
    told = f"{held}|m| at d$_x$ = {surface.common_d_x_mm:.1f} mm, ± {spread:.2g} % (median)"
    top.annotate(
        told,
        (0.04, 0.04),
        xycoords="axes fraction",
        fontsize=7,
        color="0.25",
        va="bottom",
        linespacing=1.5,
    )


def _what(points: Sequence[Point]) -> str:
    most = max(p.whisks for p in points)
    return "one whisk each, ± its sigma" if most == 1 else f"mean ± SD of up to {most} whisks"
