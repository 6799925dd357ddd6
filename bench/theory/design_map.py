"""`whisker-bench design`: the best design over a region, its corners by the rig, what each choice is worth; written."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bench.base.atomic import lock_output, write_whole
from bench.base.drawing import publish, style
from bench.base.tables import Column, Table
from bench.rig.bar import Bar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.rig.rod_contact import moments_Nmm
from bench.rig.stick_slip import Friction, March
from bench.theory.design import (
    Design,
    Expected,
    Means,
    Region,
    best_design,
    expected,
    faults,
    worth_of_each,
)
from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.whisk import EstimatorSettings, Whisk

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
_STEPS = 6  # of the march from touch, as in bench.theory.model_error
_THINNEST = 1e-3  # share of the base's diameter: a tip that is thinner is a cone's
_MAP, _MAP_ALPHAS = (
    (61, 41),
    7,
)  # slopes and distances of the figure; friction angles of which the worst is shown
_UNITS = {
    "theta_deg": "θ = {:.2f}°",
    "alpha_est_deg": "α_est = {:.1f}°",
    "diameter_mm": "diameter {:.2f} mm",
    "length_mm": "length {:.0f} mm",
    "taper": "taper {:.2f}",
    "tilt_deg": "base tilted by {:.1f}°",
}


@dataclass(frozen=True)
class Designed:
    """The best design with its worst error, %; exact_percent (8,): what exact mechanics make of (10) at the region's
    corners, NaN where the whisker finds no hold; worth: see `worth_of_each`. paper_percent: of the paper's whisker."""

    design: Design
    worst_percent: float
    region: Region
    means: Means
    exact_percent: np.ndarray
    worth: Mapping[str, float]
    paper_percent: float


def designed(
    ranges: Mapping[str, tuple[float, float]], region: Region, means: Means, seed: int = 0
) -> Designed:
    """Raises BadInput where no design within the ranges serves the region."""
    best = best_design(ranges, region, means, seed)
    exact = np.array(
        [exact_percent(best[0], region, means, corner) for corner in region.corners().T]
    )
    return Designed(
        *best,
        region,
        means,
        exact,
        worth_of_each(ranges, region, means, seed),
        of_paper(region, means),
    )


def of_paper(region: Region, means: Means) -> float:
    """Worst error of the paper's whisker and settings, %; infinite where they do not serve the region."""
    if faults(Design(), region, means):
        return math.inf
    return float(expected(Design(), region, means, region.points()).bound_percent.max())


def exact_percent(design: Design, region: Region, means: Means, point: Sequence[float]) -> float:
    """Error of (10) without noise at one slope, friction angle (rad) and distance, by the rig's exact mechanics, % of
    d_x; NaN where the whisker finds no hold or (10) has no distance."""
    (beta, alpha, d_x), theta = map(float, point), design.theta_rad
    rod, beam = rod_and_beam(design, means)
    bar = Bar.at_contact(
        d_x_mm=d_x,
        beta_rad=beta - math.radians(design.tilt_deg),
        psi_rad=0.0,
        touch_rad=0.0,
        radius_mm=region.bar_radius_mm,
        whisker_radius_mm=float(rod.radius_mm(d_x)),
    )
    try:
        touch = find_first_touch(rod, bar, 0.0, d_x)
        march = March(rod, bar, Friction(math.tan(alpha), math.tan(alpha)), touch)
        *_, state = march.along(touch.motor_rad + theta * np.arange(1, _STEPS + 1) / _STEPS)[1]
    except ArithmeticError:
        return math.nan
    if state is None:
        return math.nan
    felt = Whisk(*(np.zeros(0),) * 4, theta, *moments_Nmm(state), np.zeros((2, 2)), 0.0, beam)
    estimate = with_friction(felt, EstimatorSettings(math.radians(design.alpha_est_deg)))
    return 100.0 * (estimate.d_x_mm / touch.d_x_mm - 1.0)


def rod_and_beam(design: Design, means: Means) -> tuple[Rod, Beam]:
    """The whisker of a design as the rig and as the estimators have it."""
    size = design.length_mm, design.diameter_mm
    share = 1.0 - design.taper
    if share in (0.0, 1.0) or share < _THINNEST:
        shape = "cylinder" if share == 1.0 else "cone"
        beam = Beam.from_rigidity(design.rigidity_Nmm2(means), size[0], shape)
        return Rod(shape, *size, means.youngs_modulus_GPa), beam
    rod = Rod(
        "tapered", *size, means.youngs_modulus_GPa, tip_diameter_mm=share * design.diameter_mm
    )
    return rod, Beam.from_rigidity(design.rigidity_Nmm2(means), size[0], "tapered", share)


