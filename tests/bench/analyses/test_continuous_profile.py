"""profile.csv: the sweeps of the built-in protocol, evaluated and held against what the rig did."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest

from bench.analyses.continuous_profile import (
    PROFILE,
    ContinuousProfile,
    ProfilePoint,
    interpolated_mm,
)
from bench.base.settings import Settings
from bench.rig.protocol import FOLDER
from bench.rig.simulation import simulate
from bench.workflows.session_evaluation import evaluate
from tests.scenes.rig_sessions import protocol_file
from vision import Value

SWEEP = (FOLDER / "sweep.toml").read_text()


def evaluated(tmp_path, text):
    """Folder of the evaluated session of a protocol."""
    session = simulate(tmp_path / "sweep", protocol=protocol_file(tmp_path, text), seed=4)
    settings = Settings(figures=False)
    evaluate(session, tmp_path / "out", settings, workers=0, announce=lambda text: None)
    return tmp_path / "out"


def rows(out) -> list[dict]:
    return list(csv.DictReader((out / PROFILE.file).read_text().splitlines()))


def column(table, name) -> np.ndarray:
    return np.array([float(row[name]) for row in table])


def test_contacts_through_sweeps_are_those_of_the_pictures(tmp_path, exact_vision):
    """Of 18 angles of 4 sweeps: none beyond 4 sigmas. Between frames 0.25° apart a contact is off by less than 1 µm."""
    table = rows(evaluated(tmp_path, SWEEP.replace("stage = true", "")))
    assert tuple(table[0]) == PROFILE.names and len(table) == 72
    for name in "xyz":
        z = column(table, f"error_{name}_mm") / column(table, f"{name}_est_sigma_mm")
        assert np.abs(z).max() < 4.0
    far = [row for row in table if float(row["theta_deg"]) >= 5.0]
    assert np.abs(column(far, "error_x_mm")).max() < 0.5
    assert np.abs(column(far, "error_y_mm")).max() < 0.1
    sphere = column([row for row in far if row["trial"].startswith("sphere")], "x_est_mm")
    assert sphere[0] - sphere[-1] > 3.0  # it rolls over the sphere towards the base
    summary = (tmp_path / "out" / "summary.txt").read_text()
    assert "edge_b00_v10, whisk 0: 18 contacts up to 20°" in summary and "off by" in summary


def test_without_pictures_the_score_alone_knows_the_contacts(tmp_path):
    out = evaluated(
        tmp_path, SWEEP.split("[[trials]]")[0] + "[[trials]]" + SWEEP.split("[[trials]]")[2]
    )
    assert {row["error_x_mm"] for row in rows(out)} == {""}
    scores = [
        line for line in (out / "summary.txt").read_text().splitlines() if ", profile" in line
    ]
    assert [line.split()[0] for line in scores] == ["x_est_mm,", "y_est_mm,", "z_est_mm,"]
    assert all(float(line.split()[-1]) < 4.0 for line in scores)


def test_a_session_without_a_load_cell_has_no_profile(tmp_path):
    text = SWEEP.replace("[load_cell]", "").split("[[trials]]")
    assert not (evaluated(tmp_path, "[[trials]]".join(text[:2])) / PROFILE.file).exists()


def point(trial: str, x_mm: float, status: str = "") -> ProfilePoint:
    """A point of a profile at x, of which one millimetre is known."""
    result = SimpleNamespace(trial=SimpleNamespace(name=trial))
    place = Value(np.array([x_mm, 1.0, 0.0]), np.ones(3))
    return ProfilePoint(result, 0, 0.1, 0.1, place, np.full(3, np.nan), status)


def test_the_figure_has_a_line_a_whisk_and_no_more_names_than_fit():
    few = [point("a", 1.0), point("a", 2.0), point("b", 3.0), point("c", 4.0, "no contact")]
    drawing = ContinuousProfile().figure(few)
    assert [len(each.get_xdata()) for each in drawing.axes[0].get_lines()] == [2, 1]
    assert [text.get_text() for text in drawing.legends[0].get_texts()] == ["a", "b"]
    assert not ContinuousProfile().figure([point(str(number), 1.0) for number in range(13)]).legends
    assert ContinuousProfile().figure([point("c", 4.0, "no contact")]) is None


def test_between_frames_a_contact_is_interpolated_and_beyond_them_it_is_none():
    points = np.array([[0.0, 1.0, 2.0], [2.0, 1.0, 4.0]])
    assert interpolated_mm(0.5, np.array([0.0, 1.0]), points) == pytest.approx([1.0, 1.0, 3.0])
    assert np.isnan(interpolated_mm(1.5, np.array([0.0, 1.0]), points)).all()
