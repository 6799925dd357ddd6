"""The interface of analyses: what each of ANALYSES keeps to, and that one more of them needs nothing else."""

from types import SimpleNamespace

import pytest

from bench.analyses.analysis import Analysis, Heading, PageTable
from bench.analyses.catalogue import ANALYSES
from bench.analyses.cells import whisk_cells
from bench.analyses.compared_estimate import ComparedEstimate
from bench.base.settings import Settings
from bench.base.tables import Column, Kind, Table
from bench.records.trial_result import EstimateRow
from bench.workflows.session_evaluation import evaluate
from tests.scenes.friction_results import WHISKER, result, run_of
from vision import UNKNOWN

COUNTS = Table("counts", "A row.", (Column("whisks", "how many", Kind.WHOLE),))
WITHOUT_MICROPHONE = SimpleNamespace(channels=("y_V", "z_V"))
TRIAL = SimpleNamespace(
    d_x_sigma_mm=0.1,
    object_velocity_mm_s=None,
    contact="",
    plane_turn_deg=0.0,
    signals_path=None,
    daq=WITHOUT_MICROPHONE,
)
SESSION = SimpleNamespace(whisker=WHISKER, trial=lambda name: TRIAL)


class Count(Analysis):
    """How many trials there are."""

    tables = (COUNTS,)
    heading = Heading("counts", "Trials counted (counts.csv)")

    def compute(self, run):
        return len(run.results)

    def rows(self, found):
        return {COUNTS: [{"whisks": found}]}

    def lines(self, found):
        yield f"{found} of them"

    def page_table(self, out):
        (row,) = COUNTS.read(out)
        return PageTable("Counted", COUNTS.file, ("trials",), ((str(row["whisks"]),),))


def names(analysis) -> str:
    return type(analysis).__name__


@pytest.mark.parametrize("analysis", ANALYSES, ids=names)
def test_what_is_written_is_declared(analysis, tmp_path):
    """Without a whisk only the tables of every run are there, and nothing is drawn or said."""
    run = run_of(session=SESSION)
    found = analysis.compute(run)
    analysis.write(tmp_path, found)
    declared = {table.file for table in analysis.tables} if analysis.in_every_run else set()
    assert {path.name for path in tmp_path.iterdir()} == declared
    assert list(analysis.lines(found)) == []
    assert analysis.draw(tmp_path, run) == []
    table = analysis.page_table(tmp_path)
    assert table is None or table.rows == ()


@pytest.mark.parametrize("analysis", ANALYSES, ids=names)
def test_rows_have_the_cells_of_their_tables(analysis):
    run = run_of(*(result(beta) for beta in (5.0, 40.0, 60.0)), session=SESSION)
    known = {name for one in analysis.tables for name in one.names}
    known |= set(whisk_cells(result(5.0), 0)) | set(
        ComparedEstimate(EstimateRow("", UNKNOWN), UNKNOWN).cells
    )
    for table, rows in analysis.rows(analysis.compute(run)).items():
        assert table.name in {declared.name for declared in analysis.tables}
        for row in rows:
            assert set(row) <= known


def test_an_analysis_is_computed_once_a_run():
    calls = []
    count = Count()
    count.compute = lambda run: calls.append(run) or len(run.results)
    run = run_of(result(40.0))
    assert [run.found(count), run.found(count)] == [1, 1] and calls == [run]
    assert run_of(result(40.0), result(60.0)).found(Count()) == 2


def test_files_and_figures_have_one_analysis_each():
    tables = [table.name for analysis in ANALYSES for table in analysis.tables]
    figures = [analysis.figure_name for analysis in ANALYSES if analysis.figure_name]
    assert len(set(tables)) == len(tables) and len(set(figures)) == len(figures)


def test_sections_of_one_code_have_one_title():
    headings = {analysis.heading for analysis in ANALYSES if analysis.heading is not None}
    assert len({heading.code for heading in headings}) == len(headings)


def test_one_more_analysis_is_in_all_that_a_run_writes(
    steel_signals, exact_vision, tmp_path, monkeypatch
):
    with_count = (*ANALYSES, Count())
    monkeypatch.setattr("bench.workflows.session_evaluation.ANALYSES", with_count)
    monkeypatch.setattr("bench.report.summary.compose.ANALYSES", with_count)
    monkeypatch.setattr("bench.report.page.write.ANALYSES", with_count)
    evaluate(steel_signals, tmp_path, Settings(figures=False), workers=0, announce=lambda text: 0)
    (row,) = COUNTS.read(tmp_path)
    line = f"{row['whisks']} of them"
    assert f"Trials counted (counts.csv)\n  {line}\n" in (tmp_path / "summary.txt").read_text()
    report = (tmp_path / "report.html").read_text()
    assert line in report and "<h3>Counted (counts.csv)</h3>" in report
