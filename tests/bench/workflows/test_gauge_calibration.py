"""`calibrate gauges`: a file that `evaluate` takes, a certificate that says what was not measured, refusals."""

import csv
import json
import re
import shutil
import sys
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.results import hash_of
from bench.base.settings import Settings
from bench.cameras.session_cameras import SessionCalibration
from bench.gauges.gauges_file import read_gauges
from bench.rig.simulation import simulate
from bench.workflows.gauge_calibration import calibrate_gauges_command
from bench.workflows.session_evaluation import evaluate
from tests.scenes.results import codes
from vision import WhiskTruth


@pytest.fixture
def calibrate(monkeypatch, exact_vision):
    """The command with exact vision."""
    nothing = SessionCalibration(None, {}, hash_of("exact"))
    monkeypatch.setattr("bench.trials.of_session.calibrate_session", lambda session, out: nothing)
    return lambda session, out, **options: calibrate_gauges_command(
        session, out, workers=0, **options
    )


@pytest.mark.parametrize("every_trial", [False, True])
def test_sample_session(calibrate, steel_signals, tmp_path, capsys, every_trial):
    """Diagonal within 1 %, cross-talk within 1 point of its column's diagonal, inside U95."""
    out = tmp_path / "gauges.toml"
    assert calibrate(steel_signals, out, every_trial=every_trial) == 0
    made = read_gauges(out, 8835.7293)
    true = np.array(
        json.loads((steel_signals / "truth.json").read_text())["gauge_matrix_Nmm_per_V"]
    )
    assert np.diag(made.all.matrix) == pytest.approx(np.diag(true), rel=0.01)
    assert np.abs(made.all.matrix / np.diag(made.all.matrix) - true / np.diag(true)).max() < 0.01
    assert np.all(np.abs(made.all.matrix - true) < 1.96 * made.all.sigma)
    said = capsys.readouterr().out
    assert "Hysteresis, friction along the rod included: not measured (no back stroke)" in said
    assert "Zero return: not measured" in said and "Repeatability" in said
    assert (tmp_path / "gauges.pdf").read_bytes().startswith(b"%PDF")
    assert (made.for_trial("gauge_roll0") is None) == (not every_trial)


def test_gauge_trials_without_a_truth_serve_by_their_wire(
    calibrate, steel_signals, tmp_path, capsys, monkeypatch
):
    """The coefficients are those with a truth, and the certificate names what they rest on."""
    calibrate(steel_signals, tmp_path / "with.toml")
    see_trial = sys.modules["bench.trials.truth_source"].see_trial

    def see(*arguments):
        seen = see_trial(*arguments)
        whisks = tuple(replace(whisk, truth=WhiskTruth(whisk.whisk)) for whisk in seen.whisks)
        return replace(seen, whisks=whisks)

    monkeypatch.setattr("bench.trials.truth_source.see_trial", see)
    calibrate(steel_signals, tmp_path / "without.toml")
    said = capsys.readouterr().out
    assert "Moments seen in pictures, by the wire alone: gauge_roll0, gauge_roll90" in said
    known, alone = (read_gauges(tmp_path / f"{name}.toml", 8835.7) for name in ("with", "without"))
    np.testing.assert_array_equal(alone.all.matrix, known.all.matrix)


def test_another_modulus_scales_the_coefficients_so_that_c_cancels(
    calibrate, steel_signals, tmp_path
):
    out = tmp_path / "gauges.toml"
    calibrate(steel_signals, out)
    one, ten_per_cent_more = read_gauges(out, 8835.7293), read_gauges(out, 1.1 * 8835.7293)
    assert ten_per_cent_more.all.matrix == pytest.approx(1.1 * one.all.matrix, rel=1e-6)
    assert ten_per_cent_more.notes and not one.notes[1:]


def test_what_cannot_be_calibrated_is_refused_and_nothing_is_written(
    calibrate, small_copy, tmp_path
):
    trial = small_copy / "trials" / "gauge_roll90" / "trial.toml"
    trial.write_text(trial.read_text().replace('"gauge"', '"measure"'))
    with pytest.raises(BadInput, match="turned by 90°"):
        calibrate(small_copy, tmp_path / "gauges.toml")
    assert not list(tmp_path.glob("gauges.*"))


