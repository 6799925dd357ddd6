"""Each of three cameras or more left out in turn: do the others see the same whisk?

One linear step from the fit's solution, on the lines already measured with the weights that they
have there, gives the fit without a camera. What it moves has mean 0 where the cameras agree, and a
covariance that follows from those of line points, priors and cameras; its square over that is a
chi² (the test of Hausman, Econometrica 46, 1251, 1978). Two cameras may know the bar too badly by
themselves to contradict a third so, and still determine where its lines are: how far these are off
as a whole, which is believed to be little, is tested besides.

Three cameras that disagree do not reveal which of them is wrong: any two determine wire and bar
with little left over. So none is dropped. The truth is taken to be where the fit would be without
one of those that fail, each with the same probability, and as uncertain as it is there.
"""

from dataclasses import dataclass, replace

import numpy as np

from vision.fit.blocks import Blocks, columns_of
from vision.fit.converged_fit import ConvergedFit
from vision.fit.covariance import FALSE_ALARM, MATTERS, chance_of
from vision.fit.problem import point_rows

# [cameras] With one fewer nothing is left over to compare. Derived.
FEWEST_CAMERAS = 3
# [1] Of its prior's variance: a combination of a camera's offsets that the others determine by no
# more is not tested; rounding and where the fit converged are less. Derived.
_DETERMINED = 1e-3
# [mm, rad → unit] Scale and unit in which quantities are written, in the order of `OneLess.moved`.
_UNITS = {
    "d_x": (1.0, "mm"),
    "touch": (np.degrees(1.0), "deg"),
    "beta": (np.degrees(1.0), "deg"),
    "slip": (1.0, "mm"),
}


@dataclass(frozen=True, eq=False)
class OneLess:
    """The fit without a camera.

    step (size,): change of the parameters. moved (4,): change of d_x, touch, beta and the last slip,
    in mm and rad; moved_sigma (4,): its sigma if all cameras agree; sigma (4,): that stated for the
    values. line_offset_px, line_offset_sigma_px: how far the worst of the camera's lines lies from
    where the others have it, and its sigma. chance: that of a change, or of lines off, as large as
    this among cameras that agree. spread (size, size): covariance of the step, where it contradicts.
    """

    camera: str
    step: np.ndarray
    moved: np.ndarray
    moved_sigma: np.ndarray
    sigma: np.ndarray
    line_offset_px: float
    line_offset_sigma_px: float
    chance: float
    spread: np.ndarray | None = None

    @property
    def contradicts(self) -> bool:
        """Return whether the others see another whisk, by more than chance, and by enough to
        matter.
        """
        off = np.hypot(self.moved, self.moved_sigma)
        return self.chance <= FALSE_ALARM and bool(np.max(off / self.sigma) >= MATTERS)

    def __str__(self) -> str:
        """Describe what moves most, in its stated sigmas."""
        worst = int(np.argmax(np.abs(self.moved) / self.sigma))
        name = list(_UNITS)[worst]
        scale, unit = _UNITS[name]
        moved = scale * self.moved[worst]
        by = f"{moved:+.3f} ± {scale * self.moved_sigma[worst]:.3f} {unit}"
        offset_px = f"{abs(self.line_offset_px):.2f} ± {self.line_offset_sigma_px:.2f} px"
        lines = f"its lines up to {offset_px} beside where the others have them"
        return f"without {self.camera} {name} is {by} elsewhere, {lines} (chance {self.chance:.1g})"


def leave_out_each(fit: ConvergedFit) -> list[OneLess]:
    """Return the fit without each of its cameras; none where there are fewer than three."""
    cameras = range(len(fit.problem.cameras))
    if len(cameras) < FEWEST_CAMERAS:
        return []
    return [_leave_out(fit, camera) for camera in cameras]


def _leave_out(fit: ConvergedFit, camera: int) -> OneLess:
    """Return the fit without one camera."""
    by = fit.by_parameter
    whisk = [by.whisk[name] for name in ("d_x", "touch", "beta")]
    gradients = np.array([*whisk, by.frame["slip"][fit.last_frame]])  # (4, size), as `moved`
    step, change = _step_without(fit, camera)
    moved = gradients @ step
    spread = fit.spread(gradients @ change)
    lines = _LinesOff.of(fit, camera)
    line_offset_px, line_offset_sigma_px = lines.worst_px()
    names = fit.problem.cameras.names
    least = min(chance_of(moved, spread), lines.chance)
    one = OneLess(
        camera=names[camera],
        step=step,
        moved=moved,
        moved_sigma=np.sqrt(np.diag(spread)),
        sigma=np.sqrt(np.diag(gradients @ fit.fit_covariance @ gradients.T)),
        line_offset_px=line_offset_px,
        line_offset_sigma_px=line_offset_sigma_px,
        chance=min(1.0, 2 * len(names) * least),
    )
    return replace(one, spread=fit.spread(change)) if one.contradicts else one


