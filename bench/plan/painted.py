"""What the cameras of a rig that does not stand yet would show, and how sure lines in such pictures are."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from bench.plan.expected import near_frames, state_of
from bench.plan.planned_cameras import seen_camera
from bench.plan.sight import bar_points, curves_of
from bench.plan.staged import Staged
from bench.rig import boards, build
from bench.rig.album import JPEG_QUALITY
from bench.rig.moments import exposure_moments
from bench.rig.painted_scene import block_corners_mm
from bench.rig.protocol import Protocol
from bench.rig.studio import Setting, Studio
from vision.boards.corners import refine_corners
from vision.fit.line_noise import LineNoise, line_noise
from vision.fit.problem import Problem
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import solve
from vision.geometry.board import Board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.view import View
from vision.touched.edges import measure_edges
from vision.touched.line import measure_bars
from vision.touched.one_view import seen_from_one_side
from vision.truth.whisk_pictures import WhiskPictures
from vision.truth.whisk_truth import trace_wire
from vision.wire.points import Observed

_FEWEST_CORNERS = 6
_USUAL = VisionSettings()


@dataclass(frozen=True, eq=False)
class Painter:
    """The cameras of a protocol with their painted scene."""

    protocol: Protocol
    seed: int = 0

    @cached_property
    def studios(self) -> list[Studio]:
        """A studio a camera."""
        scene, sensor = build.scene(self.protocol), build.sensor(self.protocol)
        return [Studio(camera, scene, sensor) for camera in build.cameras(self.protocol)]

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """The cameras for vision, exact."""
        return tuple(seen_camera(studio.camera) for studio in self.studios)

    @cached_property
    def board(self) -> Board:
        """The board for vision."""
        b = self.protocol.board
        return Board(tuple(b.squares), b.square_mm, b.marker_mm, b.dictionary, b.legacy, b.inverted)

    def _stream(self, *words: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, *words])

    @cached_property
    def empty(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Two rig pictures a camera."""
        bright = [studio.rig_brightness() for studio in self.studios]
        return [
            tuple(studio.sensor.expose(one, self._stream(k, n)) for n in range(2))
            for k, (studio, one) in enumerate(zip(self.studios, bright))
        ]

    def corner_px(self) -> dict[str, float]:
        """Sigma of a board's corner by camera, as the finder of corners states it in one held view. Raises Refused."""
        return {camera.name: self._corner_px(k) for k, camera in enumerate(self.cameras)}

    def _corner_px(self, number: int) -> float:
        studio, camera = self.studios[number], self.cameras[number]
        pose = boards.draw_poses(
            build.board(self.protocol), studio.camera, 2, self._stream(number)
        )[0]
        picture = studio.sensor.expose(studio.board_brightness(pose), self._stream(number, 2))
        px = camera.project(apply(pose, self.board.corners_mm))
        corners = refine_corners(picture, px, np.arange(len(px)), self.board)
        if len(corners) < _FEWEST_CORNERS:
            raise Refused(
                f"camera {camera.name} would not see the corners of a board held up to it: is there light, "
                "is its lens sharp?"
            )
        return float(np.median(corners.sigma_px))

    def setting(self, number: int, staged: Staged) -> Setting:
        """A trial's still scene before one camera."""
        return self.studios[number].setting(staged.whisk.bar, staged.foot_mm)

    def frame(self, number: int, staged: Staged, setting: Setting, frame: int) -> np.ndarray:
        """One frame of one camera as its sensor gives it."""
        studio, recording = self.studios[number], staged.recording
        instants = exposure_moments(
            self.protocol, studio, recording, staged.whisk, float(staged.motor_rad[frame]), False
        )
        return self._as_written(
            studio.sensor.expose(setting.brightness(instants), self._stream(number, 3, frame))
        )

    def _as_written(self, picture: np.ndarray) -> np.ndarray:
        """A frame as its file gives it back."""
        if self.protocol.pictures.moving != "jpg":
            return picture
        encoded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
        return cv2.imdecode(encoded, cv2.IMREAD_GRAYSCALE)

    def lines(
        self, staged: Staged, cameras: Cameras, settings: VisionSettings = _USUAL
    ) -> dict[str, LineNoise]:
        """What the tracer states of lines in a trial's painted pictures, once their scatter about the fit is seen."""
        curves = curves_of(staged, near_frames(staged))
        still = [self.setting(number, staged) for number in range(len(self.cameras))]
        bars, seen = self._bars(staged, cameras, still, curves, settings), []
        for number, setting in enumerate(still):
            seen += self._wire(number, staged, cameras, setting, curves, settings)
            seen += bar_points(
                self.cameras[number],
                number,
                staged.axis,
                staged.rods,
                bars[self.cameras[number].name],
            )
        return line_noise(_scattered(staged, cameras, list(curves), seen))

    def _wire(
        self,
        number: int,
        staged: Staged,
        cameras: Cameras,
        setting: Setting,
        curves,
        settings: VisionSettings,
    ) -> list[Observed]:
        """The wire's points as traced in one camera's frames."""
        first, second = self.empty[number]
        frames = {f: self.frame(number, staged, setting, f) for f in curves}
        view = View(self.cameras[number], frames, first.astype(float), measure_noise(first, second))
        whisk = WhiskPictures(
            0,
            list(curves),
            staged.time_s,
            staged.motor_rad,
            (view,),
            cameras,
            staged.rods,
            None,
            settings,
        )
        return trace_wire(whisk, view, staged.axis, curves)

    def _bars(
        self,
        staged: Staged,
        cameras: Cameras,
        still: Sequence[Setting],
        curves,
        settings: VisionSettings,
    ) -> Mapping[str, np.ndarray]:
        """Lines of the bar by camera, (k, 3) each (see `LineNoise`)."""
        axis, radius_mm = staged.axis, staged.rods.bar.radius_mm
        views, wires = [], {}
        for number, (camera, setting) in enumerate(zip(self.cameras, still)):
            picture = self.studios[number].sensor.expose(setting.empty, None)
            noise = measure_noise(*self.empty[number])
            views.append(
                View(
                    camera,
                    dict.fromkeys(curves, picture),
                    self.empty[number][0].astype(float),
                    noise,
                )
            )
            wires[camera.name] = [camera.project(curve.points_mm) for curve in curves.values()]
        try:
            lines = {
                name: line
                for name, line in measure_bars(views, axis, radius_mm, wires, settings).items()
                if line.has_edges
            }
        except Refused:
            lines = {}
        found = {name: np.array([[0.0, *line.points.sigma_px]]) for name, line in lines.items()}
        if len(lines) == 1 or seen_from_one_side(cameras, axis):
            for view in (view for view in views if view.camera.name in lines):
                edges = measure_edges(view, axis, radius_mm, wires[view.camera.name], settings)
                if edges:
                    rows = [[side, *points.sigma_px] for side, points in edges.items()]
                    found[view.camera.name] = np.array(rows, dtype=float)
        return {camera.name: found.get(camera.name, np.zeros((0, 3))) for camera in self.cameras}


