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
from estimator.curvature import slope_threshold

NUMBERS = (5, 6)
ERRORS_PERCENT = (1.0, 5.0, 10.0)
ALPHA_EST_DEG = (0.0, 10.0, 20.0)
# Denser towards each α_est, where the curves rise to a cusp at 90°.
_NEAR_DEG = np.geomspace(1e-5, 0.1, 33)
ALPHA_DEG = np.unique(
    np.concatenate(
        [
            np.linspace(0.0, 40.0, 321),
            *(
                alpha + side * _NEAR_DEG
                for alpha in ALPHA_EST_DEG
                for side in (-1.0, 1.0)
                if alpha + side > 0
            ),
        ]
    )
)
EQUATIONS = {"(10)": "with_friction", "(2)": "no_slip"}
THETA_DEG = (1.0, 3.0, 5.0)
FRICTION_DEG = (0.0, 20.0)
_TOP_DEG = 94.0  # of the axis: a cusp at 90° is seen whole
R_N = np.geomspace(0.1, 10.0, 81)
COLOURS = {1.0: "tab:blue", 3.0: "tab:green", 5.0: "tab:orange", 10.0: "tab:red"}

# What the paper's text reads off its figures: x, β_thresh [deg] by panel.
PRINTED_POINTS = {
    5: {"b": ((8.2, 60.0), (11.7, 60.0), (7.8, 70.0), (12.3, 70.0), (20.0, 45.0))},
    6: {"b": ((1.0, 63.0), (1.0, 52.0)), "c": ((1.0, 74.0), (1.0, 65.0))},
}


@dataclass(frozen=True)
class Curve:
    """One line of a panel: what it is drawn for, as CSV columns, and β_thresh [deg] over x."""

    panel: str
    row: str
    parameters: dict[str, float | str]
    x: np.ndarray
    beta_thresh_deg: np.ndarray
    colour: str
    dashed: bool
    label: str


def write_figure(number: int, out: Path) -> list[Path]:
    """Write figure 5 or 6 into the folder `out` as PNG, SVG and CSV, each whole or not at all; the paths written.

    The same figure gives the same SVG, byte for byte. Raises ValueError for another number.
    """
    if number not in NUMBERS:
        raise ValueError(
            f"figure {number}: the figures from the equations are {' and '.join(map(str, NUMBERS))}"
        )
    curves = list(figure_5() if number == 5 else figure_6())
    stem = Path(out) / f"figure_{number}"
    with matplotlib.rc_context({"font.size": 9}):
        paths = publish(_figure(number, curves), stem)
    write_whole(stem.with_suffix(".csv"), _table(number, curves))
    return [*paths, stem.with_suffix(".csv")]


def figure_5() -> Iterator[Curve]:
    """β_thresh over the true α: panels (a)–(c) for α_est = 0°, 10°, 20°; (10) solid, (2) dashed; errors 1, 5, 10 %."""
    for panel, alpha_est in zip("abc", ALPHA_EST_DEG):
        for error in ERRORS_PERCENT:
            for name, equation in EQUATIONS.items():
                beta = slope_threshold(
                    error / 100, np.radians(ALPHA_DEG), np.radians(alpha_est), equation=equation
                )
                parameters = {"alpha_est_deg": alpha_est, "error_percent": error, "equation": name}
                label = f"{name}, {error:g} %"
                yield Curve(
                    panel,
                    "",
                    parameters,
                    ALPHA_DEG,
                    np.degrees(beta),
                    COLOURS[error],
                    name == "(2)",
                    label,
                )


def figure_6() -> Iterator[Curve]:
    """β_thresh over r_n: panels (a)–(c) for errors of 1, 5, 10 %; α = α_est = 0° dashed, 20° solid; θ = 1°, 3°, 5°.

    Once with Appendix B as printed and once exact.
    """
    for form in ("printed", "exact"):
        for panel, error in zip("abc", ERRORS_PERCENT):
            for theta in THETA_DEG:
                for alpha in FRICTION_DEG:
                    beta = _curved(error, alpha, theta, form == "printed")
                    parameters = {
                        "form": form,
                        "error_percent": error,
                        "theta_deg": theta,
                        "alpha_deg": alpha,
                    }
                    label = rf"$\theta$ = {theta:g}°, $\alpha$ = {alpha:g}°"
                    yield Curve(
                        panel, form, parameters, R_N, beta, COLOURS[theta], alpha == 0, label
                    )


def _curved(error_percent, alpha_deg, theta_deg, printed):
    alpha = np.radians(alpha_deg)
    beta = slope_threshold(
        error_percent / 100, alpha, alpha, r_n=R_N, theta=np.radians(theta_deg), printed=printed
    )
    return np.degrees(beta)


def _table(number, curves) -> str:
    """CSV, a row a point; β_thresh is empty where the error is never reached."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    x_name = "alpha_deg" if number == 5 else "r_n"
    writer.writerow(["panel", *curves[0].parameters, x_name, "beta_thresh_deg"])
    for curve in curves:
        for x, beta in zip(curve.x, curve.beta_thresh_deg):
            shown = "" if np.isnan(beta) else f"{beta:.4f}"
            writer.writerow([curve.panel, *curve.parameters.values(), f"{x:.9g}", shown])
    return text.getvalue()


def _figure(number, curves):
    rows = sorted({curve.row for curve in curves}, reverse=True)
    figure = Figure(figsize=(11, 3.8 * len(rows)), layout="constrained")
    grid = figure.subplots(len(rows), 3, sharex=True, sharey=True, squeeze=False)
    for axes, row in zip(grid, rows):
        for ax, panel in zip(axes, "abc"):
            _panel(ax, number, [c for c in curves if (c.panel, c.row) == (panel, row)])
    for ax, letter in zip(grid.flat, "abcdef"):
        ax.set_title(f"({letter}) {ax.get_title()}")
    entries = {
        label: handle for ax in grid.flat for handle, label in zip(*ax.get_legend_handles_labels())
    }
    figure.legend(
        entries.values(), entries.keys(), loc="outside lower center", ncols=7, frameon=False
    )
    for ax in grid[:, 0]:
        ax.set_ylabel(r"$\beta_\mathrm{thresh}$  [°]")
    for ax in grid[-1]:
        x_label = (
            r"true friction cone angle $\alpha$  [°]"
            if number == 5
            else r"normalized radius of curvature $r_n$"
        )
        ax.set_xlabel(x_label)
    return figure


def _panel(ax, number, curves) -> None:
    """Curves and what the text reads off them. A slope that no error limits is drawn at 90°."""
    for curve in curves:
        beta = np.nan_to_num(curve.beta_thresh_deg, nan=90.0)
        ax.plot(
            curve.x,
            beta,
            "--" if curve.dashed else "-",
            color=curve.colour,
            lw=1.2,
            label=curve.label,
        )
    points = np.array(PRINTED_POINTS[number].get(curves[0].panel, ()))
    if points.size and curves[0].row != "exact":
        ax.plot(*points.T, "ko", ms=4, mfc="none", label="printed in the text")
    ax.set(ylim=(0, _TOP_DEG), yticks=range(0, 91, 15), title=_title(number, curves[0]))
    ax.grid(alpha=0.3)
    if number == 6:
        ax.set_xscale("log")


def _title(number, curve) -> str:
    if number == 5:
        return rf"$\alpha_\mathrm{{est}}$ = {curve.parameters['alpha_est_deg']:g}°"
    form = "as printed" if curve.row == "printed" else "exact slip angle"
    return f"{curve.parameters['error_percent']:g} % error, {form}"
