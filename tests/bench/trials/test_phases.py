"""Stick and slip from a saw-tooth of known angles, and none where the whisker only slides."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from bench.base.settings import Settings
from bench.gauges.felt import strokes_of
from bench.records.phases import KINETIC, NO_PHASES, STATIC, Phases
from bench.records.plain import from_plain, to_plain
from bench.rig.simulation import simulate
from bench.rig.stroke import Stroke as Plan
from bench.session.session import load_session
from bench.session.signals import read_signals
from bench.trials.readout import RawMoments
from bench.trials.stick_slip_phases import _steady, felt_phases, seen_phases
from bench.workflows.session_evaluation import evaluate
from estimator.beam import Beam
from tests.studies.accuracy.felt_phases import ONE, TWO, felt_whisks
from vision.truth.records import FrameTruth
from vision.truth.value import Value

C, D_X, BETA = 8835.7, 60.0, np.radians(50.0)
ALPHA_STATIC, ALPHA_KINETIC = np.radians(23.0), np.radians(18.5)
NOISE_NMM = 0.064  # one sample of the rig's gauges


def saw_tooth(theta, static=ALPHA_STATIC, kinetic=ALPHA_KINETIC):
    """Slip (n,) in small-angle theory of a whisker that rests until |φ| = β − static and jumps to β − kinetic."""
    slip, at_rest = np.zeros_like(theta), 0.0
    for k, t in enumerate(theta):
        held = np.arctan2(at_rest * np.cos(BETA), max(D_X * t, 1e-12) - at_rest * np.sin(BETA))
        if t > 0 and held < BETA - static:
            tangent = np.tan(BETA - kinetic)
            at_rest = D_X * t * tangent / (np.cos(BETA) + np.sin(BETA) * tangent)
        slip[k] = at_rest
    return slip


def deflection(theta, slip):
    """d_y, d_z (n,), mm."""
    return D_X * theta - slip * np.sin(BETA), slip * np.cos(BETA)


def moments(theta, slip, rng=None):
    """m_y, m_z (n, 2), N·mm, with white noise where there is a generator."""
    d_y, d_z = deflection(np.maximum(theta, 0.0), slip)
    exact = C / D_X**2 * np.stack([d_z, d_y], axis=1)
    return exact if rng is None else exact + NOISE_NMM * rng.standard_normal(exact.shape)


def samples(speed_deg_s=10.0):
    """time, θ (n,) at 2 kHz from 1.6° before touch to 4.6° after it."""
    time = np.arange(0.0, 6.2 / speed_deg_s, 1 / 2000)
    return time, np.radians(speed_deg_s * time - 1.6)


def frames(theta, slip, sigma_mm=0.003):
    """Frames as in a result, from the slip at their angles."""
    d_y, d_z = deflection(theta, slip)
    alpha = BETA - np.arctan2(d_z, d_y)
    n, untold = len(theta), np.full(len(theta), np.nan)
    return FrameTruth(
        index=np.arange(n),
        time_s=untold,
        motor_rad=untold,
        theta_rad=Value(theta),
        touching=np.ones(n, dtype=bool),
        point_mm=Value(np.full((n, 3), np.nan)),
        arc_mm=untold,
        status=("",) * n,
        slip_mm=Value(slip, np.full(n, sigma_mm)),
        d_y_mm=Value(d_y),
        d_z_mm=Value(d_z),
        alpha_rad=Value(alpha, np.full(n, 0.001)),
    )


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_moments_tell_static_from_kinetic(seed, mirror):
    """The requirement is 1°. Each end of a tooth is known to about 1°."""
    time, theta = samples()
    slip = saw_tooth(theta)
    felt = moments(theta, slip, np.random.default_rng(seed)) * [mirror, 1.0]
    found = felt_phases(RawMoments(time, theta, felt), mirror * BETA, D_X, Beam(C, 100.0))
    teeth = np.count_nonzero(np.diff(slip[theta > np.radians(2.3)]) > 0.02)
    assert teeth <= found.jumps <= teeth + 6  # earlier, smaller ones may drown in the noise
    for kind, true in ((STATIC, ALPHA_STATIC), (KINETIC, ALPHA_KINETIC)):
        angle = found.mean(kind)
        mean, sigma = angle.value, angle.sigma
        assert abs(np.degrees(mean - true)) < 1.0
        assert abs(mean - true) < 4 * sigma


def test_ringing_after_a_jump_is_no_jump():
    """165 Hz, decaying by 2 % a radian, as large as half of a tooth."""
    time, theta = samples()
    slip = saw_tooth(theta)
    ringing, rung = np.zeros_like(slip), np.flatnonzero(np.diff(slip) > 0.02)
    for k in rung:
        since = np.maximum(time - time[k], 0.0) * 2 * np.pi * 165
        ringing += np.where(
            since > 0, 0.5 * (slip[k + 1] - slip[k]) * np.exp(-0.02 * since) * np.cos(since), 0.0
        )
    felt = moments(theta, slip - ringing, np.random.default_rng(1))
    found = felt_phases(RawMoments(time, theta, felt), BETA, D_X, Beam(C, 100.0))
    assert found.jumps <= len(rung)
    assert np.degrees(found.mean(STATIC).value) == pytest.approx(23.0, abs=1.0)
    assert np.degrees(found.mean(KINETIC).value) == pytest.approx(18.5, abs=1.0)


@pytest.mark.parametrize("seed", range(5))
def test_a_whisker_that_slides_neither_rests_nor_jumps(seed):
    time, theta = samples()
    tangent = np.tan(BETA - ALPHA_KINETIC)
    slip = D_X * np.maximum(theta, 0.0) * tangent / (np.cos(BETA) + np.sin(BETA) * tangent)
    felt = moments(theta, slip, np.random.default_rng(seed))
    assert felt_phases(RawMoments(time, theta, felt), BETA, D_X, Beam(C, 100.0)) == NO_PHASES
    touching = theta > 0
    assert seen_phases(frames(theta[touching][::40], slip[touching][::40]), BETA, D_X) == NO_PHASES


@pytest.mark.parametrize("coefficients", ONE)
def test_a_motor_s_stop_is_no_slip(coefficients):
    """At 90°/s with ramps of 20 ms; while they counted, stick–slip was felt in eight whisks of ten."""
    assert not any(whisk.phases.jumps for whisk in felt_whisks(coefficients, 90.0, 3, seed=0))


def test_slips_between_a_motor_s_ramps_are_felt():
    found = list(felt_whisks(TWO[0], 10.0, 1, seed=0))
    assert len(found) == 4
    assert all(whisk.phases.jumps > 0 for whisk in found)


@pytest.mark.parametrize("noise_deg", [0.0, 0.005, 0.05])
@pytest.mark.parametrize("step_deg", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("ramp_s", [0.02, 0.05])
def test_steady_motion_ends_where_the_motor_leaves_its_speed(noise_deg, step_deg, ramp_s):
    """A ramp from 90°/s is off its line by ½ a t²: within √(2 · off/a) of either end, off being twice the noise's and
    the encoder's most; and no whisk between the ramps is cut."""
    stroke = Plan.plan(0.0, np.radians(10.0), np.radians(90.0), ramp_s=ramp_s, pause_s=0.05)
    time = np.arange(0.0, stroke.end_s, 1 / 2000)
    motor = np.degrees(stroke.angle_rad(time))
    motor += noise_deg * np.random.default_rng(1).uniform(-1, 1, len(time))
    if step_deg:
        motor = np.round(motor / step_deg) * step_deg
    steady = _steady(time, np.radians(motor))
    begin, end = stroke.forward[0]
    most_off = 2.0 * 2.0 * (noise_deg + step_deg) + 1e-6
    late = np.sqrt(2 * most_off * ramp_s / 90.0) + 2 / 2000
    assert time[steady][0] == pytest.approx(begin, abs=late)
    assert time[steady][-1] == pytest.approx(end, abs=late)


