"""`whisker-bench design`: the best design over a region, its corners by the rig, and how much each choice
improves it; written."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bench.base.atomic import lock_output, write_whole
from bench.base.drawing import publish, style
from bench.base.progress import count_parts
from bench.base.tables import Column, Table
from bench.rig.elastic_rod import Rod
from bench.theory.best_design import (
    Design,
    DesignJob,
    Equipment,
    ExpectedError,
    best_design,
    costs_of_paper_values,
    expected_error,
    faults,
    largest_percent,
)
from bench.theory.model_error import Push, feel
from estimator.builtin import with_friction
from estimator.whisk import EstimatorSettings

DESIGN = Table(
    "design",
    "A row a place of `whisker-bench design`: the corners of its region first, then a grid over it "
    "([designing.md](designing.md)). Errors are of (10), % of d_x.",
    (
        Column("beta_deg", "slope"),
        Column("alpha_deg", "the surface's friction angle"),
        Column("d_x_mm", "distance"),
        Column("bias_percent", "its bias there, expected"),
        Column("sigma_percent", "its standard deviation there, expected"),
        Column("bound_percent", "abs(bias) + 1.96 sigma"),
        Column("exact_percent", "its error by exact mechanics; of the corners alone"),
    ),
)
_SLOPES, _ALPHAS, _PLACES = 61, 7, 41  # of the figure's grid; it shows the worst over α
_SHOWN_PERCENT = 100.0  # of the figure's colours: the largest
_UNITS = {
    "theta_deg": "θ = {:.2f}°",
    "alpha_est_deg": "α_est = {:.1f}°",
    "diameter_mm": "diameter {:.2f} mm",
    "length_mm": "length {:.0f} mm",
    "taper": "taper {:.2f}",
    "tilt_deg": "base tilted by {:.1f}°",
}


@dataclass(frozen=True)
class DesignReport:
    """The best design with its worst error, %.

    exact_percent (8,): error of (10) by exact mechanics at the region's corners, NaN where the
    whisker finds no hold. costs_percent: of `costs_of_paper_values`. paper_percent: worst error of
    the paper's whisker and settings, infinite where they do not serve the region.
    """

    design: Design
    worst_percent: float
    job: DesignJob
    exact_percent: np.ndarray
    costs_percent: Mapping[str, float]
    paper_percent: float

    def expected_at(self, points: np.ndarray) -> ExpectedError:
        """Return the error that is to be expected of the design at points (3, n)."""
        return expected_error(self.design, self.job, points)


def find_design(ranges: Mapping[str, tuple[float, float]], job: DesignJob) -> DesignReport:
    """Find the best design within ranges (low, high) of each choice.

    Raises BadInput where no design within the ranges serves the region.
    """
    design, worst = best_design(ranges, job)
    corners = job.region.corners().T
    exact = []
    for corner in count_parts(corners, "corners by exact mechanics", len(corners)):
        exact.append(exact_percent(design, job, corner))
    costs = costs_of_paper_values(ranges, job)
    paper = Design()
    is_paper_sound = not faults(paper, job)
    paper_percent = largest_percent(paper, job) if is_paper_sound else math.inf
    return DesignReport(design, worst, job, np.array(exact), costs, paper_percent)


def exact_percent(design: Design, job: DesignJob, point: Sequence[float]) -> float:
    """Return the error of (10) without noise at one place by the rig's exact mechanics, % of d_x.

    point: slope and friction angle, rad, and distance, mm. NaN where the whisker finds no hold or
    (10) has no distance.
    """
    beta, alpha, d_x = point
    push = Push(
        beta_deg=math.degrees(beta) - design.tilt_deg,
        alpha_deg=math.degrees(alpha),
        d_x_mm=float(d_x),
        bar_radius_mm=job.region.bar_radius_mm,
        theta_deg=design.theta_deg,
    )
    try:
        rod = rod_of(design, job.equipment)
        whisk, true_mm = feel(push, rod, design.beam(job.equipment))
    except ArithmeticError:
        return math.nan
    estimate = with_friction(whisk, EstimatorSettings(math.radians(design.alpha_est_deg)))
    return 100.0 * (estimate.d_x_mm / true_mm - 1.0)


def rod_of(design: Design, equipment: Equipment) -> Rod:
    """Return the whisker of a design as the rig has it."""
    shape = design.beam(equipment).shape
    tip_mm = (1.0 - design.taper) * design.diameter_mm if shape == "tapered" else None
    modulus_GPa = equipment.youngs_modulus_GPa
    return Rod(shape, design.length_mm, design.diameter_mm, modulus_GPa, tip_diameter_mm=tip_mm)


def report_lines(report: DesignReport) -> Iterator[str]:
    """Yield the design, its worst error, the cost of each choice, and how the rig agrees."""
    design = report.design
    region = report.job.region
    choices = ", ".join(_with_unit(design, name) for name in _UNITS)
    yield f"{choices} (EI {design.beam(report.job.equipment).rigidity_Nmm2:.0f} N·mm² at the base)"
    beta = "β {:g} to {:g}°".format(*region.beta_deg)
    alpha = "α {:g} to {:g}°".format(*region.alpha_deg)
    d_x = "d_x {:g} to {:g} mm".format(*region.d_x_mm)
    worst = f"{report.worst_percent:.2f} % of d_x (|bias| + 1.96 sigma)"
    yield f"worst error of (10) over {beta}, {alpha}, {d_x}: {worst}"
    yield f"the paper's whisker, θ = 3°, α_est = 10°: {_percent(report.paper_percent)}"
    for name, cost in sorted(report.costs_percent.items(), key=lambda item: -item[1]):
        choice = _with_unit(Design(), name)
        yield f"  all else as good as can be, but {choice}: {_percent(cost)}"
    yield from _agreement_lines(report)


def _agreement_lines(report: DesignReport) -> Iterator[str]:
    """Yield how far the expected bias is from exact mechanics at the region's corners."""
    expected = report.expected_at(report.job.region.corners())
    difference = report.exact_percent - expected.bias_percent
    is_known = np.isfinite(difference)
    if is_known.any():
        within = f"{np.abs(difference[is_known]).max():.2f} % of d_x"
        yield f"exact mechanics at the region's corners: the bias is as expected within {within}"
    unknown = np.count_nonzero(~is_known)
    if unknown:
        yield f"at {unknown} of 8 corners the whisker finds no hold, or (10) no distance"


