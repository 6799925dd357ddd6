"""The motor's angle by pictures, where none was logged: against the log that is left out, and faults in one line."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.exit_codes import DONE
from bench.base.settings import Settings
from bench.cameras.cameras_toml import write_cameras
from bench.commands import cli
from bench.session.abilities import ability_lines
from bench.session.angle_source import SOURCES, AngleSigma
from bench.session.angles_file import FrameAngles
from bench.session.manifest import TrialKeys
from bench.session.session import load_session
from bench.session.signals import read_signals
from bench.workflows.session_evaluation import evaluate
from tests.scenes.no_motor_log import without_log
from tests.scenes.recorded import exact_cameras
from tests.scenes.results import table

FIXTURES = Path(__file__).parents[3] / "fixtures"
TRACES = (
    FIXTURES / "bring" / "traces"
)  # one whisk before exact cameras, which others have traced, too
SMALL = FIXTURES / "small-session"
WHISKER = 'angle_from = "whisker"'
MARKER = 'angle_from = "marker"\nhub_marker = 40'


@pytest.fixture(scope="module")
def whisker_session(tmp_path_factory) -> Path:
    """A session with the whisker's own angles; read only."""
    session = without_log(TRACES, tmp_path_factory.mktemp("whisker") / "session", WHISKER)
    assert cli.main(["calibrate", "angles", str(session)]) == 0
    return session


@pytest.fixture(scope="module")
def marker_session(tmp_path_factory) -> Path:
    """A session with angles by the hub's marker, and its true cameras; read only."""
    session = without_log(SMALL, tmp_path_factory.mktemp("marker") / "session", MARKER, trials=1)
    write_cameras(session / "cameras.toml", exact_cameras(SMALL))
    assert cli.main(["calibrate", "angles", str(session)]) == 0
    return session


def logged_rad(source: Path, trial: str, time_s: np.ndarray) -> np.ndarray:
    """The angle of the log that was left out."""
    return read_signals(load_session(source).trial(trial)).motor_at(time_s)


@pytest.mark.parametrize(("name", "source"), [("whisker", TRACES), ("marker", SMALL)])
def test_angles_turn_as_the_log_that_is_left_out(name, source, request):
    """Turns from the first frame on: all within four sigmas, and none known worse than to 2 % of them and
    0.1°, of which a tenth of a degree is what one frame shows of a bent whisker's clamp."""
    session = load_session(request.getfixturevalue(f"{name}_session"))
    trial = session.trials[0]
    signals = read_signals(trial)
    file = np.genfromtxt(trial.folder / f"angles_{name}.csv", delimiter=",", names=True)
    expected = logged_rad(source, trial.name, file["time_s"])
    turn = np.radians(file["motor_deg"] - file["motor_deg"][0])
    error = turn - (expected - expected[0])
    at = zip(np.radians(file["motor_deg"][:1]), turn)
    sigma = [signals.angle_sigma.of_push(signals.motor_rad, first, by) for first, by in at]
    own = np.radians(np.hypot(file["motor_sigma_deg"], file["motor_sigma_deg"][0]))
    sigma = np.hypot(own, file["share_sigma"] * turn)
    assert np.all(np.abs(error[1:]) < 4.0 * sigma[1:])
    assert np.all(sigma < np.radians(0.1) + 0.02 * turn)
    assert signals.time_s[0] >= file["time_s"][0] and signals.time_s[-1] <= file["time_s"][-1]


def test_truth_and_interval_hold_by_the_whisker_s_own_angles(whisker_session, tmp_path):
    assert evaluate(whisker_session, tmp_path, Settings(), announce=lambda text: None) == DONE
    whisk = table(tmp_path / "whisks.csv")[0]
    truth_mm = tomllib.loads((TRACES / "trials" / whisk["trial"] / "truth.toml").read_text())[
        "d_x_mm"
    ]
    assert abs(float(whisk["d_x_mm"]) - truth_mm) < 2.0 * float(whisk["d_x_sigma_mm"])
    assert float(whisk["d_x_sigma_mm"]) < 0.03  # 0.015 with the log
    rows = {row["estimator"]: row for row in table(tmp_path / "estimates.csv")}
    ten = rows["with_friction"]
    assert float(ten["d_x_est_low_mm"]) < truth_mm < float(ten["d_x_est_high_mm"])
    assert whisk["angle_from"] == ten["angle_from"] == "whisker"
    assert "θ of their estimates is seen" in (tmp_path / "summary.txt").read_text()


def test_check_says_where_angles_are_from_and_what_is_not_known(whisker_session):
    lines = list(ability_lines(load_session(whisker_session)))
    assert "by the whisker's base" in lines[0] and "the motor between frames" in lines[0]
    assert "seen" in lines[1]


