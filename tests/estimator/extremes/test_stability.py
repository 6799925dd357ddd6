"""Every equation against mpmath at 50 digits, over the extremes of its domain.

Run as a script it prints the worst error of each function, in units of ε max(1, κ):

    python tests/estimator/extremes/test_stability.py --samples 3000

The bound is 8 ε max(1, κ), ε = 2⁻⁵². κ = Σ |x ∂f/∂x| / |f| over all inputs is what an error of ε in each of them
would do to the result, so no algorithm in float64 can promise much better. On a kink the larger one-sided κ counts.
Where the exact value is 0 the function must return exactly 0.

The oracle follows the printed equations, with tan and cot, in 50 digits; it shares no formula with the package.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import mpmath as mp
import numpy as np
import pytest

from estimator import compliance, curvature, distance, slip

EPSILON = 2.0**-52
BOUND = 8.0
STEP = mp.mpf(10) ** -30
SMALLEST, LARGEST = 1e-290, 1e308  # between these the result is a normal number

mp.mp.dps = 70  # 50 digits remain after the differences that make κ


# ---------------------------------------------------------------- the oracle: the paper's formulas as printed


def phi_of(beta, alpha):
    return max(mp.mpf(0), beta - alpha)


def m_z(d_x, theta, beta, alpha, C):  # (13)
    return C * theta / d_x / (mp.tan(beta) * mp.tan(phi_of(beta, alpha)) + 1)


def m_y(d_x, theta, beta, alpha, C):  # (14)
    phi = phi_of(beta, alpha)
    return C * theta / d_x / (mp.tan(beta) + mp.cot(phi)) if phi else mp.mpf(0)


def magnitude(*arguments):
    return mp.sqrt(m_y(*arguments) ** 2 + m_z(*arguments) ** 2)


def slid(d_x, theta, beta, alpha):  # (5)
    phi = phi_of(beta, alpha)
    return d_x * theta / (mp.sin(beta) + mp.cos(beta) * mp.cot(phi)) if phi else mp.mpf(0)


def known_slope(theta, y, z, beta, C):  # (6)
    return C * theta / (z + y * mp.tan(beta))


def assumed_friction(theta, y, z, alpha, C):  # (8), (9), (10)
    return C * theta / (z + y * mp.tan(mp.atan(y / z) + alpha))


def cone(theta, y, z, alpha, C, length):  # (17) at the scaled angle
    phi = mp.atan(y / z)
    scaled = theta * mp.cos(phi + alpha) / mp.cos(alpha)
    return C * scaled * length / (C * scaled + mp.sqrt(y * y + z * z) * length)


def cone_printed(theta, y, z, C, length):  # (17)
    m = mp.sqrt(y * y + z * z)
    return C * theta * length / (C * theta + m * length) * z / m


def circle(r_n, theta, beta):  # (25)–(28), (32)
    y_c, z_c = r_n * mp.cos(beta), r_n * mp.sin(beta)
    return y_c, z_c, mp.atan2(z_c, y_c - theta), mp.sqrt((y_c - theta) ** 2 + z_c**2)


def appendix_b(r_n, theta, beta, alpha, printed):  # (24), (31)
    _, _, zeta, p = circle(r_n, theta, beta)
    exact = zeta - mp.asin(r_n * mp.sin(alpha) / p) if beta > alpha else mp.mpf(0)
    phi = max(mp.mpf(0), zeta - alpha) if printed else exact
    d = mp.sqrt(r_n**2 - p**2 / 2 * (1 - mp.cos(2 * (zeta - phi)))) - p * mp.cos(zeta - phi)
    return phi, d


def two_distances(c_1, c_2, shift, C):  # section VII, with k_theta = d/C + 1/(k d²) at both places
    def excess(d):
        return (C * c_1 - d) * d**2 - (C * c_2 - d - shift) * (d + shift) ** 2

    a = [excess(mp.mpf(i)) for i in range(3)]
    square = (a[2] - 2 * a[1] + a[0]) / 2
    linear = a[1] - a[0] - square
    root = mp.sqrt(linear**2 - 4 * square * a[0])
    return max((-linear + root) / (2 * square), (-linear - root) / (2 * square))


# ---------------------------------------------------------------- where they are tried


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
    return min(angle_of(rng, 90.0), float(np.radians(90 - 1e-9) if rng.integers(2) else np.pi / 2 - 1e-9))


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


def any_float(rng):
    """Any positive float, subnormal ones too."""
    return float(np.ldexp(rng.uniform(1, 2), int(rng.integers(-1070, 1000))))


def far_out(rng):
    """Moments from anywhere in float64, with a C that brings the distance back to where it is a float."""
    z, alpha = any_float(rng), angle_of(rng, 89.0)
    y = min(any_float(rng), 0.5 * z / max(np.tan(alpha), 1.0))
    C = float(np.clip(z * log_uniform(rng, 1e-3, 1e3), 1e-300, 1e300))
    return theta_of(rng), float(y), z, alpha, C


def contact_far_out(rng):
    beta, alpha = slope_and_friction(rng)
    return any_float(rng), theta_of(rng), beta, alpha, any_float(rng)


def deflected(rng):
    d_x, theta = log_uniform(rng, 1e-3, 1e4), theta_of(rng)
    return d_x, theta, d_x * theta * (1 - log_uniform(rng, 1e-12, 0.99)), d_x * log_uniform(rng, 1e-12, 0.3)


def soft_object(rng):
    """Compliances at two distances of an object of some stiffness."""
    C, d, shift = rigidity(rng), log_uniform(rng, 1e-1, 1e4), log_uniform(rng, 1e-2, 1e3)
    give = log_uniform(rng, 1e-6, 10) * d**3 / C
    return d / C + give / d**2, (d + shift) / C + give / (d + shift) ** 2, shift, C


def two_samples(rng):
    angle, moment = theta_of(rng), log_uniform(rng, 1e-9, 1e9)
    return angle, angle * (1 + log_uniform(rng, 1e-6, 10)), moment, moment * (1 + log_uniform(rng, 1e-6, 10))


# ---------------------------------------------------------------- the cases


@dataclass(frozen=True)
class Case:
    """A function, its exact counterpart, and where to draw arguments from."""

    name: str
    computed: Callable
    exact: Callable
    draw: Callable


def _nth(function, n):
    return lambda *arguments: function(*arguments)[n]


def _with_settings(draw, *more):
    return lambda rng: (*draw(rng), *(extra(rng) for extra in more))


def _cone_nu(theta, m, C, length):
    return C * theta * length / (C * theta + m * length)


CASES = [
    Case("slip_angle (4)", slip.slip_angle, phi_of, slope_and_friction),
    Case("m_z (13)", _nth(slip.moments, 1), m_z, _with_settings(contact, rigidity)),
    Case("m_y (14)", _nth(slip.moments, 0), m_y, _with_settings(contact, rigidity)),
    Case("|m|", slip.moment_magnitude, magnitude, _with_settings(contact, rigidity)),
    Case("slip_distance (5)", slip.slip_distance, slid, contact),
    Case(
        "m_z (18)",
        _nth(slip.moment_from_deflection, 1),
        lambda d_x, d_y, d_z, C: C * d_y / d_x**2,
        lambda rng: (*(log_uniform(rng, 1e-6, 1e4) for _ in range(3)), rigidity(rng)),
    ),
    Case(
        "beta (20)",
        _nth(slip.slope_from_deflection, 0),
        lambda d_x, theta, d_y, d_z: mp.atan((d_x * theta - d_y) / d_z),
        deflected,
    ),
    Case(
        "phi (21)",
        _nth(slip.slope_from_deflection, 1),
        lambda d_x, theta, d_y, d_z: mp.atan(d_z / d_y),
        deflected,
    ),
    Case(
        "rotational_compliance (1)",
        lambda a, b, m, n: distance.rotational_compliance([a, b], [m, n]),
        lambda a, b, m, n: (b - a) / (n - m),
        two_samples,
    ),
    Case(
        "no_slip (2)",
        distance.no_slip,
        lambda theta, z, C: C * theta / z,
        lambda rng: (theta_of(rng), log_uniform(rng, 1e-12, 1e12), rigidity(rng)),
    ),
    Case(
        "known_slope (6)",
        distance.known_slope,
        known_slope,
        lambda rng: (theta_of(rng), *moments_of(rng), beta_of(rng), rigidity(rng)),
    ),
    Case("phi (8)", distance.felt_slip_angle, lambda y, z: mp.atan(y / z), moments_of),
    Case(
        "beta_est (9)",
        distance.estimated_slope,
        lambda y, z, alpha: mp.atan(y / z) + alpha,
        lambda rng: (lambda alpha: (*moments_of(rng, alpha), alpha))(angle_of(rng, 89.0)),
    ),
    Case("with_friction (10)", distance.with_friction, assumed_friction, pushed),
    Case("with_friction (10), any float", distance.with_friction, assumed_friction, far_out),
    Case("m_z (13), any float", _nth(slip.moments, 1), m_z, contact_far_out),
    Case(
        "frictionless_sum (11)",
        distance.frictionless_sum,
        lambda theta, y, z, C: C * theta / (z + y**2 / z),
        lambda rng: (theta_of(rng), *moments_of(rng), rigidity(rng)),
    ),
    Case(
        "frictionless (12)",
        distance.frictionless,
        lambda theta, y, z, C: C * theta / mp.hypot(y, z) * mp.cos(mp.atan(y / z)),
        lambda rng: (theta_of(rng), *moments_of(rng), rigidity(rng)),
    ),
    Case(
        "general (16) on a cone",
        lambda theta, y, z, alpha, C, length: distance.general(
            theta, y, z, alpha, lambda t, m: distance.cone_no_slip(t, m, C, length)
        ),
        cone,
        _with_settings(pushed, rigidity),
    ),
    Case("cone (17), scaled angle", distance.cone, cone, _with_settings(pushed, rigidity)),
    Case(
        "cone (17) as printed",
        distance.cone_printed,
        cone_printed,
        lambda rng: (theta_of(rng), *moments_of(rng), rigidity(rng), rigidity(rng)),
    ),
    Case("zeta (25)", curvature.virtual_angle, lambda *a: circle(*a)[2], lambda rng: curved(rng)[:3]),
    Case("p (32)", curvature.virtual_radius, lambda *a: circle(*a)[3], lambda rng: curved(rng)[:3]),
    Case("phi exact", curvature.slip_angle, lambda *a: appendix_b(*a, False)[0], curved),
    Case("phi (24) as printed", curvature.slip_angle_printed, lambda *a: appendix_b(*a, True)[0], curved),
    Case("d (31) exact", curvature.deflection, lambda *a: appendix_b(*a, False)[1], curved),
    Case("d (31) as printed", curvature.deflection_printed, lambda *a: appendix_b(*a, True)[1], curved),
    Case(
        "m_z (22) exact",
        _nth(curvature.moments, 1),
        lambda *a: (lambda phi, d: d * mp.cos(phi))(*appendix_b(*a, False)),
        curved,
    ),
    Case(
        "m_y (22) as printed",
        _nth(curvature.moments_printed, 0),
        lambda *a: (lambda phi, d: d * mp.sin(phi))(*appendix_b(*a, True)),
        curved,
    ),
    Case("distance on a soft object", _nth(compliance.two_distances, 0), two_distances, soft_object),
]


# ---------------------------------------------------------------- the measure


def condition(exact, arguments, value):
    """κ, the larger of its one-sided values."""
    sides = []
    for sign in (1, -1):
        total = mp.mpf(0)
        for i, x in enumerate(arguments):
            if x:
                step = sign * x * STEP
                moved = exact(*arguments[:i], x + step, *arguments[i + 1 :])
                total += abs((moved - value) / STEP)
        sides.append(total / abs(value))
    return max(sides)


def error_in_bounds(case, arguments):
    """Relative error over ε max(1, κ); 0 for an exact 0, infinite where the function gives another or no number."""
    computed = case.computed(*arguments)
    inputs = [mp.mpf(x) for x in arguments]
    exact = case.exact(*inputs)
    if exact == 0:
        return 0.0 if computed == 0 else float("inf")
    if not SMALLEST < abs(exact) < LARGEST:
        return 0.0
    if not np.isfinite(computed):
        return float("inf")
    error = abs(mp.mpf(computed) - exact) / abs(exact)
    return float(error / (EPSILON * max(1, condition(case.exact, inputs, exact))))


def worst(case, samples, seed=20080923):
    """(largest error in units of ε max(1, κ), the arguments that gave it)."""
    rng = np.random.default_rng(seed)
    tried = [case.draw(rng) for _ in range(samples)]
    errors = [error_in_bounds(case, arguments) for arguments in tried]
    return max(zip(errors, tried), key=lambda pair: pair[0])


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_error_stays_within_eight_epsilon_of_the_condition(case):
    error, arguments = worst(case, samples=150)
    assert error <= BOUND, arguments


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=20080923)
    options = parser.parse_args()
    print(f"worst error over {options.samples} samples, in units of epsilon max(1, kappa); the bound is {BOUND:g}")
    for case in CASES:
        print(f"{case.name:32s} {worst(case, options.samples, options.seed)[0]:8.3f}")


if __name__ == "__main__":
    main()
