"""An array from its signals to its verdict: each whisker's run is what its own session would give."""

import re
import shutil
import tomllib

import numpy as np
import pytest

from bench import api
from bench.api import ArrayRun, Run
from bench.array.compare_arrays import compare_arrays
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.report.compare_runs import compare_runs
from bench.report.video import write_video
from bench.rig.simulation import simulate
from bench.session.array_view import load_views
from bench.session.signals import forward_strokes, read_signals
from bench.trials.stated_truth import stated_whisk
from bench.workflows.preflight import check
from bench.workflows.session_evaluation import evaluate
from tests.scenes.rig_sessions import protocol_file

PROTOCOL = """
name = "two"
[[columns]]
heights_mm = [0, 9]
length_mm = [100, 90]
[[trials]]
beta_deg = 30
"""
QUIET = Settings(figures=False)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("array")
    return simulate(
        folder / "session", protocol=protocol_file(folder, PROTOCOL), seed=3, signals_only=True
    )


@pytest.fixture(scope="module")
def out(session, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    evaluate(session, out, QUIET, workers=0, announce=lambda _: None)
    return out


def test_each_row_names_its_whisker(out):
    run = api.read(out)
    assert isinstance(run, ArrayRun) and list(run.whiskers) == ["w1", "w2"] and not run.has_warnings
    assert isinstance(run.whiskers["w2"], Run)
    assert run.table("whisks")["whisker"].tolist() == ["w1", "w2"]
    for name in run.whiskers:
        mine = run.table("estimates")
        mine = mine[mine["whisker"] == name]
        np.testing.assert_array_equal(
            mine["d_x_est_mm"], run.whiskers[name].estimates["d_x_est_mm"]
        )
    with pytest.raises(KeyError):
        run.table("beam")


def test_felt_contacts_lie_on_the_bar(out):
    """The rig's bar, by the manifest: nothing is off by more than four stated sigmas, across and along."""
    rows = api.read(out).table("surface")
    rows = rows[rows["estimator"] == "with_friction"]
    assert rows["surface_from"].tolist() == ["manifest", "manifest"]
    assert (np.abs(rows["distance_mm"]) < 4 * rows["distance_sigma_mm"]).all()
    assert (np.abs(rows["along_mm"]) < 4 * rows["along_sigma_mm"]).all()
    assert (rows["normal_off_deg"] < 4 * rows["normal_sigma_deg"]).all()
    summary = (out / "summary.txt").read_text()
    assert summary.startswith("Surface by (10) with friction: 2 contacts felt by 2 whiskers lie")
    assert (
        "Score against the truth files" in summary
        and '<a href="whiskers/w2/report.html">' in (out / "report.html").read_text()
    )


def test_a_stage_s_place_is_the_truth_of_each_whisker(session, tmp_path):
    """By the object of the manifest and each base: within three of the sigmas that these have."""
    stated = shutil.copytree(session, tmp_path / "session", copy_function=shutil.copyfile)
    manifest = stated / "session.toml"
    manifest.write_text(f'{manifest.read_text()}\n[truth]\nsource = "stage"\n')
    for view in load_views(stated):
        (trial,) = view.trials
        signals = read_signals(trial)
        truth = stated_whisk(view, trial, signals, forward_strokes(signals)[0]).truth
        true_mm = tomllib.loads(trial.own("truth.toml").read_text())["d_x_mm"]
        assert abs(truth.d_x_mm.value - true_mm) < 3.0 * truth.d_x_mm.sigma < 3.0
    text = re.sub(r"axis = \[[^\]]*\]\n", "", (trial.folder / "trial.toml").read_text())
    (trial.folder / "trial.toml").write_text(f"beta_deg = 30.0\n{text}")
    with pytest.raises(
        BadInput, match="beta_deg is one whisker's slope; of an array write axis of"
    ):
        load_views(stated)


def test_a_whisker_of_an_array_gives_what_its_own_session_gives(session, out, tmp_path):
    """Byte for byte: its columns under their usual names, its tables as [whisker] and [gauges]."""
    alone = tmp_path / "alone"
    shutil.copytree(session, alone)
    text = (alone / "session.toml").read_text()
    keys = tomllib.loads(text)["whiskers"][1]
    assert keys["name"] == "w2"
    head, _, table = text.split("[[whiskers]]\n")[0], *text.split("[[whiskers]]\n")[1:]
    table = re.sub(r"name = .*\nbase_mm = \[[^]]*\]\nbase_deg = \[[^]]*\]\n", "", table)
    (alone / "session.toml").write_text(
        head + "[whisker]\n" + table.replace("[whiskers.gauges]", "[gauges]")
    )
    (signals,) = alone.glob("trials/*/signals.csv")
    rows = [line.split(",") for line in signals.read_text().splitlines()]
    signals.write_text(
        "\n".join(",".join([*row[:2], *row[4:]]) for row in rows).replace("@w2", "") + "\n"
    )
    evaluate(alone, tmp_path / "out", QUIET, workers=0, announce=lambda _: None)
    for name in ("whisks.csv", "estimates.csv", "against_theta.csv"):
        assert (tmp_path / "out" / name).read_bytes() == (
            out / "whiskers" / "w2" / name
        ).read_bytes()


def test_the_report_is_made_again_of_the_runs_alone(out):
    before = {
        name: (out / name).read_bytes()
        for name in ("report.html", "summary.txt", "surface.csv", "array.json")
    }
    (out / "surface.csv").unlink()
    assert out / "report.html" in api.report(out)
    assert {name: (out / name).read_bytes() for name in before} == before


def test_verbs_of_one_run_ask_for_one_whisker(out):
    several = "is of several whiskers; give the folder of one of them"
    with pytest.raises(BadInput, match=several):
        compare_runs([out / "whiskers" / "w1", out], None)
    with pytest.raises(BadInput, match=several):
        write_video(out, "steel_b30_v10")


def test_arrays_are_compared_whisker_by_whisker(out, tmp_path):
    again = tmp_path / "again"
    shutil.copytree(out, again)
    lines, code = compare_arrays([out, again], tmp_path / "changes.csv")
    assert code == 0 and sum("1 whisks in both" in line for line in lines) == 2
    assert (tmp_path / "changes@w2.csv").is_file()
    with pytest.raises(BadInput, match="is no array's run"):
        compare_arrays([out, out / "whiskers" / "w1"], None)


def test_check_takes_arrays(session, capsys):
    assert check(session) == 0
    assert "two, 2 whiskers: 1 trial, no error, no warning" in capsys.readouterr().out
