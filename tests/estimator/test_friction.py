"""α from the moments: unbiased, with an interval that holds the truth as often as it says."""

import numpy as np
import pytest

from estimator import friction, friction_ways, slip
from estimator.friction import AT_ZERO, NEVER_SLIPPED, Pushes, curves, fit_alpha
from estimator.friction_ways import ONE_SIDED, alpha_from_tilts, confidence

pytestmark = pytest.mark.filterwarnings("error")

D_X, THETA, C = 50.0, np.radians(3.0), 8835.7
RUNS = 2000
SLOPES = np.radians(np.arange(0, 80, 5))


def noisy_moments(beta, alpha, noise, rng):
    """Moments of RUNS experiments with 1 % noise: of each moment, or of the largest one; and its sigma."""
    m_y, m_z = slip.moments(D_X, THETA, beta, alpha, C)
    sigmas = [
        0.01 * (np.abs(m) if noise == "of each" else np.full(m.shape, m_z.max()))
        for m in (m_y, m_z)
    ]
    drawn = [m + s * rng.normal(size=(RUNS, len(beta))) for m, s in zip((m_y, m_z), sigmas)]
    return drawn, sigmas


def coverage(fit, alpha):
    return np.mean((fit.low_rad <= alpha) & (alpha <= fit.high_rad))


@pytest.mark.parametrize("alpha_deg", [10.5, 23.3])
@pytest.mark.parametrize("noise", ["of each", "of the largest"])
def test_interval_holds_the_true_angle_in_95_percent(alpha_deg, noise):
    """One row of 16 slopes, its noise known: 93–97 % of 2000 is four times its own scatter of 0.5 %."""
    alpha = np.radians(alpha_deg)
    (m_y, m_z), (sigma_y, sigma_z) = noisy_moments(SLOPES, alpha, noise, np.random.default_rng(5))
    fit = fit_alpha(Pushes(SLOPES, m_y, m_z, D_X, THETA, C, sigma_y=sigma_y, sigma_z=sigma_z))
    assert 0.93 <= coverage(fit, alpha) <= 0.97
    assert fit.alpha_rad.mean() == pytest.approx(
        alpha, abs=4 * fit.sigma_rad.mean() / np.sqrt(RUNS) + 1e-5
    )
    assert fit.alpha_rad.std() == pytest.approx(
        np.sqrt((fit.sigma_rad**2).mean()), rel=4 / np.sqrt(2 * RUNS)
    )


@pytest.mark.parametrize("noise", ["of each", "of the largest"])
@pytest.mark.parametrize("whisks", [1, 10])
def test_interval_holds_it_with_the_noise_found_from_the_residuals(noise, whisks):
    """The protocol's ten whisks a slope, and a single one."""
    alpha = np.radians(12.3)
    beta = np.repeat(SLOPES, whisks)
    (m_y, m_z), _ = noisy_moments(beta, alpha, noise, np.random.default_rng(6))
    fit = fit_alpha(Pushes(beta, m_y, m_z, D_X, THETA, C))
    assert 0.93 <= coverage(fit, alpha) <= 0.97


def test_interval_holds_it_where_each_slope_is_set_up_once():
    """Ten whisks a slope that share 0.4° of slope and 0.7 % of distance, beside 0.5 % of their own. Counted one by one
    they would promise too much: √10 of the sigma."""
    alpha, rng, runs = np.radians(18.7), np.random.default_rng(8), (400, len(SLOPES))
    recording = np.repeat(np.arange(len(SLOPES)), 10)
    beta = SLOPES + np.radians(0.4) * rng.normal(size=runs)
    d_x = D_X * (1 + 0.007 * rng.normal(size=runs))
    moments = slip.moments(d_x[:, recording], THETA, beta[:, recording], alpha, C)
    m_y, m_z = (m * (1 + 0.005 * rng.normal(size=m.shape)) for m in moments)
    together = fit_alpha(Pushes(SLOPES[recording], m_y, m_z, D_X, THETA, C, recording=recording))
    apart = fit_alpha(Pushes(SLOPES[recording], m_y, m_z, D_X, THETA, C))
    assert (
        0.91 <= coverage(together, alpha) <= 0.98
    )  # 400 runs are good to 1.1 %; few slopes weigh most
    assert coverage(apart, alpha) < 0.7


