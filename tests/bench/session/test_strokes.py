"""Forward strokes against motors whose strokes are known by construction."""

import numpy as np
import pytest

from bench.session.strokes import forward_strokes

RATE_HZ = 2000.0


def motor(*pieces: tuple[float, float]) -> tuple[np.ndarray, list[slice]]:
    """Angle, deg, from pieces (change in deg, duration in s), and the slices in which it goes forward."""
    angle, strokes = [np.zeros(1)], []
    for change, duration_s in pieces:
        n = round(duration_s * RATE_HZ)
        start = sum(map(len, angle)) - 1
        if change > 0:
            strokes.append(slice(start, start + n + 1))
        angle.append(angle[-1][-1] + change * np.arange(1, n + 1) / n)
    return np.concatenate(angle), strokes


def encoder(angle_deg, step_deg=0.0, noise_deg=0.0, seed=1):
    noisy = angle_deg + noise_deg * np.random.default_rng(seed).standard_normal(len(angle_deg))
    return np.radians(np.round(noisy / step_deg) * step_deg if step_deg else noisy)


def assert_near(found, true, samples):
    assert len(found) == len(true)
    ends = [[abs(f.start - t.start), abs(f.stop - t.stop)] for f, t in zip(found, true)]
    assert np.max(ends) <= samples, ends


ONE = [(6.2, 0.62)]
THREE = [(0, 0.1), (6, 0.6), (0, 0.2), (-6, 0.6), (0, 0.1), (6, 0.6), (-6, 0.3), (6, 0.6), (0, 0.3)]


def test_a_bare_ramp_is_one_stroke_from_end_to_end():
    angle, _ = motor(*ONE)
    assert forward_strokes(encoder(angle)) == (slice(0, len(angle)),)


# An end is known to the time in which the motor, at 0.005° a sample, moves by two encoder steps plus six sigmas
# of noise (twice the jitter); the median over five samples adds two.
@pytest.mark.parametrize(
    ("step_deg", "noise_deg"), [(0, 0), (0.005, 0), (0.09, 0), (0, 0.02), (0.05, 0.02)]
)
@pytest.mark.parametrize("pieces", [ONE, THREE])
def test_strokes_between_pauses_and_back_strokes(pieces, step_deg, noise_deg):
    angle, strokes = motor(*pieces)
    tolerance = 2 + (2 * step_deg + 6 * noise_deg) / 0.005
    assert_near(forward_strokes(encoder(angle, step_deg, noise_deg)), strokes, tolerance)


def test_frames_of_the_first_encoder_step_belong_to_the_stroke():
    angle, _ = motor(*ONE)
    (stroke,) = forward_strokes(encoder(angle, step_deg=0.09))
    assert stroke == slice(0, len(angle))


def test_a_pause_within_a_stroke_does_not_end_it():
    angle, _ = motor((3, 0.3), (0, 0.5), (3, 0.3), (-6, 0.6))
    (stroke,) = forward_strokes(encoder(angle, step_deg=0.01))
    assert stroke.start == 0
    assert abs(stroke.stop - round(1.1 * RATE_HZ)) <= 3


def test_a_recording_that_starts_and_ends_mid_stroke():
    angle, strokes = motor((2, 0.2), (-6, 0.6), (6, 0.6), (-6, 0.6), (3, 0.3))
    assert_near(forward_strokes(encoder(angle)), strokes, 2)


def test_overshoot_and_settling_are_no_strokes():
    angle, _ = motor((6.1, 0.6), (-0.2, 0.02), (0.15, 0.02), (-0.05, 0.02), (0, 0.2), (-6, 0.6))
    assert len(forward_strokes(encoder(angle))) == 1


def test_spikes_of_the_encoder_are_no_strokes():
    angle, strokes = motor(*THREE)
    spoilt = angle.copy()
    spoilt[[300, 900, 2200, 4000]] += [30, -20, 15, -40]
    assert_near(forward_strokes(encoder(spoilt)), strokes, 3)


def test_speeds_from_slow_to_fast():
    for speed in (1.0, 10.0, 90.0, 400.0):
        angle, strokes = motor((6, 6 / speed), (-6, 6 / speed), (6, 6 / speed))
        assert len(forward_strokes(encoder(angle, step_deg=0.005))) == len(strokes)


@pytest.mark.parametrize("angle", [np.zeros(0), np.zeros(1), np.zeros(500), np.linspace(6, 0, 500)])
def test_no_forward_motion_is_no_stroke(angle):
    assert forward_strokes(np.radians(angle)) == ()


def test_noise_alone_is_no_stroke():
    assert forward_strokes(encoder(np.zeros(4000), noise_deg=0.01)) == ()


def test_ten_whisks_in_one_recording():
    angle, strokes = motor(*[(6, 0.6), (0, 0.05), (-6, 0.3), (0, 0.05)] * 10)
    assert_near(forward_strokes(encoder(angle, step_deg=0.005, noise_deg=0.003)), strokes, 8)
