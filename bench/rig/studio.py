"""One camera before one scene: still parts drawn once, moving parts for each frame."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bench.rig.box import Box
from bench.rig.layer import Occluder
from bench.rig.painted_scene import Scene, Stand, draw_floor_and_wall
from bench.rig.pinhole import PinholeCamera
from bench.rig.sensor import Sensor
from bench.rig.touched_object import TouchedObject
from bench.rig.tube import Tube
from bench.rig.window import Window

# Samples a pixel each way, px of blur while drawing; tests/bench/rig/test_rig_pictures.py compares
# with 12 and 0.05.
_FINE, _SOFT_PX = 3, 0.2
_PIXEL_BLUR_PX = math.sqrt(1 / 12)  # px: standard deviation of a pixel's own width


@dataclass(frozen=True, eq=False)
class Instant:
    """The things that move, at one instant: hubs, and whiskers as tubes."""

    hubs: tuple[Box, ...]
    whiskers: tuple[Tube, ...]

    @classmethod
    def alone(cls, motor_rad: float, whisker: Tube) -> "Instant":
        """Return the instant of one whisker at the rig's origin."""
        return cls((Stand.alone().hub(motor_rad),), (whisker,))


class Studio:
    """One camera, the scene before it and its sensor.

    Samples are a third of a pixel, their edges softened by 0.2 px. The lens blurs by more than that,
    so nothing finer is lost, and things cover each other before the lens blurs them.
    """

    def __init__(self, camera: PinholeCamera, scene: Scene, sensor: Sensor):
        self.camera = camera
        self.scene = scene
        self.sensor = sensor
        self._margin = math.ceil(4 * sensor.blur_px) + 1
        self.window = Window.whole(camera, _FINE, min(_SOFT_PX, sensor.blur_px), self._margin)

    @cached_property
    def backdrop(self) -> np.ndarray:
        """Return the radiance, in samples, of what the board picture of the rig shows."""
        return self.scene.draw_backdrop(self.window)

    def board_brightness(self, T_rig_board: np.ndarray) -> np.ndarray:
        """Draw the board held in the air at a pose (3, 4).

        Nothing covers it, so its edges take lens and pixel area at once.
        """
        window = Window.whole(self.camera, 1, math.hypot(self.sensor.blur_px, _PIXEL_BLUR_PX))
        radiance = draw_floor_and_wall(window, self.scene.appearance)
        self.scene.draw_board(window, radiance, T_rig_board)
        return radiance

    def rig_brightness(self) -> np.ndarray:
        """Draw the board standing on the rig."""
        return self.crop(self.window.blur_to_pixels(self.backdrop, self.sensor.blur_px))

    def setting(self, bar: TouchedObject, middle_mm: np.ndarray) -> "Setting":
        """Draw the still scene of a trial: the rig with a bar whose middle is near a point (3,), or
        with a ring, sphere or cone."""
        radiance = self.backdrop.copy()
        occluder = None
        if bar.is_straight:
            self.scene.draw_bar(self.window, radiance, bar, middle_mm)
        else:
            occluder = self.scene.draw_round_object(self.window, radiance, bar)
        return Setting(self, radiance, occluder)

    def crop(self, picture: np.ndarray) -> np.ndarray:
        """Return the camera's picture out of one with the window's margin."""
        return picture[self._margin : -self._margin, self._margin : -self._margin]


class Setting:
    """A trial's still scene, ready for its frames.

    radiance (rows, columns): of the studio's window, in samples. occluder: an object that may hide
    whiskers.
    """

    def __init__(self, studio: Studio, radiance: np.ndarray, occluder: Occluder | None):
        self._studio = studio
        self._radiance = radiance
        self._occluder = occluder
        self._still = studio.window.blur_to_pixels(radiance, studio.sensor.blur_px)

    @property
    def empty(self) -> np.ndarray:
        """Return the picture of the scene without whisker and hub."""
        return self._studio.crop(self._still)

    def brightness(self, instants: list[Instant]) -> np.ndarray:
        """Draw one exposure, the mean over its instants (one where nothing moves far)."""
        studio = self._studio
        blur_px = studio.sensor.blur_px
        px = [studio.scene.moving_px(studio.camera, one.hubs, one.whiskers) for one in instants]
        part = studio.window.crop(np.concatenate(px), 4 * blur_px + 3)
        picture = self._still.copy()
        if part is not None:
            drawn = part.blur_to_pixels(self._draw_instants(part, instants), blur_px)
            rim = math.ceil(3 * blur_px)  # of the part's pixels, which its own edge blurs wrongly
            inner = drawn[rim : len(drawn) - rim, rim : drawn.shape[1] - rim]
            top = part.top - studio.window.top + rim
            left = part.left - studio.window.left + rim
            picture[top : top + len(inner), left : left + inner.shape[1]] = inner
        return studio.crop(picture)

    def _draw_instants(self, part, instants):
        """Return the mean radiance of a part of the window over instants."""
        studio = self._studio
        still = self._radiance[part.slices_in(studio.window)]
        total = np.zeros_like(still)
        for instant in instants:
            radiance = still.copy()
            studio.scene.draw_moving(part, radiance, instant.hubs, instant.whiskers, self._occluder)
            total += radiance
        return total / np.float32(len(instants))
