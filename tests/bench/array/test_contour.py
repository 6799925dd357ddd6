"""contour.csv: the built-in ring of whiskers round a sphere and a bar, from signals to the polygon about them."""

import numpy as np
import pytest

from bench import api
from bench.array.contour import CONTOUR
from bench.base.settings import Settings
from bench.rig.simulation import simulate
from bench.workflows.session_evaluation import evaluate

COUNT = 8
RADIUS_MM = 20.0


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ring")
    session = simulate(folder / "session", protocol="ring", seed=2)
    settings = Settings(figures=False)
    evaluate(session, folder / "out", settings, workers=0, announce=lambda text: None)
    return folder / "out"


def test_the_edges_touch_and_the_corners_stand_out_by_the_resolution(out):
    """Of a circle by eight lines: edges of 2 R tan π/8, corners R (1/cos π/8 − 1) outside; by noise 4 sigmas off."""
    table = api.read(out).table("contour")
    assert len(table) == 2 * COUNT and table.dtype.names == CONTOUR.names
    assert (np.abs(table["outside_mm"]) < 4 * table["across_sigma_mm"]).all()
    outside_mm = RADIUS_MM * (1 / np.cos(np.pi / COUNT) - 1)
    assert (np.abs(table["corner_outside_mm"] - outside_mm) < 4 * table["corner_sigma_mm"]).all()
    resolution_mm = 2 * RADIUS_MM * np.tan(np.pi / COUNT)
    assert table["resolution_mm"] == pytest.approx(resolution_mm, abs=0.05)


def test_the_summary_says_how_far_off_and_how_coarse(out):
    lines = (out / "summary.txt").read_text().split("Contour by touch alone")[1].splitlines()
    assert "bar_b00_v10: 8 edges of 16.6 mm" in lines[1] and "1.6 mm at corners" in lines[1]
    assert "contour.csv" in lines[0]
