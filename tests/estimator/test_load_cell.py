"""Distance from force and moment: against the exact rod, term by term, and what it refuses."""

import numpy as np
import pytest

from estimator import load_cell
from estimator.beam import Beam
from tests.scenes.six_axes import beam_of, pushed

BEAM = Beam(8835.7, 100.0)
FELT = (1.2, 3.0, 0.004, 0.055, -0.021)  # m_y, m_z, f_x, f_y, f_z


def share(push, beam) -> float:
    """Error of d_x in parts of it."""
    felt = (*push.moment_Nmm, *push.force_N)
    return load_cell.distance(push.theta_rad, *felt, beam) / push.d_x_mm - 1


@pytest.mark.parametrize("shape", ["cylinder", "tapered", "cone"])
@pytest.mark.parametrize(
    "beta_deg, alpha_deg", [(0.0, 0.0), (0.0, 20.0), (30.0, 10.0), (60.0, 0.0), (60.0, 20.0)]
)
def test_no_slope_and_no_friction_enters(shape, beta_deg, alpha_deg):
    """A bar of no thickness: within θ⁴ / 6 of w/d, that is 1e-4 of a cone; friction along the whisker has no part."""
    push, beam = pushed(shape, beta_deg=beta_deg, alpha_deg=alpha_deg), beam_of(shape)
    left = 60.0 / beam.as_cylinder_mm(60.0)
    rolled = load_cell.rolling(push.theta_rad, 0.05 + 0.5 * left, np.radians(beta_deg), 60.0, left)
    assert share(push, beam) == pytest.approx(rolled, abs=1e-4)


def test_the_contact_rolls_over_a_thick_bar_and_moves_along_one_that_leans():
    """Together to 3e-5; each alone is ten times that and more."""
    thick, leaning = pushed(radius_mm=3.0), pushed(beta_deg=60.0, alpha_deg=10.0, psi_deg=5.0)
    assert share(thick, beam_of()) == pytest.approx(
        load_cell.rolling(thick.theta_rad, 3.5, 0.0, 60.0, 1.0), abs=3e-5
    )
    moved = load_cell.leaning(
        leaning.theta_rad, np.radians(5.0), np.radians(50.0), np.radians(10.0)
    )
    rolled = load_cell.rolling(leaning.theta_rad, 0.55, np.radians(60.0), 60.0, 1.0)
    assert moved > 3e-3
    assert share(leaning, beam_of()) == pytest.approx(moved + rolled, abs=3e-5)


def test_the_lever_is_short_by_friction_along_the_whisker():
    """|m|/|f|, held by 20° of friction: all of that acts along the whisker, cos 20° = 0.94."""
    push = pushed(alpha_deg=20.0)
    short = load_cell.lever(*push.moment_Nmm, *push.force_N) / push.d_x_mm
    assert short == pytest.approx(np.cos(np.radians(20)), abs=0.01)
    assert abs(share(push, beam_of())) < 1e-3


def test_the_gradient_is_that_of_the_distance():
    """Central differences of the leading term; of the whole, f_x and the deflection make a hundredth of difference."""
    by = load_cell.relative_gradient(FELT[0], FELT[1], FELT[3], FELT[4])
    for k in (0, 1, 3, 4):
        step = np.zeros(5)
        step[k] = 1e-5 * abs(FELT[k])
        ends = [
            load_cell.distance(0.05, *(np.array(FELT) + way * step), BEAM) for way in (1.0, -1.0)
        ]
        found = np.log(ends[0] / ends[1]) / (2 * step[k])
        assert by[k] == pytest.approx(found, rel=0.03, abs=0.03 * np.abs(by[k]).max())
    assert by[2] == 0.0


def test_arrays_and_scalars():
    one = load_cell.distance(0.05, *FELT, BEAM)
    both = load_cell.distance(np.array([0.05, 0.05]), *FELT, BEAM)
    assert isinstance(one, float) and both == pytest.approx([one, one])


@pytest.mark.parametrize(
    "felt, said",
    [
        ((0.0, -3.0, 0.0, 0.06, 0.0), "m_z is not positive"),
        ((0.0, 3.0, 0.0, -0.06, 0.0), "not the one that its moment asks for"),
        ((0.0, 3.0, np.nan, 0.06, 0.0), "missing"),
    ],
)
def test_what_is_no_push_has_no_distance(felt, said):
    assert np.isnan(load_cell.distance(0.05, *felt, BEAM)) and np.isnan(load_cell.lever(*felt))
    assert said in load_cell.why_not(*felt)
