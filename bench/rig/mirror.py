"""A camera before a mirror: one picture in two parts, the rig itself and the rig in the mirror.

What the mirror shows is what a camera at the reflected place sees, flipped left to right.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.rig.painted_scene import Scene
from bench.rig.pinhole import PinholeCamera
from bench.rig.sensor import Sensor
from bench.rig.studio import Instant, Setting, Studio
from bench.rig.touched_object import TouchedObject

_FLIP = np.diag([-1.0, 1.0, 1.0])  # a camera's x axis


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a picture, its left upper pixel there, and the camera that sees it.

    mirrored: it stands in the picture flipped left to right.
    """

    camera: PinholeCamera
    left: int
    top: int
    mirrored: bool

    def put(self, picture: np.ndarray, seen: np.ndarray) -> None:
        """Put what the camera sees (rows, columns) into the whole picture."""
        rows, columns = seen.shape
        place = picture[self.top : self.top + rows, self.left : self.left + columns]
        place[...] = seen[:, ::-1] if self.mirrored else seen


def direct_part(whole: PinholeCamera, crop: Sequence[int]) -> Part:
    """Return the largest part of a picture outside the mirror's crop [left, top, width, height]."""
    left, top, width, height = crop
    columns, rows = whole.size_px
    sides = [
        (0, 0, columns, top),
        (0, top + height, columns, rows - top - height),
        (0, 0, left, rows),
        (left + width, 0, columns - left - width, rows),
    ]
    left, top, width, height = max(sides, key=lambda side: side[2] * side[3])
    matrix = whole.matrix.copy()
    matrix[:2, 2] -= [left, top]
    return Part(replace(whole, matrix=matrix, size_px=(width, height)), left, top, False)


def mirrored_part(
    whole: PinholeCamera,
    name: str,
    crop: Sequence[int],
    point_mm: np.ndarray,
    normal: np.ndarray,
) -> Part:
    """Return the part of a picture that shows a mirror through a point (3,) with a normal (3,).

    Raises ValueError where crop [left, top, width, height] is not within the picture.
    """
    _check_crop(whole, name, crop)
    left, top, width, height = crop
    unit = np.asarray(normal, float) / np.linalg.norm(normal)
    reflect = np.eye(3) - 2.0 * np.outer(unit, unit)
    shift_mm = 2.0 * (unit @ np.asarray(point_mm, float)) * unit
    matrix = whole.matrix.copy()
    matrix[0, 2] = left + width - 1 - whole.matrix[0, 2]
    matrix[1, 2] -= top
    distortion = whole.distortion * [1.0, 1.0, 1.0, -1.0, 1.0]
    camera = PinholeCamera(
        name,
        (width, height),
        matrix,
        distortion,
        _FLIP @ whole.rotation @ reflect,
        _FLIP @ (whole.rotation @ shift_mm + whole.translation_mm),
    )
    return Part(camera, left, top, True)


def _check_crop(whole: PinholeCamera, name: str, crop: Sequence[int]) -> None:
    """Raise ValueError where crop [left, top, width, height] is not within the camera's picture."""
    left, top, width, height = crop
    columns, rows = whole.size_px
    if min(left, top) < 0 or left + width > columns or top + height > rows:
        raise ValueError(f"camera {name}: crop {list(crop)} is not within {columns} x {rows} px")


class MirrorStudio:
    """A camera before a mirror and a scene, as a `Studio`.

    camera: of the whole picture, without the mirror.
    """

    def __init__(self, camera: PinholeCamera, parts: Sequence[Part], scene: Scene, sensor: Sensor):
        self.camera = camera
        self.parts = tuple(parts)
        self.scene = scene
        self.sensor = sensor
        self._studios = [Studio(part.camera, scene, sensor) for part in parts]

    def board_brightness(self, T_rig_board: np.ndarray) -> np.ndarray:
        """Draw the board held in the air at a pose (3, 4)."""
        return self._whole(lambda studio: studio.board_brightness(T_rig_board))

    def rig_brightness(self) -> np.ndarray:
        """Draw the board standing on the rig."""
        return self._whole(Studio.rig_brightness)

    def setting(self, bar: TouchedObject, middle_mm: np.ndarray) -> "MirrorSetting":
        """Draw the still scene of a trial: the rig with a bar whose middle is near a point (3,)."""
        return MirrorSetting(self, [studio.setting(bar, middle_mm) for studio in self._studios])

    def _whole(self, draw: Callable[[Studio], np.ndarray]) -> np.ndarray:
        """Return the picture whose parts are drawn one by one."""
        return self.joined([draw(studio) for studio in self._studios])

    def joined(self, seen: Sequence[np.ndarray]) -> np.ndarray:
        """Return the picture of what the parts' cameras see."""
        width, height = self.camera.size_px
        picture = np.zeros((height, width), dtype=seen[0].dtype)
        for part, own in zip(self.parts, seen):
            part.put(picture, own)
        return picture


class MirrorSetting:
    """A trial's still scene before a mirror, as a `Setting`."""

    def __init__(self, studio: MirrorStudio, settings: Sequence[Setting]):
        self._studio = studio
        self._settings = settings

    @property
    def empty(self) -> np.ndarray:
        """Return the picture of the scene without whisker and hub."""
        return self._studio.joined([setting.empty for setting in self._settings])

    def brightness(self, instants: list[Instant]) -> np.ndarray:
        """Draw one exposure, the mean over its instants."""
        return self._studio.joined([setting.brightness(instants) for setting in self._settings])