def _step_without(fit: ConvergedFit, camera: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the step (size,) to the fit without one camera, and its derivatives (size, n) by the
    errors of the observations.
    """
    kept = _rows_without(fit, camera)
    inverse_normal = np.linalg.inv(kept.T @ kept)
    change = inverse_normal @ kept.T - fit.inverse_normal @ fit.weighted.jacobian.T
    return -inverse_normal @ (kept.T @ fit.weighted.residual), change


def _rows_without(fit: ConvergedFit, camera: int) -> np.ndarray:
    """Return the weighted Jacobian (n, size) with zeros for the line points of a camera."""
    others = np.ones(len(fit.weighted.residual))
    for seen, rows in point_rows(fit.problem):
        others[rows] = seen.camera != camera
    return fit.weighted.jacobian * others[:, None]


@dataclass(frozen=True, eq=False)
class _LinesOff:
    """How far a camera's lines are off from where the others have them: offset and tilt of wire and
    of bar, four in all.

    The fit has these four as parameters, whose prior is 0. Of a camera that was moved they leave 0:
    their residual against the prior, over its covariance, is the test (the w-test of Baarda, A
    testing procedure for use in geodetic networks, 1968). It also serves where the others alone do
    not determine the bar.

    directions (4, k): combinations that the others determine, in sigmas of the prior. value (k,),
    covariance (k, k): their residuals against the prior. px_per_value (4, k): by how much the lines
    are off per unit of these, without the prior.
    """

    directions: np.ndarray
    value: np.ndarray
    covariance: np.ndarray
    px_per_value: np.ndarray

    @classmethod
    def of(cls, fit: ConvergedFit, camera: int) -> "_LinesOff":
        """Return how far one camera's lines are off."""
        problem = fit.problem
        off = _offset_columns(problem.blocks, camera)
        sigma_px = problem.blocks.prior_sigma[off]
        own = fit.inverse_normal[np.ix_(off, off)] / np.outer(sigma_px, sigma_px)
        determined, directions = _determined_directions(own)
        gain = fit.inverse_normal[off] @ fit.weighted.jacobian.T  # (4, n)
        rows = -gain / sigma_px[:, None]
        own_priors = problem.prior_rows.start + off
        rows[np.arange(len(off)), own_priors] += 1.0
        fitted_px = fit.state.vector[off] - gain @ fit.weighted.residual
        in_sigmas = fitted_px / sigma_px
        covariance = fit.spread(directions.T @ rows)
        px_per_value = sigma_px[:, None] * directions / determined
        return cls(directions, directions.T @ in_sigmas, covariance, px_per_value)

    @property
    def chance(self) -> float:
        """Return the chance that cameras which agree have lines so far off."""
        return chance_of(self.value, self.covariance) if len(self.value) else 1.0

    def worst_px(self) -> tuple[float, float]:
        """Return offset or tilt of the line that is farthest off in its sigmas, and its sigma, px."""
        off_px = self.px_per_value @ self.value
        variance_px2 = np.diag(self.px_per_value @ self.covariance @ self.px_per_value.T)
        sigma_px = np.sqrt(variance_px2)
        in_sigmas = np.abs(off_px) / np.maximum(sigma_px, 1e-300)
        is_determined = np.sum(self.directions**2, axis=1) > 0.5
        worst = int(np.argmax(np.where(is_determined, in_sigmas, 0.0)))
        return float(off_px[worst]), float(sigma_px[worst])


def _offset_columns(blocks: Blocks, camera: int) -> np.ndarray:
    """Return the columns (4,) of a camera's lines: offset and tilt of the wire's and the bar's."""
    wire = columns_of(blocks.wire_offsets[camera])
    return np.append(wire[:2], columns_of(blocks.bar_offsets[camera]))


def _determined_directions(covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return combinations (4, k) of parameters, and by how much (k,) of its prior's variance each is
    determined.

    covariance (4, 4): of the parameters, in sigmas of their priors. Combinations that are
    determined by less than _DETERMINED are left out.
    """
    determined, directions = np.linalg.eigh(np.eye(len(covariance)) - covariance)
    is_kept = determined > _DETERMINED
    return determined[is_kept], directions[:, is_kept]


def contradiction(found: list[OneLess]) -> str:
    """Return what is wrong where cameras contradict each other, or ''."""
    said = "; ".join(str(one) for one in found if one.contradicts)
    if not said:
        return ""
    return (
        f"the cameras see different whisks: {said}; the sigmas hold that; was one of them moved or "
        "refocused?"
    )


def covariance_of(found: list[OneLess], size: int) -> np.ndarray:
    """Return what a contradiction adds to the covariance (size, size) of the parameters."""
    wider = [np.outer(one.step, one.step) + one.spread for one in found if one.spread is not None]
    return np.mean(wider, axis=0) if wider else np.zeros((size, size))
