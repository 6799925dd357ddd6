"""A trial as the cameras recorded it: the pictures, and the motor angles at which they were taken."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.pictures.others import Others, RodLines
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.pyramid import shrunk_frames, shrunk_picture
from vision.pictures.view import View
from vision.truth.trace_points import Trace

# [pictures] Of a camera that is used: two give the noise, a third what moves. Derived.
_FEWEST_PICTURES = 3


@dataclass(frozen=True, eq=False)
class TrialPictures:
    """The pictures of a trial.

    frames: per camera the grey pictures (h, w) by frame index; a missing index is a lost frame.
    time_s, motor_rad (n,): at each frame.
    background: per camera the scene (h, w) without whisker and bar, or None.
    object_velocity_mm_s (3,): of a bar that moves, rig frame, with one sigma along each axis; None
    where it stands. object_gives_way: the bar stands until it is touched, and comes back.
    others: by camera, rods in its pictures that are not the wire.
    itself: by camera, the wire's place to a pixel or two, where that is known beforehand.
    traces: by camera, the wire's lines as another program has drawn them; with any, they are the only
    lines of the wire.
    picture_of: of cameras that are parts of one picture, the camera whose picture it is.
    """

    frames: Mapping[str, Mapping[int, np.ndarray]]
    time_s: np.ndarray
    motor_rad: np.ndarray
    background: Mapping[str, np.ndarray | None]
    object_velocity_mm_s: np.ndarray | None = None
    object_velocity_sigma_mm_s: float = 0.0
    object_gives_way: bool = False
    others: Mapping[str, Others] = field(default_factory=dict)
    itself: Mapping[str, RodLines] = field(default_factory=dict)
    traces: Mapping[str, Trace] = field(default_factory=dict)
    picture_of: Mapping[str, str] = field(default_factory=dict)

    def shrunk(self, scale: int) -> "TrialPictures":
        """Return the trial with pixels `scale` times as wide."""
        background = {}
        for name, empty in self.background.items():
            background[name] = None if empty is None else shrunk_picture(empty, scale)
        others = {}
        for name, rods in self.others.items():
            others[name] = {rod: lines.shrunk(scale) for rod, lines in rods.items()}
        itself = {name: lines.shrunk(scale) for name, lines in self.itself.items()}
        traces = {name: trace.shrunk(scale) for name, trace in self.traces.items()}
        return replace(
            self,
            frames=shrunk_frames(self.frames, scale),
            background=background,
            others=others,
            itself=itself,
            traces=traces,
        )

    def views(self, cameras: Cameras) -> tuple[View, ...]:
        """Return the view of each camera that has three pictures or more; raise Refused where none
        has.
        """
        views = []
        for camera in cameras:
            if len(self.frames.get(camera.name, ())) >= _FEWEST_PICTURES:
                views.append(self._view(camera))
        if not views:
            raise Refused("no camera has three frames or more", code="no_camera_with_frames")
        return tuple(views)

    def _view(self, camera: Camera) -> View:
        """Return one camera's pictures, with a black background where none was recorded."""
        pictures = self.frames[camera.name]
        first, second = list(pictures.values())[:2]
        background = self.background.get(camera.name)
        if background is None:
            background = np.zeros(first.shape)
        return View(
            camera,
            pictures,
            np.asarray(background, dtype=float),
            measure_noise(first, second),
            self.others.get(camera.name, {}),
            self.itself.get(camera.name),
        )
