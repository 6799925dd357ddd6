"""Where a polished shaft lies on real pictures, against the axis about which it turned, and whether its sigmas are true.

    OMP_NUM_THREADS=1 python tests/studies/real_shaft.py FOLDER [--starts 1]

FOLDER is the one of `real_cube.py`: three cameras and 24 poses of a cube on a round shaft that turns with it; nothing is
fetched. The cameras, the cube's poses and its turning axis are those of `real_cube.py`. In each pose the shaft's line is
measured in each camera, as a bar's is for the truth, and an axis is fitted to the lines by their covariances; poses in
which another rod hides it are left out. The shaft is rigid with the cube, so all poses have one direction in the cube's
frame: the median of the directions measured.
Prints by pose the angle to that direction and to the turning axis, the stated sigma and z along the sight and across it,
the width in each camera; with --starts also where the whole search arrives from frames that are 20 degrees off.
"""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.studies.real_cube import CUBE, body_poses, fit_axis, read_views
from vision.calibration.calibrate import calibrate_cameras
from vision.geometry.camera import Camera, Cameras
from vision.geometry.contact import BarAxis, axis_frame
from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.rotation import unit
from vision.geometry.silhouette import edges
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.frames import Frames
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.view import View
from vision.touched.axis import offset_px, settle_axis
from vision.touched.line import BarLineEstimate, measure_bars
from vision.touched.object_view import ObjectView
from vision.touched.search import SeenBar, find_object
from vision.touched.search_scene import SearchScene
from vision.touched.width import measure_relative_widths

SHAFT = Bar(6.0)
# [mm] A point of the shaft in the cube's frame, in the middle of what all cameras show of it.
POINT_MM = np.array([43.6, 45.7, -8.6])
# Beyond it to either side are the cube and the border of the pictures.
SETTINGS = VisionSettings(bar_reach_mm=15.0)
# Poses in which another rod passes before the shaft in all cameras.
HIDDEN = (3, 13)
PASSES = 4
START_OFF_DEG = 20.0
SEED = 11
# [mm, rad] Scales of the axis's shifts and tilts.
SCALES = np.array([1.0, 1.0, 0.02, 0.02])
# A whisker that would touch the shaft, along the sight of it: the search asks for one.
WIRE = Wire("cylinder", length_mm=60.0, diameter_mm=0.5)
MOTOR_RAD = np.radians(np.linspace(-15.0, 15.0, 5))
TOUCHED_MM = 40.0
# [1] Second differences of a picture with white noise of 1 have a sigma of 1.
SECOND_DIFFERENCES = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]]) / 6.0


class SceneWithoutWire(SearchScene):
    """A scene in which no wire hides anything."""

    @property
    def object_views(self) -> list[ObjectView]:
        """Return the views of the shaft."""
        return [ObjectView(view, self.radius_mm, self.settings) for view in self.views]


@dataclass(frozen=True)
class Place:
    """A frame in the world: R (3, 3) has its axes as columns, origin_mm (3,)."""

    R: np.ndarray
    origin_mm: np.ndarray

    def cameras(self, cameras: Cameras) -> Cameras:
        """Return the cameras with this frame for the world's."""
        placed = []
        for camera in cameras:
            T = camera.T_camera_rig
            shift_mm = T[:, :3] @ self.origin_mm + T[:, 3]
            pose = np.column_stack([T[:, :3] @ self.R, shift_mm])
            placed.append(
                Camera(camera.name, camera.size_px, camera.matrix, camera.distortion, pose)
            )
        return Cameras(tuple(placed), np.zeros((15 * len(placed), 15 * len(placed))))


def place_about(direction: np.ndarray, point_mm: np.ndarray, eye_mm: np.ndarray) -> Place:
    """Return a frame at a point, z along a direction, x nearly along the sight from an eye."""
    sight = unit(point_mm - eye_mm)
    x = unit(sight - (sight @ direction) * direction)
    return Place(np.column_stack([x, np.cross(direction, x), direction]), point_mm)


def make_views(pictures: Mapping[str, np.ndarray], cameras: Cameras) -> list[View]:
    """Return the views of one instant, with the noise of single pictures and nothing known of what is behind."""
    views = []
    for camera in cameras:
        grey = pictures[camera.name].astype(float)
        rough = cv2.filter2D(grey, -1, SECOND_DIFFERENCES)
        noise = measure_noise(grey, grey + np.sqrt(2.0) * rough)
        views.append(View(camera, {0: pictures[camera.name]}, np.zeros(grey.shape), noise))
    return views


