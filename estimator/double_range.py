"""Products and quotients of the distance's equations, within the range of doubles wherever their
result is.

Numbers near one and powers of two go separate ways (frexp, ldexp): C, the moments and their squares
may be doubles where an intermediate product of the equation is none. So no distance that a double
holds is lost on the way. All take arrays of float64 that broadcast: angles in rad, moments in N·mm,
C in N·mm², lengths in mm.
"""

import numpy as np

from estimator.domain import quotient


def _exponent(x):
    """Return the power of two that brings x near one; far below all others for zero."""
    return np.where(x == 0, -9999, np.frexp(x)[1])


def over_common_power(
    m_y: np.ndarray, m_z: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scale m_y and m_z by the power of two that brings the larger near one; return its exponent,
    too.
    """
    exponent = np.maximum(_exponent(m_y), _exponent(m_z))
    return np.ldexp(m_y, -exponent), np.ldexp(m_z, -exponent), exponent


def friction_share(
    m_y: np.ndarray, m_z: np.ndarray, alpha_est: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return m_z − μ|m_y| with μ = tan α_est as a number near one and an exponent of two."""
    across, across_power = np.frexp(m_z)
    along, along_power = np.frexp(np.abs(m_y))
    drag = np.tan(alpha_est) * along
    exponent = np.where(drag == 0, across_power, np.maximum(across_power, along_power))
    across = np.ldexp(across, across_power - exponent)
    drag = np.ldexp(drag, along_power - exponent)
    return across - drag, exponent


def across_slope(
    m_y: np.ndarray, m_z: np.ndarray, beta: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return m_z cos β + m_y sin β as a number near one and an exponent of two."""
    m_y, m_z, exponent = over_common_power(m_y, m_z)
    return m_z * np.cos(beta) + m_y * np.sin(beta), exponent


def by_slope(
    theta: np.ndarray, m_y: np.ndarray, m_z: np.ndarray, beta: np.ndarray, C: np.ndarray
) -> np.ndarray:
    """Return Cθ cos β / (m_z cos β + m_y sin β), the d_x of (6)."""
    across, exponent = across_slope(m_y, m_z, beta)
    return quotient((C, theta, np.cos(beta)), (across,), -exponent)


def by_friction(
    theta: np.ndarray, m_y: np.ndarray, m_z: np.ndarray, alpha_est: np.ndarray, C: np.ndarray
) -> np.ndarray:
    """Return Cθ (m_z − μ|m_y|) / (m_z² + m_y²) with μ = tan α_est, the d_x of (10)."""
    share, share_exponent = friction_share(m_y, m_z, alpha_est)
    m_y, m_z, exponent = over_common_power(m_y, m_z)
    square = m_z * m_z + m_y * m_y
    return quotient((C, theta, share), (square,), share_exponent - 2 * exponent)


def harmonic(d_x: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Return 1 / (1/d_x + 1/L) without leaving the range of float64, even where d_x does."""
    shorter = np.minimum(d_x, length)
    longer = np.maximum(d_x, length)
    return shorter / (1 + shorter / longer)
