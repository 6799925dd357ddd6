"""A catheter in three views: does the curve in space by two cameras agree with the third one's line?

    OMP_NUM_THREADS=1 python tests/studies/real_catheter.py FOLDER [--draw PICTURE]

FOLDER is camera_calibration of jasonkglim/Catheter-Perception @ 7e8c5db; nothing is fetched. Three webcams are calibrated
from the boards of 08-05-25, of which pairs of cameras have pictures that squash the field of view to 640 x 480. The blue
part of the catheter of 08-12-25, before a green wall, is traced in green less blue of each picture, between the ends given
here.
By camera: how far its line lies from the curve by the other two in the mean, with the sigma of that by all three lines
and by the cameras, and how much it scatters about the mean. `--draw` writes crops with the lines red, and the curves by
the other cameras yellow.
"""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from scipy.interpolate import CubicSpline

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.studies.real_wires import row_of
from vision.boards.charuco import CharucoBoard
from vision.boards.corners import Corners, find_corners
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews
from vision.geometry.camera import Camera, Cameras
from vision.wire.between_ends import WireLine, trace_between

BOARD = CharucoBoard((10, 10), 10.0, 6.0, "DICT_4X4_50")
SIZE_PX = (1280, 720)
NAMES = ("cam0", "cam1", "cam2")
PAIRS = (("cam0", "cam1"), ("cam0", "cam2"))
# [px] Where the blue part begins and ends.
ENDS = {
    "cam0": ((612, 396), (638, 338)),
    "cam1": ((606, 248), (545, 392)),
    "cam2": ((621, 334), (648, 460)),
}
# [places] On the curve through a line's points.
PLACES = 400
STEP_PX = 0.01


def find_views(folder: Path) -> BoardViews:
    """Return the board's corners in all pictures; of each instant one or two cameras have some."""
    instants = []
    for name in NAMES:
        instants += [{name: path} for path in sorted(folder.glob(f"intrinsic*/{name}/*.png"))]
    for one, other in PAIRS:
        for path in sorted(folder.glob(f"stereo*/*/{one}_*.png")):
            partner = path.with_name(path.name.replace(one, other))
            if partner.exists():
                instants.append({one: path, other: partner})
    boards = {}
    for name in NAMES:
        boards[name] = [_corners_in(paths.get(name)) for paths in instants]
    return BoardViews(boards, dict.fromkeys(NAMES, SIZE_PX))


def _corners_in(path: Path | None) -> Corners:
    """Return the corners in a picture, which is stretched to the size of the others."""
    if path is None:
        return Corners.none()
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    return find_corners(cv2.resize(grey, SIZE_PX, interpolation=cv2.INTER_CUBIC), BOARD)


def green_less_blue(picture: np.ndarray) -> np.ndarray:
    """Return green less blue of a picture (h, w, 3), from 0 to 255."""
    blue, green, _ = np.moveaxis(picture.astype(float), 2, 0)
    return 0.5 * (255.0 + green - blue)


@dataclass(frozen=True)
class Curve:
    """A line in a picture at PLACES places: px (k, 2), normals (k, 2)."""

    px: np.ndarray
    normal: np.ndarray

    @staticmethod
    def through(line: WireLine) -> "Curve":
        """Return the curve through a traced line's points."""
        spline = CubicSpline(line.points.place, line.points.px)
        place = np.linspace(line.points.place[0], line.points.place[-1], PLACES)
        along = spline(place, 1)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return Curve(spline(place), np.column_stack([-along[:, 1], along[:, 0]]))

    def shifted(self, offset_px: float) -> "Curve":
        """Return the curve shifted along its normals."""
        return replace(self, px=self.px + offset_px * self.normal)


def meet(curves: Mapping[str, Curve], cameras: list[Camera]) -> np.ndarray:
    """Return the points (n, 3) at which the rays of one camera's curve meet those of another's."""
    one, other = cameras
    rays = one.rays(curves[one.name].px)
    other_rays = other.rays(curves[other.name].px)
    apart = other.centre_mm - one.centre_mm
    volume = np.cross(rays, apart) @ other_rays.T  # 0 where two rays meet
    points = []
    for ray, volumes in zip(rays, volume):
        changes = np.flatnonzero(volumes[:-1] * volumes[1:] <= 0.0)
        if len(changes) != 1:
            continue
        k = changes[0]
        share = volumes[k] / (volumes[k] - volumes[k + 1])
        second = (1.0 - share) * other_rays[k] + share * other_rays[k + 1]
        depths = np.linalg.lstsq(np.column_stack([ray, -second]), apart, rcond=None)[0]
        points.append(one.centre_mm + depths[0] * ray)
    return np.array(points)


