"""Boards of every kind in painted pictures: their points are where session.toml says that they are."""

import msgspec
import numpy as np
import pytest

from bench.plan.planned_cameras import as_board, as_seen_camera
from bench.rig import boards, build
from bench.rig.linear import compose
from bench.rig.protocol import load
from vision.boards import find_corners
from vision.geometry import apply

QUICK = load("quick")
KINDS = {
    "checkerboard": {"squares": (8, 7), "square_mm": 13.0},
    "circles": {"squares": (8, 6), "square_mm": 14.0, "marker_mm": 8.0},
    "asymmetric_circles": {"squares": (4, 9), "square_mm": 9.0, "marker_mm": 7.0},
    "aprilgrid": {"squares": (5, 4), "square_mm": 22.0, "marker_mm": 17.0},
}


def protocol_of(kind):
    """The first camera of the protocol quick, at half its resolution, with this kind of board."""
    board = msgspec.structs.replace(QUICK.board, kind=kind, **KINDS[kind])
    camera = QUICK.cameras[0]
    width, height = camera.size_px
    half = msgspec.structs.replace(
        camera, size_px=(width // 2, height // 2), focal_px=camera.focal_px / 2, centre_px=None
    )
    return msgspec.structs.replace(QUICK, board=board, cameras=[half])


def errors_px(board, camera, T_rig_board, picture):
    """Errors (n, 2) px and sigmas (n,) px of a board's points, by names that no picture can tell apart."""
    found = find_corners(picture, board)
    true_px = as_seen_camera(camera).project(apply(T_rig_board, board.corners_mm))
    names = (np.arange(len(true_px)), *board.hidden_turns)
    off = min((found.px - true_px[n][found.ids] for n in names), key=lambda e: np.abs(e).sum())
    return off, found.sigma_px


@pytest.mark.parametrize("kind", KINDS)
def test_points_of_a_board_are_where_the_rig_has_them(kind):
    """On the rig, and held up to a camera, in the noise of a protocol."""
    protocol = protocol_of(kind)
    board = as_board(protocol.board)
    printed = build.board(protocol)
    studio = build.studios(protocol)[0]
    rng = np.random.default_rng(3)
    on_rig = studio.sensor.expose(studio.rig_brightness(), rng)
    held = boards.draw_poses(printed, studio.camera, 2, rng)[1]
    in_air = studio.sensor.expose(studio.board_brightness(held), rng)
    T_held = compose(held, printed.T_print_board)
    views = [
        errors_px(board, studio.camera, build.T_rig_board(protocol), on_rig),
        errors_px(board, studio.camera, T_held, in_air),
    ]
    if kind != "aprilgrid":  # found whole or not at all, so it is held up whole
        assert all(len(off) == len(board.corners_mm) for off, _ in views)
    off = np.concatenate([view[0] for view in views])
    z = off / np.concatenate([view[1] for view in views])[:, None]
    # Points of 0.015 to 0.03 px, 70 or more: their mean is known to 0.004 px, an RMS z of 140 values to 6 %.
    assert len(off) >= 70 and np.abs(off.mean(axis=0)).max() < 0.013
    assert 0.7 < np.sqrt(np.mean(z**2)) < 1.25
