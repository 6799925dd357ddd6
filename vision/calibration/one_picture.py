"""One picture's lens from views of the board alone: where more begins, and what explains its views best."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vision.boards.corners import Corners, by_face
from vision.calibration.bundle import N_CAMERA, POSE, BundleState, SharedLenses
from vision.calibration.corner_noise import Adjustment, adjust_coarse
from vision.calibration.first_guess import board_pose, first_lens
from vision.calibration.layout import gather
from vision.calibration.priors import lens_priors
from vision.geometry.board import Board
from vision.geometry.crop import Crop


def first_lenses(
    views: Sequence[Sequence[Corners]], board: Board, crops: Sequence[Crop]
) -> np.ndarray:
    """Return lenses (C, 9) to begin with of cameras that are parts of one picture, by the views of all.

    Where the picture's middle is the principal point, flipping the picture does not move it.
    """
    in_picture = []
    for own, crop in zip(views, crops):
        for view in own:
            in_picture += by_face(replace(view, px=view.px + crop.offset_px), board)
    whole = first_lens(in_picture, board.flat_mm, crops[0].whole_px)
    return np.array([crop.lens_of(whole) for crop in crops])


def calibrate_alone(views: Sequence[Corners], board: Board, size_px: tuple[int, int]) -> Adjustment:
    """Calibrate one camera by itself, robustly, as a start for more.

    The world is the camera's frame.
    """
    return calibrate_picture([views], board, [Crop.whole("", size_px)])


def calibrate_picture(
    views: Sequence[Sequence[Corners]], board: Board, crops: Sequence[Crop]
) -> Adjustment:
    """Calibrate the one lens of cameras that are parts of a picture, robustly, as a start for more.

    views: of each camera, whose frame is their world.
    """
    lenses = first_lenses(views, board, crops)
    shots = []
    poses = []
    for c, own in enumerate(views):
        for view in own:
            shots.append((c, len(poses), view))
            poses.append(board_pose(view, board.corners_mm, lenses[c]))
    T_camera_world = np.tile(np.eye(3, 4), (len(crops), 1, 1))
    state = BundleState(lenses, T_camera_world, np.array(poses), board.stated_terms)
    priors = lens_priors(len(crops), len(poses), board, SharedLenses.of(crops))
    for c in range(len(crops)):
        priors.free[N_CAMERA * c :][POSE] = False
    return adjust_coarse(state, gather(shots), board, priors)
