"""Pictures of a printed board through a known homography."""

from functools import cache

import cv2
import numpy as np

SIZE_PX = (800, 560)  # not square, and no multiple of the board
PX_PER_SQUARE_PRINTED = 120
# From squares to the picture: some 75 px a square, turned and in perspective.
H = np.array([[82.0, 14.0, 60.0], [-9.0, 78.0, 70.0], [0.012, 0.018, 1.0]])
# The same board nearly along the pixels' rows and columns.
UPRIGHT_H = np.array([[82.3, 0.7, 60.0], [-0.4, 78.4, 70.0], [0.0004, 0.0002, 1.0]])
BLUR_PX = 1.1


def true_px(board, homography=H):
    squares = np.column_stack(
        [board.corners_mm[:, :2] / board.square_mm, np.ones(len(board.corners_mm))]
    )
    mapped = squares @ homography.T
    return mapped[:, :2] / mapped[:, 2:]


@cache
def clean_picture(board, blur_px=BLUR_PX, is_upright=False):
    """The board through H, float32: each pixel the mean of 4 x 4 looks at the print, then blurred."""
    homography = UPRIGHT_H if is_upright else H
    printed = board.opencv().generateImage(
        tuple(PX_PER_SQUARE_PRINTED * n for n in board.squares), marginSize=0
    )
    grid = np.stack(np.meshgrid(*((np.arange(4 * n) - 1.5) / 4.0 for n in SIZE_PX)), axis=-1)
    squares = (
        np.concatenate([grid, np.ones((*grid.shape[:2], 1))], axis=-1) @ np.linalg.inv(homography).T
    )
    place = (squares[..., :2] / squares[..., 2:] * PX_PER_SQUARE_PRINTED - 0.5).astype(np.float32)
    fine = cv2.remap(
        printed, place[..., 0], place[..., 1], cv2.INTER_NEAREST, borderValue=255
    ).astype(np.float32)
    grey = fine.reshape(SIZE_PX[1], 4, SIZE_PX[0], 4).mean(axis=(1, 3))
    blurred = cv2.GaussianBlur(grey, (0, 0), blur_px) if blur_px > 0.0 else grey
    return 40 + 0.6 * blurred


def picture(board, rng, noise=0.0, correlated=False, invert=False, **clean):
    """The board through H as a camera stores it; noise white, or blurred as a demosaiced picture's is."""
    white = rng.standard_normal(SIZE_PX[::-1])
    if correlated:
        white = cv2.GaussianBlur(white, (0, 0), 0.8)
        white /= white.std()
    grey = clean_picture(board, **clean) + noise * white
    return np.clip(np.round(255 - grey if invert else grey), 0, 255).astype(np.uint8)
