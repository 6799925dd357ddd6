"""How clearly does a picture of the board on the rig tell whose lens is whose?

    python tests/studies/accuracy/exchanged_boards.py [SESSION …]

Draws recordings of two cameras that are alike but for so many per cent of focal length, and as much of 8 % of the
picture's width in principal point, calibrates each by itself, and prints the residuals of the rig picture by its own
lens, by the other's, and their ratio: the median over draws and the range. Of a SESSION with a board on the rig it
prints them for each camera.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.cameras.board_views import read_board_views
from bench.session.session import load_session
from tests.studies.accuracy.board_scenes import (
    BOARD,
    SIZE_PX,
    board_views,
    noisy,
    rig_view,
    two_cameras,
)
from vision.calibration.calibrate import standing_boards
from vision.calibration.exchanged_boards import lens_residuals_px
from vision.calibration.one_picture import calibrate_alone
from vision.geometry.camera import Cameras, camera_matrix

SIGMA_PX = 0.04
DIFFERENCES = (0.0, 0.0025, 0.005, 0.01, 0.02, 0.04)
DRAWS = 12


def alike_cameras(difference: float) -> Cameras:
    """The two cameras of `two_cameras`, the second with the first's lens but for a share of it."""
    high, low = two_cameras()
    lens = high.lens.copy()
    lens[:2] *= 1.0 - difference
    lens[2:4] += 0.08 * difference * np.array(SIZE_PX)
    return Cameras((high, replace(low, matrix=camera_matrix(lens), distortion=lens[4:])))


def ratios(difference: float, seed: int) -> np.ndarray:
    """Residuals of each camera's rig picture by the other's lens over those by its own, (2,)."""
    rng = np.random.default_rng(seed)
    cameras = alike_cameras(difference)
    lenses = {}
    standing = {}
    for camera in cameras:
        views = [noisy(view, SIGMA_PX, rng) for view in board_views(camera, 10, rng)]
        lenses[camera.name] = calibrate_alone(views, BOARD, SIZE_PX).solution.state.lens[0]
        standing[camera.name] = noisy(rig_view(camera), SIGMA_PX, rng)
    residual_px = lens_residuals_px(lenses, standing, BOARD)
    return residual_px[[0, 1], [1, 0]] / np.diag(residual_px)


def of_session(folder: Path) -> None:
    """Print the residuals of each camera's rig picture by each lens."""
    session = load_session(folder)
    views = read_board_views(session)
    lenses = {}
    for name, of_camera in views.boards.items():
        seen = [view for view in of_camera if len(view)]
        adjusted = calibrate_alone(seen, session.board, views.sizes_px[name])
        lenses[name] = adjusted.solution.state.lens[0]
    residual_px = lens_residuals_px(lenses, standing_boards(views, session.board), session.board)
    for row, name in zip(residual_px, lenses):
        by = ", ".join(f"by the lens of {other} {px:.4f} px" for other, px in zip(lenses, row))
        print(f"{folder.name}, rig picture of {name}: {by}")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sessions", nargs="*", type=Path)
    for folder in parser.parse_args().sessions:
        of_session(folder)
    print("focal lengths differ by | ratio in one picture: median (least, most) | in both")
    for difference in DIFFERENCES:
        drawn = np.array([ratios(difference, seed) for seed in range(DRAWS)])
        both = drawn.min(axis=1)
        print(
            f"{100 * difference:5.2f} % | {np.median(drawn):.2f} ({drawn.min():.2f}, {drawn.max():.2f})"
            f" | {np.median(both):.2f} ({both.min():.2f}, {both.max():.2f})"
        )


if __name__ == "__main__":
    main()
