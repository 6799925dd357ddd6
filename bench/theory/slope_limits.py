"""Figures 5 and 6 of the paper, from its equations: how steep a surface may be for a given error of d_x."""

import csv
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from bench.base.atomic import write_whole
from bench.base.drawing import publish
from estimator import curvature
from estimator.threshold import curved_threshold, slope_threshold

NUMBERS = (5, 6)
ERRORS_PERCENT = (1.0, 5.0, 10.0)
ALPHA_EST_DEG = (0.0, 10.0, 20.0)
# Denser towards each α_est, where the curves rise to a cusp at 90°.
_NEAR_DEG = np.geomspace(1e-5, 0.1, 33)
_CUSPS_DEG = np.add.outer(ALPHA_EST_DEG, np.concatenate([-_NEAR_DEG, _NEAR_DEG])).ravel()
ALPHA_DEG = np.unique(np.concatenate([np.linspace(0.0, 40.0, 321), _CUSPS_DEG[_CUSPS_DEG > 0]]))
EQUATIONS = {"(10)": "with_friction", "(2)": "no_slip"}
THETA_DEG = (1.0, 3.0, 5.0)
FRICTION_DEG = (0.0, 20.0)
_TOP_DEG = 94.0  # of the axis: a cusp at 90° is seen whole
R_N = np.geomspace(0.1, 10.0, 81)
_X_LABELS = {
    5: r"true friction cone angle $\alpha$  [°]",
    6: r"normalized radius of curvature $r_n$",
}
COLOURS = {1.0: "tab:blue", 3.0: "tab:green", 5.0: "tab:orange", 10.0: "tab:red"}

# Points that the paper's text reads off its figures: x, β_thresh [deg] by panel.
PRINTED_POINTS = {
    5: {"b": ((8.2, 60.0), (11.7, 60.0), (7.8, 70.0), (12.3, 70.0), (20.0, 45.0))},
    6: {"b": ((1.0, 63.0), (1.0, 52.0)), "c": ((1.0, 74.0), (1.0, 65.0))},
}


@dataclass(frozen=True)
class ThresholdCurve:
    """One line of a panel.

    parameters: columns of the CSV file, by name. x, beta_thresh_deg (n,): NaN where the error is never reached.
    """

    panel: str
    parameters: dict[str, float | str]
    x: np.ndarray
    beta_thresh_deg: np.ndarray
    colour: str
    is_dashed: bool
    label: str

    @property
    def form(self) -> str:
        """Return the form of Appendix B that it is by: "printed" or "exact"; empty in figure 5."""
        return self.parameters.get("form", "")


def write_figure(number: int, out: Path) -> list[Path]:
    """Write figure 5 or 6 into the folder `out` as PNG, SVG and CSV, each whole; return the paths.

    The same figure gives the same SVG, byte for byte. Raises ValueError for another number.
    """
    if number not in NUMBERS:
        known = " and ".join(map(str, NUMBERS))
        raise ValueError(f"figure {number}: the figures from the equations are {known}")
    curves = list(figure_5() if number == 5 else figure_6())
    stem = Path(out) / f"figure_{number}"
    with matplotlib.rc_context({"font.size": 9}):
        paths = publish(_draw(number, curves), stem)
    write_whole(stem.with_suffix(".csv"), _table(number, curves))
    return [*paths, stem.with_suffix(".csv")]


def figure_5() -> Iterator[ThresholdCurve]:
    """Yield the curves of figure 5: β_thresh over the true α.

    Panels (a) to (c) are of α_est = 0°, 10°, 20°; (10) is solid, (2) dashed; errors 1, 5, 10 %.
    """
    alpha = np.radians(ALPHA_DEG)
    for panel, alpha_est_deg in zip("abc", ALPHA_EST_DEG):
        for error in ERRORS_PERCENT:
            for name, equation in EQUATIONS.items():
                alpha_est = np.radians(alpha_est_deg)
                beta = slope_threshold(error / 100, alpha, alpha_est, equation)
                yield ThresholdCurve(
                    panel,
                    {"alpha_est_deg": alpha_est_deg, "error_percent": error, "equation": name},
                    ALPHA_DEG,
                    np.degrees(beta),
                    COLOURS[error],
                    name == "(2)",
                    f"{name}, {error:g} %",
                )


