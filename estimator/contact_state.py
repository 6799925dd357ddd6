"""The contact of an estimate: deflection and slip there, and the covariance with the distance.

Frame and signs are those of the sensing plane (y, z): d_y against the push, d_z along the surface's
rise. Angles in rad, moments in N·mm, lengths in mm.
"""

from dataclasses import dataclass, replace
from math import cos, nan, sqrt

import numpy as np

from estimator.beam import Beam
from estimator.numerics import RELATIVE_STEP, central_differences
from estimator.whisk import Estimate, Whisk


@dataclass(frozen=True)
class Contact:
    """Deflections d_y, d_z and slip at the pushing angle with their sigmas, mm.

    touch_covariance_mm_rad: covariance of the distance with the angle of touch. NaN where the
    estimate determines no contact.
    """

    d_y_mm: float
    d_y_sigma_mm: float
    d_z_mm: float
    d_z_sigma_mm: float
    slip_mm: float
    slip_sigma_mm: float
    touch_covariance_mm_rad: float


NO_CONTACT = Contact(nan, nan, nan, nan, nan, nan, nan)


def deflection(d_x: float, theta: float, m_y: float, m_z: float, beam: Beam) -> tuple[float, float]:
    """Return (d_y, d_z) of (18), (19), mm, of any whisker: m d_x d / C, d the distance as a
    cylinder.

    The whisker bends across itself, but the sensing plane is where it first touched: d_y gains
    1/cos θ.

    >>> deflection(50.0, 0.0, 1.8, 9.0, Beam(9000.0, 100.0))
    (2.5, 0.5)
    """
    per_moment = d_x * beam.as_cylinder_mm(d_x) / beam.C_Nmm2
    return per_moment * m_z / cos(theta), per_moment * m_y


def slip(d_x: float, theta: float, m_y: float, m_z: float, alpha: float) -> float:
    """Return σ of (5), mm, at the slope β = φ + α of (9): d_x θ sin φ / cos α."""
    return d_x * theta * m_y / sqrt(m_y * m_y + m_z * m_z) / cos(alpha)


def contact_of(whisk: Whisk, estimate: Estimate, alpha_sigma: float) -> Contact:
    """Return the contact of an estimate, its sigmas by first order from the whisk's angle and
    moments.

    The error of an estimate without a gradient is taken as independent; a variance beyond that of
    the gradient is the model's. A deflection that the estimate gives itself is kept.
    """
    d_x = estimate.d_x_mm
    beam = whisk.beam
    on_whisker = d_x > 0 and np.isfinite(beam.as_cylinder_mm(d_x * (1 + RELATIVE_STEP)))
    if not (on_whisker and estimate.sigma_mm > 0):
        return NO_CONTACT
    inputs = np.array([*whisk.felt, estimate.alpha_est_rad])
    error = _DistanceError.of(whisk, estimate, alpha_sigma)
    variances = error.variances(*_derivatives(d_x, inputs, beam))
    sigmas = np.sqrt(np.maximum(variances, 0.0)).tolist()
    d_y, d_z, slip_mm = _quantities(d_x, inputs, beam).tolist()
    touch_covariance = -float(error.gradient @ error.covariance[:, 0])
    contact = Contact(d_y, sigmas[0], d_z, sigmas[1], slip_mm, sigmas[2], touch_covariance)
    return _with_own_deflection(contact, estimate)


@dataclass(frozen=True, eq=False)
class _DistanceError:
    """Errors of the inputs θ, m_y, m_z and α_est, and of the distance with them and without.

    covariance (4, 4): of the inputs. gradient (4,): derivative of the distance by them, zero where
    the estimate has none. of_model: variance of the distance that is left, mm².
    """

    covariance: np.ndarray
    gradient: np.ndarray
    of_model: float

    @classmethod
    def of(cls, whisk: Whisk, estimate: Estimate, alpha_sigma: float) -> "_DistanceError":
        """Assemble the errors of an estimate; that of α_est is independent of the others."""
        covariance = np.zeros((4, 4))
        covariance[:3, :3] = whisk.felt_covariance
        covariance[3, 3] = alpha_sigma**2
        gradient = np.zeros(4)
        if estimate.gradient is not None:
            gradient = np.array(estimate.gradient, dtype=float)
        of_model = max(estimate.sigma_mm**2 - gradient @ covariance @ gradient, 0.0)
        return cls(covariance, gradient, of_model)

    def variances(self, by_d_x: np.ndarray, by_input: np.ndarray) -> np.ndarray:
        """Compute variances (3,) of quantities from their derivatives by distance (3,) and inputs
        (3, 4).
        """
        rows = by_input + np.outer(by_d_x, self.gradient)  # d_x as a function of the inputs
        by_inputs = np.einsum("ij,jk,ik->i", rows, self.covariance, rows)
        return by_inputs + by_d_x**2 * self.of_model


def _with_own_deflection(contact: Contact, estimate: Estimate) -> Contact:
    """Return the contact with the deflection that the estimate gives itself, if it does."""
    if estimate.deflection_mm is None:
        return contact
    d_y, d_z = estimate.deflection_mm
    d_y_sigma, d_z_sigma = estimate.deflection_sigma_mm
    return replace(contact, d_y_mm=d_y, d_z_mm=d_z, d_y_sigma_mm=d_y_sigma, d_z_sigma_mm=d_z_sigma)


def _quantities(d_x: float, inputs: np.ndarray, beam: Beam) -> np.ndarray:
    """Compute d_y, d_z and slip (3,), mm, from the inputs θ, m_y, m_z and α_est."""
    theta, m_y, m_z, alpha = inputs.tolist()
    return np.array([*deflection(d_x, theta, m_y, m_z, beam), slip(d_x, theta, m_y, m_z, alpha)])


def _derivatives(d_x: float, inputs: np.ndarray, beam: Beam) -> tuple[np.ndarray, np.ndarray]:
    """Differentiate `_quantities` by d_x (3,) and by θ, m_y, m_z and α_est (3, 4)."""
    moment = np.hypot(inputs[1], inputs[2])
    sizes = np.array([d_x, inputs[0], moment, moment, 1.0])

    def quantities(d_x_and_inputs: np.ndarray) -> np.ndarray:
        """Compute the quantities (3,) from the distance and the inputs (5,)."""
        return _quantities(d_x_and_inputs[0], d_x_and_inputs[1:], beam)

    derivatives = central_differences(quantities, np.append(d_x, inputs), RELATIVE_STEP * sizes)
    return derivatives[:, 0], derivatives[:, 1:]
