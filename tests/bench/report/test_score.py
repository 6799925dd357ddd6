"""The score against truth files: right numbers, and no word where there is nothing to score against."""

import csv
import re

import numpy as np
import pytest

from bench.analyses.friction_tables import FRICTION
from bench.gauges.matrix import GaugeCalibration, GaugeMatrix
from bench.report.score import Score, score
from bench.report.whisk_tables import ESTIMATES, TRACK, WHISKS
from bench.session.session import load_session


@pytest.fixture
def finished(small_session, tmp_path):
    """Results that are off by known amounts: d_x by 0.02 mm with a sigma of 0.015, slip by 0.01 mm."""
    rows, estimates = [], []
    for trial, d_x, slip in (("b30_3", 55.257944, 0.983388), ("b60_4", 64.949086, 2.639823)):
        rows.append(
            {
                "trial": trial,
                "whisk": 0,
                "theta_deg": 3.0,
                "d_x_mm": d_x + 0.02,
                "d_x_sigma_mm": 0.015,
                "slip_mm": slip - 0.01,
                "slip_sigma_mm": 0.004,
            }
        )
        estimates.append(
            {
                "trial": trial,
                "whisk": 0,
                "estimator": "no_slip",
                "d_x_est_mm": d_x,
                "d_x_est_sigma_mm": 1.0,
            }
        )
        with (small_session / "trials" / trial / "truth.csv").open(newline="") as file:
            track = [
                {
                    "frame": r["frame"],
                    "whisk": 0,
                    "touching": r["contact"],
                    "slip_mm": float(r["slip_mm"]) + 0.01,
                    "slip_sigma_mm": 0.01,
                }
                for r in csv.DictReader(file)
            ]
        TRACK.write_file(tmp_path / "track" / f"{trial}.csv", track)
    WHISKS.write(tmp_path, rows)
    ESTIMATES.write(tmp_path, estimates)
    return tmp_path


def line(lines, name) -> list[str]:
    return next(text for text in lines if text.startswith(name)).removeprefix(name).split()


def test_bias_rms_and_share_within_their_intervals(finished, small_session):
    lines = score(load_session(small_session), finished)
    assert line(lines, "d_x_mm") == ["2", "+0.0200", "0.0200", "mm", "100", "%", "1.33"]
    assert line(lines, "slip_mm at 3 deg") == ["2", "-0.0100", "0.0100", "mm", "0", "%", "2.50"]
    assert line(lines, "slip_mm, touching frames")[1:4] == ["+0.0100", "0.0100", "mm"]


def test_estimates_are_scored_on_measure_trials(finished, small_session):
    assert line(score(load_session(small_session), finished), "d_x by no_slip")[0] == "2"


def test_gauges_against_the_true_matrix(finished, small_session):
    true = np.array(
        [[11.31159134809883, 0.32264565212488266], [-0.2488179917658187, 10.536191428351158]]
    )
    lines = score(
        load_session(small_session), finished, GaugeCalibration(GaugeMatrix(true * [1.01, 1.0]), "")
    )
    assert "diagonal +1.00 %, +0.00 %" in lines[-1] and "cross-talk +0.00, +0.00" in lines[-1]


@pytest.mark.filterwarnings("error")
def test_a_channel_that_answers_to_no_moment_has_no_cross_talk(finished, small_session):
    lines = score(
        load_session(small_session),
        finished,
        GaugeCalibration(GaugeMatrix(np.diag([11.3116, 0.0])), ""),
    )
    assert (
        "diagonal +0.00 %, -100.00 %" in lines[-1] and "cross-talk +nan, +2.20 points" in lines[-1]
    )


def test_a_recorded_session_has_no_score(finished, small_copy):
    for path in [small_copy / "truth.json", *small_copy.glob("trials/*/truth.*")]:
        path.unlink()
    assert score(load_session(small_copy), finished) == []


def test_unreadable_truth_is_said_and_stops_nothing(finished, small_copy):
    (small_copy / "trials" / "b30_3" / "truth.toml").write_text("touch_deg = [1.0")
    lines = score(load_session(small_copy), finished)
    assert len(lines) == 1 and "cannot be read" in lines[0]


def test_sigmas_that_are_not_stated_are_not_scored():
    assert Score("x", "mm", np.array([0.1]), np.array([np.nan])).line().split()[-1] == "-"


def test_friction_is_scored_as_one_angle_or_as_two(finished, small_session):
    """The sample's surfaces have one coefficient, 10.5°; with another at rest the two angles are scored instead."""
    row = {"trial": "b60_4", "whisk": 0, "alpha_seen_deg": 10.7, "alpha_seen_sigma_deg": 0.2}
    row |= {"alpha_static_felt_deg": 15.0, "alpha_static_felt_sigma_deg": 0.5}
    FRICTION.write(finished, [row])
    lines = score(load_session(small_session), finished)
    assert line(lines, "alpha_seen_deg") == ["1", "+0.2000", "0.2000", "deg", "100", "%", "1.00"]
    assert not any(text.startswith("alpha_static_felt_deg") for text in lines)


def test_static_and_kinetic_are_scored_where_they_differ(finished, small_copy):
    truth = small_copy / "trials" / "b60_4" / "truth.toml"
    truth.write_text(re.sub("mu_static = .*", "mu_static = 0.267949", truth.read_text()))  # 15°
    row = {
        "trial": "b60_4",
        "whisk": 0,
        "alpha_static_felt_deg": 15.5,
        "alpha_static_felt_sigma_deg": 0.5,
    }
    FRICTION.write(finished, [row | {"alpha_seen_deg": 12.0}])
    lines = score(load_session(small_copy), finished)
    assert line(lines, "alpha_static_felt_deg")[1] == "+0.5000"
    assert not any(text.startswith("alpha_seen_deg") for text in lines)
