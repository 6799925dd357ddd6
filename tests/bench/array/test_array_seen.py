"""An array in pictures, boards to verdict: each whisker's wire is its own, and its truth true."""

import re
import shutil

import numpy as np
import pytest

from bench import api
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.base.tables import sigma_name
from bench.report.score import truth_of
from bench.rig.simulation import simulate
from bench.session.array_view import load_views
from bench.workflows.session_evaluation import evaluate
from tests.scenes.results import codes
from tests.scenes.rig_sessions import protocol_file

# Two columns that stand before each other, one higher: their wires cross in both cameras' pictures.
PROTOCOL = """
name = "seen"
[[cameras]]
name = "high"
position_mm = [38.0, -175.0, 335.0]
focal_px = 1340.0
size_px = [853, 480]
[[cameras]]
name = "low"
position_mm = [98.0, -325.0, 120.0]
target_mm = [53.0, 7.0, 0.0]
roll_deg = 1.4
focal_px = 1290.0
size_px = [853, 480]
[board]
views = 6
[pictures]
step_deg = 0.8
[[columns]]
name = "a"
heights_mm = [0]
[[columns]]
name = "b"
base_mm = [0, -14, 6]
heights_mm = [0]
[[trials]]
beta_deg = 20
d_x_mm = 55
"""
QUIET = Settings(figures=False)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("array")
    return simulate(folder / "session", protocol=protocol_file(folder, PROTOCOL), seed=4)


@pytest.fixture(scope="module")
def out(session, tmp_path_factory):
    out = tmp_path_factory.mktemp("out")
    evaluate(session, out, QUIET, workers=0, announce=lambda _: None)
    return out


def test_each_whisker_has_a_truth_that_is_true(session, out):
    """Nothing is off by more than four stated sigmas; a wire that was the other's would be, by some hundreds."""
    rows, views = (
        api.read(out).table("whisks"),
        {view.base.name: view for view in load_views(session)},
    )
    assert rows["whisker"].tolist() == ["a1", "b1"]
    for row in rows:
        true = truth_of(views[row["whisker"]], row["trial"], 0)
        for name in ("d_x_mm", "touch_deg", "beta_deg"):
            assert abs(row[name] - true[name]) < 4.0 * row[sigma_name(name)], name
        assert row["d_x_sigma_mm"] < 0.3 and "wire_of_another" not in codes(
            out / "whiskers" / row["whisker"], row["trial"]
        )


def test_felt_contacts_lie_on_the_bar_that_is_seen(out):
    rows = api.read(out).table("surface")
    felt, seen = (rows[rows["estimator"] == name] for name in ("with_friction", "seen"))
    assert felt["surface_from"].tolist() == ["pictures", "pictures"] and len(seen) == 2
    assert (np.abs(felt["distance_mm"]) < 4 * felt["distance_sigma_mm"]).all()
    assert (np.abs(felt["along_mm"]) < 4 * felt["along_sigma_mm"]).all()
    assert not np.isfinite(seen["distance_mm"]).any()  # on that bar by its making


def test_cameras_are_calibrated_once(out):
    assert (out / "calibration" / "cameras.toml").is_file()
    assert not list(out.glob("whiskers/*/calibration/cameras.toml"))


@pytest.mark.slow
def test_results_do_not_hang_on_the_number_of_workers(session, out, tmp_path):
    evaluate(session, tmp_path, QUIET, workers=2, announce=lambda _: None)
    for name in ("whisks.csv", "estimates.csv", "surface.csv", "whiskers/b1/whisks.csv"):
        assert (tmp_path / name).read_bytes() == (out / name).read_bytes()


def test_pictures_without_a_place_are_refused(session, tmp_path):
    """Which of several wires turns about the origin nobody can tell."""
    copy = shutil.copytree(session, tmp_path / "session", ignore=shutil.ignore_patterns("*.jpg"))
    for picture in session.rglob("*.jpg"):
        (copy / picture.relative_to(session)).write_bytes(b"")
    text = (copy / "session.toml").read_text()
    (copy / "session.toml").write_text(
        re.sub(r"T_rig_board = \[.*?\n\]\n", "", text, flags=re.DOTALL)
    )
    with pytest.raises(BadInput, match="T_rig_board is missing; measure it, or bring"):
        load_views(copy)
