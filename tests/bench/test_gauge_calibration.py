"""`calibrate gauges`: a file that `evaluate` takes, a certificate that says what was not measured, refusals."""

import json

import numpy as np
import pytest

from bench.calibration import SessionCalibration
from bench.errors import BadInput
from bench.gauge_calibration import calibrate_gauges_command
from bench.gauges_file import read_gauges
from bench.results import hash_of


@pytest.fixture
def calibrate(monkeypatch, exact_vision):
    """The command with exact vision."""
    nothing = SessionCalibration(None, {}, hash_of("exact"))
    monkeypatch.setattr("bench.gauge_calibration.calibrate_session", lambda session, out: nothing)
    return lambda session, out, **options: calibrate_gauges_command(session, out, workers=0, **options)


@pytest.mark.parametrize("every_trial", [False, True])
def test_sample_session(calibrate, steel_sample, tmp_path, capsys, every_trial):
    """Diagonal within 1 %, cross-talk within 1 point of its column's diagonal, inside U95."""
    out = tmp_path / "gauges.toml"
    assert calibrate(steel_sample, out, every_trial=every_trial) == 0
    made = read_gauges(out, 8835.7293)
    true = np.array(json.loads((steel_sample / "truth.json").read_text())["gauge_matrix_Nmm_per_V"])
    assert np.diag(made.all.matrix) == pytest.approx(np.diag(true), rel=0.01)
    assert np.abs(made.all.matrix / np.diag(made.all.matrix) - true / np.diag(true)).max() < 0.01
    assert np.all(np.abs(made.all.matrix - true) < 1.96 * made.all.sigma)
    said = capsys.readouterr().out
    assert "Hysteresis: not measured" in said and "Repeatability" in said
    assert (tmp_path / "gauges.pdf").read_bytes().startswith(b"%PDF")
    assert (made.for_trial("gauge_roll0") is None) == (not every_trial)


def test_another_modulus_scales_the_coefficients_so_that_c_cancels(calibrate, steel_sample, tmp_path):
    out = tmp_path / "gauges.toml"
    calibrate(steel_sample, out)
    one, ten_per_cent_more = read_gauges(out, 8835.7293), read_gauges(out, 1.1 * 8835.7293)
    assert ten_per_cent_more.all.matrix == pytest.approx(1.1 * one.all.matrix, rel=1e-6)
    assert ten_per_cent_more.notes and not one.notes[1:]


def test_what_cannot_be_calibrated_is_refused_and_nothing_is_written(calibrate, small_copy, tmp_path):
    trial = small_copy / "trials" / "gauge_roll90" / "trial.toml"
    trial.write_text(trial.read_text().replace('"gauge"', '"measure"'))
    with pytest.raises(BadInput, match="turned by 90°"):
        calibrate(small_copy, tmp_path / "gauges.toml")
    assert not list(tmp_path.glob("gauges.*"))
