"""The search for a bar in all cameras: each line where it converges, and every pair of lines that could win."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.studies.accuracy.bar_scenes import FOUND_PX, axis_off_px, read_scene
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.vision_settings import VisionSettings
from vision.touched import search
from vision.touched.axis import meeting_axis, offset_px
from vision.touched.find import axis_from_angles, can_touch
from vision.touched.search_scene import SearchScene

LAMP = Path(__file__).parents[3] / "fixtures" / "scenes" / "lamp"


@pytest.fixture(scope="module")
def lamp():
    """A path-traced scene of two cameras, and its true axis."""
    views, cameras, rods, motor_rad, true = read_scene(LAMP)
    return SearchScene(views, cameras, rods, motor_rad, VisionSettings()), true


def farther(axis: BarAxis, camera, shift_mm: float) -> BarAxis:
    """The axis moved so that the camera sees it farther to one side."""
    across = np.cross(axis.direction, axis.point_mm - camera.centre_mm)
    return replace(axis, point_mm=axis.point_mm + shift_mm * across / np.linalg.norm(across))


def test_a_bar_is_found_by_lines_that_no_hypothesis_has_right_in_two_cameras(lamp, monkeypatch):
    """Each is 20 px off in one camera, two half-widths of the bar; from there a line does not come to the bar at once."""
    scene, true = lamp
    one, other = scene.cameras
    right_in_one = meeting_axis(one, true, other, farther(true, other, 6.0))
    right_in_other = meeting_axis(one, farther(true, one, -6.0), other, true)
    assert offset_px(other, right_in_one, true) > 15.0
    assert offset_px(one, right_in_other, true) > 15.0
    monkeypatch.setattr(search, "find_bars", lambda *_: [right_in_one, right_in_other])
    found = search.BarSearch(scene).best_by_all_cameras()
    for camera in scene.cameras:
        assert axis_off_px(camera, true, found.axis, scene.radius_mm) < FOUND_PX


def test_a_line_is_followed_until_it_converges(lamp, monkeypatch):
    """A pass reads 3 px to either side; this hypothesis is 10 px off in one camera."""
    scene, true = lamp
    one, other = scene.cameras
    start = meeting_axis(one, true, other, farther(true, other, 3.0))
    assert offset_px(other, start, true) > 7.0
    monkeypatch.setattr(search, "find_bars", lambda *_: [start])
    found = search.BarSearch(scene).best_by_all_cameras()
    assert max(offset_px(camera, found.axis, true) for camera in scene.cameras) < FOUND_PX


def test_lines_that_no_axis_fits_end_their_hypothesis_and_not_the_search(lamp, monkeypatch):
    scene, true = lamp
    one, other = scene.cameras
    wrong = meeting_axis(one, true, other, farther(true, other, 40.0))
    monkeypatch.setattr(search, "find_bars", lambda *_: [wrong, true])
    converge = search.BarSearch._converge

    def refuse_wrong(self, axis, found):
        """Converge, but from where the first hypothesis is."""
        if offset_px(other, axis, true) > 20.0:
            raise Refused("no axis fits")
        return converge(self, axis, found)

    monkeypatch.setattr(search.BarSearch, "_converge", refuse_wrong)
    found = search.BarSearch(scene).best_by_all_cameras()
    assert max(offset_px(camera, found.axis, true) for camera in scene.cameras) < FOUND_PX


def test_a_camera_that_looks_along_a_hypothesis_ends_it_and_not_the_search(lamp, monkeypatch):
    scene, true = lamp
    one = scene.cameras.cameras[0]
    sight = true.point_mm - one.centre_mm
    beside = true.point_mm + np.array([0.5, 0.0, 0.0])
    along = BarAxis(beside, sight / np.linalg.norm(sight))
    monkeypatch.setattr(search, "find_bars", lambda *_: [along, true])
    found = search.BarSearch(scene).best_by_all_cameras()
    assert max(offset_px(camera, found.axis, true) for camera in scene.cameras) < FOUND_PX


def test_the_only_hypothesis_behind_a_camera_leaves_the_bar_to_single_cameras(lamp, monkeypatch):
    """Of an upright bar in a mirror's two views none converged: that ended the search, and the whisk had no truth."""
    scene, true = lamp
    camera = scene.cameras.cameras[0]
    behind = replace(true, point_mm=2.0 * camera.centre_mm - true.point_mm)
    monkeypatch.setattr(search, "find_bars", lambda *_: [behind])
    alone = bar_seen_by(scene, true, scene.cameras.names)
    monkeypatch.setattr(search.BarSearch, "bars_of_single_cameras", lambda _: [alone])
    assert search.find_object(scene) is alone


