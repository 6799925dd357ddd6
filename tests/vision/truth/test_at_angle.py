"""What frames scatter about the fit at a wanted angle."""

import numpy as np
import pytest

from vision.truth.at_angle import Smooth, _unfitted, expected_scatter

THETA_RAD = np.radians(np.arange(0.5, 6.0, 0.5))


def frames(covariance: np.ndarray, slip: np.ndarray) -> Smooth:
    """Each frame's slip is one of the parameters."""
    size = len(THETA_RAD)
    return Smooth(THETA_RAD, np.zeros(size), {"slip": slip}, {"slip": np.eye(size)}, covariance)


@pytest.mark.parametrize("shared", [0.0, 0.8])
def test_scatter_expected_is_that_of_draws(shared):
    """RMS over 4000 draws of a mean square with 4 degrees of freedom: known to 1 %, four times that. What all frames
    share is no scatter."""
    size, rng = len(THETA_RAD), np.random.default_rng(2)
    covariance = 0.01**2 * ((1.0 - shared) * np.eye(size) + shared * np.ones((size, size)))
    draws = rng.multivariate_normal(np.zeros(size), covariance, size=4000)
    seen = [_unfitted(frames(covariance, 0.3 * THETA_RAD**2 + one), "slip", np.radians(3.0)) for one in draws]
    expected = expected_scatter(frames(covariance, draws[0]), "slip", np.radians(3.0))
    assert np.sqrt(np.mean(np.square(seen))) == pytest.approx(expected, rel=0.04)
    assert expected == pytest.approx(0.01 * np.sqrt(1.0 - shared))