def design_lines(made: Designed) -> Iterator[str]:
    """The design, its worst error, what each choice is worth, and how the rig agrees."""
    design, region = made.design, made.region
    said = ", ".join(text.format(getattr(design, name)) for name, text in _UNITS.items())
    yield f"{said} (EI {design.rigidity_Nmm2(made.means):.0f} N·mm² at the base)"
    where = ", ".join(
        f"{name} {low:g} to {high:g}{unit}"
        for name, (low, high), unit in (
            ("β", region.beta_deg, "°"),
            ("α", region.alpha_deg, "°"),
            ("d_x", region.d_x_mm, " mm"),
        )
    )
    yield f"worst error of (10) over {where}: {made.worst_percent:.2f} % of d_x (|bias| + 1.96 sigma)"
    yield f"the paper's whisker, θ = 3°, α_est = 10°: {_percent(made.paper_percent)}"
    for name, worst in sorted(made.worth.items(), key=lambda item: -item[1]):
        yield f"  all else as good as can be, but {_UNITS[name].format(getattr(Design(), name))}: {_percent(worst)}"
    off = made.exact_percent - _at_corners(made).bias_percent
    known = np.isfinite(off)
    if known.any():
        within = f"{np.abs(off[known]).max():.2f} % of d_x"
        yield f"exact mechanics at the region's corners: the bias is as expected within {within}"
    if not known.all():
        yield f"at {np.count_nonzero(~known)} of 8 corners the whisker finds no hold, or (10) no distance"


def _percent(worst: float) -> str:
    return f"{worst:.2f} %" if math.isfinite(worst) else "does not serve the region"


def _at_corners(made: Designed) -> Expected:
    return expected(made.design, made.region, made.means, made.region.corners())


def write_design(out: Path, made: Designed) -> list[Path]:
    """design.txt, design.csv, design.png and .svg in a folder, each whole; their paths."""
    with lock_output(out):
        write_whole(out / "design.txt", "\n".join(design_lines(made)) + "\n")
        DESIGN.write(out, _rows(made))
        with style():
            figures = publish(draw(made), out / "design")
    return [out / "design.txt", out / DESIGN.file, *figures]


def _rows(made: Designed) -> Iterator[dict]:
    """The corners, with what the rig says, then the region's grid."""
    yield from _of_points(made, made.region.corners(), made.exact_percent)
    points = made.region.points()
    yield from _of_points(made, points, np.full(points.shape[1], np.nan))


def _of_points(made: Designed, points: np.ndarray, exact: np.ndarray) -> Iterator[dict]:
    found = expected(made.design, made.region, made.means, points)
    columns = np.degrees(points[0]), np.degrees(points[1]), points[2]
    errors = found.bias_percent, found.sigma_percent, found.bound_percent, exact
    for row in zip(*columns, *errors):
        yield dict(zip(DESIGN.names, map(float, row)))


def draw(made: Designed) -> Figure:
    """The worst over α at each slope and distance: this design, and the paper's whisker."""
    figure = Figure(figsize=(8.0, 3.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    beta, d_x = (
        np.linspace(*ends, n) for ends, n in zip((made.region.beta_deg, made.region.d_x_mm), _MAP)
    )
    for panel, design, title in zip(
        panels, (made.design, Design()), ("this design", "the paper's whisker")
    ):
        bound = _worst_over_alpha(design, made)
        shown = panel.pcolormesh(
            beta, d_x, np.minimum(bound, 100.0), cmap="viridis", shading="nearest", rasterized=True
        )
        figure.colorbar(shown, ax=panel, label="|bias| + 1.96 σ, % of d$_x$")
        panel.set(xlabel="slope β, °", title=title)
    panels[0].set_ylabel("d$_x$, mm")
    return figure


def _worst_over_alpha(design: Design, made: Designed) -> np.ndarray:
    """(distances, slopes), %."""
    slopes, places = _MAP
    points = made.region.points(slopes, _MAP_ALPHAS, places)
    bound = expected(design, made.region, made.means, points).bound_percent.reshape(
        slopes, _MAP_ALPHAS, places
    )
    return bound.max(axis=1).T
