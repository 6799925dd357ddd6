"""Lines of the summary that rest on a whisk's record alone."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from bench.analyses.estimator_accuracy import RunAccuracy
from bench.base.settings import Settings
from bench.base.statuses import cure_of
from bench.gauges.felt import gauge_delay, lateness
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import Clock, EstimateRow, FeltWhisk, SeenTrial, TrialResult
from bench.report.run_facts import Section
from bench.report.summary.compose import Summary
from bench.report.summary.truth import beam_lines, budget_lines, clock_lines
from bench.report.summary.verdict import verdict
from bench.report.summary.warning_lines import (
    estimator_limits,
    frame_lines,
    light_lines,
    whisk_warnings,
)
from bench.report.whisk_rows import beam_rows, budget_rows
from bench.trials.estimates import as_felt
from estimator.signal import FeltTouch
from tests.scenes.results import seen_whisk, trial_result
from vision.fit.beam_check import BeamCheck, Compared
from vision.fit.covariance import CAUSES
from vision.geometry.number_words import counted
from vision.geometry.reasons import Reason
from vision.truth.value import Value
from vision.wire.one_sided import SeenWidth


def result(clock=None, **truth) -> TrialResult:
    whisk = seen_whisk(d_x_mm=Value(60.0, 0.01), **truth)
    return trial_result(SeenTrial((whisk,), clock=clock))


def test_frames_without_recorded_times_say_what_is_known_of_their_clock():
    recorded, stated = Clock("frames.csv", 0.0, True), Clock("frame_rate_Hz", 0.025, False)
    own, other = clock_lines([result(recorded), result(stated), result(stated)])
    assert own.endswith("(frames.csv), 1 of 3 trials; their clock is taken as that of the signals")
    assert "by frame_rate_Hz, 2 of 3 trials: no recorded edge" in other
    assert (
        "do not separate a late clock from a shifted zero of the encoder; taken as known to 25 ms"
        in other
    )


@pytest.mark.parametrize(
    "filter_Hz, late_deg, sigma_deg",
    [(800.0, 0.0468, 0.0014), (None, 0.0468, 0.0270), (0.0, 0.0, 0.0)],
)
def test_the_filters_delay_is_taken_out_of_felt_touch(filter_Hz, late_deg, sigma_deg):
    """At 90 deg/s 0.52 ms are 0.047 deg, known to 3 %; a filter that is not named may delay by up to twice the paper's."""
    own = np.radians(0.001)
    felt = as_felt(0, FeltTouch(0.0508, own), None, np.radians(90.0), gauge_delay(filter_Hz))
    late = lateness(seen_whisk(touch_rad=Value(0.05, own)), felt)
    assert np.degrees(late.value) == pytest.approx(np.degrees(8e-4) - late_deg, abs=1e-4)
    assert np.degrees(late.sigma) == pytest.approx(np.hypot(0.001 * 2**0.5, sigma_deg), abs=1e-4)
    assert felt.theta_sigma_rad == own  # touch and moments are late alike


@pytest.mark.parametrize("filter_Hz", [200.0, 800.0])
def test_the_delay_is_the_mean_of_the_filters_impulse_response(filter_Hz):
    rate_Hz = 1e5
    sections = butter(4, filter_Hz, fs=rate_Hz, output="sos")
    answer = sosfilt(sections, np.eye(1, 10_000)[0])
    assert answer @ np.arange(10_000) / rate_Hz == pytest.approx(
        gauge_delay(filter_Hz).value, rel=1e-3
    )


def test_a_rig_board_that_is_not_told_apart_is_an_empty_cell_and_a_line():
    shares = dict.fromkeys(CAUSES, 0.0) | {"light": 0.8, "cameras": 0.2}
    told, untold = result(budget=shares), result(budget=shares | {"placement": np.nan})
    assert np.isnan(next(budget_rows([untold]))["placement_percent"])
    assert len(list(budget_lines([told]))) == 1
    assert "`cameras` is both" in list(budget_lines([told, untold]))[1]


