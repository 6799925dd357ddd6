"""The figures by which the cameras are judged, on recorded-like and on real pictures.

    python tests/studies/accuracy/cameras.py [--shared FOLDER]

FOLDER holds sessions/steel-sample and real/calibration; by default ../shared beside the checkout. Prints:
- real video, frames with index % 4 == 3 held out: each camera by itself, all together, pitch in space, seconds from
  pictures to figures; the same with OpenCV's own corners instead of the saddle fit, and with every view's pictures
  taken as of one instant;
- steel-sample: where the calibrated cameras project points of the rig, against the true cameras.
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.threads import in_threads
from bench.cameras.board_views import read_board_views
from bench.cameras.calibrate_session import calibrate_from
from bench.session.session import load_session
from fixtures.say_exact import exact_copy
from vision.boards.charuco import CharucoBoard
from vision.boards.corners import Corners, detect, find_corners
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.held_out import check_held_out
from vision.calibration.views import BoardViews
from vision.geometry.camera import Camera
from vision.pictures.frames import Frames

ROOT = Path(__file__).resolve().parents[3]
WEBCAM_BOARD = CharucoBoard((4, 5), 54.0, 40.5, "DICT_4X4_1000", inverted=True)
# What OpenCV's corners scatter by, an axis, on these videos.
OPENCV_SIGMA_PX = 0.15


def opencv_corners(grey: np.ndarray, board: CharucoBoard) -> Corners:
    """The corners that others start from."""
    ids, px = detect(grey, board)
    return Corners(ids, px, np.full(len(ids), OPENCV_SIGMA_PX))


def real_video(folder: Path, names: list[str], find, **how) -> str:
    """One line of figures for a set of videos, in the manner of a comparison of tools."""
    begin = time.perf_counter()
    series = {name: Frames.open(folder / f"{name}.mp4") for name in names}
    views = {
        name: list(in_threads(lambda shot: find(shot[1], WEBCAM_BOARD), frames.read()))
        for name, frames in series.items()
    }
    found = time.perf_counter()
    is_held = np.arange(len(views[names[0]])) % 4 == 3
    kept = {
        n: [Corners.none() if out else v for v, out in zip(vs, is_held)] for n, vs in views.items()
    }
    sizes = {name: frames.size_px for name, frames in series.items()}
    made = calibrate_cameras(BoardViews(kept, sizes), WEBCAM_BOARD, None, **how)
    done = time.perf_counter()
    got = check_held_out(made, views, is_held)
    alone = np.sqrt(np.mean(np.square(list(got.alone_px.values()))))
    seconds = f"{found - begin:.1f} s corners, {done - found:.1f} s adjustment"
    if not got.corners:
        return f"alone {alone:.3f} px; {seconds}"
    ways = {
        "at once": got.at_once,
        "offset a camera": got.offsets,
        "instant a picture": got.instants,
    }
    figures = [
        f"{how}: joint {one.joint_px:.3f} px, pitch RMS {one.pitch_rms_mm:.3f} mm, mean {one.pitch_mean_mm:+.3f} mm"
        for how, one in ways.items()
        if one is not None
    ]
    return "; ".join([f"alone {alone:.3f} px", *figures, seconds])


def steel(session_folder: Path) -> list[str]:
    """Largest error of projected rig points, and largest in stated sigmas, a line a camera."""
    begin = time.perf_counter()
    session = load_session(session_folder)
    made = calibrate_from(session, read_board_views(session))
    seconds = time.perf_counter() - begin
    truth = json.loads((session_folder / "truth.json").read_text())["cameras"]
    points = np.array(
        [[x, 0.0, z] for x in np.linspace(0, 100, 11) for z in np.linspace(-30, 30, 5)]
    )
    lines = [
        _against_truth(made.cameras, camera, truth[camera.name], points) for camera in made.cameras
    ]
    return [*lines, f"{seconds:.1f} s from pictures to cameras"]


def _against_truth(cameras, camera: Camera, true: dict, points: np.ndarray) -> str:
    T = np.column_stack([true["R"], true["t"]])
    exact = Camera(camera.name, (true["width"], true["height"]), true["K"], true["dist"], T)
    px, _, J = camera.project_with_jacobians(points)
    own = cameras.parameters_of(camera.name)
    sigma = np.sqrt(np.einsum("nij,jk,nik->ni", J, cameras.covariance[own, own], J))
    error = px - exact.project(points)
    return (
        f"{camera.name}: largest error {np.abs(error).max():.3f} px, {np.abs(error / sigma).max():.2f} sigma; stated "
        f"sigma {np.median(sigma):.3f} px in the middle, {sigma.max():.3f} px at most"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared")
    shared = parser.parse_args().shared
    real = shared / "real" / "calibration"
    four = [f"cam_{k}" for k in range(4)]
    print("multi4_b                      ", real_video(real / "multi4_b", four, find_corners))
    print("multi4_b, OpenCV's corners    ", real_video(real / "multi4_b", four, opencv_corners))
    print(
        "multi4_b, taken as at once    ",
        real_video(real / "multi4_b", four, find_corners, triggered=True),
    )
    for name in ("cam_0", "cam_2"):
        print(f"single {name}                  ", real_video(real / "single", [name], find_corners))
        print(
            f"single {name}, OpenCV's corners", real_video(real / "single", [name], opencv_corners)
        )
    with tempfile.TemporaryDirectory() as folder:
        sample = exact_copy(shared / "sessions" / "steel-sample", Path(folder) / "steel-sample")
        print("steel-sample", *steel(sample), sep="\n  ")


if __name__ == "__main__":
    main()
