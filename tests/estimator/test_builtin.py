"""The built-in estimators on whisks of known distance, and what they say where there is none."""

import dataclasses

import numpy as np
import pytest

from estimator import builtin, slip
from estimator.beam import Beam
from estimator.builtin import ESTIMATORS
from estimator.signal import felt_touch, moment_at
from estimator.uncertainty import Z_95
from estimator.whisk import Estimate, EstimatorSettings, Whisk

pytestmark = pytest.mark.filterwarnings("error")

BEAM = Beam.from_modulus(60.0, 1.0, 100.0)
THETA, ALPHA = np.radians(3.0), np.radians(10.5)
SETTINGS = EstimatorSettings(ALPHA)
BEYOND_PAPER = ("corrected",)
PAPER = {name: function for name, function in ESTIMATORS.items() if name not in BEYOND_PAPER}


def whisk_of(m_y, m_z, *, beam=BEAM, sigma=0.01, theta=THETA):
    samples = np.linspace(-0.02, 0.08, 50)
    covariance = sigma**2 * np.eye(2)
    return Whisk(
        samples * 5, samples, m_y * samples, m_z * samples, theta, m_y, m_z, covariance, 1e-4, beam
    )


def whisk_at(d_x, beta, alpha=ALPHA, **settings):
    return whisk_of(*slip.moments(d_x, THETA, beta, alpha, BEAM.C_Nmm2), **settings)


@pytest.mark.parametrize("beta_deg", [0, 30, 60, 75])
def test_with_friction_finds_the_distance(beta_deg):
    estimate = ESTIMATORS["with_friction"](whisk_at(60.0, np.radians(beta_deg)), SETTINGS)
    assert estimate.d_x_mm == pytest.approx(60.0, rel=1e-12)
    assert estimate.status == ""
    assert 0 < estimate.sigma_mm < 1.5


def test_without_slip_all_agree():
    found = [function(whisk_at(60.0, 0.1), SETTINGS).d_x_mm for function in PAPER.values()]
    np.testing.assert_allclose(found, 60.0, rtol=1e-14)


def test_under_slip_no_slip_and_frictionless_are_too_long():
    """Section II: slip makes (2) overestimate; (12) with too little friction as well."""
    whisk = whisk_at(40.0, np.radians(45))
    no_slip, with_friction, frictionless = (ESTIMATORS[n](whisk, SETTINGS).d_x_mm for n in PAPER)
    assert no_slip > frictionless > with_friction == pytest.approx(40.0)


def test_no_slip_is_equation_2_whatever_m_y_does():
    assert ESTIMATORS["no_slip"](whisk_of(5.0, 9.0), SETTINGS).d_x_mm == pytest.approx(
        BEAM.C_Nmm2 * THETA / 9.0
    )


def test_sigma_holds_touch_moments_and_friction():
    whisk = whisk_at(60.0, np.radians(60), sigma=0.0)
    touch_alone = ESTIMATORS["with_friction"](whisk, SETTINGS).sigma_mm
    assert touch_alone == pytest.approx(60.0 * 1e-4 / THETA, rel=1e-12)
    doubtful = EstimatorSettings(ALPHA, alpha_est_sigma_rad=np.radians(1.0))
    sensitivity = np.tan(np.radians(60)) - np.tan(ALPHA)
    friction_alone = np.sqrt(
        ESTIMATORS["with_friction"](whisk, doubtful).sigma_mm ** 2 - touch_alone**2
    )
    assert friction_alone == pytest.approx(60.0 * sensitivity * np.radians(1.0), rel=1e-9)
    assert ESTIMATORS["frictionless"](whisk, doubtful).sigma_mm < friction_alone


def test_beyond_the_tip_is_the_tip_with_its_sigma_and_a_word():
    estimate = ESTIMATORS["frictionless"](whisk_at(80.0, np.radians(75)), SETTINGS)
    assert estimate.d_x_mm == 100.0
    assert estimate.status.code == "tip_contact"
    assert estimate.sigma_mm > 0


