"""Pictures of the rig's hub with its marker alone, painted by the rig, with the marker's true corners."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from msgspec import structs

from bench.plan.planned_cameras import as_board, as_seen_camera
from bench.rig import build
from bench.rig.painted_scene import Stand, draw_floor_and_wall
from bench.rig.picture_files import JPEG_QUALITY
from bench.rig.protocol import Protocol, load
from bench.rig.studio import Studio
from vision.boards import find_other_markers
from vision.calibration import MarkerSighting
from vision.geometry import Board, Camera
from vision.geometry.centreline import rotation_z

# [px] About the hub, in a picture that holds nothing else.
_MARGIN_PX = 30
# [mm], [deg] By which cameras are moved along each axis and rolled, at most.
_SCATTER_MM, _SCATTER_DEG = 40.0, 5.0
# [mm] The hub's marker in the hub, its corners in OpenCV's order.
CORNERS_MM = np.array([[-11.0, 5.0, 7.0], [-1.0, 5.0, 7.0], [-1.0, -5.0, 7.0], [-11.0, -5.0, 7.0]])


@dataclass(frozen=True, eq=False)
class HubPictures:
    """A rig whose hub alone is painted, before cameras that stand a little elsewhere by each seed."""

    protocol: Protocol
    seed: int

    @staticmethod
    def drawn(seed: int, *, blur_px: float = 0.9) -> "HubPictures":
        """Return the rig of "quick" with each camera moved and rolled at random."""
        rng = np.random.default_rng([seed, 0])
        table = load("quick")
        pictures = structs.replace(table.pictures, blur_px=blur_px)
        cameras = []
        for camera in table.cameras:
            place = np.array(camera.position_mm) + _SCATTER_MM * rng.uniform(-1.0, 1.0, 3)
            roll_deg = camera.roll_deg + float(_SCATTER_DEG * rng.uniform(-1.0, 1.0))
            cameras.append(structs.replace(camera, position_mm=tuple(place), roll_deg=roll_deg))
        return HubPictures(structs.replace(table, cameras=cameras, pictures=pictures), seed)

    @cached_property
    def _studios(self) -> list[Studio]:
        scene = build.scene(self.protocol)
        sensor = build.sensor(self.protocol)
        return [Studio(camera, scene, sensor) for camera in build.cameras(self.protocol)]

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """Return the cameras for vision, exact."""
        return tuple(as_seen_camera(studio.camera) for studio in self._studios)

    @cached_property
    def board(self) -> Board:
        """Return the board, whose dictionary the marker is of."""
        return as_board(self.protocol.board)

    def corners_px(self, camera: Camera, motor_rad: float) -> np.ndarray:
        """Return the true corners (4, 2) of the marker, px."""
        return camera.project(CORNERS_MM @ rotation_z(motor_rad).T)

    def picture(self, number: int, motor_rad: float, frame: int) -> np.ndarray:
        """Paint the hub alone in one camera's picture (h, w) at a motor angle."""
        studio = self._studios[number]
        hub = Stand.alone().hub(motor_rad)
        part = studio.window.crop(studio.camera.project(hub.corners_mm()), _MARGIN_PX)
        radiance = draw_floor_and_wall(part, studio.scene.appearance)
        studio.scene.draw_moving(part, radiance, (hub,), ())
        rng = np.random.default_rng([self.seed, 1, number, frame])
        drawn = studio.sensor.expose(part.blur_to_pixels(radiance, studio.sensor.blur_px), rng)
        encoded = cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
        drawn = cv2.imdecode(encoded, cv2.IMREAD_GRAYSCALE)
        width, height = studio.camera.size_px
        whole = np.full((height + 400, width + 400), int(np.median(drawn)), np.uint8)
        whole[200 + part.top : 200 + part.bottom, 200 + part.left : 200 + part.right] = drawn
        return whole[200:-200, 200:-200]

    def sightings(self, motor_rad: Sequence[float]) -> list[MarkerSighting]:
        """Return the marker as vision finds it in pictures at these motor angles."""
        found = []
        for number, camera in enumerate(self.cameras):
            for frame, angle in enumerate(motor_rad):
                for marker in find_other_markers(self.picture(number, angle, frame), self.board):
                    instant = ("painted", frame)
                    found.append(
                        MarkerSighting(marker.number, camera.name, instant, angle, marker.px)
                    )
        return found
