"""Changes that are tried, and places that are found."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.plan import camera_places as where
from bench.plan.changes import LIGHT, Change, list_changes
from bench.plan.outlook import Outlook
from bench.plan.plan_rows import ChangedSigmas, Facts, Row, changed_sigmas
from bench.rig.build import cameras as built
from tests.scenes.planned import LINES, cameras_of, protocol_of, staged_of
from vision.geometry.camera import Cameras
from vision.truth.predicted_truth import predict_truth

THETA_RAD = np.radians(3.0)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    protocol = protocol_of(tmp_path_factory.mktemp("bench"))
    return protocol, staged_of(protocol), cameras_of(protocol)


def by_kind(found: list[Change], kind: str) -> list[Change]:
    return [one for one in found if one.kind == kind]


def changed(staged, change, lines):
    predicted = predict_truth(staged.known, change.cameras, lines)
    return changed_sigmas(change, predicted, THETA_RAD)


def test_every_kind_of_change_is_tried(bench):
    _, staged, cameras = bench
    found = list_changes(cameras, None, staged.known.contact_mm, light=True)
    assert {one.kind for one in found} == {"move", "lens", "views", "third", "light"}
    assert len({one.words for one in found}) == len(found)
    assert f"{LIGHT:g} times the light" in by_kind(found, "light")[0].words
    for one in by_kind(found, "third"):
        assert len(one.cameras) == 3
    for one in by_kind(found, "lens"):
        assert np.allclose(
            [c.lens[:4] for c in one.cameras], [c.lens[:4] * [1.5, 1.5, 1, 1] for c in cameras]
        )
    for one in by_kind(found, "move"):  # each looks at the contact
        for name in one.like:
            camera = one.cameras[name]
            assert np.allclose(camera.rays(camera.lens[None, 2:4]), camera.T_camera_rig[2, :3])
            away = staged.known.contact_mm - camera.centre_mm
            assert np.allclose(away / np.linalg.norm(away), camera.T_camera_rig[2, :3])


def test_a_third_camera_helps_and_each_camera_keeps_its_lines(bench):
    _, staged, cameras = bench
    lines = dict.fromkeys(cameras.names, LINES)
    as_is = changed(staged, Change("", "", cameras), lines)
    third = by_kind(list_changes(cameras, None, staged.known.contact_mm, light=False), "third")[0]
    after = third.line_noise(lines, staged.known)
    assert set(after) == {*cameras.names, "third"}
    assert changed(staged, third, after).sigma["d_x_mm"] < as_is.sigma["d_x_mm"]


def test_only_a_camera_elsewhere_comes_to_see_the_bar(bench):
    """A longer lens does not turn a camera away from the bar's axis; nor does a place from which it looks along it."""
    _, staged, cameras = bench
    blind = replace(LINES, bar_px=np.zeros((0, 3)))
    found = list_changes(cameras, None, staged.known.contact_mm, light=False)
    lines = dict.fromkeys(cameras.names, blind)
    assert not any(
        len(noise.bar_px)
        for noise in by_kind(found, "lens")[0].line_noise(lines, staged.known).values()
    )
    moved = by_kind(found, "move")[0]
    (name,) = moved.like
    assert len(moved.line_noise(lines, staged.known)[name].bar_px) == 1
    axis = staged.known.axis
    sight = moved.cameras[name].centre_mm - axis.point_mm
    along = replace(axis, direction=sight / np.linalg.norm(sight))
    seen_along = replace(staged.known, axis=along)
    assert len(moved.line_noise(lines, seen_along)[name].bar_px) == 0


def test_more_views_leave_less_of_the_cameras_own_uncertainty(bench):
    _, staged, cameras = bench
    sigmas = [*[0.3] * 4, *[1e-3] * 5, *[1e-4] * 3, *[0.05] * 3]
    known = Cameras(cameras.cameras, np.diag(np.tile(sigmas, 2)) ** 2)
    found = list_changes(known, None, staged.known.contact_mm, light=False)
    assert np.allclose(by_kind(found, "views")[0].cameras.covariance, known.covariance / 4.0)
    assert not by_kind(found, "board")  # no placement is told


def test_a_board_placed_better_leaves_less_of_what_all_cameras_share(bench):
    _, staged, cameras = bench
    placement = np.diag([1e-3] * 3 + [0.1] * 3) ** 2
    shared = cameras.by_placement @ placement @ cameras.by_placement.T
    own = 1e-6 * np.eye(len(shared))
    known = Cameras(cameras.cameras, own + shared, placement)
    (better,) = by_kind(list_changes(known, None, staged.known.contact_mm, light=False), "board")
    assert np.allclose(better.cameras.covariance, own + shared / 16.0)
    assert np.allclose(better.cameras.placement, placement / 16.0)


def row(sigma_mm: float, tried: dict[str, float]) -> Row:
    facts = Facts("t", 0, "measure", "", 10.0, 30.0, 0.0, 60.0)
    one = Outlook() if np.isnan(sigma_mm) else Outlook({"d_x_mm": sigma_mm})
    return Row(
        facts,
        one,
        tuple(
            ChangedSigmas("", words, {"d_x_mm": mm} if mm else {}) for words, mm in tried.items()
        ),
    )


def test_the_best_change_and_whether_it_halves():
    better = row(0.02, {"a": 0.015, "b": 0.009, "c": 0.0})
    assert (
        better.best()[0].words == "b"
        and better.best()[1] == pytest.approx(0.45)
        and better.is_halved
    )
    assert not row(0.02, {"a": 0.015}).is_halved
    assert row(np.nan, {"a": 0.015}).is_halved  # a truth at all
    assert row(0.02, {"a": 0.0}).best() is None


def test_cameras_without_a_place_are_given_one(bench, monkeypatch):
    monkeypatch.setattr(where, "_AZIMUTHS_DEG", (-90.0, 60.0))
    protocol, staged, _ = bench
    free = [msgspec.structs.replace(camera, position_mm=None) for camera in protocol.cameras]
    with pytest.raises(ValueError, match="camera high has no position_mm"):
        built(msgspec.structs.replace(protocol, cameras=free))
    placed = where.place_cameras(
        msgspec.structs.replace(protocol, cameras=free[:1] + protocol.cameras[1:]),
        [staged],
        staged.known.contact_mm,
    )
    assert placed.cameras[1] == protocol.cameras[1] and placed.cameras[0].position_mm is not None
    assert len(built(placed)) == 2


def test_cameras_that_see_nothing_anywhere_are_refused(bench, monkeypatch):
    monkeypatch.setattr(where, "_AZIMUTHS_DEG", (-90.0,))
    monkeypatch.setattr(where, "_ELEVATIONS_DEG", (20.0,))
    protocol, staged, _ = bench
    alone = [msgspec.structs.replace(protocol.cameras[0], position_mm=None, size_px=(8, 8))]
    with pytest.raises(BadInput, match="no place"):
        where.place_cameras(
            msgspec.structs.replace(protocol, cameras=alone), [staged], staged.known.contact_mm
        )
