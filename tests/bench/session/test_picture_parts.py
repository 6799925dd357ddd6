"""Cameras that are parts of another camera's picture: what session.toml may say of them, and what they read."""

import shutil

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.session.footage import read_frames, rig_picture
from bench.session.session import load_session


@pytest.fixture
def one_camera(small_copy):
    """A session of the camera high alone, 1280 x 720 px."""
    shutil.rmtree(small_copy / "boards" / "low", ignore_errors=True)
    for entry in small_copy.rglob("low*"):
        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
    return small_copy


def state(session, *cameras: str) -> None:
    """Write these [[cameras]] in place of those that session.toml has."""
    file = session / "session.toml"
    text = file.read_text().replace("[[cameras]]", "[[unused]]")
    kept = [part for part in text.split("\n[") if not part.startswith("[unused]]")]
    own = "".join(f"\n[[cameras]]\n{camera}\n" for camera in cameras)
    file.write_text("\n[".join(kept) + own)


MIRROR = 'name = "mirrored"\nof = "high"\ncrop = [0, 0, 1280, 300]\nmirrored = true'


def test_a_mirror_s_part_is_flipped_and_the_rest_is_the_camera(one_camera):
    whole = load_session(one_camera)
    trial = next(trial for trial in whole.trials if trial.camera_sources).name
    state(one_camera, MIRROR)
    session = load_session(one_camera)
    assert session.camera_names == ("high", "mirrored")
    grey = read_frames(whole.trial(trial).camera_sources["high"], [1])[1]
    sources = session.trial(trial).camera_sources
    np.testing.assert_array_equal(read_frames(sources["high"], [1])[1], grey[300:])
    np.testing.assert_array_equal(read_frames(sources["mirrored"], [1])[1], grey[:300, ::-1])
    rig = rig_picture(whole.rig_pictures["high"])
    np.testing.assert_array_equal(rig_picture(session.rig_pictures["mirrored"]), rig[:300, ::-1])
    assert set(session.board_sources) == {"high", "mirrored"}


def test_a_split_view_leaves_no_whole_camera(one_camera):
    state(
        one_camera,
        'name = "left"\nof = "high"\ncrop = [0, 0, 600, 720]',
        'name = "right"\nof = "high"\ncrop = [640, 0, 640, 720]\nmirrored = true',
    )
    assert load_session(one_camera).camera_names == ("left", "right")


def test_the_rest_beside_two_mirrors_is_the_largest_rectangle(one_camera):
    other = 'name = "side"\nof = "high"\ncrop = [0, 300, 200, 420]\nmirrored = true'
    state(one_camera, MIRROR, other)
    rest = load_session(one_camera).crops["high"]
    assert (rest.left, rest.top, rest.width, rest.height) == (200, 300, 1080, 420)


@pytest.mark.parametrize(
    ("cameras", "found"),
    [
        ([MIRROR.replace("1280, 300", "1281, 300")], "not within high's picture of 1280 x 720 px"),
        ([MIRROR.replace("[0, 0", "[-1, 0")], "not within"),
        ([MIRROR.replace("1280, 300", "0, 300")], "not within"),
        ([MIRROR.replace('"high"', '"hihg"')], 'of = "hihg" is no camera with pictures; there are'),
        (
            [MIRROR, 'name = "b"\nof = "mirrored"\ncrop = [0, 0, 9, 9]'],
            'of = "mirrored" is no camera with pictures',
        ),
        (
            [MIRROR, MIRROR.replace('"mirrored"', '"b"').replace("[0, 0", "[0, 299")],
            "overlaps that of camera b",
        ),
        (['name = "b"\ncrop = [0, 0, 9, 9]'], "of is missing"),
        (['name = "b"\nof = "high"'], "crop is missing"),
        (['name = "high"\nmirrored = true'], "of is missing"),
        ([MIRROR.replace('"mirrored"', '"high"', 1)], "has pictures of its own"),
        ([MIRROR.replace("300]", "300, 1]")], "crop"),
    ],
)
def test_a_part_that_cannot_be_is_one_clear_line(one_camera, cameras, found):
    state(one_camera, *cameras)
    with pytest.raises(BadInput) as refused:
        load_session(one_camera)
    assert found in str(refused.value) and "\n" not in str(refused.value)
    assert "session.toml" in str(refused.value)