def _with_unit(design: Design, name: str) -> str:
    """Return a choice of a design as text."""
    return _UNITS[name].format(getattr(design, name))


def _percent(worst: float) -> str:
    """Return a worst error as text."""
    return f"{worst:.2f} %" if math.isfinite(worst) else "does not serve the region"


def write_design(out: Path, report: DesignReport) -> list[Path]:
    """Write design.txt, design.csv, design.png and .svg into a folder, each whole; return their
    paths."""
    region = report.job.region
    points = region.points()
    unknown = np.full(points.shape[1], np.nan)
    with lock_output(out):
        write_whole(out / "design.txt", "\n".join(report_lines(report)) + "\n")
        corners = _rows(report, region.corners(), report.exact_percent)
        DESIGN.write(out, [*corners, *_rows(report, points, unknown)])
        with style():
            figures = publish(draw(report), out / "design")
    return [out / "design.txt", out / DESIGN.file, *figures]


def _rows(report: DesignReport, points: np.ndarray, exact_percent: np.ndarray) -> Iterator[dict]:
    """Yield a row of DESIGN for each of points (3, n)."""
    error = report.expected_at(points)
    angles_deg = np.degrees(points[:2])
    errors = error.bias_percent, error.sigma_percent, error.bound_percent, exact_percent
    for row in np.stack([*angles_deg, points[2], *errors], axis=1).tolist():
        yield dict(zip(DESIGN.names, row))


def draw(report: DesignReport) -> Figure:
    """Draw the worst error over α at each slope and distance: of this design, and of the paper's
    whisker."""
    figure = Figure(figsize=(8.0, 3.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    region = report.job.region
    beta_deg = np.linspace(*region.beta_deg, _SLOPES)
    d_x_mm = np.linspace(*region.d_x_mm, _PLACES)
    points = region.points(_SLOPES, _ALPHAS, _PLACES)
    designs = {"this design": report.design, "the paper's whisker": Design()}
    for panel, (title, design) in zip(panels, designs.items()):
        error = expected_error(design, report.job, points)
        bound = error.bound_percent.reshape(_SLOPES, _ALPHAS, _PLACES).max(axis=1).T
        mesh = panel.pcolormesh(
            beta_deg,
            d_x_mm,
            np.minimum(bound, _SHOWN_PERCENT),
            cmap="viridis",
            shading="nearest",
            rasterized=True,
        )
        figure.colorbar(mesh, ax=panel, label="|bias| + 1.96 σ, % of d$_x$")
        panel.set(xlabel="slope β, °", title=title)
    panels[0].set_ylabel("d$_x$, mm")
    return figure
