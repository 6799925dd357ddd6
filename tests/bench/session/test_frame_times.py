"""Frame times from each of the sources that the format allows."""

import shutil

import cv2
import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.session.frame_times import FrameTimes, frame_times, merge_times, read_trial
from bench.session.session import load_session
from bench.session.session_check import checked_session
from bench.session.signals import forward_strokes, read_signals


@pytest.fixture
def folder(small_copy):
    return small_copy / "trials" / "b30_3"


def times(small_copy) -> FrameTimes:
    return frame_times(load_session(small_copy).trial("b30_3"))


def replace_frames_csv(folder, toml: str) -> None:
    (folder / "frames.csv").unlink()
    with (folder / "trial.toml").open("a") as file:
        file.write(toml)


def test_frames_csv(small_copy):
    found = times(small_copy)
    assert (found.source, found.clock_sigma_s) == ("frames.csv", 0.0)
    np.testing.assert_allclose(found.time_s, 0.0005 + 0.05 * np.arange(11), atol=1e-12)
    assert {camera: list(index) for camera, index in found.picture.items()} == {
        "high": list(range(11)),
        "low": list(range(11)),
    }


def test_stated_rate(small_copy, folder):
    stated = "frame_rate_Hz = 20.0\nfirst_frame_s = 0.0005\n"
    replace_frames_csv(folder, f"exact = false\n{stated}")
    found = times(small_copy)
    assert (found.source, found.warnings) == ("frame_rate_Hz", ())
    assert found.clock_sigma_s == 0.025  # half a frame: no edge was recorded
    np.testing.assert_allclose(found.time_s, 0.0005 + 0.05 * np.arange(11), atol=1e-12)


def test_a_first_frame_that_is_exact_ties_the_clocks(small_copy, folder):
    replace_frames_csv(folder, "frame_rate_Hz = 20.0\nfirst_frame_s = 0.0005\n")
    assert times(small_copy).clock_sigma_s == 0.0


def test_a_stated_sigma_of_the_first_frame_is_the_clocks(small_copy, folder):
    replace_frames_csv(
        folder, "frame_rate_Hz = 20.0\nfirst_frame_s = 0.0005\nfirst_frame_sigma_s = 0.002\n"
    )
    assert times(small_copy).clock_sigma_s == 0.002


def test_stated_rate_without_a_start_is_a_warning(small_copy, folder):
    replace_frames_csv(folder, "frame_rate_Hz = 20.0\n")
    assert times(small_copy).warnings[0].codes == ("first_frame_not_stated",)


def test_own_times_of_each_camera(small_copy, folder):
    """The low camera drops its fourth frame and runs 1 ms late."""
    (folder / "frames.csv").unlink()
    (folder / "low" / "000003.jpg").unlink()
    high = [f"{k},{0.05 * k:.4f}" for k in range(11)]
    low = [f"{k},{0.05 * k + 0.001:.4f}" for k in range(11) if k != 3]
    for camera, rows in (("high", high), ("low", low)):
        (folder / f"frames_{camera}.csv").write_text("\n".join(["frame,time_s", *rows]) + "\n")
    found = times(small_copy)
    assert found.source == "frames_<camera>.csv"
    assert list(found.picture["high"]) == list(range(11))
    assert list(found.picture["low"]) == [0, 1, 2, -1, 3, 4, 5, 6, 7, 8, 9]
    expected = 0.05 * np.arange(11) + np.where(np.arange(11) == 3, 0, 0.0005)
    np.testing.assert_allclose(found.time_s, expected, atol=1e-9)
    assert found.spread_s == pytest.approx(0.001)


def test_own_times_of_one_camera_only_are_refused(small_copy, folder):
    (folder / "frames.csv").rename(folder / "frames_high.csv")
    with pytest.raises(
        BadInput, match=r"trials/b30_3/frames_low.csv: is missing, and camera high has its own"
    ):
        times(small_copy)


def test_container_times_are_a_warning(small_copy, folder, as_video):
    replace_frames_csv(folder, "exact = false\nfirst_frame_s = 0.0005\n")
    for camera in ("high", "low"):
        as_video(folder / camera, ".mkv", "FFV1")
    found = times(small_copy)
    assert found.source == "container" and found.clock_sigma_s == pytest.approx(0.025, rel=0.05)
    assert found.warnings[0].codes == ("clock_of_container",)
    np.testing.assert_allclose(
        found.time_s, 0.0005 + 0.05 * np.arange(11), atol=6e-4
    )  # rounded to 1 ms


