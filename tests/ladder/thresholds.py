"""What a threshold of boards and calibration moves, for each of some values.

    python tests/ladder/thresholds.py boards.saddle _BAND_PX 3 4 6 8 12
    python tests/ladder/thresholds.py calibration.corner_noise REJECT_SIGMA 3.5 6

A line a value, the present one marked. Of boards: corners kept in the twenty board views of fixtures/small-session; the
two rig pictures' corners against the true cameras, RMS error in px and over the stated sigma; the same of a drawn board
in noise of 8 levels with a rod before it (tests/scenes/board_pictures.py). Of calibration: where the cameras calibrated
from that session project points of the rig, against the true ones, RMS in px and over the stated sigma.
"""

import importlib
import json
import sys
from ast import literal_eval
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.cameras.board_views import read_board_views
from bench.cameras.calibrate import calibrate_from
from bench.session.session import load_session
from tests.ladder.board_scenes import BOARD
from tests.scenes.board_pictures import picture, true_px
from tests.scenes.recorded import exact_cameras
from vision.boards.corners import find_corners
from vision.geometry.rotation import apply
from vision.pictures.files import Frames, read_picture

SESSION = Path(__file__).resolve().parents[2] / "fixtures" / "small-session"
RIG_POINTS_MM = np.array([[x, 0.0, z] for x in np.linspace(0, 100, 11) for z in (-30.0, -15.0, 0.0, 15.0, 30.0)])
ROD = ((300, 40), (420, 540))  # crosses the drawn board


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def of_views(session) -> int:
    """Corners found in all board views."""
    pictures = (grey for source in session.board_sources.values() for _, grey in Frames.open(source).read())
    return sum(len(find_corners(grey, session.board)) for grey in pictures)


def of_rig(session) -> tuple[np.ndarray, np.ndarray]:
    """Errors (n, 2) of the rig pictures' corners against the true cameras, px, and over their sigmas."""
    T_rig_board = np.array(json.loads((SESSION / "truth.json").read_text())["T_rig_board"])[:3]
    points = apply(T_rig_board, session.board.corners_mm)
    errors, z = [], []
    for camera in exact_cameras(SESSION):
        found = find_corners(read_picture(session.rig_pictures[camera.name]), session.board)
        errors.append(found.px - camera.project(points)[found.ids])
        z.append(errors[-1] / found.sigma_px[:, None])
    return np.concatenate(errors), np.concatenate(z)


def of_drawn() -> tuple[int, float, float]:
    """Corners kept beside a rod, their RMS error in px, and over their sigmas."""
    grey = picture(BOARD, np.random.default_rng(1), noise=8.0)
    cv2.line(grey, *ROD, 90, 20, cv2.LINE_AA)
    found = find_corners(grey, BOARD)
    error = found.px - true_px(BOARD)[found.ids]
    return len(found), rms(error), rms(error / found.sigma_px[:, None])


def of_boards(session) -> str:
    (errors, z), drawn = of_rig(session), of_drawn()
    return (
        f"{of_views(session)} corners in the views; rig: {len(errors)}, {rms(errors):.4f} px, z {rms(z):.2f}; "
        f"drawn: {drawn[0]}, {drawn[1]:.4f} px, z {drawn[2]:.2f}"
    )


def of_calibration(session) -> str:
    cameras = calibrate_from(session, read_board_views(session)).cameras
    errors, z = [], []
    for camera, true in zip(cameras, exact_cameras(SESSION)):
        px, _, by_camera = camera.project_with_jacobians(RIG_POINTS_MM)
        own = cameras.parameters_of(camera.name)
        variance = np.einsum("nij,jk,nik->ni", by_camera, cameras.covariance[own, own], by_camera)
        errors.append(px - true.project(RIG_POINTS_MM))
        z.append(errors[-1] / np.sqrt(variance))
    return f"points of the rig: {rms(errors):.4f} px, z {rms(z):.2f}"


def main() -> None:
    name, constant, *values = sys.argv[1:]
    module, session = importlib.import_module(f"vision.{name}"), load_session(SESSION)
    measure = of_boards if name.startswith("boards.") else of_calibration
    usual = getattr(module, constant)
    print(constant)
    for value in (usual, *map(literal_eval, values)):
        setattr(module, constant, value)
        print(f"{value!s:>20} {'*' if value == usual else ' '} {measure(session)}", flush=True)


if __name__ == "__main__":
    main()
