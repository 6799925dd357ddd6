"""The session's figures as the page draws them: Fig. 8, error against slope, friction and θ, its parts, the budget."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from bench.analyses.against_theta import AtTheta, against_theta
from bench.analyses.alphas import seen_friction
from bench.analyses.explained import SHARES, explained_rows
from bench.analyses.friction_tables import SurfaceFriction
from bench.analyses.surfaces import Felt, Surface
from bench.base.drawing import SLOPES_DEG, label_of
from bench.base.settings import Settings
from bench.report.page.svg import Mark, Panel, legend, limits
from bench.report.page.words import Row, number, with_sigma
from bench.report.run_facts import RunRecord
from bench.trials.estimate_errors import Judged, judge
from estimator.beam import moment_in_EI_per_metre
from estimator.friction import curves
from estimator.threshold import distance_error

_OWN = {"no_slip": "e0", "with_friction": "e1", "frictionless": "e2"}
_OWN |= {"with_friction_fitted": "e3", "with_friction_seen": "e4"}
_ASSUMED = {"frictionless": 0.0, "no_slip": 0.0}
_DASHES = ("", "6 4", "2 3", "8 3 2 3")
_ASIDE_PX = 5.0  # between the points of two estimators
_EVERY = 8  # slopes of a drawn curve: a step of 2°


@dataclass(frozen=True)
class Figure:
    """A title, a caption, and one or more panels with their legend."""

    title: str
    caption: str
    panels: tuple[Markup, ...]
    legend: Markup | str = ""


def figures(
    record: RunRecord, rows: Sequence[Row], friction: Sequence[SurfaceFriction]
) -> Iterator[Figure]:
    """All figures that the results allow."""
    judged = [j for j in judge(row.result for row in unique(rows)) if _shown(j)]
    fitted = [f.surface for f in friction]
    keys = {(row.trial, row.seen.whisk): row.key for row in rows}
    yield from (figure_8(surface, keys) for surface in fitted)
    if judged:
        yield error_by_slope(judged, keys, fitted, record.settings)
        yield from error_by_friction(judged, keys, rows)
    yield from error_by_theta(against_theta([row.result for row in unique(rows)]))


def unique(rows: Sequence[Row]) -> Sequence[Row]:
    """A row of each trial."""
    return list({row.trial: row for row in rows}.values())


def _shown(j: Judged) -> bool:
    return j.purpose == "measure" and not j.one_factor and math.isfinite(j.error_percent)


def series_of(estimator: str, names: Sequence[str]) -> tuple[str, int]:
    """Class and marker of an estimator: its own for the built-in ones, others by number."""
    found = _OWN.get(estimator)
    if found is None:
        others = [name for name in names if name not in _OWN]
        found = f"e{5 + others.index(estimator) % 3}"
    return found, int(found[1:])


def error_by_slope(
    judged: Sequence[Judged], keys: dict, fitted: Sequence[Surface], settings: Settings
) -> Figure:
    """Error against slope, with every estimator and without (2), whose error dwarfs the others'."""
    names = list(dict.fromkeys(j.estimator for j in judged))
    near = [name for name in names if name != "no_slip"]
    panels = [
        _slope_panel(judged, chosen, names, keys, fitted, settings, title)
        for chosen, title in ((names, "every estimator"), (near, "without (2)"))
        if chosen
    ]
    entries = [(label_of(name), *series_of(name, names)) for name in names]
    caption = (
        f"Error of d_x at θ = {settings.theta_deg:g}°, estimate less truth, in per cent of the truth, ± one sigma. "
        "Lines: as (13), (14) predict with the α that fits each surface. Points of "
        "one whisk are set apart sideways; a point leads to its whisk; a hollow one is in doubt and not in the verdict."
    )
    return Figure("Error against slope", caption, tuple(panels), legend(entries))


def _slope_panel(judged, chosen, names, keys, fitted, settings, title: str) -> Markup:
    mine = [j for j in judged if j.estimator in chosen]
    reach = [
        j.error_percent + side * min(j.error_sigma_percent, 50.0)
        for j in mine
        for side in (-1.0, 1.0)
    ]
    panel = Panel((-3.0, 85.0), limits(reach, (-5.0, 5.0)))
    lines = [line for name in chosen for line in _predicted(panel, name, names, fitted, settings)]
    marks = [panel.mark(_error_mark(j, names, keys, abs(j.beta_deg))) for j in mine]
    alt = f"Error of d_x in per cent against the slope β, {title}: {len(mine)} points"
    return panel.drawing([*lines, *marks], ("slope |β|  [°]", "error of d_x  [%]"), title, alt)


