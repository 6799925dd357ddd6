"""Motor, vibration, gauges: each effect measured in what it leaves in the volts, each of them alone."""

import math

import numpy as np
import pytest

from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.rig.loading import quasi_static_Nmm, ringing_Nmm
from bench.rig.protocol_tables import GaugesTable
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.strain_gauges import fine_times_s, sample_volts
from bench.rig.stroke import Stroke
from bench.rig.vibration import Mode, damped_oscillation
from bench.rig.whisk_mechanics import WhiskMechanics

WIRE = Rod("cylinder", 100.0, 1.0, 60.0)
MATRIX = np.array([[11.3, 0.32], [-0.25, 10.5]])
OFFSET = np.array([-0.015, -0.026])


def gauges(**changes):
    quiet = {
        "matrix_Nmm_per_V": MATRIX,
        "offset_V": OFFSET,
        "noise_V": 0.0,
        "hum_V": 0.0,
        "hum_Hz": 50.0,
        "drift_V_per_s": 0.0,
        "filter_Hz": 0.0,
        "rate_Hz": 2000.0,
        "adc_bits": 0,
        "range_V": 10.0,
    }
    return GaugesTable(**(quiet | changes))


def rng():
    return np.random.default_rng(7)


def ramp(seconds=1.0, top=(3.0, 6.0)):
    times = fine_times_s(gauges(), seconds)
    return times[:, None] / seconds * np.array(top)


def test_quiet_gauges_give_back_the_moments():
    moments = ramp()
    volts = sample_volts(gauges(), moments, 0.0, rng())
    assert (volts - OFFSET) @ MATRIX.T == pytest.approx(moments[::4], abs=1e-12)


def test_a_follicle_turned_by_90_degrees_senses_m_z_on_y_and_minus_m_y_on_z():
    moments = ramp()
    volts = sample_volts(gauges(), moments, math.pi / 2, rng())
    assert (volts - OFFSET) @ MATRIX.T == pytest.approx(
        moments[::4] @ np.array([[0, -1], [1, 0]]), abs=1e-12
    )


def test_noise_is_white_and_of_its_size():
    volts = sample_volts(gauges(noise_V=0.0064), np.zeros((80_000, 2)), 0.0, rng()) - OFFSET
    assert volts.std(0) == pytest.approx(0.0064, rel=0.02)  # of 20 000 samples: 0.5 %
    assert np.abs(np.mean(volts[1:] * volts[:-1], 0)).max() < 4 * 0.0064**2 / math.sqrt(20_000)


def test_hum_stands_at_its_frequency():
    volts = sample_volts(gauges(hum_V=0.01), np.zeros((40_000, 2)), 0.0, rng()) - OFFSET
    spectrum = np.abs(np.fft.rfft(volts[:, 1])) * 2 / len(volts)
    assert np.argmax(spectrum) * 2000 / len(volts) == pytest.approx(50.0)
    assert 0.007 <= spectrum.max() <= 0.0101
    assert np.delete(spectrum, np.argmax(spectrum)).max() < 1e-6


def test_drift_grows_with_time():
    volts = sample_volts(gauges(drift_V_per_s=0.01), np.zeros((80_000, 2)), 0.0, rng())
    assert np.ptp(np.diff(volts, axis=0), axis=0).max() < 1e-12
    assert (np.abs(volts[-1] - volts[0]) <= 0.1).all() and np.abs(volts[-1] - volts[0]).max() > 1e-3


def test_converter_rounds_to_its_steps_and_clips_at_its_rails():
    volts = sample_volts(gauges(adc_bits=8, range_V=0.4), ramp(), 0.0, rng())
    step = 0.8 / 256
    assert volts / step == pytest.approx(np.rint(volts / step), abs=1e-9)
    assert volts.max() == pytest.approx(0.4 - step) and (volts[:, 1] == volts.max()).sum() >= 3


