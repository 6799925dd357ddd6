"""The edges of a picture that the picture without rods does not have, as a tensor at every pixel.

The gradients of both pictures are taken at the blur of an edge. Other light on the same background
scales its gradient, so the multiple of the background's gradient that fits best at a pixel is
subtracted: a square of the board in a shadow is no edge. What is left counts against the noise and
against the mean of its surroundings, because a soft shadow changes everywhere and a rod's edge only
across its line. The result is a strength from 0 to 1 times the tensor of the gradient's direction,
(xx, xy, yy). Like a structure tensor it can be blurred without opposite gradients cancelling, and
n' T n is how strong the edge across a direction n is.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import rotation_z
from vision.geometry.rods import Rods
from vision.pictures.change import HALF
from vision.pictures.view import View

# [half-widths] An edge's own blur, so that rim and highlight stay apart: with 0.1, 83 % of 53
# path-traced scenes were found within 3 px at once, with 0.06 87 %. Study: bar_scenes.py.
_EDGE_BLUR = 0.06
# [px] Least blur of an edge. Study: bar_scenes.py.
_LEAST_BLUR_PX = 0.7
# [1] Times the picture without rods: more is no other light on the same thing. By 1.2 a d_x moves by
# 0.1 sigma, by 3 by 0.6. Study: thresholds.py touched.edge_map _MOST_LIGHT ….
_MOST_LIGHT = 1.5
# [1] An edge is half strong at so many times the median gradient. By 1 a d_x moves by
# 1 sigma, by 2.2 a slope by 1.4. Study: thresholds.py touched.edge_map _OVER_NOISE ….
_OVER_NOISE = 1.5
# [blurs] Blur of the surroundings that an edge must exceed. By 3 a d_x moves by 0.6 sigma; by 1.4 by
# 0.4, and in the sun another of two bars is taken, whose slope is off by 10°. Study: thresholds.py
# touched.edge_map _SURROUND_BLURS ….
_SURROUND_BLURS = 2.0
# [1] Added to what is divided by. Stated.
_TINY = 1e-12


@dataclass(frozen=True)
class EdgeMap:
    """The edges that one camera sees, at every HALF-th pixel.

    tensor (h, w, 3): strength times direction across the edge, see `edge_strength_tensor`.
    half_width_px: half the width of the bar at the middle of the whisker, in these pixels.
    """

    camera: Camera
    tensor: np.ndarray
    half_width_px: float

    def blurred(self, half_widths: float) -> "EdgeMap":
        """Return the map blurred by so many half-widths of the bar, without edges at its border.

        At the border lines end that leave the picture.
        """
        bell, _ = _gaussian_and_derivative(half_widths * self.half_width_px)
        tensor = _filter(self.tensor, bell, bell)
        tensor[[0, -1]] = 0.0
        tensor[:, [0, -1]] = 0.0
        return replace(self, tensor=tensor)

    def strength_across(self, px: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Return the strength (...) of edges with unit normals (..., 2) at points (..., 2) px."""
        x, y = np.moveaxis(normal, -1, 0)
        xx, xy, yy = np.moveaxis(self.tensor_at(px[..., 0], px[..., 1]), -1, 0)
        return x * x * xx + 2.0 * x * y * xy + y * y * yy

    def tensor_at(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the tensors (..., 3) of the pixels nearest to x, y (...).

        Outside the picture they are those of its border.
        """
        height, width = self.tensor.shape[:2]
        column = np.fmin(np.fmax(x, 0.0), width - 1.0) + 0.5
        row = np.fmin(np.fmax(y, 0.0), height - 1.0) + 0.5
        index = row.astype(np.intp) * width + column.astype(np.intp)
        return self.tensor.reshape(-1, 3).take(index, axis=0)


def compute_edge_map(view: View, rods: Rods, motor_rad: float) -> EdgeMap:
    """Compute the edges of what stands still in one camera.

    motor_rad: where the whisker about touches, which says how far away the bar is.
    """
    camera = view.camera
    middle_mm = 0.5 * rods.wire.length_mm * rotation_z(motor_rad)[:, 0]
    distance_mm = float(np.linalg.norm(middle_mm - camera.centre_mm))
    focal_px = float(np.mean(camera.lens[:2])) / HALF
    half_width_px = rods.bar.radius_mm * focal_px / distance_mm
    blur_px = max(_EDGE_BLUR * half_width_px, _LEAST_BLUR_PX)
    tensor = edge_strength_tensor(view.still, view.half_background, blur_px)
    return EdgeMap(camera, tensor, half_width_px)


def edge_strength_tensor(grey: np.ndarray, background: np.ndarray, blur_px: float) -> np.ndarray:
    """Compute the edges (h, w, 3) of a picture (h, w) that its background (h, w) does not have.

    The three are strength · (xx, xy, yy) with (x, y) the unit vector across the edge. The strength
    goes from 0 to 1: it compares what the gradient has beyond its surroundings with the median
    gradient, which is that of noise.
    """
    residual = _gradient_beyond(grey, background, blur_px)
    size = np.hypot(residual[0], residual[1])
    bell, _ = _gaussian_and_derivative(_SURROUND_BLURS * blur_px)
    excess = np.maximum(size - _filter(size, bell, bell), 0.0)
    noise = _OVER_NOISE * np.median(size)
    strength = excess**2 / (excess**2 + noise**2 + _TINY)
    x, y = residual / np.maximum(size, _TINY)
    return strength[..., None] * np.stack([x * x, x * y, y * y], axis=-1)


def _gradient_beyond(grey: np.ndarray, background: np.ndarray, blur_px: float) -> np.ndarray:
    """Compute the gradient (2, h, w) of a picture that its background in any light lacks."""
    gradient = _gradient(grey, blur_px)
    behind = _gradient(background, blur_px)
    power = np.maximum(np.sum(behind**2, axis=0), _TINY)
    light = np.sum(gradient * behind, axis=0) / power  # of this picture over the background's
    return gradient - np.clip(light, 0.0, _MOST_LIGHT) * behind


def _gradient(picture: np.ndarray, blur_px: float) -> np.ndarray:
    """Compute the gradient (2, h, w), by x and y, of a picture (h, w) blurred by a Gaussian."""
    bell, derivative = _gaussian_and_derivative(blur_px)
    picture = np.asarray(picture, dtype=np.float32)
    by_x = _filter(picture, derivative, bell)
    by_y = _filter(picture, bell, derivative)
    return np.stack([by_x, by_y])


def _gaussian_and_derivative(blur_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a Gaussian (n,) out to four sigmas, and the kernel (n,) of the derivative under it."""
    reach = int(4.0 * blur_px + 0.5)
    place = np.arange(-reach, reach + 1)
    bell = np.exp(-0.5 * (place / blur_px) ** 2)
    bell /= np.sum(bell)
    return bell, place / blur_px**2 * bell


def _filter(picture: np.ndarray, along_rows: np.ndarray, along_columns: np.ndarray) -> np.ndarray:
    """Filter a picture (h, w) or (h, w, 3) by one kernel along x and one along y.

    At its border it is reflected.
    """
    return cv2.sepFilter2D(picture, -1, along_rows, along_columns, borderType=cv2.BORDER_REFLECT)
