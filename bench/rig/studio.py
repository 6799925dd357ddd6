"""One camera before one scene: still parts drawn once, moving parts for each frame."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bench.rig.bar import Bar
from bench.rig.layer import Front
from bench.rig.painted_scene import Box, Scene, Stand, floor_and_wall
from bench.rig.pinhole import Camera
from bench.rig.sensor import Sensor
from bench.rig.tube import Tube
from bench.rig.window import Window

# Samples a pixel each way, px of blur while drawing; tests/bench/rig/test_rig_pictures.py compares with 12 and 0.05.
_FINE, _SOFT_PX = 3, 0.2


@dataclass(frozen=True, eq=False)
class Moment:
    """What moves, at one instant: hubs, and whiskers as tubes."""

    hubs: tuple[Box, ...]
    whiskers: tuple[Tube, ...]

    @classmethod
    def alone(cls, motor_rad: float, whisker: Tube) -> "Moment":
        """Of one whisker at the rig's origin."""
        return cls((Stand.alone().hub(motor_rad),), (whisker,))


class Studio:
    """Takes the pictures of one camera.

    Samples are a third of a pixel, their edges softened by 0.2 px. The lens blurs by more than that, so nothing finer
    is lost, and what covers what is settled before the lens blurs it.
    """

    def __init__(self, camera: Camera, scene: Scene, sensor: Sensor):
        self.camera, self.scene, self.sensor = camera, scene, sensor
        self._margin = math.ceil(4 * sensor.blur_px) + 1
        self.window = Window.whole(camera, _FINE, min(_SOFT_PX, sensor.blur_px), self._margin)

    @cached_property
    def backdrop(self) -> np.ndarray:
        """Radiance, in samples, of what the board picture of the rig shows."""
        return self.scene.backdrop(self.window)

    def board_brightness(self, T_rig_board: np.ndarray) -> np.ndarray:
        """The board held in the air. Nothing covers it, so its edges take lens and pixel area at once."""
        window = Window.whole(self.camera, 1, math.hypot(self.sensor.blur_px, math.sqrt(1 / 12)))
        radiance = floor_and_wall(window, self.scene.looks)
        self.scene.print_board(window, radiance, T_rig_board)
        return radiance

    def rig_brightness(self) -> np.ndarray:
        """The board standing on the rig."""
        return self.cropped(self.window.seen(self.backdrop, self.sensor.blur_px))

    def setting(self, bar: Bar, middle_mm: np.ndarray) -> "Setting":
        """The still scene of a trial: the rig with a bar whose middle is near a point, or a ring, sphere or cone."""
        radiance, front = self.backdrop.copy(), None
        if bar.is_straight:
            self.scene.stand_bar(self.window, radiance, bar, middle_mm)
        else:
            front = self.scene.stand_rounded(self.window, radiance, bar)
        return Setting(self, radiance, self.window.seen(radiance, self.sensor.blur_px), front)

    def cropped(self, picture: np.ndarray) -> np.ndarray:
        """The camera's picture out of a wider one."""
        return picture[self._margin : -self._margin, self._margin : -self._margin]


class Setting:
    """A trial's still scene, ready for its frames."""

    def __init__(
        self, studio: Studio, radiance: np.ndarray, seen: np.ndarray, front: Front | None = None
    ):
        self._studio, self._radiance, self._seen, self._front = studio, radiance, seen, front

    @property
    def empty(self) -> np.ndarray:
        """The scene without whisker and hub."""
        return self._studio.cropped(self._seen)

    def brightness(self, moments: list[Moment]) -> np.ndarray:
        """One exposure, the mean over its moments (one where nothing moves far)."""
        studio, blur = self._studio, self._studio.sensor.blur_px
        px = [studio.scene.moving_px(studio.camera, m.hubs, m.whiskers) for m in moments]
        part = studio.window.around(np.concatenate(px), 4 * blur + 3)
        picture = self._seen.copy()
        if part is not None:
            there, own = _inner(part, studio.window, math.ceil(3 * blur))
            picture[there] = part.seen(self._moved(part, moments), blur)[own]
        return studio.cropped(picture)

    def _moved(self, part, moments):
        still = self._radiance[part.within(self._studio.window)]
        total = np.zeros_like(still)
        for moment in moments:
            radiance = still.copy()
            self._studio.scene.move(part, radiance, moment.hubs, moment.whiskers, self._front)
            total += radiance
        return total / np.float32(len(moments))


def _inner(part, whole, rim):
    """Where a part's pixels go in the whole and which of its own they are, without a rim that the blur spoils."""
    rows, columns = part.bottom - part.top, part.right - part.left
    own = slice(rim, rows - rim), slice(rim, columns - rim)
    shifts = part.top - whole.top, part.left - whole.left
    return tuple(slice(o.start + s, o.stop + s) for o, s in zip(own, shifts)), own
