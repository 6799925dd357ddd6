"""Shrunk pictures and their cameras."""

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS
from vision.geometry.camera import Cameras
from vision.pictures.pyramid import full_px, shrunk_cameras, shrunk_picture


def test_a_shrunk_camera_sees_the_same_places():
    points = np.array([[40.0, 5.0, -3.0], [80.0, -2.0, 8.0]])
    for whole, small in zip(CAMERAS, shrunk_cameras(CAMERAS, 3)):
        assert full_px(small.project(points), 3) == pytest.approx(whole.project(points), abs=1e-9)


def test_its_covariance_is_that_of_smaller_pixels():
    """A focal length known to 3 px in the picture is known to 1 px in one a third as large; a pose to what it was."""
    size = len(CAMERAS) * 15
    covariance = np.diag(np.full(size, 9.0))
    small = np.diag(shrunk_cameras(Cameras(CAMERAS.cameras, covariance), 3).covariance)
    assert small.reshape(-1, 15) == pytest.approx(
        np.tile([1.0] * 4 + [9.0] * 11, (len(CAMERAS), 1))
    )


def test_pixels_are_means():
    picture = np.arange(35, dtype=np.float32).reshape(5, 7)
    assert shrunk_picture(picture, 2) == pytest.approx(
        np.array(
            [
                [picture[2 * y : 2 * y + 2, 2 * x : 2 * x + 2].mean() for x in range(3)]
                for y in range(2)
            ]
        )
    )
    assert shrunk_picture(picture, 1) is picture
