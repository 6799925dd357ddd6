"""Cameras that are parts of another camera's picture: what session.toml may say of them, and what they read."""

import shutil

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.cameras.cameras_toml import write_cameras
from bench.session.footage import read_frames, rig_picture
from bench.session.session import load_session
from bench.session.session_check import check_sizes
from bench.session.traces import read_traces, read_traces_alone
from vision.geometry import Camera, Cameras
from vision.pictures import read_picture


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


PART_SIZES_PX = {"high": (1280, 420), "mirrored": (1280, 300)}
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


@pytest.mark.parametrize("has_pictures", [True, False])
def test_a_trace_of_the_whole_picture_serves_all_its_parts(one_camera, has_pictures):
    """Lines of 11 points down the picture: one in the mirror's part, one in the rest."""
    state(one_camera, MIRROR)
    trial = next(trial for trial in load_session(one_camera).trials if trial.camera_sources)
    down = np.arange(20.0, 131.0, 11.0)
    rows = [f"0,{u},{v + top}" for u, top in ((100.0, 0.0), (200.0, 400.0)) for v in down]
    for name in ("high", "mirrored"):
        table = "\n".join(["frame,u_px,v_px", *rows]) + "\n"
        trial.own(f"trace_{name}.csv").write_text(table)
    if not has_pictures:
        shutil.rmtree(trial.folder / "high")
    session = load_session(one_camera)
    trial = session.trial(trial.name)
    if has_pictures:
        pictures = {name: np.zeros(1, dtype=int) for name in trial.camera_sources}
        read = read_traces(trial.trace_files, trial.camera_sources, pictures, "t")
    else:
        read = read_traces_alone(trial, 1, PART_SIZES_PX, session.crops).wire
    found = {name: traced.trace.px for name, traced in read.items()}
    np.testing.assert_allclose(found["mirrored"], np.column_stack([np.full(11, 1179.0), down]))
    np.testing.assert_allclose(found["high"], np.column_stack([np.full(11, 200.0), down + 100.0]))


def test_a_picture_says_how_large_the_whole_is(one_camera):
    """One picture of the board on the rig does; where there is none, pixels of the whole are those of no part."""
    state(one_camera, MIRROR)
    trials = load_session(one_camera).trials
    for source in one_camera.rglob("high"):
        shutil.rmtree(source)
    trials[0].own("trace_high.csv").write_text("frame,u_px,v_px\n0,9,9\n")
    session = load_session(one_camera, lenses_known=True)
    assert session.crops["high"].whole_px == (1280, 720)
    for picture in (one_camera / "boards" / "rig").iterdir():
        picture.unlink()
    with pytest.raises(
        BadInput, match="no picture says how large high's is, of which it is a part"
    ):
        load_session(one_camera)


def test_pictures_of_a_board_on_the_object_are_divided_as_others(one_camera):
    state(one_camera, MIRROR)
    trial = load_session(one_camera).trials[0]
    rig = next((one_camera / "boards" / "rig").iterdir())
    shutil.copy(rig, trial.folder / f"board_high{rig.suffix}")
    divided = load_session(one_camera).trial(trial.name).board_pictures
    assert {name: read_picture(part).shape for name, part in divided.items()} == {
        "high": (420, 1280),
        "mirrored": (300, 1280),
    }


OTHER_SIZE = MIRROR.replace("1280, 300]", "1280, 310]")
OTHER_PLACE = MIRROR.replace("[0, 0, 1280", "[8, 0, 1272")


@pytest.mark.parametrize(
    "made_with, refused",
    [
        (MIRROR, ""),
        (OTHER_SIZE, "is it of another crop?"),
        (OTHER_PLACE.replace("[8", "[0"), "as mirrored part [8, 0, 1272, 300]: calibrate again"),
        (OTHER_PLACE.replace("true", "false"), "with camera mirrored as part [8, 0, 1272, 300] of"),
    ],
)
def test_cameras_brought_along_are_of_the_parts(one_camera, made_with, refused):
    """As `calibrate cameras` writes them; of another crop they are refused: 8 px put touch 3 sigma off."""
    state(one_camera, made_with)
    crops = load_session(one_camera).crops
    cameras = []
    for name, crop in crops.items():
        matrix = [[1500.0, 0.0, 640.0], [0.0, 1500.0, 200.0], [0.0, 0.0, 1.0]]
        pose = np.column_stack([np.eye(3), [0.0, 0.0, 500.0]])
        cameras.append(Camera(name, crop.size_px, matrix, np.zeros(5), pose))
    is_known = "part" in refused or not refused
    file = one_camera / "cameras.toml"
    write_cameras(file, Cameras(tuple(cameras)), crops if is_known else {})
    state(one_camera, OTHER_PLACE if "part" in refused else MIRROR)
    problems = InputProblems(stop_at_first=False)
    check_sizes(load_session(one_camera), problems)
    said = [str(refusal) for refusal in problems.refusals]
    assert said == [] if not refused else refused in said[0]


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
