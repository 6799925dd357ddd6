"""Lines and pictures painted by OpenCV: overlays and films, where Matplotlib would take many times as long."""

import cv2
import numpy as np

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


def put_text(
    picture: np.ndarray, text: str, place: tuple[int, int], colour: tuple[int, int, int]
) -> None:
    """Write text into a picture, its lower left corner at a place, px."""
    cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.45, colour, 1, cv2.LINE_AA)
