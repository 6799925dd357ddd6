"""The whisker's first bending mode: free, then propped at the bar; rung by the motor's ramps, by touch and by stick–slip.

Small and linear on top of the quasi-static whisk. What rings is the moment at the base; the pictures' whisker does not shake.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh, null_space

from bench.rig.rod import Rod

_TERMS = 14


@dataclass(frozen=True)
class Mode:
    """A first mode. `moment_Nmm`: moment on the base for a unit of the mode (the sign of a push's moment). `swing`: how much of
    the mode a unit of angular acceleration of the hub drives (1/s² per rad/s²); `strike`: how fast the mode moves after a unit of
    angular speed was stopped at the prop (1/s per rad/s, zero for the free mode)."""

    frequency_rad_s: float
    moment_Nmm: float
    swing: float
    strike: float

    @classmethod
    def of(cls, rod: Rod, prop_mm: float | None = None) -> "Mode":
        """Rayleigh–Ritz with polynomials that are clamped at the base, and zero at the prop if there is one."""
        length = rod.length_mm * 1e-3
        x, weights = legendre.leggauss(64)
        x, weights = 0.5 * length * (x + 1), 0.5 * length * weights
        width = rod.width(1e3 * x)
        stiff, mass = 1e-6 * rod.rigidity_Nmm2 * width**4, rod.mass_kg_m * width**2
        shape, bend = _clamped(x / length), _clamped(x / length, 2) / length**2
        free = np.eye(_TERMS) if prop_mm is None else null_space(_clamped(np.array([1e-3 * prop_mm / length])))
        k = free.T @ (bend.T * (weights * stiff)) @ bend @ free
        m = free.T @ (shape.T * (weights * mass)) @ shape @ free
        squares, modes = eigh(k, m, subset_by_index=[0, 0])
        mode = free @ modes[:, 0]  # of unit modal mass
        moment = -1e-6 * rod.rigidity_Nmm2 * float(_clamped(np.zeros(1), 2)[0] @ mode) / length**2 * 1e3
        values = weights * mass * (shape @ mode)
        strike = 0.0 if prop_mm is None else float(values @ _pushed(rod, 1e3 * x, prop_mm)) * 1e-3
        return cls(math.sqrt(squares[0]), moment, -float(values @ x), strike)


def _clamped(u, derivative=0):
    """Polynomials u²·(Legendre) on 0…1 (n, terms), or their second derivatives."""
    basis = np.stack([np.polynomial.Polynomial([0, 0, 1])(u) * legendre.legval(2 * u - 1, e) for e in np.eye(_TERMS)], -1)
    if not derivative:
        return basis
    columns = []
    for e in np.eye(_TERMS):
        poly = legendre.Legendre(e, domain=[0, 1]).convert(kind=np.polynomial.Polynomial) * np.polynomial.Polynomial([0, 0, 1])
        columns.append(poly.deriv(2)(u))
    return np.stack(columns, -1)


def _pushed(rod, x_mm, prop_mm):
    """Deflection (mm) of the rod held at the prop while the hub turns on by 1 rad: what it lags behind the straight line."""
    grid = np.linspace(0, prop_mm, 401)
    curvature = (prop_mm - grid) / np.maximum(rod.width(grid), 1e-3) ** 4
    step = grid[1]
    slope = np.concatenate([[0], np.cumsum(0.5 * (curvature[1:] + curvature[:-1]) * step)])
    lag = np.concatenate([[0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * step)])
    inside = np.interp(x_mm, grid, lag)
    beyond = lag[-1] + slope[-1] * (x_mm - prop_mm)
    return np.where(x_mm <= prop_mm, inside, beyond) * prop_mm / lag[-1]


def ring(times_s, start_s, end_s, frequency_rad_s, damping, amplitude=0.0, speed=0.0) -> np.ndarray:
    """A damped oscillation from `start_s` with a first value and a first rate; zero before it and after `end_s`."""
    t = np.asarray(times_s) - start_s
    alive = (t >= 0) & (np.asarray(times_s) < end_s)
    t = np.where(alive, t, 0)
    damped = frequency_rad_s * math.sqrt(1 - damping**2)
    rate = (speed + damping * frequency_rad_s * amplitude) / damped
    wave = amplitude * np.cos(damped * t) + rate * np.sin(damped * t)
    return np.where(alive, np.exp(-damping * frequency_rad_s * t) * wave, 0.0)
