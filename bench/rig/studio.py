"""One camera before one scene: still parts painted once, moving parts for each frame."""

from dataclasses import dataclass

import numpy as np

from bench.rig.bar import Bar
from bench.rig.camera import Camera
from bench.rig.scene import Scene
from bench.rig.sensor import Sensor
from bench.rig.tube import Tube
from bench.rig.window import Window

_FINE, _SOFT_PX = 3, 0.3


class Studio:
    """Takes the pictures of one camera. Samples are a third of a pixel, their edges softened by 0.3 px: the lens blurs by more,
    so nothing finer is lost and what covers what is settled before the blur."""

    def __init__(self, camera: Camera, scene: Scene, sensor: Sensor):
        self.camera, self.scene, self.sensor = camera, scene, sensor
        self._margin = int(np.ceil(4 * sensor.blur_px)) + 1
        self.window = Window.whole(camera, _FINE, min(_SOFT_PX, sensor.blur_px), self._margin)
        self._backdrop = None

    @property
    def backdrop(self) -> np.ndarray:
        if self._backdrop is None:
            self._backdrop = self.scene.backdrop(self.window)
        return self._backdrop

    def board_picture(self, T_rig_board, rng=None) -> np.ndarray:
        """The board held in the air, nothing else in front. Nothing covers it, so its edges take the whole blur at once."""
        window = Window.whole(self.camera, 1, self.sensor.blur_px)
        paint = self._plain_backdrop(window)
        self.scene.print_board(window, paint, T_rig_board)
        return self.sensor.exposed(paint, rng)

    def _plain_backdrop(self, window):
        from bench.rig.scene import _floor_and_wall
        return _floor_and_wall(window, self.scene.looks)

    def rig_picture(self, rng=None) -> np.ndarray:
        """The board standing on the rig."""
        return self.sensor.exposed(self._cropped(self.window.seen(self.backdrop, self.sensor.blur_px)), rng)

    def setting(self, bar: Bar, middle_mm) -> "Setting":
        """The still scene of a trial."""
        paint = self.backdrop.copy()
        self.scene.stand_bar(self.window, paint, bar, middle_mm)
        return Setting(self, paint, self.window.seen(paint, self.sensor.blur_px))

    def _cropped(self, picture):
        m = self._margin
        return picture[m:-m, m:-m]


@dataclass(frozen=True, eq=False)
class Moment:
    """What moves, at one instant: motor angle, the whisker as a tube."""

    motor_rad: float
    whisker: Tube


class Setting:
    """A trial's still scene, ready for its frames."""

    def __init__(self, studio: Studio, paint, seen):
        self._studio, self._paint, self._seen = studio, paint, seen

    def frame(self, moments: list[Moment], rng=None) -> np.ndarray:
        """One exposure, the mean over its moments (one where nothing moves far)."""
        studio = self._studio
        px = np.concatenate([studio.scene.moving_px(studio.camera, m.motor_rad, m.whisker) for m in moments])
        part = studio.window.around(px, 4 * studio.sensor.blur_px + 3)
        picture = self._seen.copy()
        if part is not None:
            seen = part.seen(self._moved(part, moments), studio.sensor.blur_px)
            inner = _inner(part, studio.window, int(np.ceil(3 * studio.sensor.blur_px)))
            picture[inner[0]] = seen[inner[1]]
        return studio.sensor.exposed(studio._cropped(picture), rng)

    def _moved(self, part, moments):
        still = self._paint[part.within(self._studio.window)]
        total = np.zeros_like(still)
        for moment in moments:
            paint = still.copy()
            self._studio.scene.move(part, paint, moment.motor_rad, moment.whisker)
            total += paint
        return total / np.float32(len(moments))


def _inner(part, whole, rim):
    """Where a part's pixels go in the whole picture and which of its own they are, without a rim that the blur spoils."""
    rows, columns = part.bottom - part.top, part.right - part.left
    own = slice(rim, rows - rim), slice(rim, columns - rim)
    there = tuple(slice(o.start + p - w, o.stop + p - w) for o, p, w in zip(own, (part.top, part.left), (whole.top, whole.left)))
    return there, own
