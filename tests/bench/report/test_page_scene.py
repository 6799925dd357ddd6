"""The rig in 3-D as numbers."""

import numpy as np
import pytest

from bench.report.page.rig_in_3d import _ellipsoid
from tests.scenes.results import seen_whisk
from vision.truth.value import Value


def test_the_ellipsoid_lies_along_its_own_axes():
    """A covariance with half-axes of 1, 2 and 3 µm along turned directions gives these back."""
    turn = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    half = np.array([1e-3, 2e-3, 3e-3])
    covariance = turn @ np.diag(half**2) @ turn.T
    point = Value(np.zeros(3), np.sqrt(np.diag(covariance)))
    axes = _ellipsoid(seen_whisk(point_mm=point, point_covariance_mm2=covariance))
    assert np.linalg.norm(axes, axis=1) == pytest.approx(half)
    assert axes.T @ axes == pytest.approx(covariance, abs=1e-15)


def test_without_a_covariance_it_lies_along_the_rigs():
    axes = _ellipsoid(seen_whisk(point_mm=Value(np.zeros(3), np.array([1.0, 2.0, 3.0]))))
    assert np.array_equal(axes, np.diag([1.0, 2.0, 3.0]))
