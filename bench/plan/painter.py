"""What the cameras of a rig that does not stand yet would show, and the noise of lines in it."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from bench.base.progress import count_parts
from bench.plan.planned_cameras import as_board, as_seen_camera
from bench.plan.staged import StagedWhisk
from bench.rig import boards, build
from bench.rig.exposure_instants import exposure_instants
from bench.rig.other_boards import AnyBoard
from bench.rig.painted_scene import block_corners_mm
from bench.rig.picture_files import JPEG_QUALITY
from bench.rig.protocol import Protocol
from bench.rig.studio import Setting, Studio
from vision import CameraPictures, LineNoise, line_noise_in_pictures
from vision.boards import refine_corners
from vision.geometry import Board, Camera, Cameras, Refused, apply, compose

# [corners] Of a board held up to a camera; fewer, and it would not be found. Stated.
_FEWEST_CORNERS = 6
# Words of the random streams: a held board's picture, a frame.
_BOARD_PICTURE = 2
_FRAME = 3


@dataclass(frozen=True, eq=False)
class Painter:
    """The cameras of a protocol with their painted scene."""

    protocol: Protocol
    seed: int = 0

    @cached_property
    def studios(self) -> list[Studio]:
        """Return the studio of each camera."""
        scene = build.scene(self.protocol)
        sensor = build.sensor(self.protocol)
        return [Studio(camera, scene, sensor) for camera in build.cameras(self.protocol)]

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the cameras for vision, exact."""
        return tuple(as_seen_camera(studio.camera) for studio in self.studios)

    @cached_property
    def board(self) -> Board:
        """Return the board for vision."""
        return as_board(self.protocol.board)

    @cached_property
    def printed(self) -> AnyBoard:
        """Return the board for the rig."""
        return build.board(self.protocol)

    def _stream(self, *words: int) -> np.random.Generator:
        """Return the random stream of these words."""
        return np.random.default_rng([self.seed, *words])

    @cached_property
    def empty(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return for each camera two pictures (h, w) of the rig without rods."""
        pairs = []
        for number, studio in enumerate(self.studios):
            brightness = studio.rig_brightness()
            first = studio.sensor.expose(brightness, self._stream(number, 0))
            pairs.append((first, studio.sensor.expose(brightness, self._stream(number, 1))))
        return pairs

    def corner_px(self) -> dict[str, float]:
        """Return by camera the sigma of a board's corner that is stated in one held view, px.

        Raises Refused where a camera would not see the corners.
        """
        return {camera.name: self._corner_px(k) for k, camera in enumerate(self.cameras)}

    def _corner_px(self, number: int) -> float:
        """Return the median sigma of corners in one camera, px. Raises Refused."""
        studio = self.studios[number]
        camera = self.cameras[number]
        pose = boards.draw_poses(self.printed, studio.camera, 2, self._stream(number))[0]
        brightness = studio.board_brightness(pose)
        picture = studio.sensor.expose(brightness, self._stream(number, _BOARD_PICTURE))
        T_rig_board = compose(pose, self.printed.T_print_board)
        px = camera.project(apply(T_rig_board, self.board.corners_mm))
        corners = refine_corners(picture, px, np.arange(len(px)), self.board)
        if len(corners) < _FEWEST_CORNERS:
            raise Refused(
                f"camera {camera.name} would not see the corners of a board held up to it: is there light, "
                "is its lens sharp?"
            )
        return float(np.median(corners.sigma_px))

    def setting(self, number: int, staged: StagedWhisk) -> Setting:
        """Return a trial's still scene before one camera."""
        return self.studios[number].setting(staged.mechanics.bar, staged.known.axis.point_mm)

    def frame(self, number: int, staged: StagedWhisk, setting: Setting, frame: int) -> np.ndarray:
        """Return one painted frame (h, w) of one camera as its file gives it back."""
        studio = self.studios[number]
        motor_rad = float(staged.known.motor_rad[frame])
        instants = exposure_instants(studio, staged.recording, staged.mechanics, motor_rad, False)
        brightness = setting.brightness(instants)
        picture = studio.sensor.expose(brightness, self._stream(number, _FRAME, frame))
        if self.protocol.pictures.moving != "jpg":
            return picture
        encoded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
        return cv2.imdecode(encoded, cv2.IMREAD_GRAYSCALE)

    def last_frames(self, staged: StagedWhisk) -> dict[str, np.ndarray]:
        """Return by camera the painted frame (h, w) of a whisk's largest motor angle."""
        last = int(np.argmax(staged.known.motor_rad))
        pictures = {}
        for number, camera in enumerate(self.cameras):
            pictures[camera.name] = self.frame(number, staged, self.setting(number, staged), last)
        return pictures

    def line_noise(self, staged: StagedWhisk, cameras: Cameras) -> dict[str, LineNoise]:
        """Return by camera the noise that the tracer states of lines in a trial's pictures.

        cameras: those of the painter, as they are calibrated.
        """
        pictures = []
        for number, camera in enumerate(self.cameras):
            setting = self.setting(number, staged)
            frames = {}
            numbers = staged.known.frames_to_fit
            name = f"pictures painted of camera {camera.name}"
            for f in count_parts(numbers, name, len(numbers)):
                frames[f] = self.frame(number, staged, setting, f)
            with_bar = self.studios[number].sensor.expose(setting.empty, None)
            pictures.append(CameraPictures(camera, self.empty[number], with_bar, frames))
        return line_noise_in_pictures(staged.known, pictures, cameras)


@dataclass(frozen=True, eq=False)
class Clamp:
    """The block at the bar's upper end, by its corners (n, 3): what stands before the rods."""

    corners_mm: np.ndarray

    @staticmethod
    def of(staged: StagedWhisk) -> "Clamp":
        """Return the clamp of a trial's bar."""
        return Clamp(block_corners_mm(staged.mechanics.bar, staged.known.axis.point_mm))

    def __call__(self, camera: Camera, points_mm: np.ndarray) -> np.ndarray:
        """Return which of points (n, 3) the clamp hides from a camera, (n,) bool."""
        px = camera.project(points_mm)
        corners_px = camera.project(self.corners_mm)
        if not np.all(np.isfinite(corners_px)):
            return np.zeros(len(px), dtype=bool)
        hull = cv2.convexHull(corners_px.astype(np.float32))
        is_inside = []
        for u, v in px.tolist():
            is_inside.append(cv2.pointPolygonTest(hull, (u, v), False) >= 0)
        distance_mm = np.linalg.norm(points_mm - camera.centre_mm, axis=1)
        clamp_mm = np.linalg.norm(self.corners_mm.mean(axis=0) - camera.centre_mm)
        return np.array(is_inside, dtype=bool) & (distance_mm > clamp_mm)
