"""A whisk whose wire and bar are known exactly, in the terms in which whisks are fitted."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision.fit.problem import Problem, State
from vision.geometry.camera import Camera
from vision.geometry.centreline import REST_POWERS, Curves, one_curve
from vision.geometry.contact import BarAxis
from vision.geometry.rods import Rods
from vision.truth.line_source import WhiskPlace
from vision.truth.strategies import TouchByClearance

# [rad] A camera that looks at the bar at less than this to its axis has it a third as long. Stated.
_ALONG_RAD = np.radians(20.0)


@dataclass(frozen=True, eq=False)
class KnownWhisk:
    """One whisk of which everything is known.

    axis: of the bar, its point opposite the first contact. motor_rad, time_s (f,): of the frames.
    bend_rad (f, 2), arc_mm (f,): bend and contact arc in each, before touch 0 and that of the
    touch. rest_mm (2, 4): rest shape, see `vision.geometry.centreline`. touch_rad, contact_mm (3,):
    motor angle and contact of first touch.
    """

    rods: Rods
    axis: BarAxis
    motor_rad: np.ndarray
    time_s: np.ndarray
    bend_rad: np.ndarray
    arc_mm: np.ndarray
    rest_mm: np.ndarray
    touch_rad: float
    contact_mm: np.ndarray

    @staticmethod
    def rest_shape(share: np.ndarray, offset_mm: np.ndarray) -> np.ndarray:
        """Return the rest shape (2, 4) of a wire by its offsets (n, 2) in y and z, mm.

        share (n,): where on the wire they are, 0 at its base and 1 at its tip.
        """
        powers = np.vander(share, REST_POWERS, increasing=True)
        return np.linalg.lstsq(powers, offset_mm, rcond=None)[0].T

    @property
    def frames_to_fit(self) -> list[int]:
        """Return the frames that make the truth."""
        motor = dict(enumerate(self.motor_rad.tolist()))
        return TouchByClearance().frames_to_fit(motor, dict(enumerate(self.bend_rad)))

    def curves(self, frames: Sequence[int]) -> dict[int, Curves]:
        """Return the wire's centreline by frame."""
        curves = {}
        for f in frames:
            curves[f] = one_curve(
                self.rest_mm, self.bend_rad[f], self.arc_mm[f], self.motor_rad[f], self.rods.wire
            )
        return curves

    def place(self, frames: Sequence[int]) -> WhiskPlace:
        """Return where wire and bar are in these frames."""
        return WhiskPlace(self.axis, self.curves(frames), self.rods.bar.radius_mm)

    def is_touching(self, frames: Sequence[int]) -> np.ndarray:
        """Return in which of these frames (f,) bool the whisker touches."""
        return self.motor_rad[frames] > self.touch_rad

    def state(self, problem: Problem, frames: Sequence[int]) -> State:
        """Return the parameters of a fit to these frames."""
        vector = np.zeros(problem.size)
        vector[problem.blocks.rest_shape.slice] = np.ravel(self.rest_mm)
        vector[problem.first_bend :] = self.bend_rad[frames][problem.bent].ravel()
        return State(vector, self.arc_mm[frames])

    def is_bar_nearer(self, camera: Camera) -> bool:
        """Return whether the bar stands before the whisker at first touch."""
        to_bar_mm = np.linalg.norm(self.axis.point_mm - camera.centre_mm)
        return bool(to_bar_mm < np.linalg.norm(self.contact_mm - camera.centre_mm))

    def angle_to_bar_rad(self, camera: Camera) -> float:
        """Return the angle between a camera's line of sight and the bar, where it is touched."""
        sight = self.axis.point_mm - camera.centre_mm
        cosine = abs(sight @ self.axis.direction) / np.linalg.norm(sight)
        return float(np.arccos(np.clip(cosine, 0.0, 1.0)))

    def is_seen_along_bar(self, camera: Camera) -> bool:
        """Return whether a camera looks so nearly along the bar that it hardly shows its edges."""
        return self.angle_to_bar_rad(camera) < _ALONG_RAD
