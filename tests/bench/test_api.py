"""The Python interface: its examples work as shown, its tables are those of the files."""

import doctest
from inspect import signature

import numpy as np
import pytest

from bench import api
from bench.analyses.soft import COMPLIANCE
from bench.base.errors import BadInput
from bench.base.tables import Kind
from bench.report.whisk_tables import WHISKS


def test_the_examples_are_right(without_pictures, tmp_path):
    out = tmp_path / "out"
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    names = vars(api) | {"session": str(without_pictures), "out": str(out)}
    example = doctest.DocTestParser().get_doctest(api.__doc__, names, "bench.api", None, 0)
    assert len(example.examples) >= 7
    found = []
    doctest.DocTestRunner(optionflags=flags).run(example, out=found.append)
    assert not found, "".join(found)


def test_tables_are_those_of_the_files(exact_run):
    run = api.read(exact_run)
    for name in api.TABLES:
        table = run.table(name)
        lines = (exact_run / f"{name}.csv").read_text().splitlines()
        declared = COMPLIANCE if name == "compliance" else api.TABLES[name]
        assert table.dtype.names == tuple(lines[0].split(",")) == declared.names
        assert len(table) == len(lines) - 1 - (name == "explained")  # whose last row is a mean
        letters = {Kind.NUMBER: "f", Kind.WHOLE: "i", Kind.TEXT: "U", Kind.SENTENCE: "U"}
        for column in declared.columns:
            assert table.dtype[column.name].kind == letters[column.kind]
    row = run.whisks[run.whisks["trial"] == "b60_4"][0]
    assert row["d_x_mm"] == pytest.approx(64.949086, abs=1e-5) and np.isnan(
        run.estimates["beta_est_deg"][0]
    )
    assert (
        len(run.track("b60_4"))
        == len((exact_run / "track" / "b60_4.csv").read_text().splitlines()) - 1
    )


def test_how_hard_pictures_were_looked_at_is_text(tmp_path):
    row = {"trial": "b60_4", "whisk": 0, "cameras": 2, "frames_used": 11, "looked": "standard"}
    WHISKS.write(tmp_path, [row])
    assert WHISKS.read(tmp_path)["looked"].tolist() == ["standard"]


def test_a_script_of_ones_own_starts_no_process_that_would_read_it_again():
    """A process that is spawned imports the script that asks for it, and would evaluate there, too."""
    for verb in (api.evaluate, api.plan):
        assert signature(verb).parameters["workers"].default == 0


def test_what_is_not_there_is_named(exact_run, tmp_path):
    run = api.read(exact_run)
    with pytest.raises(KeyError, match="b60_4"):
        run.track("no_such_trial")
    with pytest.raises(KeyError, match="whisks"):
        run.table("truth")
    with pytest.raises(BadInput, match=r"run\.json"):
        api.read(tmp_path)


def test_a_damaged_table_is_one_line(tmp_path):
    for text in ("", "trial,whisk\nb,one\n", "trial,whisk\nb\n"):
        (tmp_path / "whisks.csv").write_text(text)
        with pytest.raises(BadInput, match="evaluate the session again"):
            WHISKS.read(tmp_path)


def test_figures_are_matplotlibs(exact_run):
    figures = api.read(exact_run).figures()
    assert set(figures) == {
        "fig8",
        "error_against_slope",
        "error_against_friction",
        "explained",
        "error_map",
        "against_theta",
    }
    assert all(figure.axes for figure in figures.values())
