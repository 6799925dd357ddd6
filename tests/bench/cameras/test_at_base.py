"""An array's cameras in a whisker's base frame show what they show in the rig frame, and are known as well."""

from dataclasses import replace

import numpy as np
import pytest

from bench.cameras.session_cameras import SessionCalibration, at_base
from bench.session.session import Base, load_session
from vision.calibration.place import by_board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.rotation import apply, compose, exp_rotation

T_RIG_BASE = np.column_stack([exp_rotation(np.array([0.1, -0.2, 0.7])), [3.0, -14.0, 6.0]])
T_RIG_BOARD = np.column_stack([exp_rotation(np.array([3.0, 0.1, 0.0])), [4.0, 39.0, -44.0]])
SIGMAS = 0.1, np.radians(0.2)


@pytest.fixture
def view(small_session):
    """Of a whisker whose base is as uncertain as the board."""
    whole = replace(
        load_session(small_session),
        T_rig_board=T_RIG_BOARD,
        T_rig_board_sigma_mm=SIGMAS[0],
        T_rig_board_sigma_rad=SIGMAS[1],
    )
    base = Base("w", T_RIG_BASE, *SIGMAS)
    sigmas = {
        name: np.sqrt(2.0) * getattr(whole, name)
        for name in ("T_rig_board_sigma_mm", "T_rig_board_sigma_rad")
    }
    return replace(
        whole, base=base, whole=whole, T_rig_board=compose(base.T_base_rig, T_RIG_BOARD), **sigmas
    )


def calibration() -> SessionCalibration:
    camera = Camera(
        "one",
        (640, 480),
        np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]]),
        np.zeros(5),
        np.column_stack([exp_rotation(np.array([2.0, 0.1, 0.0])), [1.0, 2.0, 300.0]]),
    )
    placement = by_board(T_RIG_BOARD, *SIGMAS).covariance
    by_rig = Cameras((camera,)).by_placement
    return SessionCalibration(
        Cameras((camera,), by_rig @ placement @ by_rig.T, placement), {}, "h", (), T_RIG_BOARD
    )


def test_points_of_the_base_frame_are_seen_where_they_are(view):
    there, points = at_base(calibration(), view), np.random.default_rng(0).uniform(-20, 60, (9, 3))
    (before,), (after,) = calibration().cameras, there.cameras
    np.testing.assert_allclose(
        after.project(points), before.project(apply(T_RIG_BASE, points)), atol=1e-8
    )
    np.testing.assert_allclose(
        apply(T_RIG_BASE, there.T_rig_board[:, 3][None])[0], T_RIG_BOARD[:, 3]
    )
    assert there.hash != calibration().hash


def test_the_base_is_known_as_its_board_is_stated(view):
    """All that these cameras err by is their placement: in the base frame that of the view's board."""
    there = at_base(calibration(), view).cameras
    board = by_board(
        view.T_rig_board, view.T_rig_board_sigma_mm, view.T_rig_board_sigma_rad
    ).covariance
    np.testing.assert_allclose(there.placement, board, rtol=1e-9, atol=1e-12)
    scale = np.sqrt(np.diag(there.covariance)[-6:])
    own = there.by_placement @ board @ there.by_placement.T
    np.testing.assert_allclose(
        there.covariance[-6:, -6:] / np.outer(scale, scale),
        own[-6:, -6:] / np.outer(scale, scale),
        atol=1e-6,
    )