def test_filter_delays_a_ramp_by_its_group_delay_and_keeps_its_slope():
    """Fourth-order Butterworth: the delay at zero frequency is 2.6131/ω, 0.52 ms at 800 Hz; sampled at 8 kHz the
    bilinear map shortens it by tan(x)/x at x = π·800/8000, to 0.503 ms.
    """
    x = math.pi * 800 / 8000
    plain, filtered = (sample_volts(gauges(filter_Hz=f), ramp(), 0.0, rng()) for f in (0.0, 800.0))
    slope = np.diff(plain, axis=0)[1000]
    late = (plain - filtered)[1000] / slope / 2000
    assert late == pytest.approx(2.6131 / (2 * math.pi * 800) * x / math.tan(x), rel=1e-4)
    assert np.diff(filtered, axis=0)[1000] == pytest.approx(np.diff(plain, axis=0)[1000], rel=1e-6)


def test_free_wire_rings_at_the_textbook_frequency():
    """1.8751²/2π·√(EI/ρA)/L² = 42.67 Hz; propped at the end 3.9266² in its place; a cone 8.7192/2π."""
    unit = math.sqrt(1e-6 * WIRE.rigidity_Nmm2 / WIRE.mass_kg_m) / 0.1**2 / (2 * math.pi)
    assert Mode.solve(WIRE).frequency_rad_s / (2 * math.pi) == pytest.approx(
        1.8751041**2 * unit, rel=1e-6
    )
    assert Mode.solve(WIRE, 100.0).frequency_rad_s / (2 * math.pi) == pytest.approx(
        3.9266023**2 * unit, rel=1e-5
    )
    cone = Mode.solve(Rod("cone", 100.0, 1.0, 60.0))
    assert cone.frequency_rad_s / (2 * math.pi) == pytest.approx(8.7192 * unit, rel=1e-3)


def test_pushed_mode_knows_the_small_angle_moment():
    assert Mode.solve(WIRE, 60.0).push_Nmm == pytest.approx(3 * WIRE.rigidity_Nmm2 / 60, rel=1e-5)
    cone = Rod("cone", 100.0, 1.0, 60.0)
    assert Mode.solve(cone, 60.0).push_Nmm == pytest.approx(
        3 * cone.rigidity_Nmm2 * (1 / 60 - 1 / 100), rel=1e-4
    )


def test_ring_solves_its_equation():
    times, frequency, damping = np.arange(0, 0.1, 1e-5), 270.0, 0.03
    wave = damped_oscillation(times, 0.0, 1.0, frequency, damping, value=0.4, rate=-30.0)
    speed, push = np.gradient(wave, times), np.gradient(np.gradient(wave, times), times)
    left = push + 2 * damping * frequency * speed + frequency**2 * wave
    assert wave[0] == 0.4 and speed[1] == pytest.approx(-30.0, rel=0.05)
    assert (
        np.abs(left[5:-5]).max() < 1e-4 * frequency**2
    )  # central differences: (ω dt)²/12 = 6e-7, doubled twice


def whisked(friction, back=False, beta_deg=60.0, whisks=1, ramp_s=0.0):
    bar = TouchedBar.at_contact(
        d_x_mm=60.0,
        beta_rad=math.radians(beta_deg),
        psi_rad=0.0,
        touch_rad=0.04,
        radius_mm=3.0,
        whisker_radius_mm=0.5,
    )
    touch = find_first_touch(WIRE, bar, 0.04, 60.0)
    stroke = Stroke.plan(
        touch.motor_rad - 0.05,
        touch.motor_rad + 0.07,
        math.radians(10),
        whisks=whisks,
        back=back,
        ramp_s=ramp_s,
    )
    end_rad = float(stroke.angles_rad.max())
    whisk = WhiskMechanics.run(
        WIRE, bar, friction, touch, end_rad, step_rad=math.radians(0.1), back=back
    )
    return stroke, (whisk,) * whisks


def test_moments_are_zero_before_touch_and_after_the_way_back():
    stroke, whisks = whisked(FrictionCoefficients(0.18, 0.18), back=True, whisks=2, ramp_s=0.02)
    times = np.arange(0, stroke.end_s, 1e-3)
    moments, motor = quasi_static_Nmm(stroke, whisks, times), stroke.angle_rad(times)
    free = motor < whisks[0].touch.motor_rad
    assert not moments[free].any() and (moments[~free][1:-1].any(1)).all()
    half = len(times) // 2
    assert moments[half : 2 * half] == pytest.approx(
        moments[:half], abs=0.05
    )  # the second whisk is like the first


