"""A cantilever's end by Legendre's elliptic integrals."""

import math

import numpy as np
from scipy import optimize, special

from bench.rig.elastic_rod import Rod

CYLINDER = Rod("cylinder", 100.0, 1.0, 60.0)
CONE = Rod("cone", 100.0, 1.0, 60.0)


def elliptic_end(load, direction_rad):
    """End (x, e) and tangent angle of a unit cantilever under a force `load`·EI at an angle to the clamped tangent.

    First integral: ½ψ'² = load·(cos(ψ − direction)|end − cos(ψ − direction)), with ψ' = 0 at the load. With
    cos half the angle from the force as the amplitude's sine, lengths are Legendre's F and E.
    """
    k_full = math.sqrt(load)

    def amplitudes(end_angle):
        modulus = math.sin(0.5 * (math.pi - direction_rad + end_angle))
        return modulus, math.asin(math.sin(0.5 * (math.pi - direction_rad)) / modulus)

    def length(end_angle):
        modulus, start = amplitudes(end_angle)
        return (special.ellipk(modulus**2) - special.ellipkinc(start, modulus**2)) / k_full - 1

    end_angle = optimize.brentq(length, 1e-14, direction_rad - 1e-14, xtol=1e-15)
    modulus, start = amplitudes(end_angle)
    m = modulus**2
    first = special.ellipk(m) - special.ellipkinc(start, m)
    second = special.ellipe(m) - special.ellipeinc(start, m)
    along = -(2 * second - first) / k_full
    across = 2 * modulus * math.cos(start) / k_full
    # `along` runs with the force, `across` to the side on which the rod lies.
    u = np.array([math.cos(direction_rad), math.sin(direction_rad)])
    v = np.array([math.sin(direction_rad), -math.cos(direction_rad)])
    return along * u + across * v, end_angle
