"""The verb `plan`: a small rig painted and planned, a session's whisk planned as recorded, bad input."""

import json
from dataclasses import replace

import numpy as np
import pytest

from bench import api
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.commands import cli
from bench.commands.plan import EXAMPLE
from bench.plan.outlook import QUANTITIES
from bench.plan.plan_rows import Plan
from bench.plan.plan_text import lines_of
from bench.plan.recorded_whisk import SeenTask, plan_seen
from bench.plan.run_plan import Options, plan
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import Clock, SeenTrial
from bench.rig.protocol import load
from bench.session.session import load_session
from bench.trials.seen import whisk_record
from tests.scenes.planned import LINES, cameras_of, protocol_of, staged_of
from tests.scenes.results import seen_whisk
from tests.scenes.rig_sessions import protocol_file, rows
from vision.fit.line_noise import LineNoise
from vision.geometry.reasons import Reason
from vision.truth.predicted_truth import predict_truth

SMALL = """
name = "small"
[[cameras]]
name = "high"
position_mm = [38.0, -175.0, 335.0]
size_px = [480, 270]
focal_px = 750.0
[[cameras]]
name = "low"
position_mm = [98.0, -325.0, 120.0]
size_px = [480, 270]
focal_px = 720.0
[board]
views = 8
[whisker]
shape = "cone"
[[trials]]
beta_deg = 30
d_x_mm = 50.0
"""
FAR = """
[[trials]]
surface = "far"
beta_deg = 60
d_x_mm = 97.0
after_deg = 25.0
friction = 0.0
"""


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan")
    made = api.plan(protocol_file(folder, SMALL + FAR), folder / "out", changes=False)
    return made, folder / "out"


@pytest.mark.slow
def test_a_rig_is_planned_whole(planned):
    made, out = planned
    good, bad = made.rows
    assert good.outlook.has_truth and all(
        0.0 < good.outlook.sigma[name] < 3.0 for name in QUANTITIES
    )
    assert not bad.outlook.has_truth and "slips off" in bad.outlook.status and made.lacks_truth
    first, second = rows(out / "plan.csv")
    assert float(first["d_x_sigma_mm"]) == pytest.approx(good.outlook.sigma["d_x_mm"], rel=1e-8)
    assert second["d_x_sigma_mm"] == ""
    assert (
        json.loads((out / "plan.json").read_text())["rows"][0]["sigma"]["d_x_mm"]
        == good.outlook.sigma["d_x_mm"]
    )
    assert (out / "plan.png").stat().st_size > 10_000
    assert sorted(path.name for path in (out / "views").iterdir()) == ["high.png", "low.png"]
    text = (out / "plan.txt").read_text()
    assert (
        "has no truth: the whisker slips off" in text
        and "camera high: at (38, -175, 335) mm" in text
    )


@pytest.mark.slow
def test_the_same_rig_gives_the_same_plan(planned, tmp_path):
    _, out = planned
    api.plan(out.parent / "protocol.toml", tmp_path, changes=False)
    for name in ("plan.csv", "plan.json", "plan.txt"):
        assert (tmp_path / name).read_bytes() == (out / name).read_bytes()


def test_a_recorded_whisk_beside_what_was_stated(tmp_path, steel_signals):
    """A whisk that is known as well as its staging lets it be is expected to be known so."""
    protocol = protocol_of(tmp_path)
    staged, cameras = staged_of(protocol), cameras_of(protocol)
    truth = predict_truth(staged.known, cameras, dict.fromkeys(cameras.names, LINES)).truth
    session = load_session(steel_signals)
    seen = whisk_record(truth, Settings())
    assert seen.truth.lines["high"].wire_px == pytest.approx(LINES.wire_px)
    trial = SeenTrial((seen,), clock=Clock("frames.csv", 0.0, True))
    row = plan_seen(SeenTask(session, session.trials[0], trial, seen, cameras, (), np.radians(3.0)))
    ratios = np.array([row.outlook.sigma[name] / row.stated[name] for name in QUANTITIES])
    assert ratios[:3] == pytest.approx(
        1.0, abs=0.02
    )  # by another whisker's stiffness and bar's diameter
    assert np.all(ratios[3:] > 0.98) and np.all(
        ratios[3:] < 1.3
    )  # staged frames do not scatter, those expected do
    text = "\n".join(lines_of(Plan("t", (), (row,), 3.0)))
    assert "those of the evaluated run, median of 1 whisk: d_x 1.0" in text


