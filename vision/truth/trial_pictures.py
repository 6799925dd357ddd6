"""A trial as the cameras recorded it: the pictures, and where the motor stood when they were taken."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused
from vision.pictures.others import Others, RodLines
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.pyramid import shrunk_frames, shrunk_picture
from vision.pictures.view import View

# [pictures] Of a camera that is asked: two tell the noise, a third what moves. Derived.
_FEWEST_PICTURES = 3


@dataclass(frozen=True, eq=False)
class TrialPictures:
    """frames: per camera the grey pictures (h, w) by frame index, a missing index is a lost frame; time_s, motor_rad
    (n,) at each frame; background: per camera the scene (h, w) without whisker and bar, or None. object_velocity_mm_s
    (3,), with one sigma each way: of a bar that moves, rig frame; None where it stands.
    object_gives_way: it stands until it is touched, and comes back. others: by camera, rods in its pictures that are
    not the wire; itself: where that is, to a pixel or two, where it is known beforehand."""

    frames: Mapping[str, Mapping[int, np.ndarray]]
    time_s: np.ndarray
    motor_rad: np.ndarray
    background: Mapping[str, np.ndarray | None]
    object_velocity_mm_s: np.ndarray | None = None
    object_velocity_sigma_mm_s: float = 0.0
    object_gives_way: bool = False
    others: Mapping[str, Others] = field(default_factory=dict)
    itself: Mapping[str, RodLines] = field(default_factory=dict)

    def shrunk(self, scale: int) -> "TrialPictures":
        """The same with pixels `scale` times as wide."""
        behind = self.background.items()
        background = {
            name: None if empty is None else shrunk_picture(empty, scale) for name, empty in behind
        }
        others = {
            name: {rod: lines.shrunk(scale) for rod, lines in some.items()}
            for name, some in self.others.items()
        }
        itself = {name: lines.shrunk(scale) for name, lines in self.itself.items()}
        frames = shrunk_frames(self.frames, scale)
        return replace(self, frames=frames, background=background, others=others, itself=itself)

    def views(self, cameras: Cameras) -> tuple[View, ...]:
        """What each camera that has three pictures or more shows. Raises Refused where none has."""
        views = tuple(
            self._view(camera)
            for camera in cameras
            if len(self.frames.get(camera.name, ())) >= _FEWEST_PICTURES
        )
        if not views:
            raise Refused("no camera has three frames or more", code="no_camera_with_frames")
        return views

    def _view(self, camera) -> View:
        pictures, empty = self.frames[camera.name], self.background.get(camera.name)
        first, second = list(pictures.values())[:2]
        empty = np.zeros(first.shape) if empty is None else np.asarray(empty, dtype=float)
        others, itself = self.others.get(camera.name, {}), self.itself.get(camera.name)
        return View(camera, pictures, empty, measure_noise(first, second), others, itself)
