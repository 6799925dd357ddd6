"""The contact that an estimate amounts to: deflection and slip there, and how they and the distance err together.

Frame and signs are those of the sensing plane (y, z): d_y against the push, d_z along the surface's rise. Angles in
rad, moments in N·mm, lengths in mm.
"""

from dataclasses import dataclass, replace
from math import cos, nan, sqrt

import numpy as np

from estimator.beam import Beam
from estimator.whisk import Estimate, Whisk

_STEP = 1e-6  # relative, of central differences


@dataclass(frozen=True)
class Contact:
    """Deflections d_y, d_z and slip at the pushing angle with their sigmas, mm; the covariance of the distance with the
    angle of touch, mm·rad. NaN where the estimate tells none."""

    d_y_mm: float
    d_y_sigma_mm: float
    d_z_mm: float
    d_z_sigma_mm: float
    slip_mm: float
    slip_sigma_mm: float
    touch_covariance_mm_rad: float


NO_CONTACT = Contact(*(nan,) * 7)


def deflection(d_x: float, theta: float, m_y: float, m_z: float, beam: Beam) -> tuple[float, float]:
    """(d_y, d_z) of (18), (19), mm, of any whisker: m d_x d / C, d the distance on its base's cylinder.

    The whisker bends across itself, the sensing plane stands where it first touched: d_y gains 1/cos θ.

    >>> deflection(50.0, 0.0, 1.8, 9.0, Beam(9000.0, 100.0))
    (2.5, 0.5)
    """
    per_moment = d_x * beam.as_cylinder_mm(d_x) / beam.C_Nmm2
    return per_moment * m_z / cos(theta), per_moment * m_y


def slip(d_x: float, theta: float, m_y: float, m_z: float, alpha: float) -> float:
    """σ of (5), mm, at the slope β = φ + α of (9): d_x θ sin φ / cos α."""
    return d_x * theta * m_y / sqrt(m_y * m_y + m_z * m_z) / cos(alpha)


def contact_of(whisk: Whisk, estimate: Estimate, alpha_sigma: float) -> Contact:
    """The contact of an estimate, by first order from what the whisk says of its angle and moments.

    An estimate without a gradient is taken to err on its own; what a sigma holds beyond the gradient is the model's. A
    deflection that the estimate gives itself stands.
    """
    on_whisker = estimate.d_x_mm > 0 and np.isfinite(
        whisk.beam.as_cylinder_mm(estimate.d_x_mm * (1 + _STEP))
    )
    if not (on_whisker and estimate.sigma_mm > 0):
        return NO_CONTACT
    inputs = np.array(
        [whisk.theta_at_rad, whisk.m_y_at_Nmm, whisk.m_z_at_Nmm, estimate.alpha_est_rad]
    )
    covariance = _covariance(whisk, alpha_sigma)
    gradient = (
        np.zeros(4) if estimate.gradient is None else np.array(estimate.gradient, dtype=float)
    )
    of_model = max(estimate.sigma_mm**2 - gradient @ covariance @ gradient, 0.0)
    values = _quantities(estimate.d_x_mm, inputs, whisk.beam)
    by_d_x, by_input = _derivatives(estimate.d_x_mm, inputs, whisk.beam)
    rows = by_input + np.outer(by_d_x, gradient)
    variances = np.einsum("ij,jk,ik->i", rows, covariance, rows) + by_d_x**2 * of_model
    sigmas = np.sqrt(np.maximum(variances, 0.0))
    pairs = (float(number) for pair in zip(values, sigmas) for number in pair)
    found = Contact(*pairs, -float(gradient @ covariance[:, 0]))
    if estimate.deflection_mm is None:
        return found
    (d_y, d_z), (d_y_sigma, d_z_sigma) = estimate.deflection_mm, estimate.deflection_sigma_mm
    return replace(found, d_y_mm=d_y, d_z_mm=d_z, d_y_sigma_mm=d_y_sigma, d_z_sigma_mm=d_z_sigma)


def _covariance(whisk: Whisk, alpha_sigma: float) -> np.ndarray:
    """Covariance (4, 4) of θ, m_y, m_z and α_est."""
    whole = np.zeros((4, 4))
    whole[0, 0], whole[3, 3] = whisk.theta_sigma_rad**2, alpha_sigma**2
    whole[1:3, 1:3] = whisk.covariance_at
    whole[0, 1:3] = whole[1:3, 0] = whisk.theta_moment_covariance_at
    return whole


def _quantities(d_x: float, inputs: np.ndarray, beam: Beam) -> np.ndarray:
    """d_y, d_z and slip (3,)."""
    theta, m_y, m_z, alpha = inputs.tolist()
    return np.array([*deflection(d_x, theta, m_y, m_z, beam), slip(d_x, theta, m_y, m_z, alpha)])


def _derivatives(d_x: float, inputs: np.ndarray, beam: Beam) -> tuple[np.ndarray, np.ndarray]:
    """Of `_quantities` by d_x (3,) and by θ, m_y, m_z and α_est (3, 4)."""
    steps = _STEP * np.array([d_x, inputs[0], *[np.hypot(*inputs[1:3])] * 2, 1.0])
    columns = [
        (
            _quantities(d_x + shift[0], inputs + shift[1:], beam)
            - _quantities(d_x - shift[0], inputs - shift[1:], beam)
        )
        / (2 * shift.sum())
        for shift in np.diag(steps)
    ]
    return columns[0], np.stack(columns[1:], axis=1)