def figure_6() -> Iterator[ThresholdCurve]:
    """Yield the curves of figure 6: β_thresh over r_n, once with Appendix B as printed and once exact.

    Panels (a) to (c) are of errors of 1, 5, 10 %; α = α_est = 0° is dashed, 20° solid; θ = 1°, 3°,
    5°.
    """
    forms = {"printed": curvature.printed, "exact": curvature.exact}
    for form, appendix_b in forms.items():
        for panel, error in zip("abc", ERRORS_PERCENT):
            for theta_deg in THETA_DEG:
                for alpha_deg in FRICTION_DEG:
                    beta = _curved_threshold(error, alpha_deg, theta_deg, appendix_b)
                    yield ThresholdCurve(
                        panel,
                        {
                            "form": form,
                            "error_percent": error,
                            "theta_deg": theta_deg,
                            "alpha_deg": alpha_deg,
                        },
                        R_N,
                        np.degrees(beta),
                        COLOURS[theta_deg],
                        alpha_deg == 0,
                        rf"$\theta$ = {theta_deg:g}°, $\alpha$ = {alpha_deg:g}°",
                    )


def _curved_threshold(error_percent, alpha_deg, theta_deg, form):
    """Return β_thresh, rad, on curved surfaces of R_N, with the friction angle known."""
    alpha = np.radians(alpha_deg)
    theta = np.radians(theta_deg)
    error = error_percent / 100
    return curved_threshold(error, alpha, R_N, theta, form)


def _table(number, curves) -> str:
    """Return the CSV text, a row a point; β_thresh is empty where the error is never reached."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    x_name = "alpha_deg" if number == 5 else "r_n"
    writer.writerow(["panel", *curves[0].parameters, x_name, "beta_thresh_deg"])
    for curve in curves:
        for x, beta in zip(curve.x, curve.beta_thresh_deg):
            threshold = "" if np.isnan(beta) else f"{beta:.4f}"
            writer.writerow([curve.panel, *curve.parameters.values(), f"{x:.9g}", threshold])
    return text.getvalue()


def _draw(number, curves):
    """Draw all panels of a figure."""
    forms = sorted({curve.form for curve in curves}, reverse=True)
    figure = Figure(figsize=(11, 3.8 * len(forms)), layout="constrained")
    grid = figure.subplots(len(forms), 3, sharex=True, sharey=True, squeeze=False)
    for axes, form in zip(grid, forms):
        for ax, panel in zip(axes, "abc"):
            own = [one for one in curves if one.panel == panel and one.form == form]
            _draw_panel(ax, number, own)
    _draw_legend(figure, grid)
    for ax in grid[:, 0]:
        ax.set_ylabel(r"$\beta_\mathrm{thresh}$  [°]")
    for ax in grid[-1]:
        ax.set_xlabel(_X_LABELS[number])
    return figure


def _draw_legend(figure, grid) -> None:
    """Draw one legend of all panels' lines, and a letter above each panel."""
    entries = {}
    for ax, letter in zip(grid.flat, "abcdef"):
        ax.set_title(f"({letter}) {ax.get_title()}")
        handles, labels = ax.get_legend_handles_labels()
        entries |= dict(zip(labels, handles))
    figure.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=7, frameon=False
    )


def _draw_panel(ax, number, curves) -> None:
    """Draw curves and the points that the text reads off them.

    A slope that no error limits is drawn at 90°.
    """
    for curve in curves:
        beta = np.nan_to_num(curve.beta_thresh_deg, nan=90.0)
        line = "--" if curve.is_dashed else "-"
        ax.plot(curve.x, beta, line, color=curve.colour, lw=1.2, label=curve.label)
    points = np.array(PRINTED_POINTS[number].get(curves[0].panel, ()))
    if points.size and curves[0].form != "exact":
        ax.plot(*points.T, "ko", ms=4, mfc="none", label="printed in the text")
    ax.set(ylim=(0, _TOP_DEG), yticks=range(0, 91, 15), title=_title(number, curves[0]))
    ax.grid(alpha=0.3)
    if number == 6:
        ax.set_xscale("log")


def _title(number, curve) -> str:
    """Return the title of a panel by one of its curves."""
    if number == 5:
        return rf"$\alpha_\mathrm{{est}}$ = {curve.parameters['alpha_est_deg']:g}°"
    form = "as printed" if curve.form == "printed" else "exact slip angle"
    return f"{curve.parameters['error_percent']:g} % error, {form}"