def offsets_px(curves: Mapping[str, Curve], cameras: Cameras, third: str) -> np.ndarray:
    """Return how far the curve by two cameras lies beside the third one's line, along its normals, (n,)."""
    points = meet(curves, [camera for camera in cameras if camera.name != third])
    px = cameras[third].project(points)
    line = curves[third]
    away = px[:, None] - line.px  # (n, k, 2)
    nearest = np.argmin(np.sum(away**2, axis=2), axis=1)
    is_beside = (nearest > 0) & (nearest < PLACES - 1)
    rows = np.flatnonzero(is_beside)
    return np.sum(away[rows, nearest[rows]] * line.normal[nearest[rows]], axis=1)


def mean_sigma_px(
    lines: Mapping[str, WireLine], curves: Mapping[str, Curve], cameras: Cameras, third: str
) -> tuple[float, float]:
    """Return the sigma of the mean offset by the three lines, each off as a whole, and by the cameras."""
    mean = np.mean(offsets_px(curves, cameras, third))
    by_lines = 0.0
    for name, line in lines.items():
        moved = {**curves, name: curves[name].shifted(STEP_PX)}
        slope = (np.mean(offsets_px(moved, cameras, third)) - mean) / STEP_PX
        by_lines += (slope * np.median(line.sigma_px)) ** 2
    sigmas = np.sqrt(np.diag(cameras.covariance))
    gradient = np.zeros(len(sigmas))
    for c, camera in enumerate(cameras):
        for k, parameter in enumerate(range(15 * c, 15 * (c + 1))):
            if sigmas[parameter] == 0.0:
                continue
            step = np.zeros(15)
            step[k] = STEP_PX * sigmas[parameter]
            others = list(cameras.cameras)
            others[c] = camera.moved(step)
            moved = replace(cameras, cameras=tuple(others))
            gradient[parameter] = (np.mean(offsets_px(curves, moved, third)) - mean) / step[k]
    return float(np.sqrt(by_lines)), float(np.sqrt(gradient @ cameras.covariance @ gradient))


def draw(path: Path, pictures, lines, curves, cameras: Cameras) -> None:
    """Write crops of all pictures, three times as large, side by side."""
    crops = []
    for name, picture in pictures.items():
        corner = np.array(ENDS[name][0]) - (70, 80)
        crop = picture[corner[1] : corner[1] + 240, corner[0] : corner[0] + 140]
        large = cv2.resize(crop, None, fx=3, fy=3, interpolation=cv2.INTER_CUBIC)
        others = [camera for camera in cameras if camera.name != name]
        by_others = cameras[name].project(meet(curves, others))
        for px, colour in ((by_others, (0, 255, 255)), (lines[name].points.px, (0, 0, 255))):
            at = np.rint(3.0 * (px - corner) + 1.0).astype(int)
            cv2.polylines(large, [at], False, colour, 1, cv2.LINE_AA)
        crops.append(large)
    cv2.imwrite(str(path), np.hstack(crops))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--draw", type=Path)
    options = parser.parse_args()
    views = find_views(options.folder / "08-05-25")
    made = calibrate_cameras(views, BOARD, None, triggered=True)
    for camera, report in zip(made.cameras, made.report):
        print(f"{camera.name}: {report.views} views, RMS {camera.rms_px:.3f} px", flush=True)
    print(*made.notes, *made.warnings, sep="\n")
    pictures = {}
    lines = {}
    for name in NAMES:
        path = options.folder / "08-12-25" / "test_calib_images" / f"{name}_0.png"
        pictures[name] = cv2.imread(str(path))
        lines[name] = trace_between(green_less_blue(pictures[name]), *ENDS[name])
        print(f"{name}: {row_of(lines[name])}")
    curves = {name: Curve.through(line) for name, line in lines.items()}
    for name in NAMES:
        offset_px = offsets_px(curves, made.cameras, name)
        sigma_px = mean_sigma_px(lines, curves, made.cameras, name)
        mean = np.mean(offset_px)
        print(
            f"{name}: its line is {mean:+.2f} px beside the curve by the others, sigma {sigma_px[0]:.2f} by lines and "
            f"{sigma_px[1]:.2f} by cameras, z {mean / np.hypot(*sigma_px):+.2f}; scatter {np.std(offset_px):.2f} px, "
            f"{len(offset_px)} places"
        )
    if options.draw:
        draw(options.draw, pictures, lines, curves, made.cameras)


if __name__ == "__main__":
    main()
