"""The cameras: calibrated and placed in the rig frame, with the covariance of all their parameters.

Lengths in mm, angles in rad, picture coordinates in px with pixel centres at integers (OpenCV's
convention).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vision.geometry import lens as lens_model
from vision.geometry.checks import require
from vision.geometry.optics import UNKNOWN, Optics
from vision.geometry.rotation import apply, moved_pose, nearest_rotation, skew, unit

# [parameters] A layout, no threshold: nine of the lens, six of the pose.
N_PARAMETERS = 15
PARAMETERS = (*lens_model.LENS_TERMS, "w_x", "w_y", "w_z", "v_x", "v_y", "v_z")
# [px, mm, 1] No lens, picture or rig has a larger one, and its powers stay finite. Stated.
MOST_NUMBER = 1e9
# [1] Written-out rotations carry rounding; beyond this the matrix is none at all. Stated.
_ROTATION_TOLERANCE = 1e-4


@dataclass(frozen=True, eq=False)
class Camera:
    """One calibrated camera, placed in the rig frame.

    size_px: (width, height). matrix: (3, 3), px. distortion: (5,) k1 k2 p1 p2 k3. T_camera_rig: (3,
    4), mm. optics: transfer curve and lens blur.

    Its 15 parameters (for Jacobians and covariances, see PARAMETERS) are fx fy cx cy k1 k2 p1 p2 k3
    and a small rotation w and shift v in the camera frame: x_camera = Exp(w) R x_rig + t + v, with
    w = v = 0 at the stored pose. Raises Refused where numbers are missing, not finite, or no
    camera's.
    """

    name: str
    size_px: tuple[int, int]
    matrix: np.ndarray
    distortion: np.ndarray
    T_camera_rig: np.ndarray
    rms_px: float = 0.0
    optics: Optics = UNKNOWN

    def __post_init__(self):
        """Raise Refused where a field cannot be, and store read-only arrays with an exact rotation."""
        shapes = {"matrix": (3, 3), "distortion": (5,), "T_camera_rig": (3, 4)}
        for name, shape in shapes.items():
            value = _require_finite(f"camera {self.name}: {name}", getattr(self, name), shape)
            object.__setattr__(self, name, value)
        are_counts = all(
            0 < n < MOST_NUMBER and n % 1 == 0 for n in self.size_px
        )  # NaN and infinity are not
        require(
            len(self.size_px) == 2 and are_counts,
            f"camera {self.name}: size_px = {list(self.size_px)}, must be two counts above 0",
        )
        object.__setattr__(self, "size_px", tuple(int(n) for n in self.size_px))
        require(
            np.allclose(self.matrix, camera_matrix(self.lens)) and min(self.lens[:2]) > 0,
            f"camera {self.name}: matrix must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with fx, fy above 0",
        )
        object.__setattr__(self, "T_camera_rig", self._exact_pose())

    def _exact_pose(self) -> np.ndarray:
        """Return T_camera_rig (3, 4) without the rounding of a file, so that every use has an exact
        rotation. Raises Refused where it has none.
        """
        R = nearest_rotation(self.T_camera_rig[:, :3])
        require(
            bool(np.abs(R - self.T_camera_rig[:, :3]).max() < _ROTATION_TOLERANCE),
            f"camera {self.name}: the left 3 x 3 of T_camera_rig is no rotation",
        )
        T = np.column_stack([R, self.T_camera_rig[:, 3]])
        T.setflags(write=False)
        return T

    @cached_property
    def lens(self) -> np.ndarray:
        """Return the nine lens parameters (9,): fx fy cx cy k1 k2 p1 p2 k3."""
        K = self.matrix
        return np.array([K[0, 0], K[1, 1], K[0, 2], K[1, 2], *self.distortion])

    @property
    def centre_mm(self) -> np.ndarray:
        """Return the centre of projection (3,) in the rig frame."""
        return -self.T_camera_rig[:, :3].T @ self.T_camera_rig[:, 3]

    def project(self, points_mm: np.ndarray) -> np.ndarray:
        """Project points (..., 3) of the rig frame to pixels (..., 2); NaN behind the camera."""
        points = np.asarray(points_mm, dtype=float)
        x_camera = apply(self.T_camera_rig, points.reshape(-1, 3))
        return lens_model.project(x_camera, self.lens).reshape(*points.shape[:-1], 2)

    def project_with_jacobians(
        self, points_mm: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return pixels (n, 2) of rig points (n, 3), d px / d point (n, 2, 3), and d px / d
        parameters (n, 2, 15).
        """
        R = self.T_camera_rig[:, :3]
        rotated = np.asarray(points_mm, dtype=float) @ R.T
        x_camera = rotated + self.T_camera_rig[:, 3]
        px, by_x, by_lens = lens_model.project_with_jacobians(x_camera, self.lens)
        by_rotation = -by_x @ skew(rotated)  # Exp(w) y = y + w × y = y − skew(y) w to first order
        return px, by_x @ R, np.concatenate([by_lens, by_rotation, by_x], axis=2)

    def rays(self, px: np.ndarray) -> np.ndarray:
        """Return the rays (n, 3) through pixels (n, 2), unit vectors of the rig frame; NaN where
        the lens folds.
        """
        ab = lens_model.unproject(np.asarray(px, dtype=float), self.lens)
        directions = np.column_stack([ab, np.ones(len(ab))]) @ self.T_camera_rig[:, :3]
        return unit(directions)

    def has_in_picture(self, px: np.ndarray) -> np.ndarray:
        """Return which (...) of points (..., 2) px lie in the picture."""
        last_px = np.array(self.size_px) - 1.0
        return np.all((px >= 0.0) & (px <= last_px), axis=-1)

    def moved(self, step: np.ndarray) -> "Camera":
        """Return the camera whose 15 parameters differ by `step` (15,): a draw from a covariance,
        or a step of a fit.
        """
        lens = self.lens + step[:9]
        return replace(
            self,
            matrix=camera_matrix(lens),
            distortion=lens[4:],
            T_camera_rig=moved_pose(self.T_camera_rig, step[9:]),
        )


