"""The whole path on a session whose truth is known exactly, so that what is tested is the bench and not vision."""

import json
import shutil
import sys
from dataclasses import replace

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.base.statuses import reason
from bench.base.workers import DIED, Workers
from bench.report.whisk_tables import ESTIMATES, TRACK, WHISKS
from bench.trials.trial_evaluation import evaluate_unit
from bench.workflows.session_evaluation import evaluate
from tests.faults.interrupted import contents, full_disk
from tests.scenes.results import codes, seen_whisk, table

TRUE_ALPHA = Settings(alpha_est_deg=10.5)


def run(session, out, settings=TRUE_ALPHA, workers=0) -> int:
    return evaluate(session, out, settings, workers=workers)


def estimates(out) -> dict[tuple[str, str], dict]:
    return {(row["trial"], row["estimator"]): row for row in table(out / "estimates.csv")}


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory):
    """A function that evaluates the sample session with exact vision once, for all tests of this module."""
    return tmp_path_factory.mktemp("exact")


@pytest.fixture
def steel(steel_signals, exact_vision, evaluated):
    """Folder of the finished results of the sample session."""
    if not (evaluated / "summary.txt").exists():
        run(steel_signals, evaluated)
    return evaluated


def test_tables_have_the_columns_of_the_format_in_their_order(steel):
    """Names are what other people's scripts rely on, so they stand here as in the format's description."""
    first = "trial,whisk,surface,speed_deg_s,beta_nominal_deg,theta_deg,angle_from,touch_deg,touch_sigma_deg,touch_felt_deg"
    assert ",".join(WHISKS.names).startswith(first)
    assert WHISKS.names[-10:] == (
        "x_mm",
        "x_sigma_mm",
        "y_mm",
        "y_sigma_mm",
        "z_mm",
        "z_sigma_mm",
        "cameras",
        "frames_used",
        "looked",
        "status",
    )
    for name, columns in (
        ("whisks", WHISKS.names),
        ("estimates", ESTIMATES.names),
        ("track/b60_4", TRACK.names),
    ):
        assert (steel / f"{name}.csv").read_text().splitlines()[0] == ",".join(columns)


def test_every_whisk_has_its_row(steel, steel_signals):
    trials = sorted(path.name for path in (steel_signals / "trials").iterdir())
    assert [row["trial"] for row in table(steel / "whisks.csv")] == trials
    assert len(table(steel / "track" / "b60_4.csv")) == 13


def test_10_with_the_right_friction_angle(steel):
    """1.5 % for slopes up to 30°, 4 % at 60°, where an error of 1° in φ is 3 % (equations.md, sensitivity of (10))."""
    rows = estimates(steel)
    for trial, percent in (("b00_2", 1.5), ("b30_3", 1.5), ("b60_4", 4.0)):
        assert abs(float(rows[trial, "with_friction"]["error_percent"])) < percent


def test_stated_sigma_of_10_holds_its_error(steel):
    for trial in ("b00_2", "b30_3", "b60_4"):
        row = estimates(steel)[trial, "with_friction"]
        assert abs(float(row["error_mm"])) < 3 * float(row["d_x_est_sigma_mm"])


def test_2_is_wrong_by_what_13_predicts(steel):
    """(2)/d_x = cos α/(cos β cos φ): 1.204 at 30°."""
    ratio = 1 + float(estimates(steel)["b30_3", "no_slip"]["error_percent"]) / 100
    assert ratio == pytest.approx(1.204, rel=0.04)


def test_one_gauge_factor_a_channel_costs_five_per_cent_at_60_degrees(steel):
    answers = json.loads((steel / "trials" / "b60_4.json").read_text())["felt"]["whisks"][0][
        "one_factor"
    ]
    d_x = next(a["d_x_est_mm"] for a in answers if a["estimator"] == "with_friction")
    assert 3.0 < 100 * (d_x / 64.949086 - 1) < 7.0


def test_no_gauge_trial_is_judged_by_gauges_fitted_to_it(steel):
    rows = {row["trial"]: row for row in table(steel / "whisks.csv")}
    for trial in ("gauge_roll0", "gauge_roll90"):
        assert rows[trial]["m_z_Nmm"] == "" and "own_gauges" in codes(steel, trial)
        assert (trial, "with_friction") not in estimates(steel)


