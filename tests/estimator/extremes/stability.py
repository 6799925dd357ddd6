"""Every equation against mpmath at 50 digits, over the extremes of its domain.

Run as a script it prints the worst error of each function, in units of ε max(1, κ):

    python tests/estimator/extremes/stability.py --samples 3000

The bound is 8 ε max(1, κ), ε = 2⁻⁵². κ = Σ |x ∂f/∂x| / |f| over all inputs is what an error of ε in each of them
would do to the result, so no algorithm in float64 can promise much better. On a kink the larger one-sided κ counts.
Where the exact value is 0 the function must return exactly 0.

The oracle follows the printed equations, with tan and cot, in 50 digits; it shares no formula with the package.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mpmath as mp
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from estimator import compliance, curvature, distance, slip
from estimator.beam import Beam
from tests.estimator.extremes.draws import (
    angle_of,
    beta_of,
    contact,
    curved,
    deflected,
    log_uniform,
    moments_of,
    pushed,
    rigidity,
    slope_and_friction,
    soft_object,
    theta_of,
    two_samples,
)
from tests.estimator.extremes.oracle import (
    appendix_b,
    assumed_friction,
    circle,
    cone,
    cone_printed,
    known_slope,
    m_y,
    m_z,
    magnitude,
    phi_of,
    slid,
    two_distances,
)

EPSILON = 2.0**-52
BOUND = 8.0
STEP = mp.mpf(10) ** -30
SMALLEST, LARGEST = 1e-290, 1e308  # between these the result is a normal number


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


def _cone_without_slip(C, length):
    beam = Beam(C, length, "cone")
    return lambda theta, m: beam.distance_mm(C * theta / m)


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
    Case(
        "frictionless (11)",
        distance.frictionless,
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
            theta, y, z, alpha, _cone_without_slip(C, length)
        ),
        cone,
        _with_settings(pushed, rigidity),
    ),
    Case(
        "cone (17), by (10)",
        lambda theta, y, z, alpha, C, length: Beam(C, length, "cone").distance_mm(
            distance.with_friction(theta, y, z, alpha, C)
        ),
        cone,
        _with_settings(pushed, rigidity),
    ),
    Case(
        "cone (17) as printed",
        lambda theta, y, z, C, length: distance.general_printed(
            theta, y, z, _cone_without_slip(C, length)
        ),
        cone_printed,
        lambda rng: (theta_of(rng), *moments_of(rng), rigidity(rng), rigidity(rng)),
    ),
    Case(
        "zeta (25)",
        lambda r_n, theta, beta: beta + curvature.virtual_turn(theta / r_n, beta),
        lambda *a: circle(*a)[2],
        lambda rng: curved(rng)[:3],
    ),
    Case(
        "p (32)",
        lambda r_n, theta, beta: r_n * curvature.virtual_radius(theta / r_n, beta),
        lambda *a: circle(*a)[3],
        lambda rng: curved(rng)[:3],
    ),
    Case("phi (23) exact", _nth(curvature.exact, 0), lambda *a: appendix_b(*a, False)[0], curved),
    Case("phi (24)", _nth(curvature.printed, 0), lambda *a: appendix_b(*a, True)[0], curved),
    Case("d (31) exact", _nth(curvature.exact, 1), lambda *a: appendix_b(*a, False)[1], curved),
    Case("d (31)", _nth(curvature.printed, 1), lambda *a: appendix_b(*a, True)[1], curved),
    Case(
        "distance on a soft object", _nth(compliance.two_distances, 0), two_distances, soft_object
    ),
]


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


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=20080923)
    options = parser.parse_args()
    print(
        f"worst error over {options.samples} samples, in units of epsilon max(1, kappa); the bound is {BOUND:g}"
    )
    for case in CASES:
        print(f"{case.name:32s} {worst(case, options.samples, options.seed)[0]:8.3f}")


if __name__ == "__main__":
    main()
