"""The bar's line in pictures whose truth is known (tests/ladder/bar_lines.py, at small size)."""

import numpy as np
from scipy.stats import chi2

from tests.ladder.bar_lines import SCENES, errors_and_sigmas

BARS = 4
# Once in a thousand right sigmas the RMS of z lies outside. A bar's two points share its shading: counted once.
Z_LOW, Z_HIGH = np.sqrt(chi2.ppf([0.0005, 0.9995], BARS) / BARS)


def measured(name: str, rng) -> tuple[np.ndarray, np.ndarray]:
    """Errors and stated sigmas (BARS, 2), px."""
    error, sigma = np.array([errors_and_sigmas(*SCENES[name], rng) for _ in range(BARS)]).swapaxes(0, 1)
    return error, sigma


def test_over_printed_squares_both_edges_are_told_to_a_fiftieth_of_a_pixel(rng):
    """RMS measured over twelve bars: 0.008 px; four bars of two points scatter by 25 %."""
    error, sigma = measured("painted, printed squares", rng)
    assert np.sqrt(np.mean(error**2)) < 0.02
    assert Z_LOW < np.sqrt(np.mean((error / sigma) ** 2)) < Z_HIGH


def test_before_an_even_wall_the_line_states_what_rims_and_position_share(rng):
    """There the rims' shading can stand in for a shift. RMS measured over twelve bars: 0.019 px."""
    error, sigma = measured("painted, flat background", rng)
    assert np.sqrt(np.mean(error**2)) < 0.04
    assert Z_LOW < np.sqrt(np.mean((error / sigma) ** 2)) < Z_HIGH
