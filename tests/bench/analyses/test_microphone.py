"""microphone.csv: taps of the built-in protocol, heard, and held against what the rig did."""

import csv

import numpy as np
import pytest

from bench.analyses.microphone import MICROPHONE
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.rig.protocol import FOLDER, load
from bench.rig.simulation import simulate
from bench.workflows.session_evaluation import evaluate
from tests.scenes.rig_sessions import protocol_file

TAP = (FOLDER / "tap.toml").read_text()
QUIET = Settings(figures=False)


def evaluated(tmp_path, text):
    """Folder of the evaluated session of a protocol."""
    session = simulate(tmp_path / "tap", protocol=protocol_file(tmp_path, text), seed=1)
    evaluate(session, tmp_path / "out", QUIET, workers=0, announce=lambda text: None)
    return tmp_path / "out"


def rows(out) -> list[dict]:
    return list(csv.DictReader((out / MICROPHONE.file).read_text().splitlines()))


def test_fast_taps_are_heard_when_they_touch(tmp_path, exact_vision):
    """Within four sigmas; at 30°/s and faster all of them, at 360°/s to less than half a millisecond."""
    table = rows(evaluated(tmp_path, TAP.replace("stage = true", "")))
    assert tuple(table[0]) == MICROPHONE.names and len(table) == 8
    fast = [row for row in table if float(row["speed_deg_s"]) >= 30.0]
    assert all(not row["status"] for row in fast)
    for row in fast:
        assert abs(float(row["delay_s"])) < 4.0 * float(row["delay_sigma_s"])
    assert all(abs(float(row["delay_s"])) < 5e-4 for row in table if row["speed_deg_s"] == "360")
    summary = (tmp_path / "out" / "summary.txt").read_text()
    assert "at 360°/s 2 of 2 touches are heard" in summary and "late by" in summary


def test_without_pictures_the_score_alone_knows_the_touch(tmp_path):
    out = evaluated(tmp_path, TAP.replace("[10.0, 30.0, 90.0, 360.0]", "90.0"))
    assert {row["delay_s"] for row in rows(out)} == {""}
    lines = [x for x in (out / "summary.txt").read_text().splitlines() if "touch_heard_deg" in x]
    assert len(lines) == 1 and float(lines[0].split()[-1]) < 4.0


def test_a_session_without_a_microphone_has_no_such_table(tmp_path):
    text = TAP.replace("[microphone]", "").replace("[10.0, 30.0, 90.0, 360.0]", "90.0")
    assert not (evaluated(tmp_path, text) / MICROPHONE.file).exists()


def test_its_pressure_stands_after_a_load_cell_s_forces(tmp_path):
    text = TAP.replace("[microphone]", "[microphone]\n[load_cell]")
    text = text.replace("[10.0, 30.0, 90.0, 360.0]", "360.0").replace("[0, 40]", "0")
    session = simulate(tmp_path / "both", protocol=protocol_file(tmp_path, text))
    (path,) = (session / "trials").glob("*/signals.csv")
    lines = path.read_text().splitlines()
    assert lines[0] == "time_s,motor_deg,y_V,z_V,f_x_N,f_y_N,f_z_N,p_Pa"
    pressure = np.array([float(line.split(",")[-1]) for line in lines[1:]])
    assert np.std(pressure[:50]) == pytest.approx(0.01, rel=0.4)  # 4 sigmas of 50 samples


@pytest.mark.parametrize(
    "text, message",
    [
        (TAP + "\n[[columns]]\nheights_mm = [0.0]\n", "one whisker"),
        (TAP.replace("[microphone]", "[microphone]\nband_Hz = [800.0, 80.0]"), "800 to 80; rising"),
        (TAP.replace("[microphone]", "[microphone]\nband_Hz = [80.0, 1000.0]"), "below 1000"),
    ],
)
def test_a_microphone_that_no_rig_has_is_refused(tmp_path, text, message):
    with pytest.raises(BadInput, match=message):
        load(protocol_file(tmp_path, text))