def test_planes_of_two_cameras_meet_in_the_axis_that_both_see(lamp):
    scene, true = lamp
    one, other = scene.cameras
    moved = replace(true, point_mm=true.point_mm + 15.0 * true.direction)
    meeting = meeting_axis(one, true, other, moved)
    assert np.allclose(np.abs(meeting.direction @ true.direction), 1.0)
    assert max(offset_px(camera, meeting, true) for camera in (one, other)) < 1e-6


@pytest.mark.parametrize(
    "x_mm, touch_deg, is_touched",
    [(60.0, 5.0, True), (60.0, -20.0, False), (60.0, 25.0, False), (130.0, 5.0, False)],
)
@pytest.mark.parametrize("beta_deg", [-60.0, 0.0, 60.0])
def test_a_whisker_touches_what_lies_along_it_and_in_its_stroke(
    lamp, x_mm, touch_deg, is_touched, beta_deg
):
    rods = lamp[0].rods
    angles = np.radians([touch_deg, beta_deg, 3.0])
    axis = axis_from_angles(x_mm, *angles, rods.reach_mm(x_mm)).upward()
    assert can_touch(axis, rods, tuple(np.radians([0.0, 10.0]))) is is_touched


def bar_seen_by(scene, true, names):
    """A bar at the true axis, whose lines some cameras show."""
    lines = {}
    for camera in scene.cameras:
        seen = camera.name in names
        lines[camera.name] = SimpleNamespace(has_edges=seen, joint_score=5.0 if seen else -3.0)
    return search.SeenBar(true, lines)


@pytest.mark.parametrize("count", [1, 2])
def test_what_a_camera_sees_by_all_together_is_searched_by_none_alone(lamp, monkeypatch, count):
    scene, true = lamp
    by_all = bar_seen_by(scene, true, scene.cameras.names[:count])
    monkeypatch.setattr(search.BarSearch, "best_by_all_cameras", lambda _: by_all)
    monkeypatch.setattr(search.BarSearch, "bars_of_single_cameras", lambda _: pytest.fail())
    assert search.find_object(scene) is by_all


@pytest.mark.parametrize("is_seen, from_one_side", [(False, False), (True, True)])
def test_single_cameras_find_what_all_together_do_not_and_how_far_away_a_bar_is(
    lamp, monkeypatch, is_seen, from_one_side
):
    scene, true = lamp
    by_all = bar_seen_by(scene, true, scene.cameras.names if is_seen else [])
    alone = [bar_seen_by(scene, true, scene.cameras.names[:k]) for k in (1, 2)]
    monkeypatch.setattr(search.BarSearch, "best_by_all_cameras", lambda _: by_all)
    monkeypatch.setattr(search.BarSearch, "bars_of_single_cameras", lambda _: alone)
    monkeypatch.setattr(search, "seen_from_one_side", lambda *_: from_one_side)
    found = search.find_object(scene)
    assert found.lines is alone[1].lines
    assert found.rivals == ((by_all.axis,) if is_seen else ())


def test_a_bar_that_does_not_converge_competes_with_none_that_does(lamp, monkeypatch):
    """It never counts as converged; lines that still move score high beside a bar."""
    scene, true = lamp
    monkeypatch.setattr(search, "_has_left", lambda *_: True)
    found = []
    search.BarSearch(scene)._converge(true, found)
    assert not found
