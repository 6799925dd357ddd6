"""The unloaded whisker's shape as a lab states it: a curvature, or a table of traced points."""

import re
import shutil

import numpy as np
import pytest
from scipy.integrate import quad

from bench.base.input_problems import InputProblems
from bench.session.session import load_session
from bench.session.session_check import checked_session
from tests.scenes.refusals import refusal
from tests.scenes.rig_sessions import state_of_whisker
from vision.geometry import as_reason
from vision.geometry.centreline import centrelines

LENGTH_MM = 100.0  # of the sample's whisker


@pytest.fixture
def session(steel_signals, tmp_path):
    """A session without pictures, to be changed."""
    return shutil.copytree(steel_signals, tmp_path / "session", copy_function=shutil.copyfile)


def trace(session, points: np.ndarray, header: str = "x_mm,y_mm,z_mm") -> None:
    """Write points (n, 3) to rest.csv, and name it in session.toml."""
    rows = [",".join(f"{value:.6f}" for value in point) for point in points]
    (session / "rest.csv").write_text("\n".join([header, *rows]) + "\n")
    state_of_whisker(session, 'rest_shape = "rest.csv"')


def spiral(arc_mm: float) -> tuple[float, float]:
    """Angle of the tangent (to y) and its slope to z: an Euler spiral that also leans."""
    return 1.0 * (arc_mm / LENGTH_MM) ** 2, 0.1 * arc_mm / LENGTH_MM


def spiral_point(arc_mm: float) -> np.ndarray:
    """The point (3,) of the spiral at an arc length, by quadrature."""

    def along(component):
        return quad(lambda s: component(*spiral(s)), 0.0, arc_mm, epsabs=1e-11)[0]

    return np.array(
        [
            along(lambda turn, z: np.cos(turn) * np.sqrt(1 - z**2)),
            along(lambda turn, z: np.sin(turn) * np.sqrt(1 - z**2)),
            along(lambda turn, z: z),
        ]
    )


def seen_points(session, arc_mm: np.ndarray) -> np.ndarray:
    """Points (n, 3) of the unbent whisker as vision takes it."""
    wire = load_session(session).whisker.wire
    curve = centrelines(np.zeros((2, 4)), np.zeros(2), LENGTH_MM, 0.0, wire)
    return curve.at(arc_mm)[0]


def test_a_traced_spiral_is_the_wire_that_vision_sees(session):
    """An Euler spiral to 57°, which no polynomial is: within 0.03 mm of 100 (3e-4), the stated part."""
    arc = np.linspace(0.0, LENGTH_MM, 26)
    points = np.array([spiral_point(s) for s in arc])
    trace(session, points)
    assert np.abs(seen_points(session, arc) - points).max() < 0.03


def test_noise_of_tracing_does_not_lengthen_the_whisker(session):
    """A chord over each of 400 steps of 0.25 mm would add 2·0.05²/0.25² / 2 = 4 % to the length."""
    arc = np.linspace(0.0, LENGTH_MM, 401)
    points = np.array([spiral_point(s) for s in arc])
    noisy = points + np.random.default_rng(1).normal(0, [0.0, 0.05, 0.05], points.shape)
    trace(session, noisy)
    assert np.abs(seen_points(session, arc) - points).max() < 0.06


def test_a_stated_curvature_is_an_arc(session):
    """y = κ s²/2; what goes aside is lost forward: x = s − κ² s³/6 but for κ⁴ s⁵/40 = 3e-4 mm."""
    state_of_whisker(session, "rest_curvature_per_mm = [0.002, -0.001]")
    tip = seen_points(session, np.array([LENGTH_MM]))[0]
    assert tip[1:] == pytest.approx([10.0, -5.0], abs=1e-9)
    kappa = np.hypot(0.002, 0.001)
    assert tip[0] == pytest.approx(100 - kappa**2 * 100**3 / 6 - kappa**4 * 100**5 / 40, abs=1e-3)


def test_nothing_stated_is_straight(session):
    assert seen_points(session, np.array([LENGTH_MM]))[0] == pytest.approx([100.0, 0.0, 0.0])


STRAIGHT = np.linspace([0.0, 0.0, 0.0], [100.0, 0.0, 0.0], 11)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda p: p[1:], r"rest.csv, row 2: the first point is 10 mm from the base"),
        (
            lambda p: p[[0, 1, 3, 2, *range(4, 11)]],
            r"rest.csv, row 5, column x_mm: goes back from 30",
        ),
        (
            lambda p: 1.1 * p,
            r"rest.csv: the points go to an arc length of 110 mm, length_mm is 100",
        ),
        (
            lambda p: 1000 * p,
            r"rest.csv, row 3, column x_mm: 10000; far beyond .*Are the points in mm\?",
        ),
        (lambda p: p[:9], r"arc length of 80 mm, length_mm is 100; 90 % of the whisker or more"),
        (lambda p: p[:4], r"rest.csv: has 4 points; 6 or more are needed"),
        (
            lambda p: p + np.outer(np.arange(11) == 5, [0, 8, 0]),
            r"rest.csv, row 7: lies \d\.\d+ mm beside the smooth curve",
        ),
        (
            lambda p: 0.1 * p + np.outer(np.linspace(0, 1, 11), [0, 95, 0]),
            r"rest.csv: the whisker turns by more than 60°",
        ),
    ],
)
def test_a_fault_of_the_trace_is_named_by_its_row(session, change, expected):
    trace(session, change(STRAIGHT))
    assert re.search(expected, refusal(session))


def test_text_in_a_number_is_named_by_its_cell(session):
    trace(session, STRAIGHT)
    file = session / "rest.csv"
    file.write_text(file.read_text().replace("30.000000", "thirty"))
    assert "rest.csv, row 5, column x_mm: 'thirty' is not a finite number" in refusal(session)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ('rest_shape = "rest.csv"', "there is no such file beside session.toml"),
        (f'rest_shape = "{"x" * 5000}"', "there is no such file beside session.toml"),
        ('rest_shape = "../rest.csv"', "there is no such file beside session.toml"),
        ("rest_curvature_per_mm = [0.02, 0.0]", "turn by more than 60° from its base"),
        ("rest_curvature_per_mm = [6.0, 0.0]", "Is it in 1/m? Then write 0.006."),
        ("rest_curvature_per_mm = [0.001]", "[whisker] rest_curvature_per_mm"),
    ],
)
def test_a_fault_of_the_keys_is_one_line(session, line, expected):
    state_of_whisker(session, line)
    assert expected in refusal(session)


def test_a_shape_is_stated_once(session):
    trace(session, STRAIGHT)
    state_of_whisker(session, "rest_curvature_per_mm = [0.001, 0.0]")
    assert "give either rest_curvature_per_mm or rest_shape" in refusal(session)


@pytest.mark.parametrize(("curvature", "said"), [([0.002, -0.001], True), ([0.0005, 0.0], False)])
def test_a_curved_whisker_is_said_to_be_taken_as_straight(session, curvature, said):
    """0.36 · 0.224² = 1.8 % of d_x at the tip, and 0.36 · 0.05² = 0.09 %, which is nothing beside noise."""
    state_of_whisker(session, f"rest_curvature_per_mm = {curvature}")
    problems = InputProblems()
    checked_session(session, problems)
    found = [line for line in problems.warnings if as_reason(line).codes == ("whisker_curved",)]
    assert len(found) == said
    assert all("turns by 13° up to its tip" in line and "1.8 %" in line for line in found)
