"""The exact planar elastica: a rod clamped at its base, bent by one point force, however large the deflection.

One point force on a straight rod of round section bends it in the plane of clamped tangent and force, so this is all
the bending that a whisker on a bar needs, in three dimensions too. Chebyshev collocation of the tangent angle and
Newton's method; nothing marches in time.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from bench.rig.elastic_rod import Rod
from bench.rig.linear import solved


class Bent:
    """An equilibrium: where the loaded point went, how the rod points there, and how both answer to the load.

    In the plane of bending: along the clamped tangent (x) and across it (e). `angle` (n,) is the tangent's at the
    nodes.
    """

    __slots__ = ("angle", "arc_mm", "end_by", "end_mm", "slope", "slope_by")

    def __init__(self, angle, arc_mm, end_mm, end_by, slope, slope_by):
        self.angle, self.arc_mm = angle, arc_mm
        self.end_mm, self.end_by = end_mm, end_by  # (2,), (2, 3) by force x, force e, arc
        self.slope, self.slope_by = slope, slope_by  # tangent's angle at the load, (3,)


@dataclass(frozen=True)
class Nodes:
    """Chebyshev points on 0…1 with the integrals from 0 to each of them and from each of them to 1."""

    at: np.ndarray
    from_base: np.ndarray
    to_load: np.ndarray
    weights: np.ndarray

    @classmethod
    def make(cls, count: int) -> "Nodes":
        """So many Chebyshev points with the matrices that integrate over them."""
        at = 0.5 * (1 - np.cos(np.pi * np.arange(count) / (count - 1)))
        values = chebyshev.chebvander(2 * at - 1, count - 1)
        integrals = np.stack([_integral(k, count, at) for k in range(count)], -1)
        from_base = np.linalg.solve(values.T, integrals.T).T
        return cls(at, from_base, from_base[-1] - from_base, from_base[-1])


def _integral(k, count, at):
    """Integral from 0 to `at` of the k-th Chebyshev polynomial shifted to 0…1."""
    return 0.5 * chebyshev.chebval(2 * at - 1, chebyshev.chebint(np.eye(count)[k], lbnd=-1))


class Elastica:
    """Solves EI(u) dψ/du = (x_s − x_u) F_e − (e_s − e_u) F_x, ψ(0) = 0, for the tangent angle ψ along 0 ≤ u ≤ s.

    With u = s·x this reads ψ = K g, g = (F_e cos ψ − F_x sin ψ) s²/EI, where K integrates twice (the moment from the
    load, then the curvature from the base). Beyond the load the rod is straight.
    """

    def __init__(self, rod: Rod, nodes: int = 0):
        self.rod = rod
        self.nodes = Nodes.make(nodes or (20 if rod.shape == "cylinder" else 40))
        self._uniform = self.nodes.from_base @ self.nodes.to_load

    def solve(
        self, force_x_N: float, force_e_N: float, arc_mm: float, guess: np.ndarray | None = None
    ) -> Bent:
        """Equilibrium under a force (along the clamped tangent, across it) at arc length.

        Raises ArithmeticError where Newton's method does not settle (loads far past buckling with no guess nearby).
        """
        scale = arc_mm**2 / self.rod.rigidity_Nmm2
        twice, twice_by_arc = self._double_integral(arc_mm)
        angle = np.zeros(len(self.nodes.at)) if guess is None else guess
        for _ in range(40):
            cos, sin = np.cos(angle), np.sin(angle)
            load = scale * (force_e_N * cos - force_x_N * sin)
            matrix = np.eye(len(angle)) + twice * (scale * (force_e_N * sin + force_x_N * cos))
            step = solved(matrix, twice @ load - angle)
            angle = angle + step
            if np.abs(step).max() < 1e-9:  # quadratic: the next step would be below 1e-16
                return self._bent(
                    angle, matrix, twice, twice_by_arc, scale, (force_x_N, force_e_N), arc_mm
                )
        raise ArithmeticError(
            f"no equilibrium found for {force_x_N:.4g}, {force_e_N:.4g} N at {arc_mm:.4g} mm"
        )

    def _double_integral(self, arc_mm):
        if self.rod.shape == "cylinder":
            return self._uniform, None
        at, base, load = self.nodes.at, self.nodes.from_base, self.nodes.to_load
        per_mm = self.rod.lost / self.rod.length_mm
        width = 1 - at * arc_mm * per_mm
        width[-1] = max(
            width[-1], 1e-3
        )  # at the very tip both moment and rigidity vanish; the curvature is finite
        softness = width**-4.0
        by_arc = 4 * softness / width * at * per_mm
        return (base * softness) @ load, (base * by_arc) @ load

    def _bent(self, angle, matrix, twice, twice_by_arc, scale, force, arc_mm):
        cos, sin = np.cos(angle), np.sin(angle)
        load = scale * (force[1] * cos - force[0] * sin)
        sources = np.stack(
            [-scale * (twice @ sin), scale * (twice @ cos), 2 / arc_mm * (twice @ load)], -1
        )
        if twice_by_arc is not None:
            sources[:, 2] += twice_by_arc @ load
        angle_by = solved(matrix, sources)
        unit_end = np.array([self.nodes.weights @ cos, self.nodes.weights @ sin])
        end_by = arc_mm * np.stack(
            [-(self.nodes.weights * sin) @ angle_by, (self.nodes.weights * cos) @ angle_by]
        )
        end_by[:, 2] += unit_end
        return Bent(angle, arc_mm, arc_mm * unit_end, end_by, angle[-1], angle_by[-1])

    def curve_mm(self, bent: Bent, arc_mm: np.ndarray) -> np.ndarray:
        """Points (n, 2) of the bent rod at arc lengths (n,), straight beyond the load."""
        arc = np.asarray(arc_mm, float)
        within = np.clip(arc / bent.arc_mm, 0, 1)
        points = bent.arc_mm * np.stack(
            [self.nodes.from_base @ np.cos(bent.angle), self.nodes.from_base @ np.sin(bent.angle)],
            -1,
        )
        curve = chebyshev.chebval(2 * within - 1, np.linalg.solve(self._values(), points)).T
        beyond = np.maximum(arc - bent.arc_mm, 0)[:, None]
        return curve + beyond * np.array([np.cos(bent.slope), np.sin(bent.slope)])

    def _values(self):
        return chebyshev.chebvander(2 * self.nodes.at - 1, len(self.nodes.at) - 1)