def test_a_motor_that_slows_down_still_pushes():
    """Friction turns round where the motor does, not where its steady motion ends."""
    stroke, (whisk,) = whisked(FrictionCoefficients(0.18, 0.18), back=True, ramp_s=0.1)
    ((_, steady_end_s),) = stroke.forward
    times = steady_end_s + np.linspace(0.0, 0.099, 12)
    moments = quasi_static_Nmm(stroke, [whisk], times)
    np.testing.assert_array_equal(moments, whisk.forward.moments_at(stroke.angle_rad(times)))


def test_friction_opens_a_loop_between_the_two_ways():
    _, (whisk,) = whisked(FrictionCoefficients(0.18, 0.18), back=True)
    at = whisk.touch.motor_rad + math.radians(2)
    up, down = (i.moments_at([at])[0] for i in (whisk.forward, whisk.back))
    phi_up, phi_down = (math.atan2(*m) for m in (up, down))
    assert phi_down > phi_up + 0.05


def test_touch_rings_the_propped_mode_and_dies_out():
    stroke, whisks = whisked(FrictionCoefficients(0.18, 0.18))
    times = np.arange(0, stroke.end_s, 1e-4)
    ringing = ringing_Nmm(stroke, whisks, times, damping=0.02)
    touch_s = float(stroke.time_s(0, whisks[0].touch.motor_rad))
    after = ringing[times > touch_s + 1e-3][:, 1]
    crossings = np.nonzero(np.diff(np.sign(after[:2000])))[0]
    assert len(crossings) / (2 * 0.2) == pytest.approx(
        Mode.solve(WIRE, 60.0).frequency_rad_s / (2 * math.pi), rel=0.05
    )
    assert not ringing[times < touch_s].any()
    assert (
        0.001 < np.abs(ringing).max() < 0.2
        and np.abs(after[3000:]).max() < 0.05 * np.abs(after[:300]).max()
    )


def test_ringing_makes_a_jump_of_stick_slip_continuous():
    """A mass cannot jump: quasi-static moment and ringing change by less than a fifth of the jump in 0.1 ms."""
    stroke, whisks = whisked(FrictionCoefficients(0.25, 0.18))
    times = np.arange(0, stroke.end_s, 1e-4)
    still = quasi_static_Nmm(stroke, whisks, times)
    shaken = still + ringing_Nmm(stroke, whisks, times, damping=0.02)
    jumps = np.abs(np.diff(still[:, 0]))
    largest = int(np.argmax(jumps))
    assert jumps[largest] > 0.1
    assert np.abs(np.diff(shaken[:, 0]))[largest] < 0.2 * jumps[largest]


@pytest.mark.parametrize(
    "ramp_s, pause_s, back, whisks", [(0, 0, False, 1), (0.02, 0.1, True, 3), (0, 0, True, 2)]
)
def test_stroke_goes_where_and_when_it_says(ramp_s, pause_s, back, whisks):
    stroke = Stroke.plan(0.1, 0.3, 1.5, whisks=whisks, ramp_s=ramp_s, pause_s=pause_s, back=back)
    assert len(stroke.forward) == whisks
    for whisk in range(whisks):
        angles = np.linspace(0.1, 0.3, 9)
        assert stroke.angle_rad(stroke.time_s(whisk, angles)) == pytest.approx(angles, abs=1e-12)
    times = np.linspace(0, stroke.end_s, 200_001)
    angle = stroke.angle_rad(times)
    assert np.abs(np.diff(angle)).max() <= 1.5 * times[1] * (
        1 + 1e-9
    )  # never faster than told, never a jump
    assert angle.min() == pytest.approx(0.1 - 0.75 * ramp_s, abs=1e-9)
    assert angle.max() == pytest.approx(0.3 + 0.75 * ramp_s, abs=1e-5)


def test_several_whisks_need_a_way_back():
    with pytest.raises(ValueError, match="back stroke"):
        Stroke.plan(0.1, 0.3, 1.5, whisks=2)
