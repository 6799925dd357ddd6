"""Path-traced scenes through the command's whole way: light, shadows and rims that no rasterised picture has."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from bench.base.settings import Settings
from bench.base.tables import sigma_name
from bench.workflows.session_evaluation import evaluate
from tests.scenes.results import table

SCENES = Path(__file__).resolve().parents[2] / "fixtures" / "scenes"


@pytest.mark.parametrize("name", ["ring", pytest.param("lamp", marks=pytest.mark.slow)])
def test_a_scene_is_seen_within_what_it_states(name, tmp_path):
    """Three values and some eight slips that err alike: |z| beyond 3 once in a hundred such scenes.

    The truth lies outside of what is evaluated. So that no wide sigma passes, errors are below five times those of two
    cameras 20 degrees apart in docs/ladder.md (0.005 and 0.12 degrees, 0.003 mm of slip). That of d_x hangs on the bar's
    lines, and these bars have a rim as dark as the bench: it is below 0.1 mm, four times the median sigma there.
    """
    session = tmp_path / "session"
    shutil.copytree(SCENES / name, session, ignore=shutil.ignore_patterns("truth*"))
    evaluate(session, tmp_path / "out", Settings(), workers=1)
    truth = tomllib.loads((SCENES / name / "trials" / "w" / "truth.toml").read_text())
    (seen,) = table(tmp_path / "out" / "whisks.csv")
    for quantity, most in (("d_x_mm", 0.1), ("touch_deg", 0.025), ("beta_deg", 0.6)):
        error, sigma = float(seen[quantity]) - truth[quantity], float(seen[sigma_name(quantity)])
        assert abs(error) < min(most, 3 * sigma), (quantity, error, sigma)
    true = {
        row["frame"]: float(row["slip_mm"])
        for row in table(SCENES / name / "trials" / "w" / "truth.csv")
    }
    track = [row for row in table(tmp_path / "out" / "track" / "w.csv") if row["touching"] == "1"]
    errors = np.array([float(row["slip_mm"]) - true[row["frame"]] for row in track])
    assert np.all(np.abs(errors) < 3 * np.array([float(row["slip_sigma_mm"]) for row in track]))
    assert np.sqrt(np.mean(errors**2)) < 0.015
