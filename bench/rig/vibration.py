"""The whisker's first bending mode: free, or propped at the bar; rung by ramps, touch, stick–slip.

Small and linear on top of the quasi-static whisk. What rings is the moment at the base; the
whisker in the pictures does not shake.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre, leggauss
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import eigh, null_space

from bench.rig.elastic_rod import Rod

# Polynomials of a mode by parts of the length; each vanishes at the base together with its slope.
_CLAMPED = [
    Legendre.basis(degree, domain=[0, 1]).convert(kind=Polynomial) * Polynomial([0, 0, 1])
    for degree in range(14)
]
_CURVATURES = [shape.deriv(2) for shape in _CLAMPED]  # by which a rod bends at its clamp


@dataclass(frozen=True)
class Mode:
    """A first mode, of unit modal mass (kg m², so that its coordinate is √kg·m).

    moment_Nmm: moment on the base for a unit of the mode, of the sign of a push's. swing: modal
    acceleration for a unit of the hub's angular acceleration.
    strike: modal speed for a unit of angular speed that the prop stopped. push_Nmm: quasi-static
    moment for a radian pushed head-on against the prop. These two are zero without a prop.
    """

    frequency_rad_s: float
    moment_Nmm: float
    swing: float
    strike: float = 0.0
    push_Nmm: float = 0.0

    @classmethod
    def solve(cls, rod: Rod, prop_mm: float | None = None) -> "Mode":
        """Find the mode by Rayleigh–Ritz, with polynomials that are clamped at the base, and zero
        at the prop if there is one."""
        length = rod.length_mm * 1e-3
        at, mass, stiffness = _beam(rod)
        frequency, mode = _first_mode(rod, prop_mm, at, mass, stiffness)
        momentum = mass * (_evaluate(_CLAMPED, at) @ mode)
        curvature_at_base = float(_evaluate(_CURVATURES, np.zeros(1))[0] @ mode) / length**2
        moment = -1e-3 * rod.rigidity_Nmm2 * curvature_at_base
        swing = -float(momentum @ at) * length
        if prop_mm is None:
            return cls(frequency, moment, swing)
        lag_mm, push = _push_against_prop(rod, at * rod.length_mm, prop_mm)
        return cls(frequency, moment, swing, 1e-3 * float(momentum @ lag_mm), push)


def _beam(rod):
    """Return parts (64,) of the length with the mass, kg, and the stiffness, N·m³, that stand for
    the rod there in integrals over its length, m."""
    nodes, weights = leggauss(64)
    at = 0.5 * (nodes + 1)
    weights = 0.5 * (rod.length_mm * 1e-3) * weights
    width = rod.width(at * rod.length_mm)
    mass = weights * rod.mass_kg_m * width**2
    stiffness = weights * 1e-6 * rod.rigidity_Nmm2 * width**4
    return at, mass, stiffness


def _first_mode(rod, prop_mm, at, mass, stiffness):
    """Return the lowest frequency, rad/s, and its mode, coefficients (k,) of _CLAMPED.

    at, mass, stiffness (n,): see `_beam`.
    """
    allowed = np.eye(len(_CLAMPED))
    if prop_mm is not None:
        allowed = null_space(_evaluate(_CLAMPED, np.array([prop_mm / rod.length_mm])))
    shapes = _evaluate(_CLAMPED, at) @ allowed
    curvatures = _evaluate(_CURVATURES, at) / (rod.length_mm * 1e-3) ** 2 @ allowed
    squares, modes = eigh(
        (curvatures.T * stiffness) @ curvatures,
        (shapes.T * mass) @ shapes,
        subset_by_index=[0, 0],
    )
    return math.sqrt(squares[0]), allowed @ modes[:, 0]


def _evaluate(polynomials, at):
    """Evaluate polynomials at parts (n,) of the length: (n, polynomials)."""
    return np.stack([polynomial(at) for polynomial in polynomials], -1)


def _push_against_prop(rod, at_mm, prop_mm):
    """Return how far (n,), mm, the rod at arc lengths (n,) lags behind the straight line when the
    hub turns a radian against the prop, and the moment, N·mm."""
    grid = np.linspace(0, prop_mm, 801)
    curvature = (prop_mm - grid) / np.maximum(rod.width(grid), 1e-3) ** 4
    slope = cumulative_trapezoid(curvature, dx=grid[1], initial=0)
    lag = cumulative_trapezoid(slope, dx=grid[1], initial=0)
    beyond = lag[-1] + slope[-1] * (at_mm - prop_mm)
    whole = np.where(at_mm <= prop_mm, np.interp(at_mm, grid, lag), beyond)
    return whole * prop_mm / lag[-1], rod.rigidity_Nmm2 * prop_mm**2 / lag[-1]


def damped_oscillation(
    times_s: np.ndarray,
    start_s: float,
    end_s: float,
    frequency_rad_s: float,
    damping: float,
    *,
    value: float = 0.0,
    rate: float = 0.0,
) -> np.ndarray:
    """Return a damped oscillation (n,) from `start_s` with a first value and a first rate; zero
    before it and after `end_s`."""
    times = np.asarray(times_s)
    is_ringing = (times >= start_s) & (times < end_s)
    t = np.where(is_ringing, times - start_s, 0)
    damped_rad_s = frequency_rad_s * math.sqrt(1 - damping**2)
    sine = (rate + damping * frequency_rad_s * value) / damped_rad_s
    wave = value * np.cos(damped_rad_s * t) + sine * np.sin(damped_rad_s * t)
    return np.where(is_ringing, np.exp(-damping * frequency_rad_s * t) * wave, 0.0)
