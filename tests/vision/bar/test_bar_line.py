"""The bar's line in pictures whose truth is known (tests/ladder/bar_lines.py, at small size)."""

import numpy as np

from tests.ladder.bar_lines import SCENES, errors_and_sigmas
from vision.fit.problem import BAR_OFFSET_PX, BAR_TILT_PX


def test_over_printed_squares_both_edges_are_told_to_a_fiftieth_of_a_pixel(rng):
    """RMS measured over eight bars: 0.010 px, stated 0.007; three bars of two points scatter by 30 %."""
    error, _ = np.array([errors_and_sigmas(*SCENES["painted, printed squares"], rng) for _ in range(3)]).swapaxes(0, 1)
    assert np.sqrt(np.mean(error**2)) < 0.02


def test_before_an_even_wall_the_fit_prices_what_rims_and_position_share(rng):
    """There the rims' shading can stand in for a shift: 0.06 to 0.09 px, of which the line itself states a third."""
    error, sigma = errors_and_sigmas(*SCENES["painted, flat background"], rng)
    priced = np.sqrt(sigma**2 + BAR_OFFSET_PX**2 + BAR_TILT_PX**2)  # as vision.fit.solve adds them at its two points
    assert np.all(np.abs(error) < 3 * priced)