def _error_mark(j: Judged, names: Sequence[str], keys: dict, x: float) -> Mark:
    series, shape = series_of(j.estimator, names)
    error = with_sigma(j.error_percent, j.error_sigma_percent, sign=True)
    title = f"{j.trial}, whisk {j.whisk}: {label_of(j.estimator)} {error} %, β = {number(j.beta_deg, 1)}°"
    title += " (in doubt)" if j.doubtful else ""
    place = x, j.error_percent, j.error_sigma_percent
    aside_px = _ASIDE_PX * (names.index(j.estimator) - 0.5 * (len(names) - 1))
    which = keys[j.trial, j.whisk], j.trial, j.whisk
    return Mark(*place, series + " doubt" * j.doubtful, shape, *which, title, aside_px)


def _predicted(
    panel: Panel, name: str, names, fitted: Sequence[Surface], settings: Settings
) -> Iterator[Markup]:
    """The error that (13), (14) predict where the surface has its fitted α; what leaves the panel is not drawn."""
    assumed = settings.alpha_est_rad if name == "with_friction" else _ASSUMED.get(name)
    equation = "no_slip" if name == "no_slip" else "with_friction"
    slopes = SLOPES_DEG[::_EVERY]
    for place, surface in enumerate(fitted):
        if surface.fit is not None and assumed is not None:
            error = distance_error(
                np.radians(slopes), surface.alpha_rad, assumed, equation=equation
            )
            error = 100.0 * surface.beam.error_share(surface.common_d_x_mm, error)
            inside = np.where((error > panel.y[0]) & (error < panel.y[1]), error, np.nan)
            yield panel.line(
                slopes, inside, series_of(name, names)[0], _DASHES[place % len(_DASHES)]
            )


def error_by_friction(
    judged: Sequence[Judged], keys: dict, rows: Sequence[Row]
) -> Iterator[Figure]:
    """Error of (10) against the friction angle that the pictures show; nothing where none shows it."""
    alpha = {
        row.key: math.degrees(seen_friction(row.seen)[0])
        for row in rows
        if row.seen.deflection is not None
    }
    mine = [j for j in judged if j.estimator == "with_friction"]
    mine = [j for j in mine if math.isfinite(alpha.get(keys[j.trial, j.whisk], math.nan))]
    if len(mine) < 2:
        return
    places = [alpha[keys[j.trial, j.whisk]] for j in mine]
    reach = [
        j.error_percent + side * min(j.error_sigma_percent, 50.0)
        for j in mine
        for side in (-1.0, 1.0)
    ]
    panel = Panel(limits(places, (0.0, 0.0)), limits(reach, (-5.0, 5.0)))
    marks = [panel.mark(_error_mark(j, ["with_friction"], keys, x)) for j, x in zip(mine, places)]
    alt = f"Error of (10) in per cent against the friction angle seen: {len(mine)} points"
    drawn = panel.drawing(
        marks, ("friction angle α seen  [°]", "error of d_x  [%]"), "(10) with friction", alt
    )
    said = "Against the friction angle that the pictures show, of whisks that slip: where α_est is not α, (10) errs."
    yield Figure("Error against friction", said, (drawn,))


def error_by_theta(found: Sequence[AtTheta]) -> Iterator[Figure]:
    """RMS error of each estimator and its stated sigma over the pushing angle; nothing of fewer than two angles."""
    known = [at for at in found if at.whisks and at.error_rms_percent > 0]
    if len({at.theta_deg for at in known}) < 2:
        return
    names = list(dict.fromkeys(at.estimator for at in known))
    values = [
        math.log10(v)
        for at in known
        for v in (at.error_rms_percent, at.error_sigma_percent)
        if v > 0
    ]
    panel = Panel(
        limits(math.log10(at.theta_deg) for at in known), limits(values), log=(True, True)
    )
    drawn = []
    for name in names:
        mine, (series, _) = [at for at in known if at.estimator == name], series_of(name, names)
        theta, rms, sigma = np.log10(
            [(at.theta_deg, at.error_rms_percent, at.error_sigma_percent) for at in mine]
        ).T
        drawn += [panel.line(theta, rms, series), panel.line(theta, sigma, series, "4 3")]
    alt = f"RMS error and stated sigma of {len(names)} estimators against the pushing angle"
    drawing = panel.drawing(
        drawn, ("pushing angle θ  [°]", "RMS error of d_x  [%]"), "error and sigma", alt
    )
    said = "RMS over the sound whisks: solid the error, dashed the stated sigma. Small θ: noise; large: bending."
    entries = [(label_of(name), series_of(name, names)[0], None) for name in names]
    yield Figure("Error and sigma against θ", said, (drawing,), legend(entries))