def test_summary_gives_the_verdict_first(steel):
    lines = (steel / "summary.txt").read_text().splitlines()
    assert "the true distance is" in lines[0]
    assert lines[1].startswith("Equation (2) no slip assumes") and "RMS" in lines[1]
    verdict = lines[: lines.index("")]
    assert len(verdict) <= 12 and any(line.startswith("Use ") for line in verdict)


def test_the_figures_are_there(steel):
    names = {path.relative_to(steel).as_posix() for path in steel.rglob("*.png")}
    assert {
        "fig8.png",
        "error_against_slope.png",
        "planes/b60_4_0.png",
        "planes/gauge_roll0_0.png",
    } <= names


def test_a_second_run_looks_at_nothing_again_and_changes_no_byte(
    small_copy, exact_vision, tmp_path
):
    out = tmp_path / "out"
    code = run(small_copy, out)
    before = contents(out)
    exact_vision.clear()
    assert run(small_copy, out) == code
    assert exact_vision == []
    assert contents(out) == before


def test_only_the_trial_that_changed_is_looked_at_again(small_copy, exact_vision, tmp_path):
    out = tmp_path / "out"
    run(small_copy, out)
    exact_vision.clear()
    signals = small_copy / "trials" / "b30_3" / "signals.csv"
    lines = signals.read_text().splitlines()
    signals.write_text("\n".join(lines[:-20]) + "\n")
    run(small_copy, out)
    assert exact_vision == ["b30_3"]


def test_another_friction_angle_costs_no_look_at_the_pictures(small_copy, exact_vision, tmp_path):
    out = tmp_path / "out"
    run(small_copy, out)
    before = estimates(out)["b60_4", "with_friction"]
    exact_vision.clear()
    run(small_copy, out, Settings(alpha_est_deg=20.0))
    after = estimates(out)["b60_4", "with_friction"]
    assert exact_vision == []
    assert (before["alpha_est_deg"], after["alpha_est_deg"]) == ("10.5", "20")
    assert float(after["d_x_est_mm"]) < float(before["d_x_est_mm"])


def test_truth_files_change_no_result(small_copy, exact_vision, tmp_path):
    """The finished tables are the same to the byte whatever truth.json says."""
    run(small_copy, tmp_path / "with")
    (small_copy / "truth.json").write_text("{}")
    run(small_copy, tmp_path / "without")
    for name in ("whisks.csv", "estimates.csv"):
        assert (tmp_path / "with" / name).read_bytes() == (tmp_path / "without" / name).read_bytes()


def test_an_interrupted_run_goes_on_where_it_stopped(
    small_copy, exact_vision, tmp_path, monkeypatch
):
    """Ctrl-C in the third trial: what is finished stands whole, nothing else is there, and is not done again."""
    from bench.trials import trial_evaluation

    out, done = tmp_path / "out", []
    finished = trial_evaluation.write_result

    def stop_at_third(path, result):
        done.append(path.name)
        if len(done) == 4:
            raise KeyboardInterrupt
        finished(path, result)

    monkeypatch.setattr(trial_evaluation, "write_result", stop_at_third)
    with pytest.raises(KeyboardInterrupt):
        run(small_copy, out)
    assert len(list(out.glob("trials/*"))) == 1 and not (out / "whisks.csv").exists()
    monkeypatch.setattr(trial_evaluation, "write_result", finished)
    exact_vision.clear()
    run(small_copy, out)
    assert len(exact_vision) == 1 and len(table(out / "whisks.csv")) == 4


def test_a_session_without_pictures_is_evaluated_without_truth(without_pictures, tmp_path):
    out = tmp_path / "out"
    assert run(without_pictures, out) == 0
    rows = table(out / "whisks.csv")
    assert all(
        row["d_x_mm"] == "" and row["status"] == reason("no_pictures") and row["cameras"] == "0"
        for row in rows
    )
    assert estimates(out)["b30_3", "with_friction"]["error_mm"] == ""
    assert float(estimates(out)["b30_3", "with_friction"]["d_x_est_mm"]) == pytest.approx(
        55.258, rel=0.015
    )
    assert reason("no_pictures") in (out / "summary.txt").read_text()