def hang(session, name: str, force_N: float, volts, **keys) -> None:
    """A weight trial: the motor stands still, both channels read `volts` with a little noise."""
    folder = session / "trials" / name
    folder.mkdir()
    stated = {"purpose": '"weight"', "force_N": force_N, "at_mm": 60.0} | keys
    (folder / "trial.toml").write_text(
        "".join(f"{key} = {value}\n" for key, value in stated.items())
    )
    rng, rows = np.random.default_rng(3), ["time_s,motor_deg,y_V,z_V"]
    for k, (y, z) in enumerate(volts + 0.001 * rng.standard_normal((400, 2))):
        rows.append(f"{k / 2000:.6f},0.0,{y:.6f},{z:.6f}")
    (folder / "signals.csv").write_text("\n".join(rows) + "\n")


def hung_volts(session, force_N: float, stiffer: float) -> np.ndarray:
    """What a true gauge reads of F at 60 mm where the rod is `stiffer` than the session says: the gauges, too, then
    turn out to give more newtons a volt than the calibration knows."""
    true = json.loads((session / "truth.json").read_text())
    matrix = stiffer * np.array(true["gauge_matrix_Nmm_per_V"])
    return np.array(true["gauge_offset_V"]) + np.linalg.solve(matrix, [-force_N * 60.0, 0.0])


@pytest.mark.parametrize("with_zero", [True, False])
def test_weights_fix_the_newtons_and_give_the_modulus(
    calibrate, steel_signals, tmp_path, capsys, with_zero
):
    """A rod 4 % stiffer than stated. Forces are known to 0.1 %, the lever to 0.2 mm in 60; the calibration itself is
    good to 0.6 %: E to 1.5 % in 95 of 100 cases."""
    session = tmp_path / "session"
    shutil.copytree(steel_signals, session, ignore=shutil.ignore_patterns("high", "low"))
    for force in (0.15, 0.1, *([0.0] if with_zero else [])):
        sigmas = {"force_sigma_N": 0.001 * force, "at_sigma_mm": 0.2}
        hang(
            session,
            f"weight_{1000 * force:g}",
            force,
            hung_volts(steel_signals, force, 1.04),
            **sigmas,
        )
    out = tmp_path / "gauges.toml"
    calibrate(session, out)
    said = capsys.readouterr().out
    E, u95 = map(float, re.search(r"E = ([\d.]+) ± ([\d.]+) GPa", said).groups())
    assert 0.2 < u95 < 1.5
    assert abs(E - 1.04 * 60.0) < u95
    true = np.array(
        json.loads((steel_signals / "truth.json").read_text())["gauge_matrix_Nmm_per_V"]
    )
    made = tomllib.loads(out.read_text())
    assert np.diag(made["matrix_Nmm_per_V"]) == pytest.approx(1.04 * np.diag(true), rel=0.015)
    # the session's stated stiffness still rules evaluate: C cancels
    assert np.diag(read_gauges(out, 8835.7293).all.matrix) == pytest.approx(np.diag(true), rel=0.01)


def test_a_weight_that_the_gauges_do_not_feel_is_refused(calibrate, steel_signals, tmp_path):
    session = tmp_path / "session"
    shutil.copytree(steel_signals, session, ignore=shutil.ignore_patterns("high", "low"))
    hang(session, "weight", 0.15, hung_volts(steel_signals, -0.15, 1.0))
    with pytest.raises(BadInput, match="hang along rig −z"):
        calibrate(session, tmp_path / "gauges.toml")


def test_evaluate_and_calibrate_agree_on_what_cannot_be_calibrated(
    calibrate, small_copy, tmp_path, capsys
):
    """One refuses; the other goes on without estimates, in the same words, and says so of each whisk."""
    trial = small_copy / "trials" / "gauge_roll90" / "trial.toml"
    trial.write_text(trial.read_text().replace('"gauge"', '"measure"'))
    with pytest.raises(BadInput, match="turned by 90°") as refusal:
        calibrate(small_copy, tmp_path / "gauges.toml")
    assert evaluate(small_copy, tmp_path / "out", Settings(), workers=0) == 1
    assert str(refusal.value) in capsys.readouterr().out
    assert (tmp_path / "out" / "estimates.csv").read_text().count("\n") == 1
    with (tmp_path / "out" / "whisks.csv").open(newline="") as file:
        rows = {row["trial"]: row for row in csv.DictReader(file)}
    assert all(row["d_x_mm"] for row in rows.values())
    assert all("no_gauges" in codes(tmp_path / "out", trial) for trial in rows)


