"""Pictures and cameras at a coarser scale: cheaper to look at, and less is seen."""

from collections.abc import Mapping
from dataclasses import replace

import cv2
import numpy as np

from vision.geometry.camera import N_PARAMETERS, Camera, Cameras

# [1] Lens parameters that are pixels: fx fy cx cy. Derived.
_IN_PX = 4


def shrunk_picture(picture: np.ndarray, scale: int) -> np.ndarray:
    """Means (h // scale, w // scale) of squares of `scale` pixels; what is left over at right and below is cut off."""
    if scale == 1:
        return picture
    height, width = (size // scale for size in picture.shape)
    whole = np.ascontiguousarray(picture[: height * scale, : width * scale])
    return cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA)


def shrunk_cameras(cameras: Cameras, scale: int) -> Cameras:
    """The cameras of shrunk pictures, with their covariance. A pixel's middle is where it was: (u + 1/2) / scale."""
    if scale == 1:
        return cameras
    by_px = np.ones(N_PARAMETERS)
    by_px[:_IN_PX] = 1.0 / scale
    all_by_px = np.tile(by_px, len(cameras))
    covariance = cameras.covariance * np.outer(all_by_px, all_by_px)
    return Cameras(
        tuple(_shrunk(camera, scale) for camera in cameras), covariance, cameras.placement
    )


def _shrunk(camera: Camera, scale: int) -> Camera:
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
    """Where a place of the full picture, px, is in the shrunk one."""
    return (px + 0.5) / scale - 0.5


def full_px(px: np.ndarray, scale: int) -> np.ndarray:
    """Where a place of the shrunk picture, px, is in the full one."""
    return (px + 0.5) * scale - 0.5


def shrunk_frames(
    frames: Mapping[str, Mapping[int, np.ndarray]], scale: int
) -> dict[str, dict[int, np.ndarray]]:
    """Shrunk pictures by camera and frame index."""
    return {
        name: {index: shrunk_picture(picture, scale) for index, picture in pictures.items()}
        for name, pictures in frames.items()
    }
