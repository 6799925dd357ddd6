"""A session without a camera, its truth a stage's: the whole report, the robot's trade, comparison and check."""

import shutil
import tomllib
from pathlib import Path

import pytest
import tomli_w

from bench.base.exit_codes import DONE
from bench.base.settings import Settings
from bench.commands.cli import main
from bench.report.record import read_record
from bench.session.session import load_session
from bench.setup.lab import Lab
from bench.setup.new_session import new_session
from bench.workflows.session_evaluation import evaluate
from tests.scenes.results import codes, table

ROOT = Path(__file__).parents[3]
STAGE = ROOT / "fixtures" / "bring" / "stage"
FIGURES = {"fig8.png", "error_against_slope.png", "error_against_friction.png", "explained.png"}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The fixture, evaluated. Read only."""
    out = tmp_path_factory.mktemp("stage") / "out"
    assert evaluate(STAGE, out, Settings(), announce=lambda text: None) == DONE
    return out


def exact_d_x(trial: str) -> float:
    """Return the true distance of a trial of the fixture, mm, by its truth file."""
    return tomllib.loads((STAGE / "trials" / trial / "truth.toml").read_text())["d_x_mm"]


def test_a_stage_gives_a_verdict_and_all_figures(run):
    record = read_record(run)
    assert "the true distance is known by a stage for 6 of 6" in record.verdict[0]
    assert not any("No verdict" in line for line in record.verdict)
    assert set(record.figures) >= FIGURES
    assert record.warnings == () and not record.has_pictures
    page = (run / "report.html").read_text()
    assert "The truth is known by a stage for 6 of 6" in page
    assert page.count("The truth is a stage&#39;s.") >= len(FIGURES)
    assert "truth: stage" in page


def test_every_row_says_whose_the_truth_is(run):
    for name in ("whisks", "estimates"):
        rows = table(run / f"{name}.csv")
        assert rows and {row["truth_source"] for row in rows} == {"stage"}
    row = table(run / "whisks.csv")[0]
    assert row["slip_mm"] == row["touch_deg"] == row["cameras"].strip("0") == ""
    assert "are not seen" in row["status"]
    assert not (run / "stage_and_pictures.csv").exists()


def test_errors_are_those_of_the_exact_truth_within_the_stage_s_sigma(run):
    """An error by the stage less that by the exact distance is the stage's own error: z² of six is below the
    one in 10 000 quantile of χ², 27.9."""
    sigmas = {row["trial"]: float(row["d_x_sigma_mm"]) for row in table(run / "whisks.csv")}
    squares = 0.0
    for row in table(run / "estimates.csv"):
        if row["estimator"] == "with_friction":
            exact_error_mm = float(row["d_x_est_mm"]) - exact_d_x(row["trial"])
            difference_mm = float(row["error_mm"]) - exact_error_mm
            squares += (difference_mm / sigmas[row["trial"]]) ** 2
    assert 0.0 < squares < 27.9


def test_all_of_the_error_is_explained_by_friction_and_the_rest(run):
    for row in table(run / "explained.csv"):
        parts = float(row["by_alpha_mm"]) + float(row["remainder_mm"])
        assert parts == pytest.approx(float(row["error_mm"]), abs=1e-6)
        assert row["by_touch_mm"] == row["by_moments_mm"] == ""


def test_the_robot_s_trade_counts_from_touch_felt(run, capsys):
    assert main(["robot", str(STAGE), "--out", str(run), "--trials", "steel_b[02]*"]) == 0
    rows = table(run / "robot_trade.csv")
    assert rows and {row["truth_source"] for row in rows} == {"stage"}
    # 10°/s: a push of 1° takes 0.1 s.
    for row in rows:
        if row["push_deg"] == "1" and not row["cutoff_Hz"]:
            assert float(row["time_ms"]) >= 100.0


def test_runs_of_it_compare(run, tmp_path):
    again = tmp_path / "again"
    shutil.copytree(run, again)
    assert main(["compare", str(run), str(again)]) == 0


def test_check_finds_nothing_wrong_and_says_what_is(tmp_path, capsys):
    assert main(["check", str(STAGE)]) == 0
    bad = Path(shutil.copytree(STAGE, tmp_path / "bad", copy_function=shutil.copyfile))
    file = bad / "trials" / "steel_b60_v10" / "trial.toml"
    stated = tomllib.loads(file.read_text())
    file.write_text(tomli_w.dumps(stated | {"d_x_mm": 600.0}))
    capsys.readouterr()
    assert main(["check", str(bad)]) == 2
    said = capsys.readouterr().out
    assert "error: trials/steel_b60_v10/trial.toml: d_x_mm is 600" in said
    assert main(["evaluate", str(bad), "--out", str(tmp_path / "out")]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_a_new_session_for_a_stage_asks_for_no_board(tmp_path):
    asked = []

    def ask(question: str) -> str:
        asked.append(question)
        return ""

    lab = Lab.of({"truth": "stage"})
    lines = new_session(tmp_path / "s", "", lab, {}, ask)
    assert not any("board" in question for question in asked)
    assert any("stage's origin" in question for question in asked)
    assert {entry.name for entry in (tmp_path / "s").iterdir()} == {"session.toml", "trials"}
    assert "4 lines are to be filled in" in lines[1]  # the origin has an assumed sigma
    given = {
        "whisker_length_mm": 100.0,
        "whisker_diameter_mm": 1.0,
        "youngs_modulus_GPa": 60.0,
        "bar_diameter_mm": 6.0,
        "origin_sigma_mm": 0.1,
    }
    new_session(tmp_path / "t", "", lab, given)
    assert load_session(tmp_path / "t").truth.origin_sigma_mm == 0.1


OFF_MM = 3.0


@pytest.fixture
def with_pictures(steel_signals, tmp_path, exact_run, exact_vision):
    """A stage beside exact pictures, whose b60_4 stands 3 mm off: its folder, evaluated, and the results'."""
    session = Path(shutil.copytree(steel_signals, tmp_path / "session"))
    manifest = tomllib.loads((session / "session.toml").read_text())
    manifest["truth"] = {"source": "stage", "origin_sigma_mm": 0.1}
    (session / "session.toml").write_text(tomli_w.dumps(manifest))
    for trial in (session / "trials").iterdir():
        d_x_mm = tomllib.loads((trial / "truth.toml").read_text())["d_x_mm"] + 0.05
        stated = tomllib.loads((trial / "trial.toml").read_text())
        stated |= {"d_x_mm": d_x_mm + OFF_MM * (trial.name == "b60_4"), "d_x_sigma_mm": 0.05}
        (trial / "trial.toml").write_text(tomli_w.dumps(stated))
    out = tmp_path / "out"
    evaluate(session, out, Settings(figures=False), workers=0, announce=lambda text: None)
    return out