def test_a_whisker_that_never_touches_is_a_row_with_a_status(without_pictures, tmp_path):
    """The stroke cut off before touch: nothing felt, no number, and the other trials go on."""
    signals = without_pictures / "trials" / "b30_3" / "signals.csv"
    signals.write_text("\n".join(signals.read_text().splitlines()[:280]) + "\n")
    frames = without_pictures / "trials" / "b30_3" / "frames.csv"
    frames.write_text("\n".join(frames.read_text().splitlines()[:4]) + "\n")
    out = tmp_path / "out"
    assert run(without_pictures, out) == 1
    row = next(row for row in table(out / "whisks.csv") if row["trial"] == "b30_3")
    assert "no_rise" in codes(out, "b30_3") and row["touch_felt_deg"] == "" and row["m_z_Nmm"] == ""
    assert ("b60_4", "with_friction") in estimates(out)


def test_several_whisks_of_a_recording_each_have_a_row(without_pictures, tmp_path):
    """The same stroke three times, the motor going back between: three rows with the same numbers."""
    folder = without_pictures / "trials" / "b60_4"
    header, *lines = (folder / "signals.csv").read_text().splitlines()
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    back = rows[::-1].copy()
    back[:, 0], once = rows[:, 0] + rows[-1, 0] + 0.0005, 2 * (rows[-1, 0] + 0.0005)
    cycle = np.concatenate([rows, back])
    whole = np.concatenate([cycle + np.array([k * once, 0, 0, 0]) for k in range(3)])
    np.savetxt(folder / "signals.csv", whole, "%.6f", ",", header=header, comments="")
    out = tmp_path / "out"
    run(without_pictures, out)
    felt = [row for row in table(out / "whisks.csv") if row["trial"] == "b60_4"]
    assert [row["whisk"] for row in felt] == ["0", "1", "2"]
    touches = [float(row["touch_felt_deg"]) for row in felt]
    assert (
        np.ptp(touches) < 0.02
    )  # the ends of neighbouring strokes touch, so that a few samples differ


def test_without_gauges_the_truth_still_stands(small_copy, exact_vision, tmp_path):
    """One gauge trial alone fixes one column of the matrix: no estimate, and the summary says what to record."""
    shutil.rmtree(small_copy / "trials" / "gauge_roll90")
    out = tmp_path / "out"
    assert run(small_copy, out) == 1
    rows = {row["trial"]: row for row in table(out / "whisks.csv")}
    assert (
        float(rows["b60_4"]["d_x_mm"]) == pytest.approx(64.949, abs=1e-3)
        and rows["b60_4"]["m_z_Nmm"] == ""
    )
    assert "turned by 90°" in (out / "summary.txt").read_text()


def test_gauge_trials_without_truth_say_what_it_lacks(
    small_copy, exact_vision, tmp_path, monkeypatch
):
    """The verdict hangs on them: what their pictures lack stands beside what to record, and another way out."""
    seen = sys.modules["bench.trials.truth_source"].see_trial

    def see(inputs, *rest):
        found = seen(inputs, *rest)
        dark = tuple(
            seen_whisk(whisk.whisk, "the bar stands in the dark") for whisk in found.whisks
        )
        return replace(found, whisks=dark) if inputs.trial.purpose == "gauge" else found

    monkeypatch.setattr("bench.trials.truth_source.see_trial", see)
    for name in ("gauge_roll0", "gauge_roll90"):
        path = small_copy / "trials" / name / "trial.toml"
        path.write_text(
            "\n".join(
                line for line in path.read_text().splitlines() if not line.startswith("d_x_mm")
            )
        )
    run(small_copy, tmp_path / "out")
    said = (tmp_path / "out" / "summary.txt").read_text()
    assert (
        "gauge_roll0 has no truth: the bar stands in the dark; gauge_roll90 has no truth: the bar"
        in said
    )
    assert "or let the other trials serve: --gauges-from-all" in said


