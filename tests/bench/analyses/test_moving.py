"""moving.csv, both_ways.csv and their lines: sessions simulated, felt, judged against what is seen exactly."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from bench.analyses import back_strokes as both_ways
from bench.analyses import moving_objects as moving
from bench.base.settings import Settings
from bench.base.statuses import reason
from bench.rig.simulation import simulate
from bench.workflows.session_evaluation import evaluate
from tests.scenes.rig_sessions import protocol_file

PROTOCOL = """
[gauges]
known = true
[pictures]
step_deg = 1.5
[[trials]]
name = "{name}"
beta_deg = 45
friction = 0.18
{keys}
"""
MOVING = "object_velocity_mm_s = [0, 2, 0]\nobject_velocity_sigma_mm_s = 0.01"


def run(folder, keys, **settings):
    """Folder of the evaluated session."""
    protocol = protocol_file(folder, PROTOCOL.format(name="one", keys=keys))
    session = simulate(folder / "session", protocol=protocol, signals_only=True, seed=2)
    evaluate(
        session,
        folder / "out",
        Settings(figures=False, **settings),
        workers=0,
        announce=lambda text: None,
    )
    return folder / "out"


def table(path) -> list[dict]:
    return list(csv.DictReader(path.read_text().splitlines()))


def test_an_object_that_moves_is_judged_by_itself(tmp_path, exact_vision):
    """2 mm/s of the whisker's 10.5 at 60 mm: (10) is wrong by 24 %, what knows the speed is not; no verdict is made of
    it."""
    out = run(tmp_path, MOVING)
    rows = {row["estimator"]: row for row in table(out / moving.MOVING.file)}
    assert tuple(rows["known_motion"]) == moving.MOVING.names
    assert float(rows["known_motion"]["velocity_share_percent"]) == pytest.approx(19.1, abs=0.3)
    assert float(rows["with_friction"]["error_percent"]) == pytest.approx(24.0, abs=3.0)
    assert (
        abs(float(rows["known_motion"]["error_percent"])) < 2.0
        and rows["known_motion"]["inside"] == "1"
    )
    assert "known_motion" in {row["estimator"] for row in table(out / "estimates.csv")}
    text = (out / "summary.txt").read_text()
    assert "Objects that moved (moving.csv)" in text and "(10), motion known:" in text
    assert "wrong by" not in text.splitlines()[0]
    figure = moving.MovingObjects().figure([drawn(row) for row in rows.values()])
    assert len(figure.axes[0].lines) == 1 + len(rows)


def drawn(row):
    """What the figure asks of an estimate."""
    numbers = {
        name: float(row[f"{long}_percent"])
        for name, long in (("share_percent", "velocity_share"), ("error_percent", "error"))
    }
    return SimpleNamespace(estimate=SimpleNamespace(estimator=row["estimator"]), **numbers)


def test_a_push_and_its_way_back_need_no_friction_angle(tmp_path, exact_vision):
    """With α_est = 25° (10) is off by a third; both ways together are not, and tell slope and friction."""
    out = run(tmp_path, "both_ways = true", alpha_est_deg=25.0)
    rows = {row["estimator"]: row for row in table(out / both_ways.BOTH_WAYS.file)}
    both = rows["both_ways"]
    assert tuple(both) == both_ways.BOTH_WAYS.names
    assert (
        abs(float(both["error_percent"])) < 2.0 < abs(float(rows["with_friction"]["error_percent"]))
    )
    assert float(both["beta_est_deg"]) == pytest.approx(45.0, abs=2.0)
    assert float(both["alpha_est_deg"]) == pytest.approx(np.degrees(np.arctan(0.18)), abs=2.0)
    assert float(both["phi_felt_deg"]) - float(both["phi_there_deg"]) == pytest.approx(
        2 * 10.2, abs=1.5
    )
    (there,) = table(out / "whisks.csv")
    assert float(both["touch_felt_deg"]) == pytest.approx(float(there["touch_felt_deg"]), abs=0.1)
    assert "Ways back (both_ways.csv)" in (out / "summary.txt").read_text()


def test_a_recording_without_a_way_back_says_so(tmp_path, exact_vision):
    out = run(tmp_path, MOVING)
    manifest = next((tmp_path / "session").glob("trials/*/trial.toml"))
    manifest.write_text("both_ways = true\n" + manifest.read_text())
    evaluate(
        tmp_path / "session", out, Settings(figures=False), workers=0, announce=lambda text: None
    )
    (row,) = table(out / both_ways.BOTH_WAYS.file)
    assert row["status"] == reason("no_way_back") and row["d_x_est_mm"] == ""


def test_sessions_of_standing_objects_have_neither(exact_run):
    assert (
        not (exact_run / moving.MOVING.file).exists()
        and not (exact_run / both_ways.BOTH_WAYS.file).exists()
    )