def test_a_recording_of_one_point_each_differs_by_the_pairing_of_its_moments():
    """m_y and m_z of a whisk share its slope's error; with independent noise the two sigmas agree on average."""
    (m_y, m_z), _ = noisy_moments(SLOPES, 0.2, "of the largest", np.random.default_rng(9))
    plain = fit_alpha(Pushes(SLOPES, m_y, m_z, D_X, THETA, C))
    paired = fit_alpha(Pushes(SLOPES, m_y, m_z, D_X, THETA, C, recording=np.arange(len(SLOPES))))
    assert paired.alpha_rad == pytest.approx(plain.alpha_rad)
    assert np.sqrt((paired.sigma_rad**2).mean()) == pytest.approx(
        np.sqrt((plain.sigma_rad**2).mean()), rel=0.03
    )


@pytest.mark.parametrize("alpha_deg", [4.0, 10.0, 18.7, 40.0])
def test_exact_moments_give_the_angle_back(alpha_deg):
    """A parabola's vertex is exact but for rounding."""
    m_y, m_z = slip.moments(D_X, THETA, SLOPES, np.radians(alpha_deg), C)
    fit = fit_alpha(Pushes(SLOPES, m_y, m_z, D_X, THETA, C))
    assert fit.alpha_rad == pytest.approx(np.radians(alpha_deg), abs=1e-12)
    assert fit.status == ""
    assert type(fit.alpha_rad) is float


def test_mirrored_slopes_and_own_distances_fit_alike():
    beta = np.concatenate([SLOPES, -SLOPES])
    d_x, theta = np.linspace(40, 60, beta.size), np.linspace(0.04, 0.06, beta.size)
    m_y, m_z = slip.moments(d_x, theta, beta, 0.2, C)
    assert fit_alpha(Pushes(beta, m_y, m_z, d_x, theta, C)).alpha_rad == pytest.approx(
        0.2, abs=1e-6
    )


def test_the_fit_finds_the_least_sum_of_squares_of_a_fine_grid():
    """Drawn sets of few slopes, with large noise: several minima, at slopes and at the bounds."""
    rng = np.random.default_rng(11)
    grid = np.radians(np.arange(0.0, 85.0, 0.05))
    for count in range(2, 14):
        beta = np.radians(rng.uniform(-20, 80, count))
        data = rng.normal(size=2 * count)
        observed = friction._Observed(beta, data, np.ones(count))
        least = observed.cost(observed.best_alpha())
        assert least <= observed.cost(grid).min() * (1 + 1e-12)


def test_derivative_is_the_difference():
    """Central differences of step 1e-6 are good to 1e-9 of the moments."""
    nothing = np.zeros(2 * len(SLOPES))
    observed = friction._Observed(SLOPES, nothing, np.ones(len(SLOPES)))
    above, below = (-observed.residuals(0.2 + step) for step in (1e-6, -1e-6))
    np.testing.assert_allclose(observed.derivative(0.2), (above - below) / 2e-6, atol=1e-9)


def test_curves_are_those_of_figure_8():
    m_y, m_z = slip.moments(D_X, THETA, SLOPES, 0.2, C)
    magnitude, phi = curves(0.2, SLOPES, D_X, THETA, C)
    np.testing.assert_allclose(magnitude, np.hypot(m_y, m_z), rtol=1e-14)
    np.testing.assert_allclose(phi, np.arctan2(m_y, m_z), atol=1e-15)


def test_friction_beyond_every_slope_is_not_a_number():
    beta = np.radians([0.0, 5.0, 10.0])
    m_y, m_z = slip.moments(D_X, THETA, beta, 0.5, C)
    fit = fit_alpha(Pushes(beta, m_y, m_z, D_X, THETA, C))
    assert np.isnan(fit.alpha_rad)
    assert fit.status == NEVER_SLIPPED


