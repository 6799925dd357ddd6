"""A session without a motor log: its estimates against those with the log, and its faults in one line each."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.exit_codes import DONE
from bench.base.settings import Settings
from bench.session.session import load_session
from bench.session.signals import read_signals
from bench.workflows.session_evaluation import evaluate
from tests.scenes.results import table

BRING = Path(__file__).parents[3] / "fixtures" / "bring"
NO_LOG = BRING / "no-motor-log"
TRIAL = "steel_b20_v10"


def estimates(session: Path, out: Path) -> dict[str, dict[str, str]]:
    """Return the rows of (10) of a session by trial."""
    assert evaluate(session, out, Settings(), announce=lambda text: None) == DONE
    rows = table(out / "estimates.csv")
    return {row["trial"]: row for row in rows if row["estimator"] == "with_friction"}


def test_distances_differ_from_those_with_the_log_by_the_speed_s_error(tmp_path):
    """(10) is proportional to θ at a given moment, so d_x is off as the speed is. Touch is fitted to half of
    the samples: the rest is within four sigmas of the log's own, of which α's is shared."""
    without = estimates(NO_LOG, tmp_path / "without")
    logged = estimates(BRING / "stage", tmp_path / "with")
    assert without
    speeds = {trial.name: trial.speed_deg_s for trial in load_session(NO_LOG).trials}
    for name, row in without.items():
        with_log_mm = float(logged[name]["d_x_est_mm"])
        expected_mm = speeds[name] / 10.0 * with_log_mm
        own_mm = float(logged[name]["d_x_est_sigma_alpha_exact_mm"])
        assert abs(float(row["d_x_est_mm"]) - expected_mm) < 4.0 * own_mm
        of_speed_mm = 0.1 / speeds[name] * with_log_mm
        assert float(row["d_x_est_sigma_alpha_exact_mm"]) > 0.9 * of_speed_mm


def test_the_angle_stops_at_the_crest():
    trial = load_session(NO_LOG).trial(TRIAL)
    signals = read_signals(trial)
    steps = np.diff(signals.motor_rad)
    assert signals.angle_sigma.share == pytest.approx(0.1 / trial.speed_deg_s)
    assert np.all(steps >= 0.0) and steps[0] == pytest.approx(
        np.radians(trial.speed_deg_s) / signals.rate_Hz
    )


def refusal(session: Path) -> str:
    """Return why the signals of TRIAL are refused."""
    with pytest.raises(BadInput) as refused:
        read_signals(load_session(session).trial(TRIAL))
    return str(refused.value)


def edited(tmp_path: Path, file: str, old: str, new: str) -> Path:
    """Return a copy of the session in which a file says `new` in place of `old`."""
    copy = tmp_path / "session"
    shutil.copytree(NO_LOG, copy)
    text = (copy / file).read_text()
    assert old in text
    (copy / file).write_text(text.replace(old, new))
    return copy


@pytest.mark.parametrize(
    ("file", "old", "new", "found"),
    [
        (
            "session.toml",
            'angle_from = "speed"',
            "",
            "has no column motor_deg; without a motor log",
        ),
        (f"trials/{TRIAL}/trial.toml", "speed_deg_s", "# ", "speed_deg_s is missing"),
        (f"trials/{TRIAL}/trial.toml", "speed_sigma_deg_s", "# ", "speed_sigma_deg_s is missing"),
        ("session.toml", "[trial]", "[trial]\nboth_ways = true", "both_ways needs motor_deg"),
    ],
)
def test_what_the_angle_lacks_is_one_line(tmp_path, file, old, new, found):
    line = refusal(edited(tmp_path, file, old, new))
    assert found in line and "\n" not in line


def test_several_strokes_are_refused(tmp_path):
    copy = edited(tmp_path, "session.toml", "format", "format")
    file = copy / "trials" / TRIAL / "signals.csv"
    header, *rows = file.read_text().splitlines()
    values = np.array([row.split(",") for row in rows], dtype=float)
    again = values.copy()
    again[:, 0] += values[-1, 0] + 2e-3
    again[:, 1:] *= 1.1
    np.savetxt(
        file, np.vstack([values, again]), delimiter=",", header=header, comments="", fmt="%.6f"
    )
    assert "takes one forward stroke a recording" in refusal(copy)


def test_a_place_says_nothing_where_the_motor_has_no_zero(tmp_path):
    copy = edited(tmp_path, f"trials/{TRIAL}/trial.toml", "d_x_sigma_mm", "# d_x_sigma_mm")
    with (copy / "trials" / TRIAL / "trial.toml").open("a") as file:
        file.write("[object]\npoint_mm = [60.0, 5.0, 0.0]\n")
    with pytest.raises(BadInput, match=r"no zero.*state d_x_mm, and no place"):
        load_session(copy)
