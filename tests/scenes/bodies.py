"""Bodies with boards on their faces: where faces stand, and drawn pictures of them."""

import cv2
import numpy as np

from vision.boards import Body
from vision.geometry.rotation import compose, exp_rotation

_PX_PER_MM = 20
_MARGIN_MM = 2.0
_FINER = 3  # each pixel of a picture is the mean of so many squared
_BLUR_PX = 0.7
_NOISE = 1.5
_DARKEST = 20.0
_BRIGHTEST = 220.0


def box_faces(turns: np.ndarray, centres_mm: np.ndarray, side_mm: float) -> np.ndarray:
    """Return the poses (F, 3, 4) of square faces whose middles lie at places (F, 3), each turned by a vector (F, 3)."""
    R = exp_rotation(turns)
    middle_mm = 0.5 * side_mm * np.array([1.0, 1.0, 0.0])
    return np.concatenate([R, (centres_mm - R @ middle_mm)[:, :, None]], axis=2)


def body_picture(
    body: Body,
    T_camera_body: np.ndarray,
    T_body_face: np.ndarray,
    K: np.ndarray,
    size_px: tuple[int, int],
    rng: np.random.Generator,
) -> np.ndarray:
    """Return a picture (h, w) of a convex body by a camera without distortion; dark where no face is."""
    width, height = size_px
    light = np.zeros((height * _FINER, width * _FINER), np.float32)
    fine = np.array([[_FINER, 0, 0.5 * (_FINER - 1)], [0, _FINER, 0.5 * (_FINER - 1)], [0, 0, 1.0]])
    for face, T in zip(body.faces, T_body_face):
        T_camera_face = compose(T_camera_body, T)
        if T_camera_face[:, 2] @ T_camera_face[:, 3] <= 0.0:
            continue  # z points into the face: it is seen where that leads away from the camera
        side = face.squares[0] * face.square_mm
        count = round(side * _PX_PER_MM)
        margin = round(_MARGIN_MM * _PX_PER_MM)
        printed = face.opencv().generateImage((count + 2 * margin,) * 2, marginSize=margin)
        from_px = (
            np.array([[1, 0, 0.5 - margin], [0, 1, 0.5 - margin], [0, 0, _PX_PER_MM]]) / _PX_PER_MM
        )
        H = fine @ K @ T_camera_face[:, [0, 1, 3]] @ from_px
        size = (width * _FINER, height * _FINER)
        drawn = cv2.warpPerspective(printed.astype(np.float32), H, size, flags=cv2.INTER_LINEAR)
        is_face = cv2.warpPerspective(np.ones_like(printed), H, size, flags=cv2.INTER_NEAREST) > 0
        light[is_face] = drawn[is_face]
    small = cv2.resize(light, size_px, interpolation=cv2.INTER_AREA)
    grey = _DARKEST + (_BRIGHTEST - _DARKEST) / 255.0 * cv2.GaussianBlur(small, (0, 0), _BLUR_PX)
    return np.clip(grey + rng.normal(0, _NOISE, grey.shape), 0, 255).round().astype(np.uint8)