@pytest.mark.parametrize("beyond", [1.001, 1.02, 1.5])
def test_an_interval_at_the_tip_is_as_wide_as_its_sigma(beyond):
    """However far beyond the length the distance came out: 1.96 sigma below the length, and nothing above it."""
    estimate = ESTIMATORS["with_friction"](whisk_at(beyond * 100.0, 0.0), SETTINGS)
    assert (estimate.d_x_mm, estimate.high_mm) == (100.0, 100.0)
    assert 100.0 - estimate.low_mm == pytest.approx(Z_95 * estimate.sigma_mm, rel=1e-6)


def test_at_the_tip_the_length_s_own_sigma_comes_on_top():
    beam = dataclasses.replace(BEAM, length_sigma_mm=0.5)
    sharp, wide = (
        ESTIMATORS["with_friction"](dataclasses.replace(whisk_at(110.0, 0.0), beam=one), SETTINGS)
        for one in (BEAM, beam)
    )
    assert wide.sigma_mm == pytest.approx(np.hypot(sharp.sigma_mm, 0.5))
    assert wide.high_mm == pytest.approx(100.0 + Z_95 * 0.5)
    assert 100.0 - wide.low_mm == pytest.approx(Z_95 * wide.sigma_mm, rel=1e-6)


@pytest.mark.parametrize("name", ESTIMATORS | builtin.OF_CURVED)
def test_a_taper_that_is_not_known_moves_the_distance_by_its_sigma(name):
    """A cone that is 0.5 mm longer than stated, asked with the true length and with the stated one."""
    cone = dataclasses.replace(BEAM, shape="cone")
    per_mm = 0.5 / 100.0**2
    doubtful = dataclasses.replace(cone, taper_sigma_per_mm=per_mm)
    longer = dataclasses.replace(cone, length_mm=100.5)
    m_y, m_z = slip.moments(cone.as_cylinder_mm(60.0), THETA, 0.6, ALPHA, BEAM.C_Nmm2)
    estimates = []
    for beam in (cone, longer, doubtful):
        whisk = whisk_of(m_y, m_z, beam=beam)
        estimates.append((ESTIMATORS | builtin.OF_CURVED)[name](whisk, SETTINGS))
    known, moved, wide = estimates
    by_taper = np.sqrt(wide.sigma_mm**2 - known.sigma_mm**2)
    assert by_taper == pytest.approx(abs(moved.d_x_mm - known.d_x_mm), rel=0.02)
    assert wide.high_mm - wide.low_mm > known.high_mm - known.low_mm


def test_no_slip_beyond_the_length_is_left_and_flagged():
    """d_x cos α/(cos β cos φ), the slip that (2) ignores: nothing touched the tip."""
    beta = np.radians(75)
    estimate = ESTIMATORS["no_slip"](whisk_at(60.0, beta), SETTINGS)
    ratio = np.cos(ALPHA) / (np.cos(beta) * np.cos(beta - ALPHA))
    assert estimate.d_x_mm == pytest.approx(60.0 * ratio, rel=1e-9)
    assert estimate.status.code == "longer_than_whisker"


@pytest.mark.parametrize("name", ESTIMATORS)
def test_no_distance_is_nan_with_the_reason(name):
    estimate = ESTIMATORS[name](whisk_of(1.0, -1.0), SETTINGS)
    assert np.isnan([estimate.d_x_mm, estimate.sigma_mm]).all()
    assert estimate.status.code == "not_pushing"


def test_friction_that_leaves_no_distance_is_told_by_the_one_that_assumes_it():
    whisk = whisk_of(9.0, 1.0)
    assert ESTIMATORS["with_friction"](whisk, SETTINGS).status.code == "beyond_friction"
    assert ESTIMATORS["frictionless"](whisk, SETTINGS).status == ""


