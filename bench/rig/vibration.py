"""The whisker's first bending mode: free, then propped at the bar; rung by the motor's ramps, by touch and by
stick–slip.

Small and linear on top of the quasi-static whisk. What rings is the moment at the base; the pictures' whisker does
not shake.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre, leggauss
from scipy.linalg import eigh, null_space

from bench.rig.elastic_rod import Rod

# Each vanishes at the base with its slope; a unit of length is the whisker's.
_CLAMPED = [
    Legendre.basis(k, domain=[0, 1]).convert(kind=Polynomial) * Polynomial([0, 0, 1])
    for k in range(14)
]
_BENT = [
    shape.deriv(2) for shape in _CLAMPED
]  # their curvatures, by which a vibrating rod bends at its clamp


@dataclass(frozen=True)
class Mode:
    """A first mode, of unit modal mass (kg m², so that its coordinate is √kg·m).

    `moment_Nmm`: moment on the base for a unit of the mode, of the sign of a push's. `swing`: modal acceleration for a
    unit of the hub's angular acceleration. `strike`: modal speed for a unit of angular speed that the prop stopped.
    `push_Nmm`: the quasi-static moment for a radian pushed head-on against the prop. The last two are zero without one.
    """

    frequency_rad_s: float
    moment_Nmm: float
    swing: float
    strike: float = 0.0
    push_Nmm: float = 0.0

    @classmethod
    def of(cls, rod: Rod, prop_mm: float | None = None) -> "Mode":
        """Rayleigh–Ritz with polynomials that are clamped at the base, and zero at the prop if there is one."""
        length = rod.length_mm * 1e-3
        at, weights = leggauss(64)
        at, weights = 0.5 * (at + 1), 0.5 * length * weights
        width = rod.width(at * rod.length_mm)
        mass, stiff = (
            weights * rod.mass_kg_m * width**2,
            weights * 1e-6 * rod.rigidity_Nmm2 * width**4,
        )
        shape, bend = _values(_CLAMPED, at), _values(_BENT, at) / length**2
        free = (
            np.eye(len(_CLAMPED))
            if prop_mm is None
            else null_space(_values(_CLAMPED, [prop_mm / rod.length_mm]))
        )
        squares, modes = eigh(
            free.T @ (bend.T * stiff) @ bend @ free,
            free.T @ (shape.T * mass) @ shape @ free,
            subset_by_index=[0, 0],
        )
        mode = free @ modes[:, 0]
        at_base = float(_values(_BENT, [0.0])[0] @ mode) / length**2
        moment, moved = -1e-3 * rod.rigidity_Nmm2 * at_base, mass * (shape @ mode)
        frequency, swing = math.sqrt(squares[0]), -float(moved @ at) * length
        if prop_mm is None:
            return cls(frequency, moment, swing)
        lag_mm, push = _pushed(rod, at * rod.length_mm, prop_mm)
        return cls(frequency, moment, swing, 1e-3 * float(moved @ lag_mm), push)


def _values(shapes, at):
    return np.stack([shape(np.asarray(at)) for shape in shapes], -1)


def _pushed(rod, at_mm, prop_mm):
    """How far (mm) the rod lags behind the straight line when the hub turns a radian against the prop, and the
    moment.
    """
    grid = np.linspace(0, prop_mm, 801)
    curvature = (prop_mm - grid) / np.maximum(rod.width(grid), 1e-3) ** 4
    slope = _integral(curvature, grid[1])
    lag = _integral(slope, grid[1])
    beyond = lag[-1] + slope[-1] * (at_mm - prop_mm)
    whole = np.where(at_mm <= prop_mm, np.interp(at_mm, grid, lag), beyond)
    return whole * prop_mm / lag[-1], rod.rigidity_Nmm2 * prop_mm**2 / lag[-1]


def _integral(values, step):
    return np.concatenate([[0], np.cumsum(0.5 * (values[1:] + values[:-1]) * step)])


def ring(
    times_s: np.ndarray,
    start_s: float,
    end_s: float,
    frequency_rad_s: float,
    damping: float,
    *,
    value: float = 0.0,
    rate: float = 0.0,
) -> np.ndarray:
    """A damped oscillation from `start_s` with a first value and a first rate; zero before it and after `end_s`."""
    t = np.asarray(times_s) - start_s
    alive = (t >= 0) & (np.asarray(times_s) < end_s)
    t = np.where(alive, t, 0)
    damped = frequency_rad_s * math.sqrt(1 - damping**2)
    swing = (rate + damping * frequency_rad_s * value) / damped
    wave = value * np.cos(damped * t) + swing * np.sin(damped * t)
    return np.where(alive, np.exp(-damping * frequency_rad_s * t) * wave, 0.0)
