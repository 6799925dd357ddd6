"""Arguments over the extremes of each function's domain."""

import mpmath as mp
import numpy as np

from tests.estimator.extremes.oracle import appendix_b, circle


def log_uniform(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def theta_of(rng):
    return log_uniform(rng, 1e-12, 0.35)


def angle_of(rng, top_deg):
    """From 0 to `top_deg`, crowded at both ends."""
    top = np.radians(top_deg)
    choice = rng.integers(5)
    if choice == 0:
        return float(rng.choice([0.0, top]))
    if choice == 1:
        return log_uniform(rng, 1e-12, top)
    if choice == 2:
        return float(top - log_uniform(rng, 1e-14, top))
    return float(rng.uniform(0, top))


def beta_of(rng):
    return min(
        angle_of(rng, 90.0), float(np.radians(90 - 1e-9) if rng.integers(2) else np.pi / 2 - 1e-9)
    )


def slope_and_friction(rng):
    """β and α, one time in three so close together that their difference is next to nothing."""
    alpha = angle_of(rng, 89.999)
    beta = beta_of(rng)
    if rng.integers(3) == 0:
        beta = alpha + float(rng.choice([0.0, 1.0, -1.0])) * log_uniform(rng, 1e-17, 1e-6)
    return float(np.clip(beta, 0.0, np.pi / 2 - 1e-9)), alpha


def moments_of(rng, alpha=0.0):
    """m_y, m_z with ratios from 0 to 1e12 of each other, where φ + α leaves room for a distance."""
    z = log_uniform(rng, 1e-6, 1e6)
    ratio = float(rng.choice([0.0, log_uniform(rng, 1e-12, 1e12), log_uniform(rng, 0.1, 10)]))
    if rng.integers(3) == 0 and alpha > 0:
        ratio = (1 - log_uniform(rng, 1e-14, 1)) / np.tan(alpha)
    y = ratio * z
    return (y, z) if mp.mpf(z) > mp.tan(mp.mpf(alpha)) * mp.mpf(y) else (0.0, z)


def contact(rng):
    beta, alpha = slope_and_friction(rng)
    return log_uniform(rng, 1e-3, 1e4), theta_of(rng), beta, alpha


def curved(rng):
    beta, alpha = slope_and_friction(rng)
    while True:
        r_n, theta = log_uniform(rng, 1e-3, 1e9), theta_of(rng)
        if rng.integers(4) == 0:
            theta = min(2 * r_n * np.cos(beta) * (1 - log_uniform(rng, 1e-12, 1)), 0.35)
        arguments = [mp.mpf(x) for x in (r_n, theta, beta, alpha)]
        if arguments[1] < 2 * circle(*arguments[:3])[0]:
            phis = [appendix_b(*arguments, printed)[0] for printed in (True, False)]
            if max(phis) < mp.pi / 2 - mp.mpf(10) ** -12:
                return r_n, theta, beta, alpha
        beta = beta * rng.uniform(0.2, 1)


def rigidity(rng):
    return log_uniform(rng, 1e-3, 1e9)


def pushed(rng):
    alpha = angle_of(rng, 89.999)
    return (theta_of(rng), *moments_of(rng, alpha), alpha, rigidity(rng))


def deflected(rng):
    d_x, theta = log_uniform(rng, 1e-3, 1e4), theta_of(rng)
    return (
        d_x,
        theta,
        d_x * theta * (1 - log_uniform(rng, 1e-12, 0.99)),
        d_x * log_uniform(rng, 1e-12, 0.3),
    )


def soft_object(rng):
    """Compliances at two distances of an object of some stiffness."""
    C, d, shift = rigidity(rng), log_uniform(rng, 1e-1, 1e4), log_uniform(rng, 1e-2, 1e3)
    give = log_uniform(rng, 1e-6, 10) * d**3 / C
    return d / C + give / d**2, (d + shift) / C + give / (d + shift) ** 2, shift, C


def two_samples(rng):
    angle, moment = theta_of(rng), log_uniform(rng, 1e-9, 1e9)
    return (
        angle,
        angle * (1 + log_uniform(rng, 1e-6, 10)),
        moment,
        moment * (1 + log_uniform(rng, 1e-6, 10)),
    )
