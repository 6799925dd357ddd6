"""What a marker on the hub does in pictures: its corners where the hub has turned them.

With a picture's turn t, a corner's place q in the hub, and the axis near z of the cameras' frame:

    x = Exp(w) Rz(t) q + v

Parameters: w_x, w_y (rad), v_x, v_y (mm); the corners in the hub (4, 3), mm; of each camera's corners a
bias (8,), px, and its change with the turn (8,), px/rad.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import OptimizeResult

from vision.geometry.camera import Cameras
from vision.geometry.centreline import rotation_z
from vision.geometry.rotation import exp_rotation
from vision.geometry.triangulate import nearest_to_rays

# [parameters] Of the axis and of the corners, before the biases. A layout, no threshold.
FIRST_BIAS = 16
# [parameters] The biases and their changes of one camera. A layout, no threshold.
BIASES = 16
# [parameters] Of a placement, those of the axis: two turns, two shifts. A layout, no threshold.
AXIS_OF_PLACEMENT = np.array([0, 1, 3, 4])
# [px] What print, blur and light displace a marker's corner by in all pictures of a camera alike.
# Painted hubs' are 0.01 to 0.02 px RMS, and the fit raises this where its residuals show more.
# Study: rig_place.py.
_BIAS_PX = 0.02
# [1/rad] How fast that changes with the motor's angle, in parts of itself: a print that is foreshortened
# to a third turns three times as fast in the picture as the motor does. Derived.
_DRIFT_PER_RAD = 3.0
# [px] Least scatter of a corner from picture to picture: the fit of a pattern has that where there
# is no noise. Stated.
LEAST_SCATTER_PX = 0.01
# [px] First scatter of a corner. The residuals give it then. Stated.
FIRST_SCATTER_PX = 0.05


@dataclass(frozen=True, eq=False)
class MarkerSighting:
    """A marker that is not the board's, in one picture: its corners px (4, 2).

    instant: the same for all cameras' pictures of one frame.
    """

    number: int
    camera: str
    instant: tuple[str, int]
    motor_rad: float
    px: np.ndarray


def triangulate_corners(
    sightings: Sequence[MarkerSighting], cameras: Cameras
) -> tuple[list[MarkerSighting], np.ndarray]:
    """Return a sighting of each instant in which two cameras see a marker, and its corners there
    (n, 4, 3), mm.
    """
    by_instant: dict[tuple[str, int], list[MarkerSighting]] = {}
    for one in sightings:
        by_instant.setdefault(one.instant, []).append(one)
    seen = []
    corners = []
    for _, together in sorted(by_instant.items()):
        if len({one.camera for one in together}) > 1:
            views = [cameras[one.camera] for one in together]
            seen.append(together[0])
            corners.append(nearest_to_rays(views, [one.px for one in together]))
    return seen, np.array(corners).reshape(-1, 4, 3)


def first_parameters(corners_mm: np.ndarray, turn_rad: np.ndarray, cameras: Cameras) -> np.ndarray:
    """Return first parameters: the axis at z, corners as triangulated (n, 4, 3) after turns (n,), no
    bias.
    """
    in_hub = np.mean(corners_mm @ rotation_z(turn_rad), axis=0)  # (4, 3)
    return np.concatenate([np.zeros(4), in_hub.ravel(), np.zeros(BIASES * len(cameras))])


def bias_sigmas(cameras: Cameras) -> np.ndarray:
    """Return the prior sigmas (16 cameras,) of all biases, px, and of their changes, px/rad."""
    biases = np.repeat(_BIAS_PX, BIASES // 2 * len(cameras))
    return np.concatenate([biases, _DRIFT_PER_RAD * biases])


@dataclass(frozen=True, eq=False)
class MarkerPictures:
    """A marker in n pictures: px (n, 4, 2) of its corners, camera (n,): the number of each one's."""

    px: np.ndarray
    camera: np.ndarray

    @classmethod
    def of(cls, sightings: Sequence[MarkerSighting], cameras: Cameras) -> "MarkerPictures":
        """Return the pictures of one marker's sightings."""
        px = np.array([one.px for one in sightings])
        return cls(px, np.array([cameras.index(one.camera) for one in sightings]))

    @cached_property
    def cameras_with_pictures(self) -> list[int]:
        """Return the numbers of the cameras that see the marker."""
        return np.unique(self.camera).tolist()

    def project(self, parameters: np.ndarray, turn_rad: np.ndarray, cameras: Cameras) -> np.ndarray:
        """Return the corners (n, 4, 2), px, after turns (n,), without bias."""
        w_x, w_y, v_x, v_y = parameters[:4]
        in_hub = parameters[4:FIRST_BIAS].reshape(4, 3)
        turned = in_hub @ np.swapaxes(rotation_z(turn_rad), 1, 2)  # (n, 4, 3)
        lean = exp_rotation(np.array([w_x, w_y, 0.0]))
        points_mm = turned @ lean.T + np.array([v_x, v_y, 0.0])
        px = np.empty_like(self.px)
        for k in self.cameras_with_pictures:
            own = self.camera == k
            px[own] = cameras.cameras[k].project(points_mm[own])
        return px

    def residuals(
        self,
        parameters: np.ndarray,
        turn_rad: np.ndarray,
        middle_rad: float,
        cameras: Cameras,
        scatter_px: np.ndarray,
    ) -> np.ndarray:
        """Return the corners as expected less those seen, over their scatter, (8 n,).

        middle_rad: of the motion, from which on biases change. scatter_px (cameras, 1 or 2): of
        corners along x and y.
        """
        expected_px = self.project(parameters, turn_rad, cameras)
        expected_px += self._bias_px(parameters, turn_rad - middle_rad, cameras)
        sigma_px = scatter_px[self.camera][:, None]
        return ((expected_px - self.px) / sigma_px).ravel()

    def of_corners(self, values: np.ndarray) -> np.ndarray:
        """Return what of a fit's residuals, or of their derivatives, belongs to corners, (8 n, …)."""
        return values[: self.px.size]

    def by_camera_errors(
        self,
        fitted: OptimizeResult,
        turn_rad: np.ndarray,
        cameras: Cameras,
        scatter_px: np.ndarray,
        errors: np.ndarray,
        covariance: np.ndarray,
    ) -> np.ndarray:
        """Return by how much a fit's parameters move (p, k) with unit errors (15 cameras, k) of the
        cameras.

        covariance (p, p): of the parameters, by the scatter alone.
        """
        here = self.project(fitted.x, turn_rad, cameras)
        by_error_px = np.zeros((*here.shape, errors.shape[1]))
        for k, error in enumerate(errors.T):
            by_error_px[..., k] = self.project(fitted.x, turn_rad, cameras.moved(error)) - here
        sigma_px = scatter_px[self.camera][:, None, :, None]
        over_sigma = (by_error_px / sigma_px).reshape(self.px.size, -1)
        by_parameters = self.of_corners(fitted.jac)
        return covariance @ (by_parameters.T @ over_sigma)

    def _bias_px(
        self, parameters: np.ndarray, from_middle_rad: np.ndarray, cameras: Cameras
    ) -> np.ndarray:
        """Return the biases (n, 4, 2) of the corners; from_middle_rad (n,): turns from the middle."""
        biases = parameters[FIRST_BIAS : FIRST_BIAS + BIASES * len(cameras)]
        constant_px, drift_px_rad = biases.reshape(2, -1, 4, 2)
        drift_px = drift_px_rad[self.camera] * from_middle_rad[:, None, None]
        return constant_px[self.camera] + drift_px
