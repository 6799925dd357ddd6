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

from vision.geometry.camera import Cameras
from vision.geometry.centreline import rotation_z
from vision.geometry.rotation import exp_rotation

# [parameters] Of the axis and of the corners, before the biases. A layout, no threshold.
FIRST_BIAS = 16
# [parameters] The biases and their changes of one camera. A layout, no threshold.
BIASES = 16
# [parameters] Of a placement, those of the axis: two turns, two shifts. A layout, no threshold.
AXIS_OF_PLACEMENT = np.array([0, 1, 3, 4])


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

    def bias_px(self, biases: np.ndarray, from_middle_rad: np.ndarray) -> np.ndarray:
        """Return the biases (n, 4, 2) of the corners, by the parameters (16 cameras,) of all cameras.

        from_middle_rad (n,): turns from the middle of the motion.
        """
        still_px, drift_px_rad = biases.reshape(2, -1, 4, 2)
        drift_px = drift_px_rad[self.camera] * from_middle_rad[:, None, None]
        return still_px[self.camera] + drift_px
