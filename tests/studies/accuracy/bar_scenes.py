"""How well the bar is found before any wire is known, in scenes with truth: its axis, and its line in each camera.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/bar_scenes.py FOLDER [PATTERN]

FOLDER holds sessions of one whisk each (trials/w) with exact cameras and truth.toml: d_x_mm, touch_deg, beta_deg and
psi_deg, which are the axis. A row a camera: how far off the line is at 20 mm to either side of the contact (px), with
its sigma; how wide the bar looks over how wide it is; then the share of scenes whose axis is within 1 px in every camera
that sees it, and z's RMS and largest, of the line's shift, of its tilt (over 20 mm), and of the width's logarithm. Sigmas
hold what both points have in common.
"""

import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.session.footage import rig_picture
from vision.boards.board_optics import estimate_optics
from vision.boards.charuco import CharucoBoard
from vision.calibration.cameras_file import read_cameras
from vision.geometry.camera import Camera, Cameras
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.silhouette import outline
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.view import View
from vision.touched.find import axis_from_angles
from vision.touched.line import BarLineEstimate, measure_bars
from vision.touched.search import find_object
from vision.touched.search_scene import SearchScene
from vision.touched.width import combine_widths, measure_relative_widths

FOUND_PX = 1.0


def board_of(folder: Path) -> CharucoBoard:
    """The board of a session."""
    table = tomllib.loads((folder / "session.toml").read_text())["board"]
    return CharucoBoard(**table | {"squares": tuple(table["squares"])})


def read_cameras_with_optics(folder: Path) -> Cameras:
    """A scene's exact cameras, with the transfer curve and blur that a board in its rig pictures shows."""
    cameras, board = read_cameras(folder / "cameras.toml"), board_of(folder)
    known = []
    for camera in cameras:
        picture = rig_picture(folder / "boards" / "rig" / f"{camera.name}.png")
        known.append(replace(camera, optics=estimate_optics(picture, board)))
    return replace(cameras, cameras=tuple(known))


def read_scene(folder: Path) -> tuple[list[View], Cameras, Rods, np.ndarray, BarAxis]:
    """Views, cameras, rods, motor angles (rad) of all frames, and the true axis of a scene."""
    session = tomllib.loads((folder / "session.toml").read_text())
    wire = Wire(
        **{name: session["whisker"][name] for name in ("shape", "length_mm", "diameter_mm")}
    )
    rods = Rods(wire, Bar(session["bar"]["diameter_mm"]))
    cameras = read_cameras_with_optics(folder)
    views = []
    for camera in cameras:
        files = sorted((folder / "trials" / "w" / camera.name).iterdir())
        frames = {int(file.stem): cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in files}
        rig = cv2.imread(
            str(folder / "boards" / "rig" / f"{camera.name}.png"), cv2.IMREAD_GRAYSCALE
        ).astype(float)
        views.append(View(camera, frames, rig, measure_noise(*list(frames.values())[:2])))
    truth = tomllib.loads((folder / "trials" / "w" / "truth.toml").read_text())
    angles = np.radians([truth[name] for name in ("touch_deg", "beta_deg", "psi_deg")])
    motor = np.genfromtxt(folder / "trials" / "w" / "truth.csv", delimiter=",", names=True)[
        "motor_deg"
    ]
    axis = axis_from_angles(truth["d_x_mm"], *angles, rods.reach_mm(truth["d_x_mm"]))
    return views, cameras, rods, np.radians(motor), axis.upward()


def off_px(camera: Camera, true: BarAxis, radius_mm: float, px, normal) -> np.ndarray:
    """How far points (n, 2) lie from the middle of the true bar along their normals, px."""
    place = np.linspace(-60.0, 60.0, 241)
    points = true.point_mm + place[:, None] * true.direction
    middle, _ = outline(camera, points, np.broadcast_to(true.direction, points.shape), radius_mm)
    along = np.stack([normal[:, 1], -normal[:, 0]], axis=1)
    away = px[:, None] - middle
    nearest = np.argmin(np.abs(np.einsum("nki,ni->nk", away, along)), axis=1)
    return np.sum(away[np.arange(len(px)), nearest] * normal, axis=1)


