"""The error of (10) where its assumptions fail: by the rig's exact mechanics over β × ψ and over
d_x × bar radius.

(10) gets what a perfect robot would have: exact moments, the exact pushing angle and the true
friction angle. What remains is the error of the small-angle model itself, and of slip along the
whisker, which the paper assumes away (sections II and VII).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.base.workers import Workers
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.rig.rod_contact import moments_Nmm
from bench.rig.stick_slip import FrictionCoefficients, March
from estimator import first_order
from estimator.beam import Beam
from estimator.builtin import corrected, with_friction
from estimator.whisk import EstimatorSettings, Whisk

# The paper's wire. Its stiffness cancels in d_x; its length only has to reach.
ROD = Rod("cylinder", length_mm=120.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
_BEAM = Beam(3.0 * ROD.rigidity_Nmm2, ROD.length_mm)
_NOISE_NMM = 0.01  # of m_y, by which a robot tells whether the contact slips sideways; a 250th of its moments here
BETA_DEG = np.arange(0.0, 80.1, 2.5)
PSI_DEG = np.arange(-60.0, 61.0, 10.0)
D_X_MM = np.arange(15.0, 101.0, 5.0)
BAR_RADIUS_MM = np.array([0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 12.5, 15.0, 20.0, 25.0, 30.0])
# [steps] Of the march from touch: 30 change no error by more than 0.002 % of d_x. Derived.
_STEPS = 6


@dataclass(frozen=True)
class Push:
    """One push of a straight whisker against a bar: angles in degrees, lengths in mm."""

    beta_deg: float = 0.0
    psi_deg: float = 0.0
    alpha_deg: float = 0.0
    d_x_mm: float = 60.0
    bar_radius_mm: float = 3.0
    theta_deg: float = 3.0


@dataclass(frozen=True)
class Panel:
    """A map of errors, % of d_x, (rows, columns), over values of two fields of Push.

    x, y: names of the fields. error_percent: of (10); NaN where there is no contact.
    predicted_percent: of (10) to first order; NaN where that is not known. corrected_percent: of
    (10) corrected.
    """

    title: str
    x: str
    y: str
    pushes: tuple[tuple[Push, ...], ...]
    error_percent: np.ndarray
    predicted_percent: np.ndarray
    corrected_percent: np.ndarray


def feel(push: Push, rod: Rod = ROD, beam: Beam = _BEAM) -> tuple[Whisk, float]:
    """Return a whisk with the exact moments of a push at its end, and the true d_x in mm.

    Raises ArithmeticError where the whisker finds no hold on the bar.
    """
    bar = TouchedBar.at_contact(
        d_x_mm=push.d_x_mm,
        beta_rad=np.radians(push.beta_deg),
        psi_rad=np.radians(push.psi_deg),
        touch_rad=0.0,
        radius_mm=push.bar_radius_mm,
        whisker_radius_mm=float(rod.radius_mm(push.d_x_mm)),
    )
    touch = find_first_touch(rod, bar, 0.0, push.d_x_mm)
    theta = np.radians(push.theta_deg)
    moments_at_Nmm = _end_moments_Nmm(March(rod, bar, _friction(push), touch), theta)
    covariance = _NOISE_NMM**2 * np.eye(2)
    return Whisk.without_samples(theta, moments_at_Nmm, covariance, beam), touch.d_x_mm


def _friction(push: Push) -> FrictionCoefficients:
    """Return the friction of a push, the same at rest and in motion."""
    coefficient = np.tan(np.radians(push.alpha_deg))
    return FrictionCoefficients(coefficient, coefficient)


def _end_moments_Nmm(march: March, theta_rad: float) -> tuple[float, float]:
    """Return (m_y, m_z) at a pushing angle. Raises ArithmeticError where the whisker slips off."""
    steps = theta_rad * np.arange(1, _STEPS + 1) / _STEPS
    _, states = march.along(march.touch.motor_rad + steps)
    if states[-1] is None:
        raise ArithmeticError("the whisker slips off the bar")
    return moments_Nmm(states[-1])


def errors_percent(push: Push) -> tuple[float, float]:
    """Return the errors of (10) and of (10) corrected with the true α, in percent of the true d_x.

    (10) corrected is given the bar's radius. NaN where the whisker finds no hold on the bar.
    """
    try:
        whisk, d_x = feel(push)
    except ArithmeticError:
        return np.nan, np.nan
    settings = EstimatorSettings(
        np.radians(push.alpha_deg),
        object_radius_mm=push.bar_radius_mm,
        whisker_radius_mm=ROD.diameter_mm / 2,
    )
    plain = with_friction(whisk, settings).d_x_mm
    better = corrected(whisk, settings).d_x_mm
    return 100.0 * (plain / d_x - 1.0), 100.0 * (better / d_x - 1.0)


def predicted_percent(push: Push) -> float:
    """Return the error of (10) to first order in θ, derived in docs/equations.md.

    Where it slips sideways (β ≥ α) that is leaning, held at β = ψ = 0 dragging; and rolling over the
    bar. NaN where it is held otherwise: there it depends on how friction is shared between the two
    directions.
    """
    angles_deg = [push.theta_deg, push.alpha_deg, push.beta_deg, push.psi_deg]
    theta, alpha, beta, psi = np.radians(angles_deg)
    if beta >= alpha:
        by_friction = first_order.leaning(theta, psi, beta - alpha, alpha)
    else:
        by_friction = first_order.dragging(theta, alpha) if beta == psi == 0 else np.nan
    reach_mm = push.bar_radius_mm + ROD.diameter_mm / 2
    rolling = first_order.rolling_at(theta, reach_mm, beta, push.d_x_mm, 1.0) / np.cos(psi) ** 2
    return float(100.0 * (by_friction + rolling))


def tilt_map(
    pool: Workers, *, beta_deg: Sequence[float] = BETA_DEG, psi_deg: Sequence[float] = PSI_DEG
) -> list[Panel]:
    """Compute the errors over β × ψ at d_x = 60 mm on a bar of 6 mm.

    A panel each without friction, on the paper's steel and on its sandpaper.
    """
    axes = {"beta_deg": beta_deg, "psi_deg": psi_deg}
    panels = []
    for alpha in (0.0, 10.5, 23.3):
        panels.append(_panel(pool, f"α = {alpha:g}°", Push(alpha_deg=alpha), axes))
    return panels


def radius_map(
    pool: Workers,
    *,
    d_x_mm: Sequence[float] = D_X_MM,
    bar_radius_mm: Sequence[float] = BAR_RADIUS_MM,
) -> list[Panel]:
    """Compute the errors over d_x × bar radius at ψ = 0.

    A panel each of slip along the whisker alone, with friction, and with slip sideways.
    """
    axes = {"d_x_mm": d_x_mm, "bar_radius_mm": bar_radius_mm}
    panels = []
    for beta, alpha in ((0.0, 0.0), (0.0, 23.3), (60.0, 10.5)):
        push = Push(beta_deg=beta, alpha_deg=alpha)
        panels.append(_panel(pool, f"β = {beta:g}°, α = {alpha:g}°", push, axes))
    return panels


def _panel(pool: Workers, title: str, push: Push, axes: Mapping[str, Sequence[float]]) -> Panel:
    """Compute one panel: a push with the values of two fields, of columns and of rows."""
    x, y = axes
    pushes = []
    predicted = []
    for row in axes[y]:
        of_row = []
        for column in axes[x]:
            of_row.append(replace(push, **{x: float(column), y: float(row)}))
        pushes.append(tuple(of_row))
        predicted.append([predicted_percent(one) for one in of_row])
    errors = np.array(pool.run(_row_errors, pushes, title))  # (rows, columns, 2)
    return Panel(title, x, y, tuple(pushes), errors[..., 0], np.array(predicted), errors[..., 1])


def _row_errors(pushes) -> list[tuple[float, float]]:
    """Compute the errors of a row of pushes, in a worker."""
    return [errors_percent(push) for push in pushes]
