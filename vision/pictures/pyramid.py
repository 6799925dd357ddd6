"""Pictures and cameras at a coarser scale: cheaper to evaluate, and less precise."""

from collections.abc import Mapping
from dataclasses import replace

import cv2
import numpy as np

from vision.geometry.camera import N_PARAMETERS, Camera, Cameras

# [1] Lens parameters that are pixels: fx fy cx cy. Derived.
_IN_PX = 4


def shrunk_picture(picture: np.ndarray, scale: int) -> np.ndarray:
    """Average squares of `scale` pixels, (h // scale, w // scale).

    What is left over at right and below is cut off.
    """
    if scale == 1:
        return picture
    height = picture.shape[0] // scale
    width = picture.shape[1] // scale
    whole = np.ascontiguousarray(picture[: height * scale, : width * scale])
    return cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)


def shrunk_cameras(cameras: Cameras, scale: int) -> Cameras:
    """Return the cameras of shrunk pictures, with their covariance.

    A pixel's middle is where it was: (u + 1/2) / scale.
    """
    if scale == 1:
        return cameras
    by_px = np.ones(N_PARAMETERS)
    by_px[:_IN_PX] = 1.0 / scale
    all_by_px = np.tile(by_px, len(cameras))
    covariance = cameras.covariance * np.outer(all_by_px, all_by_px)
    shrunk = tuple(_shrunk_camera(camera, scale) for camera in cameras)
    by_error = all_by_px[:, None] * cameras.by_error
    return Cameras(shrunk, covariance, cameras.placement, by_error)


def _shrunk_camera(camera: Camera, scale: int) -> Camera:
    """Return the camera of shrunk pictures."""
    matrix = camera.matrix / scale
    matrix[:2, 2] = shrunk_px(camera.matrix[:2, 2], scale)
    matrix[2, 2] = 1.0
    width, height = camera.size_px
    return replace(
        camera,
        matrix=matrix,
        size_px=(width // scale, height // scale),
        rms_px=camera.rms_px / scale,
    )


def shrunk_px(px: np.ndarray, scale: int) -> np.ndarray:
    """Convert places of the full picture to those in the shrunk one, px."""
    return (px + 0.5) / scale - 0.5


def full_px(px: np.ndarray, scale: int) -> np.ndarray:
    """Convert places of the shrunk picture to those in the full one, px."""
    return (px + 0.5) * scale - 0.5


def shrunk_frames(
    frames: Mapping[str, Mapping[int, np.ndarray]], scale: int
) -> dict[str, dict[int, np.ndarray]]:
    """Shrink pictures by camera and frame index."""
    shrunk = {}
    for name, pictures in frames.items():
        shrunk[name] = {index: shrunk_picture(grey, scale) for index, grey in pictures.items()}
    return shrunk
