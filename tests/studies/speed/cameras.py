"""What a calibration costs against the number of views and of cameras: linear in views.

    python tests/studies/speed/cameras.py

Prints seconds of the adjustment alone (corners given), least of three, and the exponent over the upper half.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.board_scenes import (
    BOARD,
    SIZE_PX,
    T_RIG_BOARD,
    board_views,
    looking_at,
    noisy,
    rig_view,
)
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews, MeasuredPose

LENS = [2000, 2002, 642.0, 358.0, -0.10, 0.10, 3e-4, -3e-4, 0.0]
PLACES = [(60, -180, 330), (30, -340, 130), (140, -300, 190), (-60, -280, 220)]


def seconds(cameras: int, views: int) -> float:
    """Of one calibration of so many cameras with so many views each."""
    rng = np.random.default_rng(0)
    made = [looking_at(f"c{k}", PLACES[k], [50, 0, 0], LENS) for k in range(cameras)]
    boards = {c.name: [noisy(v, 0.05, rng) for v in board_views(c, views, rng)] for c in made}
    rig = {c.name: noisy(rig_view(c), 0.05, rng) for c in made}
    sizes = dict.fromkeys(boards, SIZE_PX)
    return min(_timed(boards, rig, sizes) for _ in range(3))


def _timed(boards, rig, sizes) -> float:
    begin = time.process_time()
    calibrate_cameras(BoardViews(boards, sizes, rig), BOARD, MeasuredPose(T_RIG_BOARD))
    return time.process_time() - begin


def main() -> None:
    for cameras in (1, 2, 4):
        counts = [10, 20, 40, 80, 160]
        cost = [seconds(cameras, n) for n in counts]
        exponent = np.polyfit(np.log(counts[2:]), np.log(cost[2:]), 1)[0]
        print(
            f"{cameras} cameras:",
            ", ".join(f"{n} views {c:.2f} s" for n, c in zip(counts, cost)),
            f"(cost ∝ views^{exponent:.2f})",
        )


if __name__ == "__main__":
    main()
