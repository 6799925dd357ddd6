"""How an object is curved, from successive contacts of one whisk: curvature.csv, a row a whisk, from moments alone.

In the whisking plane a bar is a circle. The contact rolls over it towards the base as the whisker bends, so that (10)
comes out the shorter the further the push (docs/maps.md): its change with θ is the circle's radius. In the sensing
plane a straight bar is flat: there φ stays as it is, and what it changes by with θ is the lateral curvature of
Appendix B, by (23) to (25) as printed and by the exact form.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.settings import TILT_SIGMA_RAD
from bench.base.tables import TRIAL, WHISK, Column, Table, status, with_sigma
from bench.records.trial_result import FeltAt, FeltWhisk, TrialResult, whisks
from bench.session.whisker import Whisker
from bench.trials.estimate_errors import is_sound
from estimator import curvature, first_order
from estimator.beam import Beam
from estimator.domain import RIGHT_ANGLE
from estimator.uncertainty import Z_95, gradient_with_friction, slip_angle_sigma
from vision.truth.value import UNKNOWN, Value

CURVATURE = Table(
    "curvature",
    "A row a measured whisk: how its object is curved, from the moments at successive pushing "
    "angles.",
    (
        TRIAL,
        WHISK,
        Column("angles", "how many pushing angles served"),
        *with_sigma("radius_mm", "radius of curvature in the whisking plane, felt"),
        Column("bar_radius_mm", "radius of the bar as stated"),
        *with_sigma("phi_0_deg", "slip angle at touch"),
        *with_sigma(
            "lateral_per_mm",
            "curvature in the sensing plane, by (23) to (25) with the exact φ; 0 of a straight bar",
            "lateral_sigma_per_mm",
        ),
        Column("lateral_printed_per_mm", "the same with (24) as printed"),
        status("what is missing"),
    ),
)
_FIRST_RAD = np.radians(
    0.95
)  # nearer to touch the window of a moment is shorter, and (10) mostly noise
_APART_RAD = np.radians(0.95)  # windows of half a degree to either side share no sample
_FEWEST = 6  # angles, for four numbers
_HELD_SIGMAS = 2.0  # a slip angle within so many of its own is none: 95 % of whisks that are held
# Of φ at touch: where it turns by more, terms to θ² are too few. Of nine pushes against a ball of 40 mm those within
# 0.65 are off by 1.8 sigma at most, from 0.75 on by 2 to 7 (tests/bench/analyses/test_curved.py).
_MOST_TURN = 0.6
TOO_FEW = f"needs moments at {_FEWEST} pushing angles a degree apart: push further"


@dataclass(frozen=True)
class Curved:
    """Of one whisk: the object's radius in the whisking plane, mm; φ at touch, rad; lateral curvature, 1/mm, by the
    exact form and by (24) as printed. NaN where it is not told, and why.
    """

    angles: int
    radius_mm: Value = UNKNOWN
    phi_0_rad: Value = UNKNOWN
    lateral_per_mm: Value = UNKNOWN
    lateral_printed_per_mm: float = np.nan
    status: str = ""


def curved(
    felt: Iterable[FeltAt], whisker: Whisker, alpha_rad: float, alpha_sigma_rad: float
) -> Curved:
    """What the moments of a whisk at successive pushing angles tell, at the first of these where φ turns far; α_est and
    its sigma in rad."""
    chosen = apart(felt)
    if len(chosen) < _FEWEST:
        return Curved(len(chosen), status=TOO_FEW)
    theta, moments = (
        np.array([at.theta_rad for at in chosen]),
        np.array([(at.m_y_Nmm.value, at.m_z_Nmm.value) for at in chosen]),
    )
    phis = np.arctan2(*moments.T)
    phi, phi_rate = _rate(theta, phis, [phi_sigma(at) for at in chosen])
    beam, held = whisker.beam, abs(phi.value) <= _HELD_SIGMAS * phi.sigma
    span = float(np.ptp(phis))
    if not held and span > _MOST_TURN * abs(phi.value) + _HELD_SIGMAS * phi.sigma:
        if len(chosen) > _FEWEST:
            return curved(chosen[:-1], whisker, alpha_rad, alpha_sigma_rad)
        return Curved(
            len(chosen),
            phi_0_rad=phi,
            status=f"phi turns by {np.degrees(span):.0f} degrees: too far",
        )
    distances = [_distance(at, alpha_rad, beam) for at in chosen]
    if not np.isfinite(distances).all():
        return Curved(
            len(chosen), phi_0_rad=phi, status="(10) has no distance at all of the angles"
        )
    d_x, creep = _rate(theta, *np.array(distances).T)
    turned = 0.0 if held else _turned(d_x.value, phi.value, phi_rate, alpha_rad)
    radius = _radius(
        d_x.value, creep, 0.0 if held else phi.value, (alpha_rad, alpha_sigma_rad), turned, whisker
    )
    if held:
        return Curved(
            len(chosen), radius, phi, status="does not slip sideways: no lateral curvature"
        )
    return Curved(len(chosen), radius, phi, *_lateral(phi.value, phi_rate, d_x.value, alpha_rad))


def apart(felt: Iterable[FeltAt]) -> list[FeltAt]:
    """Those whose moments share no sample."""
    chosen: list[FeltAt] = []
    for at in sorted(felt, key=lambda at: at.theta_rad):
        if at.theta_rad >= _FIRST_RAD and (
            not chosen or at.theta_rad - chosen[-1].theta_rad >= _APART_RAD
        ):
            chosen.append(at)
    return chosen


def _rate(theta: np.ndarray, values, sigmas) -> tuple[Value, Value]:
    """Value and rate at θ = 0 of what is felt at θ (n,): to second order, with a part that goes as 1/θ, as errors of
    touch and zero do. The sigmas also hold what is common to all angles."""
    design = (
        np.stack([np.ones_like(theta), theta, theta**2, 1 / theta], axis=1)
        / np.asarray(sigmas)[:, None]
    )
    found, *_ = np.linalg.lstsq(design, values / np.asarray(sigmas), rcond=None)
    spread = np.sqrt(np.diag(np.linalg.inv(design.T @ design)))
    return Value(float(found[0]), float(spread[0])), Value(float(found[1]), float(spread[1]))


def phi_sigma(at: FeltAt) -> float:
    """One sigma of φ by the moments, rad."""
    return slip_angle_sigma(at.m_y_Nmm.value, at.m_z_Nmm.value, at.covariance_at)


def _distance(at: FeltAt, alpha_rad: float, beam: Beam) -> tuple[float, float]:
    """(10) and its sigma by the moments alone, mm."""
    felt = at.theta_rad, at.m_y_Nmm.value, at.m_z_Nmm.value, alpha_rad, beam.C_Nmm2
    gradient = gradient_with_friction(*felt)
    cylinder = float(gradient[0] * at.theta_rad)  # ∂d/∂θ = d/θ
    d_x = float(beam.distance_mm(cylinder))
    by_moments = gradient[1:3] * (d_x / cylinder) ** 2
    return d_x, float(np.sqrt(by_moments @ at.covariance_at @ by_moments))


def _turned(d_x: float, phi: float, rate: Value, alpha_rad: float) -> float:
    """What (10) may change by with θ, mm/rad, because φ turns by more than an object's lean by hand and noise let it:
    by all of it where the object leans, by half of it the other way where it is curved to the side
    (`bench.analyses.turning_phi`, docs/maps.md)."""
    beta = min(abs(phi) + alpha_rad, 0.999 * RIGHT_ANGLE)
    by_hand = 0.5 * np.cos(beta) * np.tan(TILT_SIGMA_RAD)
    beyond = float(np.sqrt(max(rate.value**2 - rate.sigma**2 - by_hand**2, 0.0)))
    return float(d_x * beyond * np.sin(abs(phi)) / (np.cos(alpha_rad) * np.cos(beta)))


def _radius(
    d_x: float,
    creep: Value,
    phi: float,
    alpha: tuple[float, float],
    turned: float,
    whisker: Whisker,
) -> Value:
    """Of the object, from the change of (10) with θ, mm/rad; phi 0 where the contact is held."""
    left = whisker.beam.left(d_x)
    per_mm = float(first_order.rolling(1.0, 1.0, phi, alpha[0], 1.0, left))
    held = d_x * float(first_order.dragging(1.0, alpha[0])) if phi == 0 else 0.0
    by_alpha = 0.2 * d_x * alpha[1] * first_order.HELD_SHARE if phi == 0 else 0.0
    leaning = d_x * float(first_order.leaning(1.0, TILT_SIGMA_RAD, phi, alpha[0]))
    reach = (creep.value - first_order.HELD_SHARE * held) / per_mm
    others = np.array([creep.sigma, first_order.HELD_SPREAD * held, by_alpha, leaning, turned])
    return Value(reach - 0.5 * whisker.diameter_mm * left, float(np.linalg.norm(others / per_mm)))


def _lateral(phi: float, rate: Value, d_x: float, alpha_rad: float) -> tuple[Value, float]:
    """κ by the exact form, with its sigma, and by (24) as printed, 1/mm; one that leans turns φ by ½ θ cos β tan ψ."""
    exact, printed = (
        float(f(1.0, phi, alpha_rad)) / d_x
        for f in (curvature.curvature_of_slip, curvature.curvature_of_slip_printed)
    )
    leaning = 0.5 * np.cos(abs(phi) + alpha_rad) * np.tan(TILT_SIGMA_RAD)
    return Value(
        exact * rate.value, abs(exact) * float(np.hypot(rate.sigma, leaning))
    ), printed * rate.value


def curved_whisks(
    results: Iterable[TrialResult], whisker: Whisker, alpha_rad: float, alpha_sigma_rad: float
) -> list[tuple[TrialResult, FeltWhisk, Curved]]:
    """Of every measured whisk with moments of which nothing is doubtful."""
    return [
        (result, felt, curved(felt.by_theta, whisker, alpha_rad, alpha_sigma_rad))
        for result, seen, felt in whisks(results)
        if result.trial.purpose == "measure" and felt.has_moments and is_sound(seen, felt)
    ]


def write_curvature(out: Path, found: Sequence[tuple[TrialResult, FeltWhisk, Curved]]) -> None:
    """Write curvature.csv."""
    CURVATURE.write(out, (_row(*one) for one in found))


def _row(result: TrialResult, felt: FeltWhisk, c: Curved) -> dict:
    """Return the row of a whisk."""
    return {
        "trial": result.trial.name,
        "whisk": felt.whisk,
        "angles": c.angles,
        "radius_mm": c.radius_mm.value,
        "radius_sigma_mm": c.radius_mm.sigma,
        "bar_radius_mm": 0.5 * result.trial.bar_diameter_mm,
        "phi_0_deg": float(np.degrees(c.phi_0_rad.value)),
        "phi_0_sigma_deg": float(np.degrees(c.phi_0_rad.sigma)),
        "lateral_per_mm": c.lateral_per_mm.value,
        "lateral_sigma_per_mm": c.lateral_per_mm.sigma,
        "lateral_printed_per_mm": c.lateral_printed_per_mm,
        "status": c.status,
    }


def curved_lines(found: Sequence[tuple[TrialResult, FeltWhisk, Curved]]) -> Iterator[str]:
    """The mean radius beside the bar's own, and whisks whose object is curved to the side."""
    known = [
        (c.radius_mm.value - 0.5 * r.trial.bar_diameter_mm, c.radius_mm.sigma) for r, _, c in found
    ]
    off, sigma = np.array([pair for pair in known if np.isfinite(pair).all()]).reshape(-1, 2).T
    if len(off):
        weights = sigma**-2.0 / np.sum(sigma**-2.0)
        holds = 100.0 * np.mean(np.abs(off) < Z_95 * sigma)
        yield (
            f"radius of the object in the whisking plane, by successive contacts of {len(off)} whisks, less the bar's "
            f"own: {weights @ off:+.1f} ± {np.sum(sigma**-2.0) ** -0.5:.1f} mm, 95 % intervals hold in {holds:.0f} % "
            "(curvature.csv)"
        )
    for result, felt, c in found:
        if abs(c.lateral_per_mm.value) > Z_95 * c.lateral_per_mm.sigma:
            yield (
                f"{result.trial.name}, whisk {felt.whisk}: curved to the side by {c.lateral_per_mm.value:.4f} ± "
                f"{c.lateral_per_mm.sigma:.4f} 1/mm (Appendix B; {c.lateral_printed_per_mm:.4f} by (24) as printed), "
                "or it leans along the whisker"
            )