def test_the_turn_of_the_follicle_is_an_input_with_sigma(calibrate, small_copy, tmp_path, capsys):
    """1.75 points of cross-talk a degree: half a degree's sigma makes the U95 of y into m_z at least 1.7 points."""
    calibrate(small_copy, tmp_path / "exact.toml")
    assert "The follicle's turn: taken as exact" in capsys.readouterr().out
    trial = small_copy / "trials" / "gauge_roll90" / "trial.toml"
    trial.write_text(trial.read_text() + "\nfollicle_roll_sigma_deg = 0.5\n")
    calibrate(small_copy, tmp_path / "turned.toml")
    said = capsys.readouterr().out
    assert "The follicle's turn: ± 0.98°" in said
    cross = re.search(r"y into m_z ([+-][\d.]+) ± ([\d.]+)", said)
    assert 1.7 < float(cross[2]) < 2.6


def test_moments_need_no_gauges(calibrate, small_copy, tmp_path):
    for file in small_copy.glob("trials/*/signals.csv"):
        file.write_text(file.read_text().replace("y_V,z_V", "m_y_Nmm,m_z_Nmm", 1))
    with pytest.raises(BadInput, match="hold moments already"):
        calibrate(small_copy, tmp_path / "gauges.toml")


def test_evaluate_takes_the_same_coefficients(calibrate, small_copy, tmp_path, capsys):
    """Fitted on the way or beforehand and copied into the session: the same estimates to the last digit written."""
    evaluate(small_copy, tmp_path / "one", Settings(), workers=0)
    calibrate(small_copy, small_copy / "gauges.toml")
    evaluate(small_copy, tmp_path / "two", Settings(), workers=0)
    rows = [
        list(csv.reader((tmp_path / name / "estimates.csv").open(newline="")))
        for name in ("one", "two")
    ]
    assert len(rows[0]) == len(rows[1]) > 3
    for one, two in zip(*rows):
        assert one[:3] == two[:3]
        assert one[4:6] == two[4:6] or [float(x) for x in one[4:6]] == pytest.approx(
            [float(x) for x in two[4:6]], 1e-6
        )


THERE_AND_BACK = """
name = "there and back"
[gauges]
vibration = true
drift_V_per_s = 0.01
[motor]
back_stroke = true
[[trials]]
purpose = "gauge"
d_x_mm = 50.0
whisks = 2
[[trials]]
purpose = "gauge"
d_x_mm = 50.0
whisks = 2
follicle_roll_deg = 90.0
"""


def test_the_way_back_tells_hysteresis_return_and_repeatability(calibrate, tmp_path, capsys):
    """A rig whose zero drifts by up to 10 mV/s, and whose whisks take 1.2 s there and back: up to 12 mV, 0.12 N·mm or
    0.9 % of full scale do not return. Taken out, it leaves the diagonal within 0.5 %."""
    (tmp_path / "protocol.toml").write_text(THERE_AND_BACK)
    session = tmp_path / "session"
    simulate(
        session,
        protocol=tmp_path / "protocol.toml",
        signals_only=True,
        seed=2,
    )
    capsys.readouterr()
    calibrate(session, tmp_path / "gauges.toml")
    said = capsys.readouterr().out
    number = r"([\d.]+) %"
    assert 0.0 < float(re.search(rf"Repeatability of the gain: {number}", said)[1]) < 0.3
    returned = re.search(rf"Zero return: m_y {number}, m_z {number}", said)
    assert 0.2 < float(returned[1]) < 1.2
    assert (
        0.1
        < float(re.search(rf"Hysteresis, friction along the rod included: m_y {number}", said)[1])
        < 1.2
    )
    true = np.array(json.loads((session / "truth.json").read_text())["gauge_matrix_Nmm_per_V"])
    made = read_gauges(tmp_path / "gauges.toml", 8835.7293)
    assert np.diag(made.all.matrix) == pytest.approx(np.diag(true), rel=0.005)
