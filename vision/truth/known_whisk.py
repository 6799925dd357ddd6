"""A whisk whose wire and bar are known exactly, in the terms in which whisks are fitted."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vision.fit.problem import Problem, State, at_rest
from vision.geometry.camera import Camera, Cameras
from vision.geometry.centreline import REST_POWERS, Curves, centrelines
from vision.geometry.contact import BarAxis
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View
from vision.truth.strategies import TouchByClearance
from vision.truth.whisk_pictures import WhiskPictures
from vision.truth.whisk_place import WhiskPlace
from vision.wire.points import Observed

# [rad] A camera whose line of sight is nearer to the bar's axis than this has it a third as long. Stated.
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

    @cached_property
    def frames_to_fit(self) -> list[int]:
        """Return the frames (f,) that make the truth."""
        motor = dict(enumerate(self.motor_rad.tolist()))
        return TouchByClearance().frames_to_fit(motor, dict(enumerate(self.bend_rad)))

    def curves(self, frames: Sequence[int]) -> dict[int, Curves]:
        """Return the wire's centreline by frame."""
        curves = {}
        for f in frames:
            curves[f] = centrelines(
                self.rest_mm, self.bend_rad[f], self.arc_mm[f], self.motor_rad[f], self.rods.wire
            )
        return curves

    @cached_property
    def place(self) -> WhiskPlace:
        """Return where wire and bar are in the frames that make the truth."""
        curves = self.curves(self.frames_to_fit)
        return WhiskPlace(self.axis, curves, self.rods.bar.radius_mm)

    def pictured(
        self, views: Sequence[View], cameras: Cameras, settings: VisionSettings
    ) -> WhiskPictures:
        """Return the whisk in views by these cameras, in the frames that all of them have."""
        return WhiskPictures(
            0,
            range(len(self.motor_rad)),
            self.time_s,
            self.motor_rad,
            tuple(views),
            cameras,
            self.rods,
            None,
            settings,
        )

    def problem(
        self, cameras: Cameras, seen: Sequence[Observed], correlation: Sequence[float] = ()
    ) -> Problem:
        """Return the fit to the frames that make the truth.

        correlation: by camera, of the errors of neighbouring points of the wire.
        """
        motor_rad = self.motor_rad[self.frames_to_fit]
        touches = motor_rad > self.touch_rad
        return Problem(
            cameras,
            self.rods,
            self.axis,
            motor_rad,
            touches,
            touches,
            seen,
            neighbour_correlation=correlation,
        )

    def state(self, problem: Problem) -> State:
        """Return the parameters of a fit to the frames that make the truth."""
        frames = self.frames_to_fit
        vector = at_rest(problem, self.rest_mm)
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
        """Return whether a line of sight is so nearly along the bar that its edges hardly show."""
        return self.angle_to_bar_rad(camera) < _ALONG_RAD