def test_beam_and_spline_stand_side_by_side():
    def both(beam, spline, sigma):
        return Compared(beam, spline, sigma, 0.01)

    compared = both(60.0, 60.004, 0.001), both(0.04, 0.041, 1e-4), both(2.0, 1.9, 0.02)
    made = result(beam=BeamCheck(*compared, theta_rad=0.07, chance=0.3))
    (row,) = beam_rows([made])
    assert (
        row["touch_spline_deg"] == pytest.approx(np.degrees(0.041)) and row["slip_beam_mm"] == 2.0
    )
    (line,) = beam_lines([made])
    assert "d_x +0.0040 ± 0.0010 mm (t)" in line and "slip -0.1000 ± 0.0200 mm (t)" in line
    assert list(beam_lines([result()])) == []


def test_the_screen_shows_the_verdict_and_the_warnings(tmp_path):
    warnings = tuple(f"t{k}, whisk 0: slips in jumps" for k in range(30))
    sections = (
        Section("cameras", "Cameras", ("camera high: 10 views",)),
        Section("warnings", "Warnings", warnings),
    )
    shown = Summary(("(2) is wrong.",), warnings, sections).on_screen(tmp_path).splitlines()
    assert shown[:3] == ["(2) is wrong.", "", "Warnings"]
    where = f"All of it: {tmp_path}/report.html, {tmp_path}/summary.txt"
    assert shown[-3:] == ["  and 10 more, in summary.txt", "", where]
    assert len(shown) == 26 and not any("camera high" in line for line in shown)
    assert Summary(("sample.",), (), sections[:1]).on_screen(tmp_path).splitlines()[:2] == [
        "sample.",
        "",
    ]


@pytest.mark.parametrize(
    ("warnings", "said"),
    [(0, "no warning."), (1, "1 warning, see below."), (2, "2 warnings, see below.")],
)
def test_warnings_are_counted_apart_from_whisks(warnings, said):
    """Of one whisk there may be two."""
    first, *_ = verdict("s", True, RunAccuracy.of_results([result()]), Settings(), warnings)
    assert first == f"s: the true distance is known for 1 of 1 measured whisk, to ± 0.01 mm; {said}"


def test_light_from_one_side_is_one_line_a_camera_whatever_notes_say():
    """The first trial's width is shown; a note on frames stays one, though it has the same words."""
    by_trial = [
        {"high": SeenWidth(3.1, 5.6, -1.4), "low": SeenWidth(2.0, 5.6, 1.0)},
        {"high": SeenWidth(3.5, 5.6, -1.2)},
    ]
    note = "camera high sees nothing in 2 of 11 frames"
    results = []
    for light in by_trial:
        seen = replace(result().seen, notes=(note,), one_sided_light=light)
        results.append(from_plain(TrialResult, to_plain(replace(result(), seen=seen))))
    high, low = light_lines(results)
    assert high.startswith("t: camera high sees 3.1 of the wire's 5.6 px")
    assert high.endswith("(and so in 1 more trial)")
    assert low.startswith("t: camera low sees 2.0 of the wire's 5.6 px") and "more" not in low
    assert list(frame_lines(results)) == [f"t: {note}"] * 2


@pytest.mark.parametrize(("count", "said"), [(0, "0 frames"), (1, "1 frame"), (2, "2 frames")])
def test_plurals(count, said):
    assert counted(count, "frame") == said


def test_a_limit_of_an_estimator_is_one_line_and_no_warning():
    """16 whisks at 75° had a line each among the doubts, with another's cure."""
    limit = Reason("only_nearer_known", "known only to be nearer than 80.0 mm (95 %)")
    failed = Reason("estimator_raised", "mine raised ValueError")
    results = []
    for number in range(3):
        sigma_mm = 0.01 * (1 + number % 2)
        estimates = (
            EstimateRow("with_friction", Value(60.0, 1.0), status=limit),
            EstimateRow("mine", Value(60.0, 1.0), status=failed),
        )
        whisk = seen_whisk(d_x_mm=Value(60.0, sigma_mm))
        felt = FeltWhisk(0, estimates=estimates)
        results.append(trial_result((whisk,), (felt,), name=f"b75_{number}"))
    (line,) = estimator_limits(results)
    assert line == f"3 whisks, with_friction; worst is b75_1, whisk 0: {limit}"
    (warning,) = whisk_warnings(results)
    assert warning.startswith("3 whisks, mine; ")
    assert cure_of(line.codes) != cure_of(warning.codes)