def test_a_stage_beside_pictures_is_compared_and_named_where_it_contradicts(
    with_pictures, exact_run
):
    rows = {row["trial"]: row for row in table(with_pictures / "stage_and_pictures.csv")}
    assert len(rows) == 5
    off = rows.pop("b60_4")
    assert float(off["d_x_difference_mm"]) == pytest.approx(OFF_MM + 0.05, abs=1e-3)
    # 0.05 and 0.1 mm of the stage; the pictures' own sigma is small beside it.
    assert float(off["z"]) == pytest.approx((OFF_MM + 0.05) / 0.112, rel=0.02)
    assert all(abs(float(row["z"])) < 1 and not row["status"] for row in rows.values())
    assert "stage_unlike_pictures" in codes(with_pictures, "b60_4")
    assert "stage_unlike_pictures" not in codes(with_pictures, "b30_3")
    verdict = read_record(with_pictures).verdict
    assert "speak against 1 of these" in verdict[0] and "1 left out for a warning" in " ".join(
        verdict
    )


def test_errors_by_the_stage_are_those_by_pictures_but_for_its_own(with_pictures, exact_run):
    """Gauges and moments are the same: errors differ by the stage's 0.05 mm, and slip and touch not at all."""
    by_stage = {row["trial"]: row for row in table(with_pictures / "whisks.csv")}
    by_pictures = {row["trial"]: row for row in table(exact_run / "whisks.csv")}
    for column in ("touch_deg", "slip_mm", "m_z_Nmm"):
        assert by_stage["b00_2"][column] == by_pictures["b00_2"][column] != ""
    errors = []
    for out in (with_pictures, exact_run):
        rows = table(out / "estimates.csv")
        rows = [row for row in rows if row["trial"] == "b00_2" and row["estimator"] == "no_slip"]
        errors.append(float(rows[0]["error_mm"]))
    assert errors[1] - errors[0] == pytest.approx(0.05, abs=1e-6)
