"""A warning of the session that speaks against numbers stands with each of them, and nowhere else."""

import json
from dataclasses import replace

import numpy as np
import pytest

from bench.analyses.estimator_accuracy import RunAccuracy
from bench.base.input_problems import InputProblems
from bench.base.settings import Settings
from bench.base.statuses import STATUSES, cure_of, reason
from bench.gauges.matrix import FROM_FILE, FROM_TRIALS, GaugeCalibration, GaugeMatrix
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenTrial
from bench.report.summary.verdict import verdict
from bench.report.summary.warning_lines import whisk_warnings
from bench.trials.contradictions import (
    against_estimates,
    contradicted,
    contradictions_alone,
    contradictions_of,
)
from bench.workflows.session_evaluation import evaluate
from tests.scenes.results import codes, seen_whisk, table, trial_result
from vision.geometry.reasons import NO_REASON, Reason
from vision.truth.value import Value

MISPLACED = Reason("board_misplaced", "board and free stroke disagree")
COPIED = reason("signals_copied", names="a, b", file="signals.csv")
HARMLESS = Reason("camera_unused", "camera far has no pictures")


def problems_with(*warnings, trials=()) -> InputProblems:
    problems = InputProblems()
    for warning in warnings:
        problems.warn(warning, trials)
    return problems


def known(number: int = 0):
    return seen_whisk(number, d_x_mm=Value(60.0, 0.02))


def test_a_warning_of_the_session_is_every_trials_and_one_of_trials_theirs_alone():
    problems = problems_with(HARMLESS, MISPLACED)
    problems.warn(COPIED, ["a", "b"])
    assert contradictions_of(problems, "a").codes == ("board_misplaced", "signals_copied")
    assert contradictions_of(problems, "c").codes == ("board_misplaced",)


def test_a_whisker_of_an_array_has_what_reaches_its_numbers_and_no_more():
    problems = problems_with(HARMLESS, COPIED, trials=["a", "b"])
    kept = contradictions_alone(problems)
    assert kept.warnings == [COPIED]
    assert contradictions_of(kept, "a") == COPIED and not contradictions_of(kept, "c")


def test_each_whisk_with_a_truth_has_what_speaks_against_it():
    trial = contradicted(SeenTrial((known(), seen_whisk(1))), MISPLACED)
    with_truth, without = trial.whisks
    assert with_truth.status == MISPLACED and with_truth.contradicted
    assert not without.status and not without.contradicted


def test_what_reaches_no_truth_leaves_the_trial_as_it_is():
    trial = SeenTrial((known(),))
    assert contradicted(trial, HARMLESS) is trial and contradicted(trial, NO_REASON) is trial


def test_estimates_by_gauges_of_these_pictures_rest_on_them():
    brought = GaugeCalibration(GaugeMatrix(np.eye(2)), FROM_FILE)
    fitted = replace(brought, source=FROM_TRIALS)
    unseen = seen_whisk()
    assert against_estimates(MISPLACED, fitted, unseen) == MISPLACED
    assert not against_estimates(MISPLACED, brought, unseen)
    assert against_estimates(COPIED, brought, unseen) == COPIED
    (seen,) = contradicted(SeenTrial((known(),)), MISPLACED).whisks
    assert not against_estimates(MISPLACED, fitted, seen)  # the whisk has it once


def compared(status: Reason):
    """Return the result of a trial of one whisk, with an estimate, and a status of its truth."""
    row = EstimateRow("with_friction", Value(61.0, 2.0))
    return trial_result([replace(known(), status=status)], [FeltWhisk(estimates=(row,))])


def test_the_verdict_is_withheld_with_cause_and_cure():
    results = [compared(MISPLACED)]
    first, *_, last = verdict("s", True, RunAccuracy.of_results(results), Settings(), 1)
    assert "to ± 0.02 mm, but warnings speak against it" in first
    assert last.startswith("No verdict on the estimators: all whisks have warnings")
    assert MISPLACED in last and cure_of(["board_misplaced"]) in last


def test_the_verdict_of_some_says_which_others_warnings_speak_against():
    results = [compared(MISPLACED), compared(NO_REASON)]
    first, *_, last = verdict("s", True, RunAccuracy.of_results(results), Settings(), 1)
    assert f"but warnings speak against 1 of these ({MISPLACED})" in first
    assert last.startswith("Use (10)")


def test_a_warning_of_the_session_is_said_once():
    results = [compared(MISPLACED), compared(MISPLACED)]
    assert not list(whisk_warnings(results, [MISPLACED]))
    assert len(list(whisk_warnings(results))) == 1


@pytest.mark.parametrize("code", ["camera_unused", "surface_unused", "speed_unlike_stated"])
def test_what_is_harmless_reaches_no_number(code):
    assert not STATUSES[code].reaches


@pytest.mark.parametrize("code", ["board_misplaced", "rig_file_contradicts"])
def test_a_rig_in_two_places_reaches_the_truth(code):
    assert "truth" in STATUSES[code].reaches


@pytest.mark.parametrize(
    ("said", "doubtful"), [(MISPLACED, True), (HARMLESS, False)], ids=["misplaced", "harmless"]
)
def test_a_run_has_it_in_json_and_csv_and_judges_no_estimator(
    steel_signals, exact_vision, tmp_path, monkeypatch, said, doubtful
):
    def place(session, calibration, units, pool, problems):
        problems.warn(said)
        return calibration

    monkeypatch.setattr("bench.trials.of_session.place_rig", place)
    announced = []
    names = {"b60_4", "gauge_roll0", "gauge_roll90"}
    arguments = {"announce": announced.append, "trials": names, "workers": 0}
    code = evaluate(steel_signals, tmp_path, Settings(figures=False), **arguments)
    assert code == 1
    assert ("board_misplaced" in codes(tmp_path, "b60_4")) == doubtful
    (row,) = (row for row in table(tmp_path / "whisks.csv") if row["trial"] == "b60_4")
    assert (said in row["status"]) == doubtful
    record = json.loads((tmp_path / "run.json").read_text())
    assert record["warnings"].count(said) == 1
    assert ("No verdict on the estimators: all whisks have warnings" in announced[0]) == doubtful
