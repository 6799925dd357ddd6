"""The cameras: calibrated and placed in the rig frame, with the covariance of all their parameters.

Lengths in mm, angles in rad, picture coordinates in px with pixel centres at integers (OpenCV's convention).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vision.geometry import lens as lens_model
from vision.geometry.checks import require
from vision.geometry.rotation import apply, exp_rotation, nearest_rotation, skew

# [parameters] A layout, no threshold: nine of the lens, six of the pose.
N_PARAMETERS = 15
PARAMETERS = (*lens_model.LENS_TERMS, "w_x", "w_y", "w_z", "v_x", "v_y", "v_z")
# [1] Written-out rotations carry rounding; beyond this the matrix is none at all. Stated.
_ROTATION_TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class Camera:
    """One calibrated camera, placed in the rig frame.

    size_px: (width, height). matrix: (3, 3), px. distortion: (5,) k1 k2 p1 p2 k3. T_camera_rig: (3, 4), mm.
    Its 15 parameters (for Jacobians and covariances, see PARAMETERS) are fx fy cx cy k1 k2 p1 p2 k3 and a
    small rotation w and shift v in the camera frame: x_camera = Exp(w) R x_rig + t + v, with w = v = 0 at
    the stored pose.
    """

    name: str
    size_px: tuple[int, int]
    matrix: np.ndarray
    distortion: np.ndarray
    T_camera_rig: np.ndarray
    rms_px: float = 0.0

    def __post_init__(self):
        for name, shape in (("matrix", (3, 3)), ("distortion", (5,)), ("T_camera_rig", (3, 4))):
            object.__setattr__(self, name, self._checked(name, shape))
        require(
            len(self.size_px) == 2
            and all(n > 0 and n % 1 == 0 for n in self.size_px),  # NaN and infinity are not
            f"camera {self.name}: size_px = {list(self.size_px)}, must be two counts above 0",
        )
        object.__setattr__(self, "size_px", tuple(int(n) for n in self.size_px))
        self._check_matrix()
        self._settle_rotation()

    def _checked(self, name: str, shape: tuple[int, ...]) -> np.ndarray:
        value = np.array(getattr(self, name), dtype=float)
        require(
            value.shape == shape and bool(np.all(np.isfinite(value))),
            f"camera {self.name}: {name} must be {' x '.join(map(str, shape))} finite numbers, "
            f"found {' x '.join(map(str, value.shape))}",
        )
        value.setflags(write=False)
        return value

    def _check_matrix(self) -> None:
        K = self.matrix
        upper = np.array([[K[0, 0], 0, K[0, 2]], [0, K[1, 1], K[1, 2]], [0, 0, 1]])
        require(
            np.allclose(K, upper) and min(K[0, 0], K[1, 1]) > 0,
            f"camera {self.name}: matrix must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with fx, fy above 0",
        )

    def _settle_rotation(self) -> None:
        """Rounding in a file is taken out, so that every use sees an exact rotation."""
        R = nearest_rotation(self.T_camera_rig[:, :3])
        require(
            bool(np.abs(R - self.T_camera_rig[:, :3]).max() < _ROTATION_TOLERANCE),
            f"camera {self.name}: the left 3 x 3 of T_camera_rig is no rotation",
        )
        T = np.column_stack([R, self.T_camera_rig[:, 3]])
        T.setflags(write=False)
        object.__setattr__(self, "T_camera_rig", T)

    @cached_property
    def lens(self) -> np.ndarray:
        """The nine lens parameters, (9,): fx fy cx cy k1 k2 p1 p2 k3."""
        K = self.matrix
        return np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], *self.distortion])

    @property
    def centre_mm(self) -> np.ndarray:
        """Centre of projection in the rig frame, (3,)."""
        return -self.T_camera_rig[:, :3].T @ self.T_camera_rig[:, 3]

    def project(self, points_mm: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of points in the rig frame (n, 3); NaN behind the camera."""
        return lens_model.project(
            apply(self.T_camera_rig, np.asarray(points_mm, dtype=float)), self.lens
        )

    def project_with_jacobians(
        self, points_mm: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pixels (n, 2) of rig points (n, 3), d px / d point (n, 2, 3), d px / d parameters (n, 2, 15)."""
        R = self.T_camera_rig[:, :3]
        turned = np.asarray(points_mm, dtype=float) @ R.T
        x_camera = turned + self.T_camera_rig[:, 3]
        px, by_x, by_lens = lens_model.project_with_jacobians(x_camera, self.lens)
        by_turn = -by_x @ skew(turned)  # Exp(w) y = y + w × y = y − skew(y) w to first order
        return px, by_x @ R, np.concatenate([by_lens, by_turn, by_x], axis=2)

    def rays(self, px: np.ndarray) -> np.ndarray:
        """Directions (n, 3), unit vectors of the rig frame, in which pixels (n, 2) look; NaN where the lens folds."""
        ab = lens_model.unproject(np.asarray(px, dtype=float), self.lens)
        directions = np.column_stack([ab, np.ones(len(ab))]) @ self.T_camera_rig[:, :3]
        return directions / np.linalg.norm(directions, axis=1, keepdims=True)

    def moved(self, step: np.ndarray) -> "Camera":
        """The camera whose 15 parameters differ by `step` (15,): one draw from a covariance, one fitting step."""
        fx, fy, cx, cy = self.lens[:4] + step[:4]
        T = self.T_camera_rig
        return replace(
            self,
            matrix=np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]),
            distortion=self.distortion + step[4:9],
            T_camera_rig=np.column_stack(
                [exp_rotation(step[9:12]) @ T[:, :3], T[:, 3] + step[12:15]]
            ),
        )


@dataclass(frozen=True, eq=False)
class Cameras:
    """Cameras of one rig with the joint covariance of all their parameters.

    covariance: (15 n, 15 n) in the cameras' order, each camera's parameters as in PARAMETERS; a row of
    zeros is a parameter held fixed. Left out, everything is taken as exact. placement (6, 6): what of it is the rig
    frame's own, of a turn w (rad) and shift v (mm) that all cameras share, x = Exp(w) x_rig + v; None where not told.
    """

    cameras: tuple[Camera, ...]
    covariance: np.ndarray = field(default=None)
    placement: np.ndarray | None = None

    def __post_init__(self):
        object.__setattr__(self, "cameras", tuple(self.cameras))
        require(
            len(set(self.names)) == len(self.cameras),
            f"two cameras share a name: {', '.join(self.names)}",
        )
        n = N_PARAMETERS * len(self.cameras)
        covariance = (
            np.zeros((n, n)) if self.covariance is None else np.array(self.covariance, dtype=float)
        )
        require(
            covariance.shape == (n, n),
            f"covariance of {len(self.cameras)} cameras must be {n} x {n}, found "
            + " x ".join(map(str, covariance.shape)),
        )
        require(
            bool(np.all(np.isfinite(covariance))),
            "covariance of the cameras holds a number that is not finite",
        )
        covariance = 0.5 * (covariance + covariance.T)
        covariance.setflags(write=False)
        object.__setattr__(self, "covariance", covariance)
        self._settle_placement()

    def _settle_placement(self) -> None:
        placement = self.placement
        if placement is None and not self.covariance.any():
            placement = np.zeros((6, 6))  # exact cameras are exactly placed
        if placement is None:
            return
        placement = np.array(placement, dtype=float)
        require(
            placement.shape == (6, 6) and bool(np.all(np.isfinite(placement))),
            "the cameras' placement must be 6 x 6 finite numbers",
        )
        placement.setflags(write=False)
        object.__setattr__(self, "placement", placement)

    @property
    def by_placement(self) -> np.ndarray:
        """The parameters' derivatives (15 n, 6) by a turn and a shift of the rig frame; lenses stand still."""
        rows = np.zeros((len(self), N_PARAMETERS, 6))
        for camera, own in zip(self.cameras, rows):
            own[-6:] = np.kron(np.eye(2), camera.T_camera_rig[:, :3])
        return rows.reshape(-1, 6)

    @property
    def names(self) -> tuple[str, ...]:
        """The cameras' names, in their order."""
        return tuple(camera.name for camera in self.cameras)

    def __len__(self) -> int:
        return len(self.cameras)

    def __iter__(self) -> Iterator[Camera]:
        return iter(self.cameras)

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> Camera:
        """The camera of that name; KeyError where there is none."""
        return self.cameras[self.index(name)]

    def index(self, name: str) -> int:
        """Place of the camera in the covariance's order; raises KeyError where there is none."""
        if name not in self.names:
            raise KeyError(f"no camera {name!r}, there are {', '.join(self.names)}")
        return self.names.index(name)

    def parameters_of(self, name: str) -> slice:
        """Rows of `covariance` that are this camera's."""
        first = N_PARAMETERS * self.index(name)
        return slice(first, first + N_PARAMETERS)

    def subset(self, names: Sequence[str]) -> "Cameras":
        """These cameras in this order, with their share of the covariance."""
        rows = np.concatenate(
            [np.arange(N_PARAMETERS) + self.parameters_of(n).start for n in names]
        )
        return Cameras(
            tuple(self[n] for n in names), self.covariance[np.ix_(rows, rows)], self.placement
        )

    def moved(self, step: np.ndarray) -> "Cameras":
        """The cameras with all parameters changed by `step` (15 n,), in the same order; same covariance."""
        steps = np.asarray(step, dtype=float).reshape(len(self), N_PARAMETERS)
        return replace(self, cameras=tuple(c.moved(s) for c, s in zip(self.cameras, steps)))
