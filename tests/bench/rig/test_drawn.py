"""Bar and whisker are drawn where truth says."""

import json
import math
import tomllib

import cv2
import numpy as np
import pytest

from bench.rig.simulation import simulate
from tests.scenes.rig_sessions import bar_of, protocol_file, rows

EVENLY_LIT = """
name = "even"
[[cameras]]
name = "left"
position_mm = [30.0, -150.0, 320.0]
focal_px = 2010.0
[[cameras]]
name = "right"
position_mm = [100.0, -300.0, 90.0]
focal_px = 1932.0
[board]
views = 1
[pictures]
read_noise = 0
shot_noise = 0
grain = 0
vignetting = 0
format = "png"
[light]
lamp = 0
soft = 1
paper = 0.02
ink = 0.02
floor = 0.02
wall = 0.02
wire_matt = 0.6
wire_shiny = 0
wire_rim = 0
bar_matt = 0.3
bar_shiny = 0
bar_rim = 0
[[trials]]
beta_deg = 30
psi_deg = 6
"""


@pytest.mark.slow
def test_the_drawn_bar_and_whisker_are_where_truth_says(tmp_path):
    """End to end, from truth's numbers alone: both edges of the bar to 0.15 px, and the whisker's tone at the
    contact.
    """
    session = simulate(tmp_path / "s", protocol=protocol_file(tmp_path, EVENLY_LIT), seed=2)
    (folder,) = (session / "trials").iterdir()
    contact = np.array([float(rows(folder / "truth.csv")[-1][k]) for k in ("x_mm", "y_mm", "z_mm")])
    axis, _, foot = bar_of(tomllib.loads((folder / "truth.toml").read_text()), both_radii_mm=3.5)
    for name, camera in json.loads((session / "truth.json").read_text())["cameras"].items():
        picture = cv2.imread(str(folder / name / "000012.png"), cv2.IMREAD_UNCHANGED).astype(
            np.float32
        )
        eye = -np.array(camera["R"]).T @ np.array(camera["t"])
        for up in (-14.0, 14.0):
            edges = [project(camera, e) for e in silhouette(foot + up * axis, axis, 3.0, eye)]
            assert half_heights(picture, *edges) == pytest.approx([0.0, 0.0], abs=0.15)
        column, row = np.round(project(camera, contact)).astype(int)
        assert picture[row, column] > 120  # the whisker's tone is 0.6 of 255, the bar's 0.3


def project(camera, point):
    lens = np.array(camera["K"]), np.array(camera["dist"])
    turn, points = (
        cv2.Rodrigues(np.array(camera["R"]))[0],
        np.asarray(point, float).reshape(1, 1, 3),
    )
    return cv2.projectPoints(points, turn, np.array(camera["t"]), *lens)[0].ravel()


def silhouette(point, axis, radius, eye):
    """Points of a cylinder where the view grazes it, at the height of a point of its axis."""
    towards = eye - point - ((eye - point) @ axis) * axis
    near = np.linalg.norm(towards)
    facing, aside = towards / near, np.cross(axis, towards / near)
    cos = radius / near
    return [
        point + radius * (cos * facing + way * math.sqrt(1 - cos**2) * aside) for way in (-1, 1)
    ]


def half_heights(picture, first, second):
    """How far from each of two edges the picture rises through half its step, along the line through both."""
    across = (second - first) / np.linalg.norm(second - first)
    steps, found = np.arange(-5, 5.01, 0.05), []
    for edge, way in ((first, 1), (second, -1)):
        x, y = (edge + steps[:, None] * way * across).T.astype(np.float32)[:, :, None]
        line = cv2.remap(picture, x, y, cv2.INTER_CUBIC).ravel()
        found.append(float(np.interp(0.5 * (line[:20].mean() + line[-20:].mean()), line, steps)))
    return found