@dataclass(frozen=True)
class Shaft:
    """The shaft in one pose. direction (3,): in the world. sigma_rad (2,): along the sight and across it.

    chi2: of the lines about the axis, by two degrees of freedom.
    """

    place: Place
    direction: np.ndarray
    sigma_rad: np.ndarray
    chi2: float
    lines: Mapping[str, BarLineEstimate]

    def error_rad(self, direction: np.ndarray) -> np.ndarray:
        """Return by how much it is off a direction of the world (3,): along the sight and across it, (2,)."""
        return ((self.direction - direction) @ self.place.R)[:2]

    def widths(self) -> dict[str, tuple[float, float]]:
        """Return apparent over assumed width and its sigma, by camera."""
        seen = SeenBar(BarAxis(np.zeros(3), np.array([0.0, 0.0, 1.0])), self.lines)
        return measure_relative_widths(seen)


def measure_shaft(views: list[View], cameras: Cameras, place: Place) -> Shaft:
    """Measure the shaft's lines about the z axis of a frame, and fit its axis to them."""
    axis = BarAxis(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    lines: dict[str, BarLineEstimate] = {}
    seen = [ObjectView(view, SHAFT.radius_mm, SETTINGS) for view in views]
    for _ in range(PASSES):
        lines = measure_bars(seen, axis, lines)
        bars = {name: line.points for name, line in lines.items() if line.is_bar}
        axis = settle_axis(axis, cameras, bars, SHAFT.radius_mm)
    return _fit_axis(axis, cameras, lines, place)


def _fit_axis(
    axis: BarAxis, cameras: Cameras, lines: Mapping[str, BarLineEstimate], place: Place
) -> Shaft:
    """Fit an axis to lines by their covariances, with what their points have in common."""
    across = axis_frame(axis.direction)
    bars = {name: line.points for name, line in lines.items() if line.is_bar}

    def residuals(vector: np.ndarray) -> np.ndarray:
        """Return how far the lines are off an axis, in independent sigmas."""
        moved = axis.shifted(across, vector)
        whitened = []
        for name, points in bars.items():
            on_axis = moved.point_mm + points.place[:, None] * moved.direction
            one, other = edges(cameras[name], on_axis, moved.direction, SHAFT.radius_mm)
            off_px = np.sum(points.normal * (points.px - 0.5 * (one + other)), axis=1)
            covariance = np.diag(points.sigma_px**2) + points.shared_px @ points.shared_px.T
            whitened.append(np.linalg.solve(np.linalg.cholesky(covariance), off_px))
        return np.concatenate(whitened)

    fitted = least_squares(residuals, np.zeros(4), x_scale=SCALES)
    covariance = np.linalg.inv(fitted.jac.T @ fitted.jac)
    steps = 1e-4 * np.eye(4)[2:]
    tilts = [(axis.shifted(across, step).direction - axis.direction) / 1e-4 for step in steps]
    by_tilt = np.array(tilts)[:, :2]  # of x and y
    sigma_rad = np.sqrt(np.diag(by_tilt.T @ covariance[2:, 2:] @ by_tilt))
    direction = place.R @ axis.shifted(across, fitted.x).upward().direction
    return Shaft(place, direction, sigma_rad, 2.0 * fitted.cost, lines)


def search_from(place: Place, pictures, cameras: Cameras, rng: np.random.Generator) -> str:
    """Search the shaft from a frame that is START_OFF_DEG off about a random axis across it; return where it arrives."""
    turn = rng.uniform(0.0, 2.0 * np.pi)
    off = np.radians(START_OFF_DEG)
    tilted = np.array([np.sin(off) * np.cos(turn), np.sin(off) * np.sin(turn), np.cos(off)])
    eye_mm = cameras.cameras[0].centre_mm
    start = place_about(place.R @ tilted, place.origin_mm, eye_mm)
    start = Place(start.R, start.origin_mm - TOUCHED_MM * start.R[:, 0])
    placed = start.cameras(cameras)
    true = BarAxis(start.R.T @ (place.origin_mm - start.origin_mm), start.R.T @ place.R[:, 2])
    views = make_views(pictures, placed)
    scene = SceneWithoutWire(views, placed, Rods(WIRE, SHAFT), MOTOR_RAD, SETTINGS)
    try:
        found = find_object(scene).axis
    except Refused as reason:
        return str(reason)
    off_px = max(offset_px(camera, true.upward(), found) for camera in placed)
    return f"{off_px:.1f} px beside it, {angle_deg(true.direction, found.direction):.1f} degrees"


def angle_deg(one: np.ndarray, other: np.ndarray) -> float:
    """Return the angle between two lines of these directions."""
    return float(np.degrees(np.arccos(min(1.0, abs(one @ other)))))


def common_direction(shafts: Mapping[int, Shaft], poses: np.ndarray) -> np.ndarray:
    """Return the direction in the cube's frame that the poses have in common: across the sight, by least absolute values."""
    in_body = np.array([poses[k, :, :3].T @ shaft.direction for k, shaft in shafts.items()])
    first = unit(np.median(in_body, axis=0))
    across = axis_frame(first)

    def residuals(tilt: np.ndarray) -> np.ndarray:
        """Return the errors of all poses across the sight."""
        direction = unit(first + tilt @ across)
        return np.array(
            [shaft.error_rad(poses[k, :, :3] @ direction)[1] for k, shaft in shafts.items()]
        )

    fitted = least_squares(residuals, np.zeros(2), loss="soft_l1", f_scale=1e-3)
    return unit(first + fitted.x @ across)


def print_summary(rows: list[list[float]], widths: list[list[float]]) -> None:
    """Print medians and worst values of all poses."""
    table = np.array(
        rows
    )  # angle to the common direction, to the turning axis, z along and across the sight
    for column, name in enumerate(("the direction of all poses", "the turning axis")):
        angles = table[:, column]
        print(f"angle to {name}: median {np.median(angles):.2f}, worst {angles.max():.2f} degrees")
    for column, name in enumerate(("along the sight", "across it"), start=2):
        z = table[:, column]
        print(f"z {name}: RMS {np.sqrt(np.mean(z**2)):.2f}, largest {np.abs(z).max():.1f}")
    if widths:
        spread = [max(some) / min(some) - 1.0 for some in widths]
        print(
            f"widths of the cameras differ by {np.median(spread):.1%} in the median, {max(spread):.1%} at most"
        )


def read_pictures(folder: Path, cameras: Cameras) -> dict[int, dict[str, np.ndarray]]:
    """Return the pictures of all poses, by pose and by camera."""
    pictures: dict[int, dict[str, np.ndarray]] = {}
    for camera in cameras:
        for index, picture in Frames.open(folder / camera.name).read():
            pictures.setdefault(index, {})[camera.name] = picture
    return pictures


def print_poses(shafts: Mapping[int, Shaft], poses: np.ndarray, turning: np.ndarray) -> None:
    """Print a line a pose, then the summary. turning (3,): the turning axis in the cube's frame."""
    common = common_direction(shafts, poses)
    print(f"the shaft leans by {angle_deg(common, turning):.2f} degrees against the turning axis")
    rows = []
    widths = []
    for index, shaft in shafts.items():
        R = poses[index, :, :3]
        direction = R @ common
        error = shaft.error_rad(direction * np.sign(direction @ shaft.place.R[:, 2]))
        z = error / shaft.sigma_rad
        angles = [angle_deg(shaft.direction, one) for one in (direction, R @ turning)]
        rows.append([*angles, *z])
        seen = shaft.widths()
        if len(seen) > 1:
            widths.append([width for width, _ in seen.values()])
        looks = ", ".join(f"{width:.3f} ± {sigma:.3f}" for width, sigma in seen.values())
        sigma_deg = np.degrees(shaft.sigma_rad)
        print(
            f"pose {index}: {angles[0]:.2f} and {angles[1]:.2f} degrees; sigma {sigma_deg[0]:.2f}, {sigma_deg[1]:.2f}, "
            f"z {z[0]:.1f}, {z[1]:.1f}; chi2 {shaft.chi2:.1f} of 2; widths {looks}"
        )
    print_summary(rows, widths)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--starts", type=int, default=0)
    options = parser.parse_args()
    corners = read_views(options.folder)
    made = calibrate_cameras(corners, CUBE, None, triggered=True)
    poses = body_poses(made, corners)
    turning = fit_axis(made, corners).in_body
    eye_mm = made.cameras.cameras[0].centre_mm
    rng = np.random.default_rng(SEED)
    shafts = {}
    for index, greys in read_pictures(options.folder, made.cameras).items():
        if index in HIDDEN:
            continue
        R = poses[index, :, :3]
        place = place_about(R @ turning, R @ POINT_MM + poses[index, :, 3], eye_mm)
        placed = place.cameras(made.cameras)
        try:
            shafts[index] = measure_shaft(make_views(greys, placed), placed, place)
        except Refused as reason:
            print(f"pose {index}: {reason}")
        for _ in range(options.starts):
            arrived = search_from(place, greys, made.cameras, rng)
            print(f"pose {index}: from {START_OFF_DEG:g} degrees off, {arrived}", flush=True)
    print_poses(shafts, poses, turning)


if __name__ == "__main__":
    main()