def test_a_whisk_without_truth_keeps_its_reason(steel_signals, tmp_path):
    session, protocol = load_session(steel_signals), protocol_of(tmp_path)
    seen = seen_whisk(0, Reason("never_touches", "it never touches"))
    task = SeenTask(
        session, session.trials[0], SeenTrial((seen,)), seen, cameras_of(protocol), (), 0.05
    )
    row = plan_seen(task)
    assert not row.outlook.has_truth and row.outlook.status.codes == ("never_touches",)


def test_lines_come_back_from_a_file():
    kept = from_plain(
        LineNoise, json.loads(json.dumps(to_plain(replace(LINES, wire_px=float("nan")))))
    )
    assert np.isnan(kept.wire_px) and np.array_equal(kept.bar_px, LINES.bar_px)


def test_the_example_is_a_rig():
    found = load(str(EXAMPLE))
    assert found.cameras[0].focal == pytest.approx(2000.0) and found.cameras[1].position_mm is None


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[[trials]]\n", "no [[cameras]]"),
        ("[[trials]]\nbeta = 3\n", "beta"),
        (SMALL.replace("focal_px = 720.0", "focal_mm = 8.0"), "pixel_um"),
        (
            SMALL.replace(
                "focal_px = 720.0", "focal_px = 720.0\ntarget_mm = [98.0, -900.0, 500.0]"
            ),
            "camera low",
        ),
        (SMALL.replace("[38.0, -175.0, 335.0]", "[55.0, 0.0, 335.0]"), "straight"),
        pytest.param(SMALL.split("[[trials]]")[0] + FAR, "slips off", marks=pytest.mark.slow),
    ],
)
def test_bad_rigs_are_one_line(text, says, tmp_path, capsys):
    assert (
        cli.main(["plan", str(protocol_file(tmp_path, text)), "--out", str(tmp_path / "out")]) == 2
    )
    told = capsys.readouterr().err
    assert says in told and told.count("\n") == 1


@pytest.mark.parametrize(
    "options",
    [[], ["rig.toml"], ["no-such.toml", "--out", "o"], ["quick", "--out", "o", "--theta-deg", "0"]],
)
def test_bad_usage_is_one_line(options, capsys):
    assert cli.main(["plan", *options]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_example_is_printed(capsys):
    assert cli.main(["plan", "--example"]) == 0
    assert capsys.readouterr().out.strip() == EXAMPLE.read_text().strip()


def test_a_session_without_pictures_is_refused(steel_signals, tmp_path, capsys):
    assert cli.main(["plan", str(steel_signals), "--out", str(tmp_path / "out")]) == 2
    assert "no pictures" in capsys.readouterr().err


def test_a_sessions_manifest_is_no_rig(small_session, tmp_path):
    with pytest.raises(
        BadInput, match=r"session\.toml: is a recorded session's; give the session's folder"
    ):
        plan(small_session / "session.toml", tmp_path / "out", Options())
    assert not (tmp_path / "out").exists()


def test_a_rounded_object_is_refused(tmp_path):
    """It would be taken for a bar along a ring's normal."""
    text = SMALL + 'object = "ring"\nring_diameter_mm = 80\n'
    with pytest.raises(BadInput, match="a ring, sphere or cone is seen is not planned"):
        plan(protocol_file(tmp_path, text), tmp_path / "out", Options())
