"""Whole sessions: what is written agrees with itself, and the bench reads it."""

import json
import tomllib

import numpy as np
import pytest

from bench.session.frame_times import frame_times
from bench.session.session import load_session
from bench.session.signals import forward_strokes, read_signals
from tests.scenes.rig_sessions import bar_of, rows


def test_the_bench_reads_what_the_rig_writes(tiny):
    session = load_session(tiny)
    assert sorted(t.name for t in session.trials) == [
        "gauge_roll90",
        "rough_b60_v90",
        "steel_b20_v10",
        "steel_b50_v10",
    ]
    for trial in session.trials:
        signals = read_signals(trial)
        assert len(forward_strokes(signals)) == (3 if trial.name.startswith("rough") else 1)
        assert len(frame_times(trial)) == (39 if trial.name.startswith("rough") else 13)


def test_frames_stand_from_before_touch_to_after_it(tiny):
    for folder in sorted((tiny / "trials").iterdir()):
        truth = tomllib.loads((folder / "truth.toml").read_text())
        touch = (
            truth["touch_deg"][0] if isinstance(truth["touch_deg"], list) else truth["touch_deg"]
        )
        angles = [float(r["motor_deg"]) - touch for r in rows(folder / "truth.csv")][:13]
        assert angles == pytest.approx(np.arange(-1.6, 4.5, 0.5), abs=1e-5)
        assert [r["contact"] for r in rows(folder / "truth.csv")][:13] == ["0"] * 4 + ["1"] * 9
        assert len(list((folder / "left").iterdir())) == len(rows(folder / "truth.csv"))


def test_truth_agrees_with_itself(tiny):
    """Slip is the point's way from P0 along the bar that β and ψ name; at 3° it lies between its neighbours'."""
    folder = tiny / "trials" / "steel_b50_v10"
    truth = tomllib.loads((folder / "truth.toml").read_text())
    axis, p0, _ = bar_of(truth, both_radii_mm=3.5)
    slips = []
    for row in rows(folder / "truth.csv")[4:]:
        point = np.array([float(row[k]) for k in ("x_mm", "y_mm", "z_mm")])
        slips.append(float(row["slip_mm"]))
        assert (point - p0) @ axis == pytest.approx(slips[-1], abs=5e-6)
    assert truth["slip_at_3deg_mm"] == pytest.approx(np.interp(3, [2.9, 3.4], slips[5:7]), rel=1e-3)


def test_truth_has_the_form_of_steel_signalss(tiny, steel_signals):
    mine, other = (json.loads((s / "truth.json").read_text()) for s in (tiny, steel_signals))
    assert set(other) <= set(mine)
    assert set(other["cameras"]["high"]) == set(mine["cameras"]["left"])
    mine, other = tiny / "trials" / "steel_b20_v10", steel_signals / "trials" / "b30_3"
    keys = [[*tomllib.loads((folder / "truth.toml").read_text())] for folder in (mine, other)]
    assert keys[0] == [*keys[1], "stiffness_N_mm"]
    for name in ("truth.csv", "signals.csv", "frames.csv"):
        assert (mine / name).read_text().startswith((other / name).read_text().split("\n")[0])


def test_camera_clock_is_off_by_what_the_protocol_says(tiny):
    folder = tiny / "trials" / "steel_b20_v10"
    stated, true = (
        [float(r["time_s"]) for r in rows(folder / f"{n}.csv")] for n in ("frames", "truth")
    )
    assert np.subtract(true, stated) == pytest.approx(0.003, abs=2e-6)


def test_signals_carry_the_truths_moments(tiny):
    """Through the gauge matrix, within noise, mains, and the filter's delay (0.5 ms: 0.02 N·mm)."""
    exact = json.loads((tiny / "truth.json").read_text())
    matrix, offset = np.array(exact["gauge_matrix_Nmm_per_V"]), np.array(exact["gauge_offset_V"])
    folder = tiny / "trials" / "steel_b50_v10"
    signals = np.genfromtxt(folder / "signals.csv", delimiter=",", names=True)
    moments = (np.column_stack([signals["y_V"], signals["z_V"]]) - offset) @ matrix.T
    for row in rows(folder / "truth.csv"):
        near = np.abs(signals["time_s"] - float(row["time_s"])) < 0.004
        if near.sum() > 14:
            expected = [float(row["m_y_Nmm"]), float(row["m_z_Nmm"])]
            assert moments[near].mean(0) == pytest.approx(expected, abs=0.13)
