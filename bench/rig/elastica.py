"""The exact planar elastica: a rod clamped at its base, bent by one point force of any size.

One point force on a straight rod of round section bends it in the plane of clamped tangent and
force, so this is all the bending that a whisker on a bar needs, in three dimensions too. Chebyshev
collocation of the tangent angle and Newton's method with exact derivatives; nothing marches in
time.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from bench.rig import linear
from bench.rig.elastic_rod import Rod

# [1] Steps of Newton's method before it is given up. Stated.
_MOST_STEPS = 40
# [rad] Largest last step: the next one, by quadratic convergence, is below 1e-16. Derived.
_LAST_STEP_RAD = 1e-9
# [1] Least diameter over the base's: at a cone's very tip moment and rigidity vanish together and
# the curvature is finite. Stated.
LEAST_WIDTH = 1e-3


@dataclass(slots=True)
class Bent:
    """An equilibrium in the plane of bending: along the clamped tangent (x) and across it (e).

    angle (n,): the tangent's at the nodes, rad. end_mm (2,), slope: position and angle of the
    loaded point at arc_mm. end_by (2, 3), slope_by (3,): their derivatives by force x, force e and
    arc.
    """

    angle: np.ndarray
    arc_mm: float
    end_mm: np.ndarray
    end_by: np.ndarray
    slope: float
    slope_by: np.ndarray


@dataclass(frozen=True)
class Nodes:
    """Chebyshev points on 0…1 and the matrices that integrate over them.

    at (n,). values (n, n): the polynomials at the points. from_base, to_load (n, n): integrals
    from 0 to each point and from each point to 1. weights (n,): the integral from 0 to 1.
    """

    at: np.ndarray
    values: np.ndarray
    from_base: np.ndarray
    to_load: np.ndarray
    weights: np.ndarray

    @classmethod
    def make(cls, count: int) -> "Nodes":
        """Make `count` Chebyshev points with their matrices."""
        on_circle = -np.cos(np.pi * np.arange(count) / (count - 1))  # (n,) from −1 to 1
        values = chebyshev.chebvander(on_circle, count - 1)
        antiderivatives = chebyshev.chebint(np.eye(count), lbnd=-1)  # (n + 1, n) coefficients
        integrals = 0.5 * chebyshev.chebvander(on_circle, count) @ antiderivatives
        from_base = np.linalg.solve(values.T, integrals.T).T
        weights = from_base[-1]
        return cls(0.5 * (1 + on_circle), values, from_base, weights - from_base, weights)

    def coefficients(self, at_nodes: np.ndarray) -> np.ndarray:
        """Return the Chebyshev coefficients (n, k) of values (n, k) at the points."""
        return np.linalg.solve(self.values, at_nodes)

    def interpolate(self, at_nodes: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Interpolate values (n, k) at the points to shares (m,) of 0…1: (m, k)."""
        return chebyshev.chebval(2 * share - 1, self.coefficients(at_nodes)).T


