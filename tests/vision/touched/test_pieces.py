"""Pieces of a bar that a wire sweeps along: what lies beside the wire is kept."""

from dataclasses import fields

import numpy as np
import pytest

from tests.studies.accuracy.board_scenes import two_cameras
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.pictures.view import View
from vision.touched.object_view import ObjectView
from vision.touched.pieces import bar_pieces, beside_wires
from vision.touched.search import BarSearch
from vision.touched.search_scene import SearchScene
from vision.wire.bands import Pieces


def test_pixels_near_a_wire_weigh_nothing_and_hidden_pieces_are_left_out():
    """Three pieces across a bar along y; a wire along the second's whole width, one beside the middle of the others."""
    rows = np.array([0.0, 30.0, 60.0])
    across = np.tile(np.arange(-20.0, 21.0), (3, 1))
    known = {
        "foot_px": np.column_stack([np.zeros(3), rows]),
        "normal": np.tile([1.0, 0.0], (3, 1)),
        "offset_px": across,
        "weight": np.ones_like(across),
    }
    pieces = Pieces(**{one.name: known.get(one.name, np.zeros(3)) for one in fields(Pieces)})
    along = np.column_stack([np.arange(-30.0, 31.0), np.full(61, 30.0)])
    beside = np.column_stack([np.full(81, 15.0), np.arange(-10.0, 71.0)])
    kept = beside_wires(pieces, [along, beside])
    assert np.array_equal(kept.foot_px[:, 1], [0.0, 60.0])
    assert np.array_equal(kept.weight > 0, np.abs(across[:2] - 15.0) >= 6.0)


def test_a_bar_about_a_camera_is_refused():
    """A search that tries such an axis goes on with the others."""
    camera = two_cameras()["high"]
    width, height = camera.size_px
    grey = np.full((height, width), 100.0)
    view = View(camera, {0: grey}, grey, Noise(1.0, 0.0))
    beside_mm = np.array([0.5, 0.0, 0.0])
    about = BarAxis(camera.centre_mm + beside_mm, np.array([0.0, 0.0, 1.0]))
    with pytest.raises(Refused) as refused:
        bar_pieces(ObjectView(view, 3.0, VisionSettings()), about, view.noise)
    assert refused.value.code == "bar_behind_camera"


def test_a_bar_that_comes_from_behind_a_camera_ends_no_run():
    """Its picture widens without end where it passes the camera: no such part is read, and here nothing is left."""
    camera = two_cameras()["high"]
    width, height = camera.size_px
    grey = np.full((height, width), 100.0)
    view = View(camera, {0: grey}, grey, Noise(1.0, 0.0))
    forward = camera.T_camera_rig[2, :3]
    beside_mm = 20.0 * camera.T_camera_rig[0, :3]
    through = BarAxis(camera.centre_mm + beside_mm + 60.0 * forward, forward)
    settings = VisionSettings(bar_reach_mm=100.0)
    assert len(bar_pieces(ObjectView(view, 3.0, settings), through, view.noise)) == 0


def test_a_bar_about_a_camera_does_not_end_the_search():
    """Of an empty bench each view has no candidate; that axis refused the whole recording."""
    cameras = two_cameras()
    views = []
    for camera in cameras:
        width, height = camera.size_px
        grey = np.full((height, width), 100.0)
        views.append(View(camera, {0: grey}, grey, Noise(1.0, 0.0)))
    beside_mm = np.array([0.5, 0.0, 0.0])
    about = BarAxis(cameras["high"].centre_mm + beside_mm, np.array([0.0, 0.0, 1.0]))
    rods = Rods(Wire("cylinder", 100.0, 1.0), Bar(6.0))
    scene = SearchScene(views, cameras, rods, np.zeros(1), VisionSettings())
    assert BarSearch(scene)._candidates([about]) == []