@pytest.mark.parametrize(
    ("rate_Hz", "toml", "count"),
    [(20.0, "", 0), (30.0, "", 2), (30.0, "frame_rate_Hz = 20.0\n", 0)],
)
def test_a_header_with_another_rate_is_a_warning_until_settled(
    small_copy, folder, as_video, rate_Hz, toml, count
):
    """A film of 500 frames a second is often stored to play at 30."""
    for camera in ("high", "low"):
        as_video(folder / camera, ".avi", "MJPG", rate_Hz)
    with (folder / "trial.toml").open("a") as file:
        file.write(toml)
    found = times(small_copy)
    assert (found.source, len(found.warnings)) == ("frames.csv", count)
    assert all(one.codes == ("rate_unlike_header",) for one in found.warnings)


def test_frames_of_a_session_without_pictures(small_copy, folder):
    for camera in ("high", "low"):
        shutil.rmtree(folder / camera)
    found = times(small_copy)
    assert (len(found), dict(found.picture)) == (11, {})


def test_frames_of_each_stroke(small_copy):
    trial = load_session(small_copy).trial("b30_3")
    signals = read_signals(trial)
    (stroke,) = forward_strokes(signals)
    assert frame_times(trial).frames_in(signals, stroke) == slice(0, 11)
    assert frame_times(trial).frames_in(signals, slice(150, 620)) == slice(2, 7)


def test_merged_times_of_unrelated_cameras_stay_apart():
    time_s, picture, _ = merge_times({"a": np.array([0.0, 0.1]), "b": np.array([5.0, 5.1])})
    np.testing.assert_array_equal(time_s, [0.0, 0.1, 5.0, 5.1])
    assert list(picture["a"]) == [0, 1, -1, -1]
    assert list(picture["b"]) == [-1, -1, 0, 1]


@pytest.mark.parametrize("seed", range(20))
def test_merging_recovers_a_common_trigger(seed):
    rng = np.random.default_rng(seed)
    trigger_s = np.cumsum(rng.uniform(0.045, 0.055, 40))
    kept = {name: np.sort(rng.choice(40, 30, replace=False)) for name in "abc"}
    seen = {name: trigger_s[k] + rng.uniform(-0.004, 0.004, 30) for name, k in kept.items()}
    time_s, picture, spread_s = merge_times(seen)
    frames = sorted(set(np.concatenate(list(kept.values()))))
    np.testing.assert_allclose(time_s, trigger_s[frames], atol=0.004)
    assert spread_s <= 0.008
    for name, k in kept.items():
        assert [frames[i] for i in np.flatnonzero(picture[name] >= 0)] == list(k)


def stacked(folder, *, inside: bool):
    """A camera's pictures as pages of a TIFF file, beside or within its folder."""
    pages = [cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in sorted(folder.iterdir())]
    shutil.rmtree(folder)
    folder.mkdir()
    target = folder / "all.tif" if inside else folder.with_suffix(".tif")
    assert cv2.imwritemulti(str(target), pages)
    if not inside:
        folder.rmdir()
    return pages


def test_a_tiff_stack_in_place_of_a_folder(small_copy, folder):
    pages = {camera: stacked(folder / camera, inside=False) for camera in ("high", "low")}
    trial = checked_session(small_copy).trial("b30_3")
    found = frame_times(trial)
    assert (found.source, found.warnings) == ("frames.csv", ())
    for camera, frames in read_trial(trial, found).items():
        assert all(np.array_equal(frames[k], page) for k, page in enumerate(pages[camera]))
    (folder / "frames.csv").unlink()
    with pytest.raises(BadInput, match=r"there are no frame times; write frames.csv"):
        frame_times(trial)


def test_a_stack_within_a_folder_of_pictures_is_refused(small_copy, folder):
    stacked(folder / "low", inside=True)
    (folder / "frames.csv").write_text("frame,time_s\n0,0.1\n")
    for file in sorted((folder / "high").iterdir())[1:]:
        file.unlink()
    with pytest.raises(
        BadInput, match=r"low/all.tif: holds 11 pictures; a stack stands beside .* as low.tif"
    ):
        checked_session(small_copy)