def test_nothing_is_overwritten(whisker_session, capsys):
    assert cli.main(["calibrate", "angles", str(whisker_session)]) == 0
    assert "1 trial with angles already: kept" in capsys.readouterr().out


def blank(session: Path) -> None:
    """Show the rig without whisker and bar in every frame."""
    for camera in ("high", "low"):
        for frame in session.glob(f"trials/*/{camera}/*.jpg"):
            shutil.copyfile(session / "boards" / "rig" / f"{camera}.jpg", frame)


def one_camera(session: Path) -> None:
    """Take a camera's pictures away."""
    for folder in session.glob("trials/*/low"):
        shutil.rmtree(folder)


def no_speed(session: Path) -> None:
    """State no nominal speed."""
    for file in session.glob("trials/*/trial.toml"):
        file.write_text(file.read_text().replace("speed_deg_s", "# "))


def nothing(session: Path) -> None:
    """Leave the session as it is."""


@pytest.mark.parametrize(
    ("keys", "spoil", "found"),
    [
        (WHISKER, blank, "trials/w_b35_v10: "),
        (WHISKER, one_camera, "needs pictures by two cameras; there are 1"),
        (WHISKER, no_speed, "speed_deg_s is missing: angle_from"),
        (WHISKER + "\nboth_ways = true", nothing, "both_ways needs motor_deg"),
        ('angle_from = "marker"', nothing, "hub_marker is missing: angle_from"),
        (
            'angle_from = "marker"\nhub_marker = 77',
            nothing,
            "marker 77 (hub_marker) is in no picture; seen besides the board's",
        ),
        ('angle_from = "markers"', nothing, "angle_from"),
        ('angle_from = "log"', nothing, "no trial has angle_from"),
    ],
)
def test_what_pictures_do_not_show_is_one_line(keys, spoil, found, tmp_path, capsys):
    session = without_log(TRACES, tmp_path / "session", keys)
    spoil(session)
    assert cli.main(["calibrate", "angles", str(session)]) == 2
    said = [line for line in capsys.readouterr().err.splitlines() if not line.endswith("...")]
    said = [line for line in said if line.startswith("whisker-bench")]
    assert len(said) == 1 and found in said[0]


def test_angles_that_are_not_there_say_how_they_are_made(tmp_path):
    session = load_session(without_log(TRACES, tmp_path / "session", WHISKER))
    with pytest.raises(BadInput, match=r"angles_whisker.csv: is not there; run `whisker-bench cal"):
        read_signals(session.trials[0])
    assert "whisker-bench calibrate angles" in "".join(ability_lines(session))


@pytest.mark.parametrize(
    ("rows", "found"),
    [
        ("0,1,0.1,0\n0,2,0.1,0\n", "row 3, column time_s"),
        ("0,1,-0.1,0\n1,2,0.1,0\n", "row 2, column motor_sigma_deg"),
        ("0,1,0.1,0\n", "has 1 rows, one a frame; 2 or more"),
    ],
)
def test_a_damaged_file_of_angles_is_named_by_row(rows, found, tmp_path):
    session = without_log(TRACES, tmp_path / "session", WHISKER)
    trial = load_session(session).trials[0]
    text = f"time_s,motor_deg,motor_sigma_deg,share_sigma\n{rows}"
    (trial.folder / "angles_whisker.csv").write_text(text)
    with pytest.raises(BadInput, match=found):
        read_signals(trial)


def test_own_errors_and_a_common_share_make_the_sigma_of_a_push():
    """Of independent errors of 0.01 rad a frame and a scale known to 3 %: both come back."""
    motor_rad = np.linspace(0.1, 0.3, 9)
    covariance = 1e-4 * np.eye(9) + 0.03**2 * np.outer(motor_rad, motor_rad)
    angles = FrameAngles.of_turns(np.arange(9.0), motor_rad, covariance)
    # steps of 0.025 rad add 0.03 · 0.025 to a frame's own error: 0.3 % of its square
    np.testing.assert_allclose(np.radians(angles.sigma_deg), 0.01, rtol=3e-3)
    assert angles.share_sigma == pytest.approx(0.03, rel=0.02)
    sigma = AngleSigma(0.03, np.full(9, 0.01))
    assert sigma.of_push(motor_rad, 0.15, 0.1) == pytest.approx(np.sqrt(2e-4 + 0.003**2))


def test_every_source_of_angles_is_a_value_of_the_key():
    allowed = TrialKeys.__annotations__["angle_from"].__args__
    assert set(allowed) == set(SOURCES)
