"""Continuous profile: the shape of a flexible whisker from force and moment at its base, up to the contact.

Scholz and Rahn [21] sweep a whisker on a load cell along an object and integrate its elastica at each instant:
the contact is where the moment vanishes. Their equations are not at hand. These are derived here from the
equilibrium of a beam without weight. In the plane of bending let x be along the clamped tangent, w the way back
from there, ψ the tangent's angle, f and f_x the base's force on the whisker against w and along x:

    M = |m| − x f − w f_x,   dψ/ds = M/EI(s),   dM/ds = −(f cos ψ + f_x sin ψ).

M falls all along the whisker, so that the integral is over M, from |m| at the base to 0 at the contact. Neither
slope nor friction nor the angle of touch enters. Angles in rad, lengths in mm.
"""

import numpy as np

from estimator import load_cell
from estimator.beam import Beam
from estimator.numerics import differences, runge_kutta, steps_each_way
from estimator.reasons import NamedReason

# [1] Steps of Runge and Kutta's fourth order from base to contact: twice as many move a contact at 20° by less than
# 2e-6 of its distance (tests/estimator/test_profile.py). Derived.
_STEPS = 24
# [1] Of moment and force: steps of the derivatives. Central differences err by its square. Stated.
_DIFFERENCE = 1e-5
NO_END = NamedReason("moment_does_not_vanish", "the moment does not fall to zero along the whisker")
CURVED = NamedReason("curved_unloaded", "the elastica is of a whisker that is straight unloaded")


def _bent_end(
    moment_Nmm: np.ndarray, across_N: np.ndarray, along_N: np.ndarray, beam: Beam
) -> np.ndarray:
    """Integrate the whisker's shape from base to contact, where the moment has fallen to none.

    moment_Nmm, across_N, along_N (n,): |m|, f and f_x. Returns (4, n): arc s, x and w, mm, and ψ, rad, of the
    contact. NaN where the moment does not fall, or not within the length.
    """
    fall = moment_Nmm / _STEPS

    def gain(place: float, shape: np.ndarray) -> np.ndarray:
        """Return what a shape (4, n) gains while the moment falls by a step."""
        moment = moment_Nmm - place * fall
        rates = _rates(moment, shape, across_N=across_N, along_N=along_N, beam=beam)
        return -fall * rates

    with np.errstate(all="ignore"):
        return runge_kutta(gain, np.zeros((4, len(moment_Nmm))), _STEPS)


def _rates(
    moment: np.ndarray,
    shape: np.ndarray,
    *,
    across_N: np.ndarray,
    along_N: np.ndarray,
    beam: Beam,
) -> np.ndarray:
    """Return the derivatives (4, n) of the shape by the moment; NaN where it does not fall."""
    arc, _, _, slope = shape
    per_arc = across_N * np.cos(slope) + along_N * np.sin(slope)
    per_arc = np.where((per_arc > 0) & (arc <= beam.length_mm), per_arc, np.nan)
    bend = moment / (beam.rigidity_Nmm2 * beam.width(arc / beam.length_mm) ** 4)
    return -np.stack([np.ones_like(arc), np.cos(slope), np.sin(slope), bend]) / per_arc


def contact_in_hub(felt: np.ndarray, beam: Beam) -> np.ndarray:
    """Compute the contact (n, 3) in the hub's axes, mm, from m_y, m_z, f_x, f_y, f_z (n, 5); NaN where none is."""
    m_y, m_z, f_x, f_y, f_z = felt.T
    moment = np.hypot(m_y, m_z)
    across = load_cell.across(m_y, m_z, f_y, f_z)
    _, x, back, _ = _bent_end(moment, across, f_x, beam)
    y = -back * m_z / moment
    z = back * m_y / moment
    return np.stack([x, y, z], axis=-1)


def contact(
    moments_Nmm: np.ndarray,
    moment_covariance: np.ndarray,
    force_N: np.ndarray,
    force_covariance: np.ndarray,
    beam: Beam,
) -> tuple[np.ndarray, np.ndarray, str]:
    """Return the contact (3,) in the hub's axes, mm, its covariance (3, 3), and why there is none, else "".

    moments_Nmm (2,): m_y and m_z; force_N (3,): of the base on the whisker; with their covariances.
    """
    felt = np.concatenate([moments_Nmm, force_N])
    why_not = CURVED if beam.is_curved else load_cell.why_not(*felt)
    if why_not:
        return np.full(3, np.nan), np.full((3, 3), np.nan), why_not
    point, gradient = _contact_with_gradient(felt, beam)
    by_moments = gradient[:, :2] @ moment_covariance @ gradient[:, :2].T
    by_forces = gradient[:, 2:] @ force_covariance @ gradient[:, 2:].T
    return point, by_moments + by_forces, "" if np.isfinite(point).all() else NO_END


def _contact_with_gradient(felt: np.ndarray, beam: Beam) -> tuple[np.ndarray, np.ndarray]:
    """Return the contact (3,) by what is felt (5,), and its derivatives (3, 5) by that."""
    moment = np.hypot(felt[0], felt[1])
    force = np.linalg.norm(felt[2:])
    steps = _DIFFERENCE * np.array([moment, moment, force, force, force])
    points = contact_in_hub(felt + steps_each_way(steps), beam)
    return points[0], differences(points.T, steps)
