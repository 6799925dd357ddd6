"""Each of three cameras or more left out in turn: do the others see the same whisk?

One linear step from the fit's solution, on the lines already measured with the weights that they have there, gives the
fit without a camera. What it moves has mean 0 where the cameras agree, and a covariance that follows from those of line
points, beliefs and cameras; its square over that is a chi² (the test of Hausman, Econometrica 46, 1251, 1978).

Three cameras that disagree do not tell which of them is wrong: any two determine wire and bar with little left over. So
none is dropped. The truth is taken to be where the fit would be without one of those that fail, each as likely.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from vision.fit.problem import Problem, State, point_rows
from vision.fit.quantities import Jacobians
from vision.fit.solve import LAST_SCALE, linear_at, robust_weights
from vision.fit.uncertainty import Uncertainty, alike, camera_rows

FEWEST_CAMERAS = 3
# Chance by which cameras that agree fail, a whisk.
FALSE_ALARM = 1e-3
# A shift of so many stated sigmas matters: less adds no more than an eighth to an error.
_MATTERS = 0.5
_UNITS = {"d_x": (1.0, "mm"), "touch": (np.degrees(1.0), "deg"), "beta": (np.degrees(1.0), "deg"), "slip": (1.0, "mm")}


@dataclass(frozen=True, eq=False)
class OneLess:
    """The fit without a camera: by how much parameters (size,), and d_x, touch, beta and the last slip (4,) differ, in
    mm and rad; sigma (4,) of these differences where all cameras agree; the chance, then, that one of them moves so
    much; and the stated sigma (4,).
    """

    camera: str
    step: np.ndarray
    moved: np.ndarray
    moved_sigma: np.ndarray
    chance: float
    sigma: np.ndarray

    @property
    def contradicts(self) -> bool:
        """Whether the others see another whisk: by more than chance, and by what matters."""
        return self.chance <= FALSE_ALARM and bool(np.max(np.abs(self.moved) / self.sigma) >= _MATTERS)

    def __str__(self) -> str:
        worst = int(np.argmax(np.abs(self.moved) / self.sigma))
        name, (scale, unit) = list(_UNITS.items())[worst]
        by = f"{scale * self.moved[worst]:+.3f} ± {scale * self.moved_sigma[worst]:.3f} {unit}"
        return f"without {self.camera} {name} is {by} elsewhere (chance {self.chance:.1g})"


def leave_out_each(problem: Problem, state: State, fitted: Uncertainty, by: Jacobians) -> list[OneLess]:
    """The fit without each of its cameras; none where there are fewer than three."""
    if len(problem.cameras) < FEWEST_CAMERAS:
        return []
    linear, last = linear_at(problem, state), np.flatnonzero(problem.touching)[-1]
    root = np.sqrt(robust_weights(linear, LAST_SCALE))
    jacobian, residual = linear.jacobian * root[:, None], linear.residual * root
    by_camera = camera_rows(problem, state) * root[linear.is_point, None]
    asked = np.array([by.whisk["d_x"], by.whisk["touch"], by.whisk["beta"], by.frame["slip"][last]])
    sigma = np.sqrt(np.einsum("qi,ij,qj->q", asked, fitted.covariance, asked))
    found = []
    for number, name in enumerate(problem.cameras.names):
        others = np.ones(len(residual))
        for seen, rows in point_rows(problem):
            others[rows] = seen.camera != number
        kept = jacobian * others[:, None]
        answer = np.linalg.inv(kept.T @ kept)
        rows = asked @ (answer @ kept.T - fitted.answer @ jacobian.T)
        of_cameras = rows[:, linear.is_point] @ by_camera
        spread = rows @ alike(problem, rows).T + of_cameras @ problem.cameras.covariance @ of_cameras.T
        step = -answer @ (kept.T @ residual)
        moved = asked @ step
        chance = chdtrc(len(moved), moved @ np.linalg.pinv(spread, hermitian=True) @ moved)
        any_of_them = min(1.0, len(problem.cameras) * float(chance))
        found.append(OneLess(name, step, moved, np.sqrt(np.diag(spread)), any_of_them, sigma))
    return found


def contradiction(found: list[OneLess]) -> str:
    """What is wrong where cameras contradict each other, or ''."""
    if not any(one.contradicts for one in found):
        return ""
    said = "; ".join(str(one) for one in found if one.contradicts)
    return f"the cameras see different whisks: {said}; the sigmas hold that; was one of them moved or refocused?"


def covariance_of(found: list[OneLess], size: int) -> np.ndarray:
    """What a contradiction adds to the covariance (size, size) of the parameters."""
    steps = [np.outer(one.step, one.step) for one in found if one.contradicts]
    return np.mean(steps, axis=0) if steps else np.zeros((size, size))
