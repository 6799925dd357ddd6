"""The error of an estimate: its stated sigma where truth and gauges were seen by the same cameras."""

from dataclasses import replace

import numpy as np
import pytest

from bench.gauges.fit import fit_matrix
from bench.gauges.gauge_readings import Pairs, reference_from_pictures
from bench.gauges.matrix import to_follicle
from bench.records.trial_result import Deflection, EstimateRow, FeltWhisk
from bench.session.whisker import Whisker
from bench.trials.estimate_errors import Judged, judge
from tests.scenes.results import seen_whisk, trial_result
from vision.truth.records import SharedSigmas
from vision.truth.value import Value

WHISKER = Whisker(length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
VOLTS_PER_NMM = np.diag([0.1, 0.1])
THETA_RAD = np.radians([1.0, 2.0, 3.0, 4.0])
D_X_MM = 70.0
EPSILON_MM = 0.1  # one sigma of the rig frame along the whisker


def deflection() -> Deflection:
    """A push at β = 0, its places along the whisker off together as the rig frame is."""
    n = len(THETA_RAD)
    by_camera_error_mm = np.zeros((n, 3, 1))
    by_camera_error_mm[:, 0] = EPSILON_MM
    by_camera_error_mm = by_camera_error_mm.reshape(3 * n, 1)
    nothing = np.zeros(n)
    return Deflection(
        theta_rad=THETA_RAD,
        motor_rad=THETA_RAD,
        slip_mm=nothing,
        slip_sigma_mm=nothing,
        along_mm=D_X_MM * np.cos(THETA_RAD),
        across_y_mm=D_X_MM * np.sin(THETA_RAD),
        across_z_mm=nothing,
        past_mm=nothing,
        covariance=by_camera_error_mm @ by_camera_error_mm.T + 1e-6 * np.eye(3 * n),
        by_camera_error_mm=by_camera_error_mm,
        touch_rad=Value(0.0, 0.0),
        d_x_mm=D_X_MM,
    )


def pairs(roll_deg: float) -> Pairs:
    """The pairs of that push with the follicle turned."""
    seen = replace(seen_whisk(d_x_mm=Value(D_X_MM, EPSILON_MM)), deflection=deflection())
    reference = reference_from_pictures(seen, WHISKER)
    to_axes = to_follicle(np.radians(roll_deg))
    turn = np.kron(np.eye(len(THETA_RAD)), to_axes)
    moments = reference.moments @ to_axes.T
    nothing = np.full(2, np.nan)
    return Pairs(
        trial=f"roll {roll_deg:g}",
        whisk=0,
        roll_deg=roll_deg,
        theta_rad=THETA_RAD,
        moments=moments,
        moments_covariance=turn @ reference.covariance @ turn.T,
        volts=moments @ VOLTS_PER_NMM,
        volts_covariance=1e-12 * np.eye(moments.size),
        paper_moment=nothing,
        paper_volts=nothing,
        scale_sigma=reference.scale_sigma,
        by_camera_error=turn @ reference.by_camera_error,
    )


def test_a_rig_frame_that_is_off_moves_an_estimate_twice_as_far_as_the_truth():
    """A rig frame ε off makes the truth ε too long, by gauges of the same pictures an estimate 2 ε.

    Their difference is known to ε, not to √5 ε as of independent errors. The friction of the bar,
    ± 0.1 % of a moment (`gauge_readings._FRICTION_SIGMA`), is the estimate's own.
    """
    gauges = fit_matrix([pairs(0.0), pairs(90.0)])
    moment_Nmm = np.array([0.0, 5.0])
    by_camera_error_Nmm = gauges.by_camera_error_at(VOLTS_PER_NMM @ moment_Nmm)
    estimate_sigma_mm = D_X_MM * float(np.linalg.norm(by_camera_error_Nmm)) / 5.0
    assert estimate_sigma_mm == pytest.approx(2.0 * EPSILON_MM, rel=0.02)
    shared = SharedSigmas(0.0, EPSILON_MM, 0.0, 0.0, np.zeros(3), np.array([EPSILON_MM]))
    seen = seen_whisk(d_x_mm=Value(D_X_MM, EPSILON_MM), shared=shared)
    felt = FeltWhisk(
        m_y_Nmm=Value(0.0, 0.0),
        m_z_Nmm=Value(5.0, 0.0),
        by_camera_error_Nmm=by_camera_error_Nmm,
        estimates=(EstimateRow("with_friction", Value(D_X_MM, estimate_sigma_mm)),),
    )
    (judged,) = judge([trial_result([seen], [felt])])
    assert judged.error_sigma_mm == pytest.approx(EPSILON_MM, rel=0.05)


def test_an_estimate_by_given_gauges_errs_apart_from_the_truth():
    shared = SharedSigmas(0.0, EPSILON_MM, 0.0, 0.0, np.zeros(3), np.array([EPSILON_MM]))
    seen = seen_whisk(d_x_mm=Value(D_X_MM, 0.3), shared=shared)
    row = EstimateRow("with_friction", Value(D_X_MM, 0.4))
    felt = FeltWhisk(m_y_Nmm=Value(0.0, 0.0), m_z_Nmm=Value(5.0, 0.0), estimates=(row,))
    (judged,) = judge([trial_result([seen], [felt])])
    assert judged.error_sigma_mm == pytest.approx(0.5)


def test_the_moments_seen_have_the_cameras_errors_in_their_sigma():
    """ε along the whisker makes a moment, as 1 / d_x², 2 ε / d_x smaller; the friction adds 0.1 %."""
    seen = replace(seen_whisk(d_x_mm=Value(D_X_MM, EPSILON_MM)), deflection=deflection())
    reference = reference_from_pictures(seen, WHISKER)
    share = reference.moments_sigma[:, 1] / reference.moments[:, 1]
    assert share == pytest.approx(2.0 * EPSILON_MM / D_X_MM, rel=0.2)


def test_places_whose_only_error_is_the_cameras_have_moments_with_a_sigma():
    """Of the places' covariance nothing is left without the cameras' errors, but rounding, of either sign."""
    for rounding in (-1e-18, 0.0, 1e-18):
        known = deflection()
        of_cameras = known.by_camera_error_mm @ known.by_camera_error_mm.T
        exact = replace(known, covariance=of_cameras + rounding)
        seen = replace(seen_whisk(d_x_mm=Value(D_X_MM, EPSILON_MM)), deflection=exact)
        assert np.isfinite(reference_from_pictures(seen, WHISKER).moments_sigma).all()


def test_an_error_whose_parts_cancel_is_no_less_than_nothing():
    judged = Judged("t", 0, "", "", None, "e", 0.0, 70.0, 0.1, 70.0, 0.3, 0.03 + 0.02 + 1e-12)
    assert judged.error_sigma_mm == 0.0
