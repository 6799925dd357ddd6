"""Lines and pictures painted by OpenCV: overlays and films, where Matplotlib would take many times as long."""

import cv2
import numpy as np

_PARTS = 4  # bits of a pixel to which lines are placed
_WHITE_PERCENT = 99.8  # of a picture's pixels are shown no brighter than white
_EVERY_PX = 3  # of these that are asked


def as_8_bit(grey: np.ndarray) -> np.ndarray:
    """A picture (h, w) of any depth as bright as a screen shows it, uint8."""
    white = max(float(np.percentile(grey[::_EVERY_PX, ::_EVERY_PX], _WHITE_PERCENT)), 1.0)
    return cv2.convertScaleAbs(grey, alpha=255.0 / white)


def polyline(picture: np.ndarray, px: np.ndarray, colour: tuple[int, int, int]) -> None:
    """Lines between points (n, 2), px, to a sixteenth of a pixel, broken where one is missing."""
    good = np.isfinite(px).all(axis=1)
    for run in np.split(np.arange(len(px)), np.flatnonzero(np.diff(good.astype(int))) + 1):
        if len(run) > 1 and good[run[0]]:
            places = [np.round(px[run] * 2**_PARTS).astype(np.int32)]
            cv2.polylines(picture, places, False, colour, 1, cv2.LINE_AA, _PARTS)
