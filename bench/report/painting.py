"""Lines and pictures painted by OpenCV: overlays and films, where Matplotlib would take many times as long."""

from collections.abc import Sequence

import cv2
import numpy as np

FILM_WIDTH_PX = 720  # of each camera's picture in a film
# Colours of a film, BGR.
WIRE = (47, 217, 255)
BAR = (74, 175, 77)
PAPER = (255, 255, 255)
TITLE_PLACE = (12, 24)  # of a camera's picture in a film, px
_FRACTION_BITS = 4  # of a pixel's coordinates: lines are placed to a sixteenth
_WHITE_PERCENT = 99.8  # of a picture's pixels are shown no brighter than white
_STEP_PX = 3  # between the pixels from which white is taken


def as_8_bit(grey: np.ndarray) -> np.ndarray:
    """Return a picture (h, w) of any depth as bright as a screen shows it, uint8."""
    sample = grey[::_STEP_PX, ::_STEP_PX]
    white = max(float(np.percentile(sample, _WHITE_PERCENT)), 1.0)
    return cv2.convertScaleAbs(grey, alpha=255.0 / white)


def polyline(picture: np.ndarray, px: np.ndarray, colour: tuple[int, int, int]) -> None:
    """Draw lines between points (n, 2), px, broken where one is missing."""
    for known in np.ma.clump_unmasked(np.ma.masked_invalid(px.sum(axis=1))):
        points = np.round(px[known] * 2**_FRACTION_BITS).astype(np.int32)
        if len(points) > 1:
            cv2.polylines(picture, [points], False, colour, 1, cv2.LINE_AA, _FRACTION_BITS)


def shrink(grey: np.ndarray, width_px: int) -> np.ndarray:
    """Return a grey picture (h, w) of any depth in colours (h, w, 3), so wide, as bright as a screen shows it."""
    size = (width_px, round(width_px / grey.shape[1] * grey.shape[0]))
    small = cv2.resize(as_8_bit(grey), size, interpolation=cv2.INTER_AREA)
    return cv2.cvtColor(small, cv2.COLOR_GRAY2BGR)


def shrink_px(px: np.ndarray, scale: float) -> np.ndarray:
    """Return where places (n, 2) of a picture are in one that is `scale` times as wide.

    The centre of a pixel is a whole number.
    """
    return scale * (px + 0.5) - 0.5


def side_by_side(pictures: Sequence[np.ndarray]) -> np.ndarray:
    """Return pictures side by side, the lower ones filled up."""
    height = max(len(picture) for picture in pictures)
    filled = []
    for picture in pictures:
        filled.append(np.pad(picture, ((0, height - len(picture)), (0, 0), (0, 0))))
    return np.hstack(filled)


def put_text(
    picture: np.ndarray, text: str, place: tuple[int, int], colour: tuple[int, int, int]
) -> None:
    """Write text into a picture, its lower left corner at a place, px."""
    cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, colour, 1, cv2.LINE_AA)