def test_friction_at_zero_is_flagged():
    rng = np.random.default_rng(3)
    m_y, m_z = slip.moments(D_X, THETA, SLOPES, 0.0, C)
    fit = fit_alpha(Pushes(SLOPES, m_y + 0.02 + 0.01 * rng.normal(size=16), m_z, D_X, THETA, C))
    assert fit.status == AT_ZERO
    assert fit.low_rad == 0.0


@pytest.mark.parametrize(
    "change, message",
    [
        ({"m_y": [0.0, np.nan]}, "missing or infinite"),
        ({"m_y": [0.0, 1.0, 2.0], "m_z": [1.0, 1.0, 1.0]}, "one slope a moment"),
        ({"C": 0.0}, "C = 0"),
    ],
)
def test_bad_data_are_refused(change, message):
    arguments = {
        "beta": [0.1, 0.5],
        "m_y": [0.0, 1.0],
        "m_z": [3.0, 2.0],
        "d_x": D_X,
        "theta": THETA,
        "C": C,
    } | change
    with pytest.raises(ValueError, match=message):
        fit_alpha(Pushes(**arguments))


# ---- section VII, way 1: tilting the array


def test_range_of_tilts_without_slip_is_twice_alpha():
    tilt = np.radians(np.arange(-60, 61, 1.0))
    phi = slip.slip_angle(np.radians(7) + tilt, np.radians(18))
    assert np.ptp(tilt[phi == 0]) == pytest.approx(2 * np.radians(18), abs=2 * np.radians(1))
    fit = alpha_from_tilts(tilt, phi)
    assert fit.alpha_rad == pytest.approx(np.radians(18), rel=1e-12)
    assert fit.status == ""


def test_sigma_from_tilts_is_the_sampled_scatter():
    """400 runs give a scatter good to 1/√800 = 3.5 %; ± 4 of these."""
    rng = np.random.default_rng(9)
    tilt = np.radians(np.arange(-60, 61, 2.0))
    phi = slip.slip_angle(np.radians(7) + tilt, np.radians(18))
    sigma = np.radians(0.7)
    fits = [alpha_from_tilts(tilt, phi + sigma * rng.normal(size=tilt.size)) for _ in range(400)]
    scores = [(fit.alpha_rad - np.radians(18)) / fit.sigma_rad for fit in fits]
    assert np.std(scores) == pytest.approx(1.0, abs=0.14)
    assert abs(np.mean(scores)) < 4 / np.sqrt(400)


def test_tilts_to_one_side_hold_no_angle():
    tilt = np.radians(np.arange(0, 60, 2.0))
    fit = alpha_from_tilts(tilt, slip.slip_angle(tilt, 0.3))
    assert np.isnan(fit.alpha_rad)
    assert fit.status == ONE_SIDED


# ---- section VII, way 3: confidence from φ


def test_confidence_falls_with_the_slip_angle_and_ends_at_90_degrees():
    phi = np.radians([0, 10, 30, 60, 79, 80, 89])
    weight = confidence(phi, np.radians(10), np.radians(3))
    assert weight[0] == 1.0
    assert (np.diff(weight[:5]) < 0).all()
    np.testing.assert_allclose(weight[5:], 0.0, atol=1e-20)
    np.testing.assert_array_equal(weight, confidence(-phi, np.radians(10), np.radians(3)))


def test_known_friction_leaves_full_confidence():
    assert confidence(0.8, 0.2, 0.0) == 1.0
    assert np.isnan(confidence(np.nan, 0.2, 0.1))


def test_weight_is_the_share_of_variance_not_due_to_friction():
    """By its definition, with (10)'s derivative taken by difference."""
    from estimator.distance import with_friction

    phi, alpha, alpha_sigma = 0.5, 0.2, 0.03
    own = friction_ways._OWN_SHARE
    d_x = [with_friction(0.05, np.sin(phi), np.cos(phi), alpha + step, C) for step in (-1e-6, 1e-6)]
    relative = alpha_sigma * (np.log(d_x[1]) - np.log(d_x[0])) / 2e-6
    assert confidence(phi, alpha, alpha_sigma) == pytest.approx(
        own**2 / (own**2 + relative**2), rel=1e-6
    )
