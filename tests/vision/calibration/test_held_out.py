"""Real video of a real board: how cameras do on views they were not made from."""

import numpy as np
import pytest

from vision.boards.charuco import CharucoBoard
from vision.boards.corners import Corners, find_corners
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.held_out import check_held_out
from vision.calibration.views import BoardViews
from vision.pictures.frames import Frames

BOARD = CharucoBoard((4, 5), 54.0, 40.5, "DICT_4X4_1000", inverted=True)


def views_of(folder, names):
    """Corners of each camera's video, a view a frame."""
    series = {name: Frames.open(folder / f"{name}.mp4") for name in names}
    views = {
        name: [find_corners(grey, BOARD) for _, grey in frames.read()]
        for name, frames in series.items()
    }
    return views, {name: frames.size_px for name, frames in series.items()}


def measured(folder, names):
    """Calibrated without the frames with index % 4 == 3, and measured on those."""
    views, sizes = views_of(folder, names)
    is_held = np.arange(len(next(iter(views.values())))) % 4 == 3
    kept = {
        n: [Corners.none() if out else v for v, out in zip(vs, is_held)] for n, vs in views.items()
    }
    made = calibrate_cameras(BoardViews(kept, sizes), BOARD, None)
    return check_held_out(made, views, is_held)


@pytest.mark.parametrize("name, best_of_others_px", [("cam_0", 0.338), ("cam_2", 0.189)])
def test_single_cameras_beat_the_best_of_others(real, name, best_of_others_px):
    made = measured(real / "calibration" / "single", [name])
    assert made.alone_px[name] < 0.4 * best_of_others_px


def test_four_cameras_beat_the_best_of_others(real):
    """mrcal 2.2 has 1.535 px joint and 0.618 mm of pitch; pictures late by up to 0.15 s are most of that."""
    made = measured(real / "calibration" / "multi4_b", ["cam_0", "cam_1", "cam_2", "cam_3"])
    assert made.views >= 13 and made.joint.pitches > 200
    assert (
        made.joint is made.offsets
        and made.joint.joint_px < 1.25
        and made.joint.pitch_rms_mm < 0.618
    )
    assert made.instants.joint_px < 0.4 and made.instants.pitch_rms_mm < 0.15
    assert abs(made.instants.pitch_mean_mm) < 0.05
    assert (
        made.at_once.joint_px > 2 * made.joint.joint_px
    )  # offsets, which the others told, explain most of it
    assert max(made.alone_px.values()) < 0.12