def figure_8(surface: Surface, keys: dict) -> Figure:
    """|m| and φ of each whisk of a surface against slope, and the curve of the α that fits."""
    EI, beam = surface.beam.rigidity_Nmm2, surface.beam
    scale = [
        beam.as_cylinder_mm(f.d_x_mm) / beam.as_cylinder_mm(surface.common_d_x_mm)
        for f in surface.felt
    ]
    m = [moment_in_EI_per_metre(s * f.m_Nmm, EI) for s, f in zip(scale, surface.felt)]
    m_sigma = [moment_in_EI_per_metre(s * f.m_sigma_Nmm, EI) for s, f in zip(scale, surface.felt)]
    phi, phi_sigma = [abs(f.phi_deg) for f in surface.felt], [f.phi_sigma_deg for f in surface.felt]
    slopes, lines = SLOPES_DEG[::_EVERY], (np.full(0, np.nan),) * 2
    if surface.fit is not None:
        common = beam.as_cylinder_mm(surface.common_d_x_mm)
        found = curves(
            surface.alpha_rad, np.radians(slopes), common, surface.theta_rad, beam.C_Nmm2
        )
        lines = moment_in_EI_per_metre(found[0], EI), np.degrees(found[1])
    quantities = (
        ("|m|  [EI/m]", m, m_sigma, lines[0]),
        ("slip angle φ  [°]", phi, phi_sigma, lines[1]),
    )
    panels = tuple(_felt_panel(surface, keys, slopes, *quantity) for quantity in quantities)
    fit = surface.fit
    fitted = (
        "no α fits"
        if fit is None
        else f"line: α = {with_sigma(*np.degrees([fit.alpha_rad, fit.sigma_rad]))}°"
    )
    caption = (
        f"What was felt at θ = {math.degrees(surface.theta_rad):.2g}°, |m| scaled to d_x = "
        f"{surface.common_d_x_mm:.1f} mm, each whisk ± one sigma; {fitted}."
    )
    return Figure(f"Fig. 8: {surface.title}", caption, panels)


def _felt_panel(surface: Surface, keys, slopes, label: str, values, sigmas, line) -> Markup:
    panel = Panel((-3.0, 85.0), limits([*values, *line], (0.0, 0.0)))
    marks = [
        panel.mark(_felt_mark(f, v, s, label, keys))
        for f, v, s in zip(surface.felt, values, sigmas)
    ]
    curve = [panel.line(slopes, line, "e1")] if len(line) else []
    alt = f"{label} against the slope β on {surface.title}: {len(marks)} points"
    return panel.drawing([*curve, *marks], ("slope |β|  [°]", label), surface.title, alt)


def _felt_mark(felt: Felt, value: float, sigma: float, label: str, keys: dict) -> Mark:
    name = label.split("  ")[0]
    title = f"{felt.trial}, whisk {felt.whisk}: {name} = {with_sigma(value, sigma)}, β = {number(felt.beta_deg, 1)}°"
    which = felt.trial, felt.whisk
    return Mark(abs(felt.beta_deg), value, sigma, "felt", 0, keys[which], *which, title)


@dataclass(frozen=True)
class Bar:
    """A stacked bar of a whisk: its key ('' for a mean), name, and shares by cause, with what they add up to."""

    key: str
    name: str
    shares: dict[str, float]
    total: str


def explained_bars(record: RunRecord, rows: Sequence[Row]) -> list[Bar]:
    """The error of (10) of each whisk in its parts, per cent of d_x."""
    keys = {(row.trial, row.seen.whisk): row for row in rows}
    bars = []
    for one in explained_rows([row.result for row in unique(rows)], record.whisker):
        row = keys[one["trial"], one["whisk"]]
        shares = {name: 100.0 * one[name] / one["d_x_mm"] for name in SHARES}
        if row.result.trial.purpose == "measure" and all(map(math.isfinite, shares.values())):
            bars.append(
                Bar(
                    row.key,
                    row.name,
                    shares,
                    number(100.0 * one["error_mm"] / one["d_x_mm"], 2) + " %",
                )
            )
    return bars


def budget_bars(rows: Sequence[Row]) -> list[Bar]:
    """Shares of d_x's variance of each whisk with a truth, per cent."""
    return [
        Bar(
            row.key,
            row.name,
            {
                cause: 100.0 * share
                for cause, share in row.seen.truth.budget.items()
                if math.isfinite(share)
            },
            f"± {row.seen.d_x_mm.sigma:.3f} mm",
        )
        for row in rows
        if row.seen.has_truth and row.seen.truth.budget
    ]
