"""Figures: what is drawn is what was found, in the conventions' frame; and a figure is drawn once."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from bench.analyses.error_against_slope import error_against_slope
from bench.analyses.figure_8 import figure_8
from bench.analyses.surfaces import Felt, FittedSurface
from bench.base.drawing import is_drawn, save, style, svg_of
from bench.base.settings import Settings
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import (
    SeenTrial,
    SeenWhisk,
)
from bench.report.sensing_plane import contact_path, draw_sensing_plane
from bench.session.session import load_session
from bench.trials.estimate_errors import Judged
from estimator import slip
from estimator.beam import Beam
from estimator.friction import Pushes, fit_alpha
from tests.scenes.results import trial_result
from vision.truth.value import Value

C, THETA = 8835.7, np.radians(3.0)


def surface(name="steel", alpha_deg=10.5, slopes=(0, 20, 40, -60)) -> FittedSurface:
    beta = np.radians(slopes)
    m_y, m_z = slip.moments(60.0, THETA, beta, np.radians(alpha_deg), C)
    felt = tuple(
        Felt(
            b,
            60.0,
            THETA,
            y,
            z,
            np.zeros((0, 2)),
            m_y_sigma_Nmm=0.02,
            m_z_sigma_Nmm=0.02,
            phi_sigma_deg=0.2,
            nominal=False,
        )
        for b, y, z in zip(beta, m_y, m_z)
    )
    return FittedSurface(
        name, 10.0, felt, fit_alpha(Pushes(beta, m_y, m_z, 60.0, THETA, C)), Beam(C, 100.0)
    )


def judged(estimator, beta, error_percent, one_factor=False) -> Judged:
    return Judged(
        "t",
        0,
        "measure",
        "steel",
        10.0,
        estimator,
        beta,
        60.0,
        0.01,
        60.0 * (1 + error_percent / 100),
        0.3,
        one_factor,
    )


@pytest.fixture
def steep(exact_record, steel_signals):
    """The record of the whisk at 60° as perfect pictures would give it, read back."""
    record = exact_record(load_session(steel_signals).trial("b60_4"))
    return from_plain(SeenWhisk, json.loads(json.dumps(to_plain(record))))


def lines_of(axes) -> list[np.ndarray]:
    return [np.asarray(line.get_xydata(), dtype=float) for line in axes.get_lines()]


def test_fig_8_has_a_panel_pair_a_surface_with_points_on_the_curve():
    figure = figure_8([surface("steel"), surface("sandpaper", 23.0)])
    axes = [a for a in figure.axes if a.get_visible()]
    assert len(axes) == 4
    for top in axes[:2]:
        curve, points = (max(lines_of(top), key=len), next(a for a in lines_of(top) if len(a) == 4))
        assert np.interp(points[:, 0], *curve.T) == pytest.approx(points[:, 1], abs=2e-3)


@pytest.mark.parametrize("count", [1, 3, 4, 6])
def test_fig_8_hides_what_it_does_not_need(count):
    figure = figure_8([surface(f"s{k}") for k in range(count)])
    assert sum(a.get_visible() for a in figure.axes) == 2 * count


def test_predicted_error_of_2_and_10_are_those_of_13_and_14():
    """tan β tan φ at 60° and α = 10.5° is 204 %; (10) with the right α is 0."""
    everything = [judged("no_slip", 60.0, 204.0), judged("with_friction", 60.0, 0.0)]
    figure = error_against_slope(everything, [surface()], Settings(alpha_est_deg=10.5))
    whole, near = figure.axes
    drawn_deg = [float(points.get_offsets()[0, 0]) for points in whole.collections[1::2]]
    assert sorted(drawn_deg) == pytest.approx([59.6, 60.4])  # side by side, with their lines
    lines = [line for line in lines_of(whole) if len(line) > 100]
    predicted = [np.interp(at_deg, *line.T) for at_deg, line in zip(drawn_deg, lines)]
    expected = 100 * np.tan(np.radians(60.0)) * np.tan(np.radians(49.5))
    assert predicted == pytest.approx([expected, 0.0], abs=0.01)
    assert len([line for line in lines_of(near) if len(line) > 100]) == 1


def test_the_contacts_path_runs_from_p0_along_the_bar(steep):
    path = contact_path(steep)
    slope = np.degrees(np.arctan2(path[-1, 0] - path[0, 0], path[-1, 1] - path[0, 1]))
    assert slope == pytest.approx(60.2, abs=0.3)
    assert np.hypot(*path[-1]) == pytest.approx(3.880, abs=0.01)  # the slip of the last frame


def test_the_sensing_planes_triangle_closes(steep):
    """V lies at (d_x tan θ, 0) seen from P0 for a straight whisker: contact + (d_y, −d_z) must lead there."""
    at, beta_rad = steep.at, steep.beta_rad.value
    contact = at.slip_mm.value * np.array([np.sin(beta_rad), np.cos(beta_rad)])
    virtual = contact + np.array([at.d_y_mm.value, -at.d_z_mm.value])
    assert virtual == pytest.approx([steep.d_x_mm.value * np.tan(THETA), 0.0], abs=0.01)


def test_the_sensing_plane_can_be_drawn_for_either_side(steep):
    for sign in (1, -1):
        beta_rad = Value(sign * steep.beta_rad.value, steep.beta_rad.sigma)
        whisk = replace(steep, truth=replace(steep.truth, beta_rad=beta_rad))
        seen = SeenTrial((whisk,), bar_radius_mm=3.0, wire_radius_mm=0.5)
        axes = Figure().subplots()
        result = trial_result(seen)
        draw_sensing_plane(axes, result, whisk, (np.radians(10.5), "fitted"))
        assert axes.get_title(loc="left").startswith("t, whisk 0")


def test_a_figure_carries_the_hash_of_what_it_shows(tmp_path):
    path = tmp_path / "a" / "figure.png"
    assert not is_drawn(path, "x")
    save(Figure(figsize=(1, 1)), path, "x")
    assert is_drawn(path, "x") and not is_drawn(path, "y")
    path.write_bytes(b"no picture")
    assert not is_drawn(path, "x")


def test_the_line_of_figure_8_has_no_chords_on_the_page():
    """Of 329 points of a smooth curve a drawing that is simplified keeps a dozen."""
    with style():
        found = svg_of(figure_8([surface(alpha_deg=0.0)]), "fig8")
    paths = [path for path in re.findall(r' d="(M[^"]*)"', found) if path.count("L") > 8]
    assert max(path.count("L") for path in paths) > 60