def test_frames_tell_static_from_kinetic_where_they_are_close():
    """Every 0.05°: a jump is known to that, and a contact at rest turns by some 0.5° in it."""
    theta = np.radians(np.arange(0.02, 4.6, 0.05))
    fine = np.radians(np.arange(0.0, 4.6, 0.001))
    slip = np.interp(theta, fine, saw_tooth(fine))
    found = from_plain(Phases, to_plain(seen_phases(frames(theta, slip), BETA, D_X)))
    assert found.jumps >= 5
    for kind, true in ((STATIC, 23.0), (KINETIC, 18.5)):
        assert np.degrees(found.mean(kind).value) == pytest.approx(true, abs=0.5)


def test_frames_too_far_apart_show_no_phases():
    """Every 0.5°, as a slow camera has it: each interval holds a jump, and none a rest."""
    theta = np.radians(np.arange(0.1, 4.6, 0.5))
    fine = np.radians(np.arange(0.0, 4.6, 0.001))
    found = seen_phases(frames(theta, np.interp(theta, fine, saw_tooth(fine))), BETA, D_X)
    assert not any(
        a.kind == STATIC and abs(np.degrees(a.alpha_rad) - 23.0) > 3.0 for a in found.angles
    )


def test_the_rig_s_sandpaper(tmp_path):
    """Exact mechanics, ringing, hum and noise; gauges and slope as they are. The requirement is 1°."""
    protocol = Path(__file__).parents[2] / "studies" / "accuracy" / "protocols" / "sandpaper.toml"
    simulate(
        tmp_path / "session",
        protocol=protocol,
        signals_only=True,
        seed=5,
    )
    session = load_session(tmp_path / "session")
    true = json.loads((tmp_path / "session" / "truth.json").read_text())
    for trial in (trial for trial in session.trials if trial.purpose == "measure"):
        told = tomllib.loads((trial.folder / "truth.toml").read_text())
        (stroke,) = strokes_of(read_signals(trial), trial, Settings())
        touch = stroke.touch
        felt = (stroke.channels - touch.offset) @ np.array(true["gauge_matrix_Nmm_per_V"]).T
        theta, beta = stroke.motor_rad - touch.motor_rad, np.radians(told["beta_deg"])
        raw = RawMoments(stroke.time_s, theta, felt)
        found = felt_phases(raw, beta, told["d_x_mm"], session.whisker.beam)
        assert found.jumps >= 7
        for kind, mu in ((STATIC, told["mu_static"]), (KINETIC, told["mu_kinetic"])):
            assert np.degrees(found.mean(kind).value - np.arctan(mu)) == pytest.approx(0.0, abs=1.0)


def test_without_pictures_the_nominal_slope_serves(tmp_path):
    """Slopes as set by hand: phases.csv has both angles, and friction.csv says where the slope is from."""
    text = (
        Path(__file__).parents[2] / "studies" / "accuracy" / "protocols" / "sandpaper.toml"
    ).read_text()
    text = text.replace("vibration = true", "vibration = true\nknown = true")
    text = text.replace("beta_deg = [45, 60]", "beta_deg = 60")
    (tmp_path / "p.toml").write_text(text)
    session = simulate(
        tmp_path / "session", protocol=tmp_path / "p.toml", signals_only=True, seed=5
    )
    evaluate(session, tmp_path / "out", Settings())
    kinds = (tmp_path / "out" / "phases.csv").read_text()
    assert kinds.count("felt,static") >= 5 and kinds.count("felt,kinetic") >= 5
    assert "sandpaper,10,60,manifest" in (tmp_path / "out" / "friction.csv").read_text()
    summary = (tmp_path / "out" / "summary.txt").read_text()
    assert "stick–slip felt, slopes as the manifest has them" in summary