def test_all_trials_serve_where_one_asks_for_it(steel_signals, exact_vision, tmp_path):
    """Without a follicle turned by 90 degrees there was no verdict. Each trial is judged by the others' gauges."""
    session, out = shutil.copytree(steel_signals, tmp_path / "session"), tmp_path / "out"
    shutil.rmtree(session / "trials" / "gauge_roll90")
    run(session, out, Settings(alpha_est_deg=10.5, gauges_from_all=True))
    said, rows = (out / "summary.txt").read_text(), estimates(out)
    assert (
        "(2) no slip assumes" in said
        and "from all trials that can serve (--gauges-from-all)" in said
    )
    assert "are judged, each by gauges fitted without it" in said
    for trial in ("b30_3", "b60_4"):
        assert abs(float(rows[trial, "with_friction"]["error_percent"])) < 3.0
        whisk = json.loads((out / "trials" / f"{trial}.json").read_text())["felt"]["whisks"][0]
        assert whisk["one_factor"] == []  # these factors are of all trials, its own too
    without, alone = tmp_path / "without", tmp_path / "alone"
    shutil.copytree(session, without, ignore=shutil.ignore_patterns("b30_3"))
    run(without, alone, Settings(alpha_est_deg=10.5, gauges_from_all=True))
    moments = [
        {row["trial"]: row for row in table(folder / "whisks.csv")} for folder in (out, alone)
    ]
    assert (
        "b30_3" not in moments[1]
        and moments[0]["b60_4"]["m_z_Nmm"] != moments[1]["b60_4"]["m_z_Nmm"]
    )


def test_estimators_of_ones_own_stand_beside_the_others(without_pictures, tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(
        "from estimator.whisk import Estimate\n\n\ndef half_way(whisk, settings):\n"
        "    return Estimate(whisk.beam.length_mm / 2, 1.0)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    run(without_pictures, tmp_path / "out", Settings(estimators=("mine:half_way",)))
    assert estimates(tmp_path / "out")["b30_3", "mine:half_way"]["d_x_est_mm"] == "50"
    with pytest.raises(BadInput, match="mine:no_such"):
        run(without_pictures, tmp_path / "out", Settings(estimators=("mine:no_such",)))


def test_two_runs_never_write_to_one_folder(without_pictures, tmp_path):
    from bench.base.atomic import lock_output

    with lock_output(tmp_path / "out"), pytest.raises(BadInput, match="another run"):
        run(without_pictures, tmp_path / "out")


def test_any_number_of_workers_gives_the_same_bytes(without_pictures, tmp_path):
    for workers in (1, 2):
        run(without_pictures, tmp_path / str(workers), workers=workers)
    for name in ("whisks.csv", "estimates.csv", "summary.txt", "fig8.png"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


def test_a_trial_whose_process_dies_is_told_and_tried_again(
    without_pictures, tmp_path, monkeypatch
):
    """The others have their results; a second run comes to what it would have been."""

    def b30_dies(_, job, tasks):
        for place, task in enumerate(tasks):
            lost = job is evaluate_unit and task.trial.name == "b30_3"
            yield place, DIED if lost else job(task)

    plain = replace(TRUE_ALPHA, figures=False)
    run(without_pictures, tmp_path / "never", plain)
    with monkeypatch.context() as patched:
        patched.setattr(Workers, "_finished", b30_dies)
        assert run(without_pictures, tmp_path / "out", plain) == 1
    rows = {row["trial"]: row for row in table(tmp_path / "out" / "whisks.csv")}
    assert "trial_lost" in codes(tmp_path / "out", "b30_3") and not rows["b30_3"]["d_x_mm"]
    assert (
        "trial_lost" not in codes(tmp_path / "out", "b60_4")
        and "died 3 times" in (tmp_path / "out" / "summary.txt").read_text()
    )
    run(without_pictures, tmp_path / "out", plain)
    assert (tmp_path / "out" / "summary.txt").read_bytes() == (
        tmp_path / "never" / "summary.txt"
    ).read_bytes()


@pytest.mark.slow
def test_a_full_disk_leaves_what_stood_and_is_gone_on_from(without_pictures, tmp_path):
    """At places all over a run with another setting: each file is the old one or the new one, and the file that could
    not be written is named."""
    plain, out = replace(TRUE_ALPHA, figures=False), tmp_path / "out"
    changed, kept = replace(plain, alpha_est_deg=20.0), []
    run(without_pictures, out, plain)
    old = contents(out)
    for first in (0, 2, 4, 8):
        with full_disk(first), pytest.raises(OSError, match=str(out)):
            run(without_pictures, out, changed)
        kept.append(contents(out))
    run(without_pictures, out, changed)
    new = contents(out)
    assert new != old
    assert all(data in (old.get(name), new[name]) for one in kept for name, data in one.items())
    run(without_pictures, tmp_path / "at once", changed)
    assert {**contents(tmp_path / "at once"), ".session": new[".session"]} == new
