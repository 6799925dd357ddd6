"""The motor's axis by a marker on the hub, which turns with the motor in every frame of a stroke.

Each of its corners describes a circle about the axis:

    x = Exp(w) Rz(motor angle) q + v,    q: the corner in the hub

Free and bent strokes serve alike. A marker fixes the axis and where it stands, across it; where the
whisker leaves the hub (the encoder's zero, the height along the axis) only the whisker shows.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from vision.calibration.marker_pictures import (
    AXIS_OF_PLACEMENT,
    FIRST_BIAS,
    FIRST_SCATTER_PX,
    LEAST_SCATTER_PX,
    MarkerPictures,
    MarkerSighting,
    bias_sigmas,
    first_parameters,
    triangulate_corners,
)
from vision.calibration.place import Placement
from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused
from vision.geometry.robust import robust_sigma
from vision.geometry.rotation import skew

# [pictures] Of a marker in two cameras; fewer show no turn. Derived.
_FEWEST_INSTANTS = 4
# [rad] Of the motor, over all pictures of a marker. Half the smallest stroke that is evaluated.
# Stated.
_LEAST_TURN_RAD = np.radians(2.0)
# [1] How far a marker's turn may be from the motor's, over it, to be on the hub: one at rest is off by
# 1, that of steel-sample by 0.004. Stated.
_TURNS_AS_MOTOR = 0.2
# [passes] Of the fit before the last: each gives scatter and size of the biases to the next. Stated.
_PASSES = 3
# [rad], [mm] Prior sigma of what a marker does not constrain: none. Stated.
_UNSEEN = (1.0, 1000.0)
_SOURCE = "marker on the hub"


@dataclass(frozen=True, eq=False)
class _Turning:
    """A marker that turns with the motor: its sightings, and its corners mm (n, 4, 3) at motor angles
    (n,) rad, where two cameras see it.
    """

    sightings: list[MarkerSighting]
    motor_rad: np.ndarray
    corners_mm: np.ndarray


def first_axis(sightings: Sequence[MarkerSighting], cameras: Cameras) -> np.ndarray | None:
    """Return the axis that markers turn about, as T (3, 4) from a frame with that axis as its z, and
    its origin relative to the markers, to the cameras'; None where no marker turns with the motor.
    """
    turning = list(_turning(sightings, cameras))
    if not turning:
        return None
    twist = np.mean([_twist(marker) for marker in turning], axis=0)
    z = twist[:3] / np.linalg.norm(twist[:3])
    on_axis = np.cross(twist[:3], twist[3:]) / (twist[:3] @ twist[:3])
    middle = np.mean([marker.corners_mm.mean(axis=(0, 1)) for marker in turning], axis=0)
    origin = on_axis + z * (z @ (middle - on_axis))
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z, origin])


def by_marker(sightings: Sequence[MarkerSighting], cameras: Cameras) -> Placement:
    """Return the placement by the markers that turn with the motor, about z of the cameras' frame or
    nearly so; what they do not constrain has a sigma without end.

    cameras: without the uncertainty of their place in the rig frame, which is what is sought. Raises
    Refused where no marker turns.
    """
    fits = [_AxisFit(marker, cameras) for marker in _turning(sightings, cameras)]
    if not fits:
        raise Refused("no marker is seen to turn with the motor in two cameras")
    covariance = np.diag(np.repeat(np.square(_UNSEEN), 3))
    step = np.zeros(6)
    axis = AXIS_OF_PLACEMENT
    step[axis], covariance[np.ix_(axis, axis)] = _combine(fits)
    numbers = ", ".join(str(fit.number) for fit in fits)
    pictures = sum(fit.pictures for fit in fits)
    basis = f"marker {numbers} on the hub in {pictures} pictures"
    note = _note(basis, np.sqrt(np.diag(covariance)))
    return Placement(step, covariance, source=_SOURCE, basis=basis, notes=(note,))


def _combine(fits: Sequence["_AxisFit"]) -> tuple[np.ndarray, np.ndarray]:
    """Return the weighted mean (4,) of the markers' axes and its covariance (4, 4).

    The cameras' errors are common to all markers: their part does not decrease with the number.
    """
    precision = np.zeros((4, 4))
    weighted = np.zeros(4)
    shared = np.zeros((4, 4))
    for fit in fits:
        own = np.linalg.inv(fit.covariance)
        precision += own
        weighted += own @ fit.axis
        shared += fit.by_cameras / len(fits)
    return np.linalg.solve(precision, weighted), np.linalg.inv(precision) + shared


def _note(basis: str, sigma: np.ndarray) -> str:
    """Return the note on how well the axis is known; sigma (6,): of the placement, rad and mm."""
    return (
        f"{basis.capitalize()} gives: axis ± "
        f"{np.degrees(max(sigma[0], sigma[1])):.3f} degrees, through a point ± {sigma[3]:.4f} mm along and ± "
        f"{sigma[4]:.4f} mm across the whisker."
    )


class _AxisFit:
    """The axis by one marker: w_x, w_y (rad), v_x, v_y (mm), with covariances of what each picture
    has by itself and of what the cameras' own uncertainty adds.

    A corner's bias in each camera and its change with the motor's angle are nuisances, as nothing
    says how a print's edge is blurred. Their size is that of the prior, or what residuals show.
    """

    def __init__(self, marker: _Turning, cameras: Cameras):
        """Fit the axis by all pictures of a marker."""
        self._cameras = cameras
        self._seen = MarkerPictures.of(marker.sightings, cameras)
        motor_rad = np.array([one.motor_rad for one in marker.sightings])
        self._motor_rad = motor_rad
        self._middle_rad = 0.5 * (motor_rad.min() + motor_rad.max())
        self.number = marker.sightings[0].number
        self.pictures = len(marker.sightings)
        fitted = self._fit(marker)
        covariance = np.linalg.inv(fitted.jac.T @ fitted.jac)
        by_error = self._seen.by_camera_errors(
            fitted, motor_rad, cameras, self._scatter_px, cameras.by_error, covariance
        )
        self.axis = fitted.x[:4]
        self.covariance = covariance[:4, :4]
        self.by_cameras = by_error[:4] @ by_error[:4].T

    def _fit(self, marker: _Turning) -> OptimizeResult:
        """Fit in passes: each gives the corners' scatter and the size of their biases to the next."""
        stated = bias_sigmas(self._cameras)
        self._prior = stated
        self._scatter_px = np.full((len(self._cameras), 2), FIRST_SCATTER_PX)
        parameters = first_parameters(marker.corners_mm, marker.motor_rad, self._cameras)
        scale = 1.0
        for _ in range(_PASSES):
            fitted = self._solve(parameters)
            parameters = fitted.x
            self._scatter_px = self._scatter(fitted)
            scale = max(scale * self._bias_excess(fitted), 1.0)
            self._prior = scale * stated
        return self._solve(parameters)

    def _solve(self, first: np.ndarray) -> OptimizeResult:
        """Fit from these parameters. Raises Refused where the fit does not converge."""
        fitted = least_squares(self._residuals, first, x_scale="jac", loss=self._loss)
        if fitted.status <= 0:
            raise Refused(f"the turn of marker {self.number} on the hub was not found")
        return fitted

    def _scatter(self, fitted: OptimizeResult) -> np.ndarray:
        """Return the scatter (cameras, 2) of corners along x and y, px, by the residuals."""
        residual = self._seen.of_corners(fitted.fun).reshape(self._seen.px.shape)
        scatter_px = self._scatter_px.copy()
        for k in self._seen.cameras_with_pictures:
            x_y = np.moveaxis(residual[self._seen.camera == k], -1, 0)
            scatter_px[k] *= [robust_sigma(one) for one in x_y]
        return np.maximum(scatter_px, LEAST_SCATTER_PX)

    def _bias_excess(self, fitted: OptimizeResult) -> float:
        """Return how many times as large as their prior sigma the biases are, as far as pictures
        constrain them.
        """
        covariance = np.linalg.inv(fitted.jac.T @ fitted.jac)
        constrained = np.sum(1.0 - np.diag(covariance)[FIRST_BIAS:] / np.square(self._prior))
        found = np.sum(np.square(fitted.x[FIRST_BIAS:] / self._prior))
        # The prior counts as one bias of its size more.
        return float(np.sqrt((1.0 + found) / (1.0 + constrained)))

    def _loss(self, squares: np.ndarray) -> np.ndarray:
        """Return the loss (3, n) of squared residuals, its slope and its bend: robust for corners in
        pictures, plain for the biases.
        """
        loss = np.stack([squares, np.ones_like(squares), np.zeros_like(squares)])
        seen = 1.0 + self._seen.of_corners(squares)
        robust = [2.0 * (np.sqrt(seen) - 1.0), seen**-0.5, -0.5 * seen**-1.5]
        loss[:, : len(seen)] = robust
        return loss

    def _residuals(self, parameters: np.ndarray) -> np.ndarray:
        """Return all residuals over their sigmas: of the corners in pictures, then of the biases."""
        of_corners = self._seen.residuals(
            parameters, self._motor_rad, self._middle_rad, self._cameras, self._scatter_px
        )
        return np.concatenate([of_corners, parameters[FIRST_BIAS:] / self._prior])


