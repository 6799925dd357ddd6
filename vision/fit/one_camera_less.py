"""Each of three cameras or more left out in turn: do the others see the same whisk?

One linear step from the fit's solution, on the lines already measured with the weights that they have there, gives the
fit without a camera. What it moves has mean 0 where the cameras agree, and a covariance that follows from those of line
points, priors and cameras; its square over that is a chi² (the test of Hausman, Econometrica 46, 1251, 1978). Two
cameras may know the bar too badly by themselves to contradict a third so, and still say where its lines are: how far
these are off as a whole, which is believed to be little, is asked beside.

Three cameras that disagree do not tell which of them is wrong: any two determine wire and bar with little left over. So
none is dropped. The truth is taken to be where the fit would be without one of those that fail, each as likely, and as
uncertain as it is there.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from vision.fit.covariance import Uncertainty, camera_rows, times_residual_covariance
from vision.fit.problem import Problem, State, point_rows
from vision.fit.quantities import Jacobians
from vision.fit.solve import LAST_SCALE, linear_at, robust_weights

# [cameras] With one fewer nothing is left over to compare. Derived.
FEWEST_CAMERAS = 3
# [chance] By which cameras that agree fail, a whisk. Study: chosen.
FALSE_ALARM = 1e-3
# [sigma] A shift of so many stated sigmas, or one as unsure, matters: less adds no more than an
# eighth to an error, √(1 + 0.5²). Derived.
_MATTERS = 0.5
# [1] Of its belief's variance: a way in which a camera's lines may be off, and of which no more
# is told by the others, is not asked; rounding and where the fit stood still are less. Derived.
_TOLD = 1e-3
_UNITS = {
    "d_x": (1.0, "mm"),
    "touch": (np.degrees(1.0), "deg"),
    "beta": (np.degrees(1.0), "deg"),
    "slip": (1.0, "mm"),
}


@dataclass(frozen=True, eq=False)
class OneLess:
    """The fit without a camera.

    step (size,): by how much parameters differ; moved (4,): d_x, touch, beta and the last slip, in mm and rad, with
    moved_sigma (4,) where all cameras agree and sigma (4,), the stated one; beside, beside_sigma: px by which that of
    the camera's lines which is off most lies beside where the others have it; chance: that of cameras that agree one
    moves so much, or has lines so far off; spread (size, size): covariance of the step, where it contradicts.
    """

    camera: str
    step: np.ndarray
    moved: np.ndarray
    moved_sigma: np.ndarray
    sigma: np.ndarray
    beside: float
    beside_sigma: float
    chance: float
    spread: np.ndarray | None = None

    @property
    def contradicts(self) -> bool:
        """Whether the others see another whisk, by more than chance, and it matters by how much or how surely."""
        off = np.hypot(self.moved, self.moved_sigma)
        return self.chance <= FALSE_ALARM and bool(np.max(off / self.sigma) >= _MATTERS)

    def __str__(self) -> str:
        worst = int(np.argmax(np.abs(self.moved) / self.sigma))
        name, (scale, unit) = list(_UNITS.items())[worst]
        by = f"{scale * self.moved[worst]:+.3f} ± {scale * self.moved_sigma[worst]:.3f} {unit}"
        lines = f"its lines up to {abs(self.beside):.2f} ± {self.beside_sigma:.2f} px beside where the others have them"
        return f"without {self.camera} {name} is {by} elsewhere, {lines} (chance {self.chance:.1g})"


@dataclass(frozen=True, eq=False)
class _Observations:
    """All observations of a fit about its solution: residuals (n,) and their Jacobian (n, size), over sigma and
    robustly weighted, and what they answer to the cameras' parameters (n, 15 cameras), 0 but for line points."""

    problem: Problem
    residual: np.ndarray
    jacobian: np.ndarray
    by_camera: np.ndarray

    @classmethod
    def of(cls, problem: Problem, state: State) -> "_Observations":
        linear = linear_at(problem, state)
        root = np.sqrt(robust_weights(linear, LAST_SCALE))
        by_camera = np.zeros((len(root), problem.cameras.covariance.shape[0]))
        by_camera[linear.is_point] = camera_rows(problem, state) * root[linear.is_point, None]
        return cls(problem, linear.residual * root, linear.jacobian * root[:, None], by_camera)

    def without(self, camera: int) -> np.ndarray:
        """The Jacobian without what a camera shows."""
        others = np.ones(len(self.residual))
        for seen, rows in point_rows(self.problem):
            others[rows] = seen.camera != camera
        return self.jacobian * others[:, None]

    def spread(self, rows: np.ndarray) -> np.ndarray:
        """Covariance (k, k) of what these rows (k, n) make of all that observations and cameras err by."""
        of_cameras = rows @ self.by_camera
        return (
            times_residual_covariance(self.problem, rows) @ rows.T
            + of_cameras @ self.problem.cameras.covariance @ of_cameras.T
        )


