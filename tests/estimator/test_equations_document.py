"""docs/equations.md names every equation, every function that it names is there, and its numbers are today's."""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest

from estimator import curvature, distance
from estimator.beam import Beam
from estimator.threshold import curved_error

TEXT = (Path(__file__).parents[2] / "docs" / "equations.md").read_text()


def table_after(heading):
    """Rows of numbers of the first table below a heading."""
    lines = TEXT.split(heading)[1].split("\n## ")[0].splitlines()
    rows = [line.strip("| ").split("|") for line in lines if line.startswith("|")][2:]
    return np.array([[float(cell) for cell in row] for row in rows])


def test_every_equation_has_a_row():
    rows = [line.split("|")[1] for line in TEXT.splitlines() if line.startswith("| (")]
    numbers = [int(n) for row in rows for n in re.findall(r"\((\d+)\)", row)]
    assert sorted(numbers) == list(range(1, 33))


def test_every_named_function_exists():
    names = re.findall(r"`(estimator\.\w+)\.(\w+)`", TEXT)
    assert len(names) > 25
    for module, name in names:
        assert callable(getattr(importlib.import_module(module), name))


def _cone_without_slip(theta, m):
    return Beam(9000.0, 100.0, "cone").distance_mm(9000.0 * theta / m)


def test_table_of_17():
    """A cone's moment without slip is Cθ (1/d_x − 1/L); slip leaves cos β / cos α of θ."""
    for alpha, beta, d_x, printed, scaled in table_after("## How far (17)"):
        theta, phi = np.radians(1.0), np.radians(max(0, beta - alpha))
        m = (
            9000.0
            * theta
            * np.cos(np.radians(beta))
            / np.cos(np.radians(alpha))
            * (1 / d_x - 1 / 100)
        )
        moments = (theta, m * np.sin(phi), m * np.cos(phi))
        found = distance.general_printed(*moments, _cone_without_slip)
        assert found == pytest.approx(printed, abs=0.05)
        found = distance.general(*moments, np.radians(alpha), _cone_without_slip)
        assert found == pytest.approx(scaled, abs=0.05)


def test_table_of_appendix_b():
    for r_n, *angles, phi_printed, phi, error_printed, error in table_after(
        "## How far Appendix B"
    ):
        theta, alpha, beta = np.radians(angles)
        for form, expected, expected_error in (
            (curvature.printed, phi_printed, error_printed),
            (curvature.exact, phi, error),
        ):
            found, _ = form(r_n, theta, beta, alpha)
            assert np.degrees(found) == pytest.approx(expected, abs=0.005)
            error_of_10 = 100 * curved_error(beta, alpha, r_n, theta, form)
            assert error_of_10 == pytest.approx(expected_error, abs=0.005)