def _scattered(
    staged: Staged, cameras: Cameras, frames: list[int], seen: list[Observed]
) -> Problem:
    """The fit's problem with sigmas as large as residuals show: where a rod is not seen, as it is."""
    touches = staged.motor_rad[frames] > staged.touch.motor_rad
    problem = Problem(
        cameras, staged.rods, staged.axis, staged.motor_rad[frames], touches, touches, seen
    )
    if not any(one.frame >= 0 for one in seen) or not any(one.frame < 0 for one in seen):
        return problem
    try:
        return inflated_by_residuals(problem, solve(problem, state_of(problem, staged, frames))[0])
    except np.linalg.LinAlgError:
        return problem


@dataclass(frozen=True, eq=False)
class Clamp:
    """The block at the bar's upper end by its corners (n, 3), as a `bench.plan.sight.Hides`."""

    corners_mm: np.ndarray

    @staticmethod
    def of(staged: Staged) -> "Clamp":
        """That of a trial's bar."""
        return Clamp(block_corners_mm(staged.whisk.bar, staged.foot_mm))

    def __call__(self, camera: Camera, points_mm: np.ndarray) -> np.ndarray:
        px, corners = camera.project(points_mm), camera.project(self.corners_mm)
        if not np.all(np.isfinite(corners)):
            return np.zeros(len(px), dtype=bool)
        hull = cv2.convexHull(corners.astype(np.float32))
        inside = [cv2.pointPolygonTest(hull, (float(u), float(v)), False) >= 0 for u, v in px]
        away = np.linalg.norm(points_mm - camera.centre_mm, axis=1)
        nearer = away > np.linalg.norm(self.corners_mm.mean(axis=0) - camera.centre_mm)
        return np.array(inside, dtype=bool) & nearer
