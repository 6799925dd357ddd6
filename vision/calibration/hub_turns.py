"""How far a hub has turned in each frame, by the marker on it: the motor's angle where none was logged.

The rig's axis is known and the angles are sought, by the model of `marker_pictures.py`. A corner's bias
in each camera, its change as the print turns, and the axis within its placement's covariance are
nuisances. Turns count from the first frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from vision.calibration.marker_pictures import (
    AXIS_OF_PLACEMENT,
    BIASES,
    FIRST_BIAS,
    FIRST_SCATTER_PX,
    LEAST_SCATTER_PX,
    MarkerPictures,
    MarkerSighting,
    bias_sigmas,
    first_parameters,
    triangulate_corners,
)
from vision.geometry.camera import Cameras, symmetric_root
from vision.geometry.refusals import Refused
from vision.geometry.robust import robust_sigma

# [frames] In which two cameras see the marker; a smooth motion has no fewer. Derived.
_FEWEST_FRAMES = 5
# [rad], [mm] Least prior sigmas of the axis, where its placement is exact: below what a corner shows.
# Derived.
_EXACT = np.array([1e-6, 1e-6, 1e-5, 1e-5])
# [mixed] Step of differences of a parameter: of mm, rad and px alike. Derived.
_STEP = 1e-5
# [passes] Each gives the scatter of corners to the next. Stated.
_PASSES = 3


@dataclass(frozen=True, eq=False)
class HubTurns:
    """Turns (n,) of a hub, rad, in frames (n,), with covariance (n, n) of all that makes them err.

    azimuth_rad: of the marker's diagonal in the first frame.
    """

    frame: np.ndarray
    turn_rad: np.ndarray
    covariance: np.ndarray
    azimuth_rad: float


def marker_turns(sightings: Sequence[MarkerSighting], cameras: Cameras) -> HubTurns:
    """Return the turns of a hub by one marker's sightings in a trial, from its first frame on.

    cameras: in the rig frame. Raises Refused where two cameras see the marker in too few frames, or
    the fit does not converge.
    """
    fit = _TurnFit(sightings, cameras)
    scatter_px = np.full((len(cameras), 1), FIRST_SCATTER_PX)
    fitted = fit.solve(fit.start(), scatter_px)
    for _ in range(_PASSES):
        scatter_px = fit.scatter_px(fitted, scatter_px)
        fitted = fit.solve(fitted.x, scatter_px)
    turns = slice(fit.first_turn, None)
    covariance = np.zeros((len(fit.frames), len(fit.frames)))
    covariance[1:, 1:] = fit.covariance(fitted, scatter_px)[turns, turns]
    x, y, _ = fitted.x[10:13] - fitted.x[4:7]  # from the first corner to the third
    azimuth_rad = float(np.arctan2(y, x))
    return HubTurns(fit.frames, fit.turns_rad(fitted.x), covariance, azimuth_rad)


class _TurnFit:
    """The fit of turns to a marker's sightings.

    Parameters: those of `marker_pictures.py`, then the turns (n - 1,) of all frames but the first, rad.
    """

    def __init__(self, sightings: Sequence[MarkerSighting], cameras: Cameras):
        """Take the sightings of one marker in one trial."""
        self.cameras = cameras
        self.sightings = sightings
        self.seen = MarkerPictures.of(sightings, cameras)
        numbers = [one.instant[1] for one in sightings]
        self.frames, self.frame = np.unique(numbers, return_inverse=True)
        self.first_turn = FIRST_BIAS + BIASES * len(cameras)
        placement = np.zeros((6, 6)) if cameras.placement is None else cameras.placement
        axis_sigma = np.hypot(np.sqrt(np.diag(placement))[AXIS_OF_PLACEMENT], _EXACT)
        self._prior = np.concatenate([axis_sigma, bias_sigmas(cameras)])
        # of the axis and the biases; corners and turns have no prior
        self._with_prior = np.r_[0:4, FIRST_BIAS : self.first_turn]

    def start(self) -> np.ndarray:
        """Return first parameters by triangulated corners, turned about z. Raises Refused where two
        cameras see the marker in too few frames.
        """
        met, corners_mm = triangulate_corners(self.sightings, self.cameras)
        if len(met) < _FEWEST_FRAMES:
            raise Refused(
                f"the marker is seen by two cameras in {len(met)} frames, {_FEWEST_FRAMES} are needed",
                code="marker_not_seen",
            )
        turn = _turns_about_z(corners_mm)
        turns = np.interp(self.frames, [one.instant[1] for one in met], turn)
        first = first_parameters(corners_mm, turn - turns[0], self.cameras)
        return np.concatenate([first, turns[1:] - turns[0]])

    def turns_rad(self, parameters: np.ndarray) -> np.ndarray:
        """Return the turns (n,) of all frames, rad, from the first."""
        return np.append(0.0, parameters[self.first_turn :])

    def solve(self, start: np.ndarray, scatter_px: np.ndarray) -> OptimizeResult:
        """Fit from these parameters. Raises Refused where the fit does not converge."""
        turns_rad = self.turns_rad(start)
        self._middle_rad = 0.5 * (turns_rad.min() + turns_rad.max())
        fitted = least_squares(
            self._residuals, start, self._jacobian, x_scale="jac", args=(scatter_px,)
        )
        if fitted.status <= 0:
            raise Refused(
                "the turns of the marker on the hub were not found", code="marker_not_fitted"
            )
        return fitted

    def scatter_px(self, fitted: OptimizeResult, used_px: np.ndarray) -> np.ndarray:
        """Return the scatter (cameras, 1) of a corner's coordinates, px, by the residuals.

        The fit's parameters take up their share of it.
        """
        freedom = max(self.seen.px.size - len(fitted.x), 1)
        residual = self.seen.of_corners(fitted.fun).reshape(self.seen.px.shape)
        residual = residual * np.sqrt(self.seen.px.size / freedom)
        scatter = used_px.copy()
        for k in self.seen.cameras_with_pictures:
            scatter[k] *= robust_sigma(residual[self.seen.camera == k])
        return np.maximum(scatter, LEAST_SCATTER_PX)

    def covariance(self, fitted: OptimizeResult, scatter_px: np.ndarray) -> np.ndarray:
        """Return the covariance of the parameters, with what the cameras' own errors add to it."""
        own = np.linalg.inv(fitted.jac.T @ fitted.jac)
        turn_rad = self.turns_rad(fitted.x)[self.frame]
        by_error = self.seen.by_camera_errors(
            fitted, turn_rad, self.cameras, scatter_px, self._camera_errors, own
        )
        return own + by_error @ by_error.T

    @cached_property
    def _camera_errors(self) -> np.ndarray:
        """Return the cameras' errors (15 n, k) but that of the axis, which is fitted."""
        cameras = self.cameras
        if not cameras.covariance.any():
            return np.zeros((len(cameras.covariance), 0))
        if cameras.placement is None:
            return cameras.by_error
        by_placement = cameras.by_placement[:, AXIS_OF_PLACEMENT]
        axis = cameras.placement[np.ix_(AXIS_OF_PLACEMENT, AXIS_OF_PLACEMENT)]
        return symmetric_root(cameras.covariance - by_placement @ axis @ by_placement.T)

    def _residuals(self, parameters: np.ndarray, scatter_px: np.ndarray) -> np.ndarray:
        """Return all residuals over their sigmas: of the corners in pictures, then of the priors."""
        turn_rad = self.turns_rad(parameters)[self.frame]
        of_corners = self.seen.residuals(
            parameters, turn_rad, self._middle_rad, self.cameras, scatter_px
        )
        return np.concatenate([of_corners, parameters[self._with_prior] / self._prior])

    def _jacobian(self, parameters: np.ndarray, scatter_px: np.ndarray) -> np.ndarray:
        """Return the derivatives of the residuals; of the turns all at once, each picture has one."""
        here = self._residuals(parameters, scatter_px)
        jacobian = np.zeros((len(here), len(parameters)))
        for k in range(self.first_turn):
            moved = parameters.copy()
            moved[k] += _STEP
            jacobian[:, k] = (self._residuals(moved, scatter_px) - here) / _STEP
        moved = parameters.copy()
        moved[self.first_turn :] += _STEP
        by_turn = (self._residuals(moved, scatter_px) - here) / _STEP
        of_frame = np.repeat(self.frame, self.seen.px[0].size)
        rows = np.flatnonzero(of_frame)  # the first frame has no turn
        jacobian[rows, self.first_turn + of_frame[rows] - 1] = by_turn[rows]
        return jacobian


def _turns_about_z(corners_mm: np.ndarray) -> np.ndarray:
    """Return by which angles about z, rad, corners (n, 4, 3) are turned from the first ones, (n,)."""
    x, y, _ = np.moveaxis(corners_mm, -1, 0)  # (n, 4) each
    first_x = x[0]
    first_y = y[0]
    along = np.sum(x * first_x + y * first_y, axis=1)
    across = np.sum(y * first_x - x * first_y, axis=1)
    return np.arctan2(across, along)
