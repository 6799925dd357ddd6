"""A tracker's lines against ours: bias, scatter, coverage, frames without, identity."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest

from bench.commands import cli
from bench.workflows.trace_scores import FrameScore, TrialScores, _mean_of_frames, _scores

BRING = Path(__file__).resolve().parents[3] / "fixtures" / "bring" / "traces"
TRIAL = next((BRING / "trials").iterdir()).name


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """The worked example without traces of its own."""
    ignored = shutil.ignore_patterns("trace_*")
    return shutil.copytree(BRING, tmp_path_factory.mktemp("s") / "session", ignore=ignored)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """Where the first run leaves the truth, which others take."""
    return tmp_path_factory.mktemp("out") / "scores"


def run(session, traces, out, capsys):
    """The exit code, what is printed, and the rows over all trials by camera."""
    code = cli.main(["score-traces", str(session), "--traces", str(traces), "--out", str(out)])
    rows = list(csv.DictReader((out / "trace_scores.csv").open())) if code < 2 else []
    return code, capsys.readouterr(), {row["camera"]: row for row in rows if not row["trial"]}


def test_traces_with_known_errors_have_their_scores(session, out, capsys):
    """They scatter by 0.3 px about what they are off by in all frames: 0.1 px, over 60 px. Sigmas of our own line: 0.08 px
    each."""
    code, printed, scores = run(session, BRING / "trials", out, capsys)
    assert code == 0
    assert scores.keys() == {"high", "low"}
    for camera, score in scores.items():
        assert f"{camera}: bias" in printed.out
        assert abs(float(score["bias_px"])) < 3.0 * float(score["bias_sigma_px"])
        assert float(score["scatter_px"]) == pytest.approx(0.3, abs=0.1)
        assert int(score["frames_without"]) == int(score["frames_elsewhere"]) == 0
        assert float(score["coverage_percent"]) > 85.0
    frames = list(csv.DictReader((out / "trace_frames.csv").open()))
    assert len(frames) == 26 and {frame["state"] for frame in frames} == {"near"}
    assert (out / "trace_scores.png").stat().st_size > 10_000


def test_a_shift_lost_frames_and_exchanged_lines_are_found(session, out, tmp_path, capsys):
    """The wire is line 0, a parallel one 12 px beside it line 1; from frame 9 they are exchanged; two frames are lost.
    The wire goes to the right, so that 2 px down is 2 px to the right of it, but for its slope."""
    rows = np.loadtxt(BRING / "trials" / TRIAL / "trace_high.csv", delimiter=",", skiprows=1)
    rows = rows[~np.isin(rows[:, 0], [3, 4])]
    wire = np.column_stack([rows + np.array([0, 0, 2.0]), np.zeros(len(rows))])
    other = np.column_stack([rows + np.array([0, 0, 14.0]), np.ones(len(rows))])
    both = np.concatenate([wire, other])
    both[:, 3] = np.where(both[:, 0] >= 9, 1 - both[:, 3], both[:, 3])
    folder = tmp_path / "traces" / TRIAL
    folder.mkdir(parents=True)
    head = "frame,u_px,v_px,line"
    np.savetxt(folder / "trace_high.csv", both, "%.6g", ",", header=head, comments="")
    code, printed, scores = run(session, tmp_path / "traces", out, capsys)
    assert code == 0 and scores.keys() == {"high"}
    score = scores["high"]
    assert float(score["bias_px"]) == pytest.approx(2.0, abs=0.3)
    assert score["frames_without"] == "2" and score["identity_mistakes"] == "4"
    assert "2 frames of 13 without a trace, 4 identity mistakes" in printed.out


def test_a_trace_of_something_else_scores_nothing_and_warns(session, out, tmp_path, capsys):
    rows = np.loadtxt(BRING / "trials" / TRIAL / "trace_high.csv", delimiter=",", skiprows=1)
    folder = tmp_path / TRIAL
    folder.mkdir()
    away = rows + np.array([0, 0, 60.0])
    np.savetxt(folder / "trace_high.csv", away, "%.6g", ",", header="frame,u_px,v_px", comments="")
    code, printed, scores = run(session, tmp_path, out, capsys)
    assert code == 1
    assert (
        "high: no line on the wire; 0 frames of 13 without a trace, 13 with one elsewhere"
        in printed.out
    )
    assert "13 of 13 frames have no line on the wire" in printed.err
    assert scores["high"]["bias_px"] == ""


def test_a_folder_without_traces_is_refused_in_a_line(session, out, tmp_path, capsys):
    (tmp_path / "somewhere").mkdir()
    code, printed, _ = run(session, tmp_path, out, capsys)
    assert code == 2
    wanted = f"holds no trace of a trial, such as {TRIAL}/trace_<camera>.csv; found somewhere"
    assert wanted in printed.err


def test_the_sigma_of_a_mean_counts_frames_that_are_alike(rng):
    """Of a series whose neighbours correlate by 0.6 the variance of the mean is four times that of independent frames."""

    def frames(values):
        return [FrameScore("t", 0, "c", k, "near", bias_px=v) for k, v in enumerate(values)]

    noise = rng.normal(size=4000)
    alike = [noise[0]]
    for step in noise[1:]:
        alike.append(0.6 * alike[-1] + 0.8 * step)
    _, independent_sigma = _mean_of_frames(frames(noise), lambda frame: frame.bias_px)
    _, alike_sigma = _mean_of_frames(frames(alike), lambda frame: frame.bias_px)
    assert independent_sigma == pytest.approx(1.0 / np.sqrt(4000), rel=0.1)
    assert alike_sigma == pytest.approx(2.0 / np.sqrt(4000), rel=0.15)


def test_identity_is_counted_within_each_trial():
    """Another number in another trial is no mistake: a tracker numbers anew."""
    scored = []
    for trial, lines in (("a", [0, 0, 1]), ("b", [5, 5, 5])):
        frames = [
            FrameScore(trial, 0, "c", k, "near", line, 1, 9.0, 0.1, 0.1)
            for k, line in enumerate(lines)
        ]
        points = {"c": (np.ones(3), np.full(3, 0.1))}
        scored.append(TrialScores(tuple(frames), points, {"c": True}))
    by_trial = {score.trial: score.identity_mistakes for score in _scores(scored)}
    assert by_trial == {"a": 1, "b": 0, "": 1}