def test_cone_is_the_cylinder_with_one_over_length_added():
    cone = dataclasses.replace(BEAM, shape="cone")
    moments = slip.moments(80.0, THETA, 0.9, ALPHA, BEAM.C_Nmm2)
    for function in PAPER.values():
        cylinder, tapered = (
            function(whisk_of(*moments, beam=beam), SETTINGS) for beam in (BEAM, cone)
        )
        if not cylinder.status:
            assert 1 / tapered.d_x_mm == pytest.approx(1 / cylinder.d_x_mm + 1 / 100.0, rel=1e-14)
            shrink = tapered.d_x_mm / cylinder.d_x_mm
            assert tapered.sigma_mm == pytest.approx(cylinder.sigma_mm * shrink**2, rel=1e-12)


def test_estimators_on_a_felt_stroke(stroke):
    """From samples to distance: 60 strokes scatter by their sigma about the truth, 60 mm on a surface of 40°."""
    beta, C = np.radians(40), BEAM.C_Nmm2
    slopes = np.array(slip.moments(60.0, np.radians(1), beta, ALPHA, C)) / 10
    rng = np.random.default_rng(21)
    scores = []
    for _ in range(60):
        s = stroke(rng, slopes=slopes)
        moments = 10 * s.moments
        touch = felt_touch(s.motor_rad, moments, s.time_s)
        at = moment_at(THETA, s.motor_rad, moments, touch, time_s=s.time_s)
        above = (moments - touch.offset).T
        whisk = Whisk(
            s.time_s,
            s.motor_rad - touch.motor_rad,
            *above,
            THETA,
            *at.values,
            at.covariance,
            touch.sigma_rad,
            BEAM,
            at.theta_covariance,
        )
        estimate = builtin.with_friction(whisk, SETTINGS)
        scores.append((estimate.d_x_mm - 60.0) / estimate.sigma_mm)
    assert abs(np.mean(scores)) < 4 / np.sqrt(60)
    assert 0.5 < np.std(scores) < 1.3


@pytest.mark.parametrize("shape", [("cylinder",), ("cone",), ("tapered", 0.4)])
def test_17_as_printed_has_its_own_name_and_sigma(shape):
    """Of a cylinder it is (12), of others it falls short under slip; its sigma is that of numeric derivatives."""
    beam = Beam.from_modulus(60.0, 1.0, 100.0, *shape)
    beta, d_x = np.radians(50.0), 60.0
    moments = np.array(slip.moments(beam.as_cylinder_mm(d_x), THETA, beta, 0.0, beam.C_Nmm2))
    told, right = (
        f(whisk_of(*moments, beam=beam), SETTINGS)
        for f in (builtin.printed_17, builtin.frictionless)
    )
    assert right.d_x_mm == pytest.approx(d_x) and (told.d_x_mm < 0.95 * d_x) == (
        shape[0] != "cylinder"
    )

    def d(theta, m_y, m_z):
        return builtin.printed_17(whisk_of(m_y, m_z, beam=beam, theta=theta), SETTINGS).d_x_mm

    at = np.array([THETA, *moments])
    numeric = [(d(*(at + h)) - d(*(at - h))) / 2e-6 for h in 1e-6 * np.eye(3)]
    assert told.sigma_mm == pytest.approx(
        np.linalg.norm(numeric * np.array([1e-4, 0.01, 0.01])), rel=1e-5
    )


# ---- where (10) loses its root


DOUBT = EstimatorSettings(np.radians(10.0), np.radians(5.0))


@pytest.mark.parametrize("alpha_deg", [0.5, 10.0, 19.5])
def test_steep_surfaces_give_an_interval_that_holds_whatever_alpha_est_may_be(alpha_deg):
    """β = 79°, the true α within two sigma of the assumed 10 ± 5°: an estimate off by up to 90 % says so itself."""
    whisk = whisk_at(60.0, np.radians(79.0), np.radians(alpha_deg), sigma=1e-3)
    estimate = ESTIMATORS["with_friction"](whisk, DOUBT)
    assert estimate.low_mm <= 60.0 <= estimate.high_mm <= 100.0
    assert estimate.status or abs(estimate.d_x_mm - 60.0) < 2 * estimate.sigma_mm