def axis_off_px(camera: Camera, true: BarAxis, found: BarAxis, radius_mm: float) -> float:
    """Largest distance of the found axis's middle from the true one's, within 20 mm of the found axis's point."""
    points = found.point_mm + np.array([-20.0, 0.0, 20.0])[:, None] * found.direction
    middle, _ = outline(camera, points, np.broadcast_to(found.direction, points.shape), radius_mm)
    along = middle[2] - middle[0]
    normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    return float(np.max(np.abs(off_px(camera, true, radius_mm, middle, np.tile(normal, (3, 1))))))


def main() -> None:
    pattern = sys.argv[2] if len(sys.argv) > 2 else "*"
    worst, every, widths = [], [], []
    for folder in sorted(
        one for one in Path(sys.argv[1]).glob(pattern) if (one / "trials/w/truth.toml").exists()
    ):
        views, cameras, rods, motor, true = read_scene(folder)
        try:
            scene = SearchScene(views, cameras, rods, motor, VisionSettings())
            seen = find_object(scene)
        except Refused as reason:
            print(f"{folder.name:<6} {reason}", flush=True)
            worst.append(np.inf)
            continue
        by_name = {camera.name: camera for camera in cameras}
        worst.append(
            max(axis_off_px(camera, true, seen.axis, rods.bar.radius_mm) for camera in cameras)
        )
        print(f"{folder.name:<6} axis off by {worst[-1]:.2f} px", flush=True)
        looks = measure_relative_widths(seen)
        for share, sigma in [combine_widths(looks)] if looks else []:
            widths.append(np.log(share) / (sigma / share))
            print(f"       looks {share:.3f} ± {sigma:.3f} times as wide as it is", flush=True)
        every += [
            row
            for name, line in measured_finely(scene, seen.axis).items()
            for row in line_rows(by_name[name], line, true, rods.bar.radius_mm)
        ]
    found = np.mean(np.array(worst) < FOUND_PX)
    print(f"{found:.0%} of {len(worst)} axes within {FOUND_PX:g} px")
    modes = np.abs(np.array(every))  # (lines, 2, 2): shift and tilt, error and sigma
    for name, (error, sigma) in zip(("shift", "tilt"), np.moveaxis(modes, 0, -1)):
        z = error / sigma
        print(
            f"{name} of {len(z)} lines: median error {np.median(error):.3f} px, sigma {np.median(sigma):.3f}; "
            f"z RMS {np.sqrt(np.mean(z**2)):.2f}, median {np.median(z):.2f}, largest {z.max():.1f}"
        )
    print(
        f"z of widths: RMS {np.sqrt(np.mean(np.square(widths))):.2f}, largest {np.max(np.abs(widths)):.1f}"
    )


def measured_finely(scene: SearchScene, axis: BarAxis) -> dict[str, BarLineEstimate]:
    """By camera the line of the bar about an axis, as the fit measures it at last."""
    coarse = measure_bars(scene.object_views, axis)
    return measure_bars(scene.object_views, axis, coarse)


def line_rows(
    camera: Camera, line: BarLineEstimate, true: BarAxis, radius_mm: float
) -> list[list[tuple[float, float]]]:
    """Error and sigma, px, of shift and tilt of a camera's line, whose two points are printed."""
    if not line.is_bar:
        return []
    points = line.points
    error = off_px(camera, true, radius_mm, points.px, points.normal)
    sigma = np.sqrt(points.sigma_px**2 + np.sum(points.shared_px**2, axis=1))
    parts = [f"{e:+.3f} ± {s:.3f}" for e, s in zip(error, sigma)]
    print(
        f"       {camera.name:<6} {'   '.join(parts)}   evidence {line.evidence_for_bar:.0f}, left {line.unresolved_share:.3f}",
        flush=True,
    )
    own = np.sqrt(np.mean(points.sigma_px**2) / 2.0)  # of shift and tilt alike
    modes = []
    for mode, weights in enumerate(np.array([[0.5, 0.5], [-0.5, 0.5]])):
        in_common = np.sqrt(np.mean(points.shared_px[:, mode] ** 2))
        modes.append((float(weights @ error), float(np.hypot(own, in_common))))
    return [modes]


if __name__ == "__main__":
    main()