def camera_matrix(lens: np.ndarray) -> np.ndarray:
    """Return the camera matrix (3, 3), px, of lens parameters fx fy cx cy …"""
    fx, fy, cx, cy = lens[:4]
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])


def symmetric_root(covariance: np.ndarray) -> np.ndarray:
    """Return a root R (n, n), with R Rᵀ equal to a covariance (n, n).

    Parameters are in px, rad and mm: each is counted in its own sigma meanwhile.
    """
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(sigma > 0.0, sigma, 1.0)
    variances, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    return scale[:, None] * (axes * np.sqrt(np.maximum(variances, 0.0))) @ axes.T


def _require_finite(name: str, value, shape: tuple[int, ...]) -> np.ndarray:
    """Return a read-only copy of `value`; raise Refused unless it is of this shape and finite."""
    array = np.array(value, dtype=float)
    require(
        array.shape == shape and bool(np.all(np.isfinite(array))),
        f"{name} must be {' x '.join(map(str, shape))} finite numbers, "
        f"found {' x '.join(map(str, array.shape))}",
    )
    largest = float(np.abs(array).max())
    require(largest < MOST_NUMBER, f"{name} holds {largest:g}, which no camera has")
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class Cameras:
    """The cameras of one rig with the joint covariance of all their parameters.

    covariance: (15 n, 15 n) in the cameras' order, each camera's parameters as in PARAMETERS; a row
    of zeros is a parameter held fixed. Left out, everything is taken as exact.
    placement (6, 6): the part of it that is the rig frame's own, of a rotation w (rad) and shift v
    (mm) that all cameras share, x = Exp(w) x_rig + v; None where it is not known.
    by_error (15 n, k): how the parameters change with each of k independent errors of unit
    variance, which make the covariance. Some of a rig's cameras have the errors of all of them, so
    that what was measured by different cameras of one rig has its errors in common.
    """

    cameras: tuple[Camera, ...]
    covariance: np.ndarray = field(default=None)
    placement: np.ndarray | None = None
    by_error: np.ndarray | None = None

    def __post_init__(self):
        """Raise Refused where names are used twice or a covariance cannot be."""
        object.__setattr__(self, "cameras", tuple(self.cameras))
        require(
            len(set(self.names)) == len(self.cameras),
            f"two cameras share a name: {', '.join(self.names)}",
        )
        n = N_PARAMETERS * len(self.cameras)
        covariance = np.zeros((n, n))
        if self.covariance is not None:
            covariance = np.array(self.covariance, dtype=float)
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
        object.__setattr__(self, "placement", self._known_placement())
        if self.by_error is None:
            object.__setattr__(self, "by_error", symmetric_root(covariance))

    def _known_placement(self) -> np.ndarray | None:
        """Return the placement's covariance (6, 6), 0 for exact cameras; raise Refused where it
        cannot be.
        """
        placement = self.placement
        if placement is None and not self.covariance.any():
            placement = np.zeros((6, 6))  # exact cameras are exactly placed
        if placement is None:
            return None
        placement = np.array(placement, dtype=float)
        require(
            placement.shape == (6, 6) and bool(np.all(np.isfinite(placement))),
            "the cameras' placement must be 6 x 6 finite numbers",
        )
        placement.setflags(write=False)
        return placement

    @property
    def by_placement(self) -> np.ndarray:
        """Return the parameters' derivatives (15 n, 6) by a rotation and a shift of the rig frame;
        0 for the lenses.
        """
        rows = np.zeros((len(self), N_PARAMETERS, 6))
        for camera, own in zip(self.cameras, rows):
            own[-6:] = np.kron(np.eye(2), camera.T_camera_rig[:, :3])
        return rows.reshape(-1, 6)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the cameras' names, in their order."""
        return tuple(camera.name for camera in self.cameras)

    def __len__(self) -> int:
        """Return the number of cameras."""
        return len(self.cameras)

    def __iter__(self) -> Iterator[Camera]:
        """Iterate over the cameras."""
        return iter(self.cameras)

    def __contains__(self, name: str) -> bool:
        """Return whether there is a camera of that name."""
        return name in self.names

    def __getitem__(self, name: str) -> Camera:
        """Return the camera of that name; raise KeyError where there is none."""
        return self.cameras[self.index(name)]

    def index(self, name: str) -> int:
        """Return the camera's place in the covariance's order; raise KeyError where there is none."""
        if name not in self.names:
            raise KeyError(f"no camera {name!r}, there are {', '.join(self.names)}")
        return self.names.index(name)

    def parameters_of(self, name: str) -> slice:
        """Return the rows of `covariance` that are this camera's."""
        first = N_PARAMETERS * self.index(name)
        return slice(first, first + N_PARAMETERS)

    def subset(self, names: Sequence[str]) -> "Cameras":
        """Return these cameras in this order, with their share of the covariance."""
        indices = np.arange(len(self.covariance))
        rows = np.concatenate([indices[self.parameters_of(name)] for name in names])
        covariance = self.covariance[np.ix_(rows, rows)]
        some = tuple(self[name] for name in names)
        return Cameras(some, covariance, self.placement, self.by_error[rows])

    def moved(self, step: np.ndarray) -> "Cameras":
        """Return the cameras with all parameters changed by `step` (15 n,), in the same order, and
        with the same covariance.
        """
        steps = np.asarray(step, dtype=float).reshape(len(self), N_PARAMETERS)
        return replace(self, cameras=tuple(c.moved(s) for c, s in zip(self.cameras, steps)))
