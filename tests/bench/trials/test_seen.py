"""What the pictures' side of a run says of lost frames, and what it takes for background where no rig picture is."""

from dataclasses import replace

import numpy as np
import pytest

from bench.base.settings import Settings
from bench.cameras.session_cameras import _background
from bench.records.trial_result import SeenTrial
from bench.report.summary.warning_lines import damage_warnings
from bench.session.frame_times import frame_times, read_trial
from bench.session.session import load_session
from bench.trials.seen import _damaged_frames, whisk_record
from tests.bench.conftest import exact_truth, read_csv
from tests.scenes.results import seen_whisk, trial_result
from vision import UNKNOWN
from vision.geometry import Reason
from vision.pictures.files import read_picture


def test_damaged_frames_are_counted_and_named(small_copy):
    folder = small_copy / "trials" / "b60_4" / "low"
    third = sorted(folder.iterdir())[2]
    data = third.read_bytes()
    third.unlink()  # the copy may share its file with the fixture
    third.write_bytes(data[: len(data) // 2][:40])
    trial = next(t for t in load_session(small_copy).trials if t.name == "b60_4")
    times = frame_times(trial)
    (found,) = _damaged_frames(read_trial(trial, times), times)
    assert found == f"camera low: 1 of {len(times)} frames damaged (2)"
    assert found.codes == ("frames_damaged",)


def test_damaged_frames_are_a_warning_of_the_run_as_they_are_of_check():
    told = Reason("frames_damaged", "camera low: 1 of 11 frames damaged (2)")
    whisk = (seen_whisk(),)
    results = [
        trial_result(SeenTrial(whisk, damaged=told), name="b60_4"),
        trial_result(SeenTrial(whisk), name="b30_3"),
    ]
    (warning,) = damage_warnings(results)
    assert warning == "b60_4: camera low: 1 of 11 frames damaged (2)"
    assert warning.codes == ("frames_damaged",)


@pytest.mark.parametrize(("wider", "is_known"), [(1.0, True), (1e6, False)])
def test_a_whisk_without_a_truth_has_its_wire_s_deflection_where_that_is_known(
    steel_signals, wider, is_known
):
    """Sigmas of 5 µm do; thousandfold ones of 5 mm at 50 mm are no place to compute a moment from."""
    folder = steel_signals / "trials" / "gauge_roll0"
    rows = np.arange(len(read_csv(folder / "truth.csv")["frame"]))
    whisk = exact_truth(folder, 0, rows)
    smooth = replace(whisk.smooth, covariance=wider * whisk.smooth.covariance)
    without = replace(whisk, d_x_mm=UNKNOWN, touch_rad=UNKNOWN, smooth=smooth)
    record = whisk_record(without, Settings())
    assert not record.has_truth and np.isnan(record.at.slip_mm.value)
    assert (record.deflection is not None) == is_known


def test_without_a_rig_picture_the_trials_median_is_the_background(small_session, monkeypatch):
    """Where neither rod ever stands, the median is the rig picture but for noise and light."""
    session = load_session(small_session)
    monkeypatch.setattr("bench.cameras.session_cameras._FEWEST_FOR_MEDIAN", 3)
    rig = read_picture(session.rig_pictures["high"]).astype(float)
    session.rig_pictures.clear()
    median = _background(session, "high")
    corner = np.s_[:150, :150]
    assert abs(np.median(median[corner] - rig[corner])) < 2.0


def test_too_few_trials_leave_no_background(small_session):
    session = load_session(small_session)
    session.rig_pictures.clear()
    assert _background(session, "high") is None
