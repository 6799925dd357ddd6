"""A part of a picture as a camera of its own: by projecting a reflected world with the whole camera."""

import numpy as np
import pytest

from vision.geometry.camera import Camera, camera_matrix
from vision.geometry.crop import Crop
from vision.geometry.rotation import exp_rotation

WHOLE_PX = (640, 900)
LENS = np.array([1500.0, 1503.0, 311.0, 462.0, -0.1, 0.1, 0.002, -0.003, 0.05])
NORMAL = np.array([0.1, -0.5, -0.8]) / np.linalg.norm([0.1, -0.5, -0.8])
REFLECT = np.eye(3) - 2.0 * np.outer(NORMAL, NORMAL)
SHIFT_MM = 2.0 * 40.0 * NORMAL
FLIP = np.diag([-1.0, 1.0, 1.0])


def camera(size_px, lens, R, t) -> Camera:
    T = np.column_stack([R, t])
    return Camera("high", size_px, camera_matrix(lens), lens[4:], T)


@pytest.fixture
def whole() -> Camera:
    return camera(WHOLE_PX, LENS, exp_rotation(np.array([0.1, -0.2, 0.3])), [3.0, -4.0, 350.0])


@pytest.fixture
def points_mm() -> np.ndarray:
    return np.random.default_rng(1).uniform(-40.0, 40.0, (50, 3))


def test_a_mirrored_part_is_a_right_handed_camera_behind_the_mirror(whole, points_mm):
    crop = Crop("high", WHOLE_PX, 20, 100, 500, 300, mirrored=True)
    R = FLIP @ whole.T_camera_rig[:, :3] @ REFLECT
    t = FLIP @ (whole.T_camera_rig[:, :3] @ SHIFT_MM + whole.T_camera_rig[:, 3])
    behind = camera(crop.size_px, crop.lens_of(LENS), R, t)
    in_whole = whole.project(points_mm @ REFLECT + SHIFT_MM)
    expected = np.column_stack([20 + 499 - in_whole[:, 0], in_whole[:, 1] - 100])
    np.testing.assert_allclose(behind.project(points_mm), expected, atol=1e-9)


def test_a_direct_part_is_the_camera_itself(whole, points_mm):
    crop = Crop("high", WHOLE_PX, 20, 100, 500, 300)
    T = whole.T_camera_rig
    own = camera(crop.size_px, crop.lens_of(LENS), T[:, :3], T[:, 3])
    np.testing.assert_allclose(own.project(points_mm), whole.project(points_mm) - [20, 100])


@pytest.mark.parametrize("mirrored", [False, True])
def test_pixels_are_cut_where_the_lens_has_them(mirrored):
    grey = np.arange(6 * 8).reshape(6, 8)
    crop = Crop("high", (8, 6), 1, 2, 4, 3, mirrored)
    part = crop.cut(grey)
    assert part.shape == (3, 4) and part.flags.c_contiguous
    column = 4 if mirrored else 1  # of the whole picture, at the part's column 0
    assert part[0, 0] == grey[2, column]
    # A pixel of the part lies `offset_px` from its place in the picture, flipped as a whole where mirrored.
    as_whole = grey[:, ::-1] if mirrored else grey
    left, top = crop.offset_px.astype(int)
    assert part[2, 3] == as_whole[top + 2, left + 3]


def test_the_lens_signs_are_the_derivative_of_the_lens():
    crop = Crop("high", WHOLE_PX, 20, 100, 500, 300, mirrored=True)
    step = np.linspace(0.01, 0.09, 9)
    moved = crop.lens_of(LENS + step) - crop.lens_of(LENS)
    np.testing.assert_allclose(moved, crop.lens_signs * step, atol=1e-12)