def test_without_a_root_there_is_still_a_farthest_distance():
    """φ = 84° and α_est = 10 ± 5°: no distance, and none beyond that of α = 0.2°."""
    moments = slip.moments(60.0, THETA, np.radians(84.0), 0.0, BEAM.C_Nmm2)
    estimate = ESTIMATORS["with_friction"](whisk_of(*moments, sigma=1e-4), DOUBT)
    assert np.isnan(estimate.d_x_mm) and estimate.low_mm == 0.0
    assert estimate.high_mm == pytest.approx(60.0, rel=0.05)
    assert estimate.status.code == "only_nearer_known"


def test_without_doubt_the_interval_is_that_of_the_sigma():
    estimate = ESTIMATORS["with_friction"](whisk_at(60.0, np.radians(40)), SETTINGS)
    half = (estimate.high_mm - estimate.low_mm) / 2
    assert half == pytest.approx(1.959964 * estimate.sigma_mm, rel=1e-6)


# ---- the session that this package did not make, with gauges found as in section V


def stroke_of(trial):
    import tomllib

    table = np.genfromtxt(trial / "signals.csv", delimiter=",", names=True)
    truth = tomllib.loads((trial / "truth.toml").read_text())
    return np.radians(table["motor_deg"]), np.c_[table["y_V"], table["z_V"]], table["time_s"], truth


def gauge_matrix(session):
    """Moments per volt [m_y, m_z] × [y_V, z_V] from (2) on both gauge trials, and the inverse volts' relative sigma.

    Unturned, m_z = Cθ/d_x meets the channels as they are; turned by 90° it meets channel y.
    """
    felt, relative = [], []
    for name in ("gauge_roll90", "gauge_roll0"):
        motor, volts, time, truth = stroke_of(session / "trials" / name)
        touch = felt_touch(motor, volts, time)
        at = moment_at(THETA, motor, volts, touch, time_s=time)
        felt.append(at.values / (BEAM.C_Nmm2 * THETA / truth["d_x_mm"]))
        size = np.hypot(*at.values)
        relative.append(np.hypot(np.sqrt(at.covariance.max()) / size, touch.sigma_rad / THETA))
    turned, unturned = felt
    return np.linalg.inv(np.stack([turned, unturned], axis=1)), max(relative)


@pytest.mark.parametrize("name", ["b00_2", "b30_3", "b60_4"])
def test_sample_session_within_three_sigma_at_the_right_friction(steel_signals, name):
    """α = atan 0.185339 is the session's. Sigma holds noise, touch and gauges; seen values make the gauges here."""
    matrix, relative = gauge_matrix(steel_signals)
    motor, volts, time, truth = stroke_of(steel_signals / "trials" / name)
    moments = volts @ matrix.T
    touch = felt_touch(motor, moments, time)
    at = moment_at(THETA, motor, moments, touch, time_s=time)
    above = (moments - touch.offset).T
    whisk = Whisk(
        time,
        motor - touch.motor_rad,
        *above,
        THETA,
        *at.values,
        at.covariance,
        touch.sigma_rad,
        BEAM,
        at.theta_covariance,
    )
    estimate = builtin.with_friction(whisk, EstimatorSettings(np.arctan(truth["mu_kinetic"])))
    sigma = np.hypot(estimate.sigma_mm, relative * estimate.d_x_mm)
    assert abs(estimate.d_x_mm - truth["d_x_mm"]) < 3 * sigma
    assert sigma < 0.015 * truth["d_x_mm"]


# ---- what goes in is checked where it is made