@dataclass(frozen=True)
class _Bending:
    """The equations ψ = K g of the angles at the nodes.

    force_x_N, force_e_N: along the clamped tangent and across it. scale: s²/EI at the base, 1/N.
    twice (n, n): K, the double integral.
    """

    force_x_N: float
    force_e_N: float
    arc_mm: float
    scale: float
    twice: np.ndarray

    def load(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return g (n,) at angles (n,), and its derivatives by them."""
        cos = np.cos(angle)
        sin = np.sin(angle)
        load = self.scale * (self.force_e_N * cos - self.force_x_N * sin)
        return load, -self.scale * (self.force_e_N * sin + self.force_x_N * cos)

    def solve(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the angles (n,) and the last Jacobian (n, n) of Newton's method.

        Raises ArithmeticError where it does not converge from `angle` (n,).
        """
        identity = np.eye(len(angle))
        for _ in range(_MOST_STEPS):
            load, load_by = self.load(angle)
            jacobian = identity - self.twice * load_by
            step = linear.solve(jacobian, self.twice @ load - angle)
            angle = angle + step
            if np.abs(step).max() < _LAST_STEP_RAD:
                return angle, jacobian
        forces = f"{self.force_x_N:.4g}, {self.force_e_N:.4g} N"
        raise ArithmeticError(f"no equilibrium found for {forces} at {self.arc_mm:.4g} mm")


class Elastica:
    """Solver of EI(u) dψ/du = (x_s − x_u) F_e − (e_s − e_u) F_x, ψ(0) = 0, for the tangent angle ψ
    along 0 ≤ u ≤ s.

    With u = s·x this reads ψ = K g, g = (F_e cos ψ − F_x sin ψ) s²/EI, where K integrates twice
    (the moment from the load, then the curvature from the base). Beyond the load the rod is
    straight.
    """

    def __init__(self, rod: Rod, nodes: int = 0):
        self.rod = rod
        self.nodes = Nodes.make(nodes or (20 if rod.shape == "cylinder" else 40))
        self._uniform = self.nodes.from_base @ self.nodes.to_load

    def solve(
        self, force_x_N: float, force_e_N: float, arc_mm: float, guess: np.ndarray | None = None
    ) -> Bent:
        """Find the equilibrium under a force (along the clamped tangent, across it) at arc length.

        guess (n,): angles at the nodes to start from. Raises ArithmeticError where Newton's method
        does not converge (loads far past buckling with no guess nearby).
        """
        scale = arc_mm**2 / self.rod.rigidity_Nmm2
        twice, twice_by_arc = self._double_integral(arc_mm)
        bending = _Bending(force_x_N, force_e_N, arc_mm, scale, twice)
        angle, jacobian = bending.solve(np.zeros(len(self.nodes.at)) if guess is None else guess)
        load, _ = bending.load(angle)
        residual_by = np.empty((len(angle), 3))  # of ψ by force x, force e, arc at fixed angles
        residual_by[:, 0] = -scale * (twice @ np.sin(angle))
        residual_by[:, 1] = scale * (twice @ np.cos(angle))
        residual_by[:, 2] = (2 / arc_mm * twice + twice_by_arc) @ load
        return self._bent(angle, arc_mm, linear.solve(jacobian, residual_by))

    def curve_mm(self, bent: Bent, arc_mm: np.ndarray) -> np.ndarray:
        """Return points (n, 2) of the bent rod at arc lengths (n,), straight beyond the load."""
        arc = np.asarray(arc_mm, float)
        directions = np.stack([np.cos(bent.angle), np.sin(bent.angle)], -1)
        at_nodes_mm = bent.arc_mm * self.nodes.from_base @ directions  # (nodes, 2)
        curve_mm = self.nodes.interpolate(at_nodes_mm, np.clip(arc / bent.arc_mm, 0, 1))
        beyond_mm = np.maximum(arc - bent.arc_mm, 0)
        end = np.array([np.cos(bent.slope), np.sin(bent.slope)])
        return curve_mm + beyond_mm[:, None] * end

    def _double_integral(self, arc_mm):
        """Return K (n, n) for a load at arc length, and its derivative by the arc."""
        if self.rod.shape == "cylinder":
            return self._uniform, 0.0
        nodes = self.nodes
        at_mm = nodes.at * arc_mm
        width = np.maximum(self.rod.width(at_mm), LEAST_WIDTH)
        softness = width**-4.0
        softness_by_arc = -4 * softness / width * nodes.at * self.rod.width_by_arc(at_mm)
        by_arc = (nodes.from_base * softness_by_arc) @ nodes.to_load
        return (nodes.from_base * softness) @ nodes.to_load, by_arc

    def _bent(self, angle, arc_mm, angle_by):
        """Return the equilibrium of converged angles (n,) and their derivatives (n, 3)."""
        weights = self.nodes.weights
        cos = np.cos(angle)
        sin = np.sin(angle)
        unit_end = np.array([weights @ cos, weights @ sin])
        end_by = arc_mm * np.stack([-(weights * sin) @ angle_by, (weights * cos) @ angle_by])
        end_by[:, 2] += unit_end
        return Bent(angle, arc_mm, arc_mm * unit_end, end_by, angle[-1], angle_by[-1])