def _turning(sightings: Sequence[MarkerSighting], cameras: Cameras) -> Iterator[_Turning]:
    """Yield the markers that are seen to turn as the motor does."""
    for number in sorted({one.number for one in sightings}):
        own = [one for one in sightings if one.number == number]
        met, corners_mm = triangulate_corners(own, cameras)
        motor_rad = np.array([one.motor_rad for one in met])
        marker = _Turning(own, motor_rad, corners_mm)
        if len(motor_rad) < _FEWEST_INSTANTS or np.ptp(motor_rad) < _LEAST_TURN_RAD:
            continue
        turn = np.linalg.norm(_twist(marker)[:3])
        if abs(turn - 1.0) < _TURNS_AS_MOTOR:
            yield marker


def _twist(marker: _Turning) -> np.ndarray:
    """Return the twist (6,), w and u of dx/d(motor angle) = w × x + u, that moves a marker's corners.

    The length of w is the marker's turn over the motor's.
    """
    angle = marker.motor_rad - marker.motor_rad.mean()
    middle = marker.corners_mm.mean(axis=0)  # (4, 3)
    away = marker.corners_mm - middle
    rate = np.tensordot(angle, away, axes=1) / (angle @ angle)
    design = np.concatenate([-skew(middle), np.tile(np.eye(3), (4, 1, 1))], axis=2)  # (4, 3, 6)
    return np.linalg.lstsq(design.reshape(12, 6), rate.ravel(), rcond=None)[0]