def test_settings_are_checked():
    with pytest.raises(ValueError, match="alpha_est_rad = 10"):
        EstimatorSettings(10.5)
    with pytest.raises(ValueError, match="alpha_est_sigma_rad = -0"):
        EstimatorSettings(0.1, -0.1)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"time_s": np.zeros(3)}, "of one length"),
        ({"covariance_at": np.eye(3)}, r"must be \(2, 2\)"),
        ({"theta_moment_covariance_at": np.zeros(3)}, r"shape \(2,\)"),
        ({"theta_sigma_rad": -1.0}, "theta_sigma_rad = -1"),
    ],
)
def test_whisks_are_checked(change, message):
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(whisk_of(1.0, 5.0), **change)


def test_answers_are_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Estimate(1.0, 0.1).d_x_mm = 2.0


THICK = EstimatorSettings(ALPHA, 0.0, 3.5, np.radians(5.0), 3.0, 0.5)


def test_corrected_takes_out_rolling_where_it_slips():
    """docs/maps.md: 3/8 θ R/d_x cos β, R of bar and whisker together."""
    plain, better = (
        f(whisk_at(60.0, np.radians(50)), THICK) for f in (builtin.with_friction, builtin.corrected)
    )
    assert better.d_x_mm - plain.d_x_mm == pytest.approx(
        0.375 * THETA * 3.5 * np.cos(np.radians(50)), rel=1e-9
    )
    assert better.sigma_mm < plain.sigma_mm
    assert better.low_mm - plain.low_mm == pytest.approx(better.d_x_mm - plain.d_x_mm, rel=0.3)


def test_corrected_takes_out_friction_along_the_whisker_where_it_is_held():
    plain, better = (
        f(whisk_at(60.0, 0.0), THICK) for f in (builtin.with_friction, builtin.corrected)
    )
    expected = THETA * (0.375 * 3.5 + 60.0 * np.pi / 4 * 0.2 * np.tan(ALPHA))
    assert better.d_x_mm - plain.d_x_mm == pytest.approx(expected, rel=1e-9)


def test_who_is_told_no_radius_allows_for_one():
    """It corrects by what it has to allow for, and keeps all of that in its sigma."""
    untold = dataclasses.replace(THICK, object_radius_mm=np.nan)
    told, guessed = (builtin.corrected(whisk_at(60.0, np.radians(50)), s) for s in (THICK, untold))
    assert guessed.d_x_mm == told.d_x_mm and guessed.sigma_mm > told.sigma_mm


@pytest.mark.parametrize("beta_deg", [79, 85])
def test_corrected_says_what_10_says_where_that_has_no_distance(beta_deg):
    steep = EstimatorSettings(np.radians(16.0), np.radians(5.0), 3.5, 0.1, 3.0, 0.5)
    whisk = whisk_at(60.0, np.radians(beta_deg), np.radians(10.0))
    plain, better = (f(whisk, steep) for f in (builtin.with_friction, builtin.corrected))
    assert plain.status == better.status
    assert (plain.high_mm > 0) == (better.high_mm > 0)


def test_sigma_of_a_steep_cone_is_no_less_than_its_interval():
    """φ = 53° and 75 mm of 100: linear in α_est it was 3.2 mm, where the interval reaches 8.8 mm down and 5 mm up."""
    cone = dataclasses.replace(BEAM, shape="cone")
    m_y, m_z = slip.moments(300.0, THETA, np.radians(65.0), np.radians(12.0), BEAM.C_Nmm2)
    doubtful = EstimatorSettings(np.radians(12.0), np.radians(5.0))
    estimate = builtin.with_friction(whisk_of(m_y, m_z, beam=cone), doubtful)
    down, up = estimate.d_x_mm - estimate.low_mm, estimate.high_mm - estimate.d_x_mm
    assert down > 1.5 * up
    assert estimate.sigma_mm == pytest.approx(np.sqrt((down**2 + up**2) / 2) / Z_95)