def leave_out_each(
    problem: Problem, state: State, fitted: Uncertainty, by: Jacobians
) -> list[OneLess]:
    """The fit without each of its cameras; none where there are fewer than three."""
    if len(problem.cameras) < FEWEST_CAMERAS:
        return []
    seen, last = _Observations.of(problem, state), np.flatnonzero(problem.touching)[-1]
    asked = np.array([by.whisk["d_x"], by.whisk["touch"], by.whisk["beta"], by.frame["slip"][last]])
    sigma = np.sqrt(np.einsum("qi,ij,qj->q", asked, fitted.covariance, asked))
    found = []
    for number, name in enumerate(problem.cameras.names):
        kept = seen.without(number)
        answer = np.linalg.inv(kept.T @ kept)
        rows = asked @ (answer @ kept.T - fitted.inverse_normal @ seen.jacobian.T)
        step = -answer @ (kept.T @ seen.residual)
        moved, spread = asked @ step, seen.spread(rows)
        beside, beside_sigma, by_lines = _lines_beside(seen, state, fitted.inverse_normal, number)
        chance = min(1.0, 2 * len(problem.cameras) * min(_chance(moved, spread), by_lines))
        one = OneLess(
            name, step, moved, np.sqrt(np.diag(spread)), sigma, beside, beside_sigma, chance
        )
        if one.contradicts:
            one = replace(
                one, spread=seen.spread(answer @ kept.T - fitted.inverse_normal @ seen.jacobian.T)
            )
        found.append(one)
    return found


def _lines_beside(
    seen: _Observations, state: State, answer: np.ndarray, camera: int
) -> tuple[float, float, float]:
    """By how many px, and its sigma, that of a camera's lines which is off most lies beside where the other cameras
    have it, and the chance of all: offset and tilt of its lines of wire and bar.

    A camera that was moved has its lines elsewhere, and the fit takes them to be off as a whole, against the belief
    that they are not: what it makes of that belief, over its covariance, tells (the w-test of Baarda, A testing
    procedure for use in geodetic networks, 1968). So it does where the others alone do not know the bar.
    """
    problem = seen.problem
    off = (
        np.r_[problem.blocks.wire_offsets[camera].slice][:2].tolist()
        + np.r_[problem.blocks.bar_offsets[camera].slice].tolist()
    )
    belief = (
        len(seen.residual) - problem.size - (problem.onset is not None) + np.array(off)
    )  # rows of what is believed
    sigma_px = 1.0 / seen.jacobian[belief, off]
    told, ways = np.linalg.eigh(
        np.eye(len(off)) - answer[np.ix_(off, off)] / np.outer(sigma_px, sigma_px)
    )
    told, ways = told[told > _TOLD], ways[:, told > _TOLD]
    if not len(told):
        return 0.0, 0.0, 1.0
    rows = -(answer[off] @ seen.jacobian.T) / sigma_px[:, None]
    rows[np.arange(len(off)), belief] += 1.0
    value = ways.T @ (
        (state.vector[off] - answer[off] @ (seen.jacobian.T @ seen.residual)) / sigma_px
    )
    spread = seen.spread(ways.T @ rows)
    freely = sigma_px[:, None] * ways / told  # as they are without that belief
    beside, sigma = freely @ value, np.sqrt(np.diag(freely @ spread @ freely.T))
    worst = int(
        np.argmax(
            np.where(np.sum(ways**2, axis=1) > 0.5, np.abs(beside) / np.maximum(sigma, 1e-300), 0.0)
        )
    )
    return float(beside[worst]), float(sigma[worst]), _chance(value, spread)


def _chance(moved: np.ndarray, spread: np.ndarray) -> float:
    """That what has this covariance (k, k) is so far (k,) from 0."""
    sigma = np.sqrt(np.maximum(np.diag(spread), 1e-300))  # 0 of a camera that shows nothing
    z = moved / sigma
    return float(
        chdtrc(len(z), z @ np.linalg.pinv(spread / np.outer(sigma, sigma), hermitian=True) @ z)
    )


def contradiction(found: list[OneLess]) -> str:
    """What is wrong where cameras contradict each other, or ''."""
    if not any(one.contradicts for one in found):
        return ""
    said = "; ".join(str(one) for one in found if one.contradicts)
    return f"the cameras see different whisks: {said}; the sigmas hold that; was one of them moved or refocused?"


def covariance_of(found: list[OneLess], size: int) -> np.ndarray:
    """What a contradiction adds to the covariance (size, size) of the parameters."""
    wider = [np.outer(one.step, one.step) + one.spread for one in found if one.spread is not None]
    return np.mean(wider, axis=0) if wider else np.zeros((size, size))
