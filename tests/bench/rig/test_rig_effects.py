"""Each effect of the signals alone, switched on in a protocol that switches off all of them."""

import math

import numpy as np
import pytest

from bench.rig.protocol import load
from bench.rig.recording import Recording
from bench.rig.vibration import Mode

OFF = """
[motor]
ramp_s = 0.0
encoder_step_deg = 0.0
[gauges]
matrix_Nmm_per_V = [[1.0, 0.0], [0.0, 1.0]]
offset_V = [0.0, 0.0]
noise_V = 0.0
hum_V = 0.0
hum_Hz = 50.0
drift_V_per_s = 0.0
filter_Hz = 0.0
adc_bits = 0
range_V = 1e9
vibration = false
[[trials]]
beta_deg = 50
friction = 0.18
"""


def recording(tmp_path, *changes):
    text = OFF
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    path = tmp_path / "protocol.toml"
    path.write_text(text)
    protocol = load(path)
    return Recording.make(protocol.runs()[0], np.random.default_rng(11))


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    """Times, motor angle and volts with everything off."""
    return recording(tmp_path_factory.mktemp("quiet"))


@pytest.fixture
def volts_with(tmp_path, quiet):
    """The volts with one thing changed, after a check that nothing else was."""

    def changed(*changes):
        signals = recording(tmp_path, *changes).signals
        assert (signals[:, :2] == quiet.signals[:, :2]).all()
        return signals[:, 2:]

    return changed


def test_all_off_is_the_motors_way_and_the_bare_moments(quiet):
    times, motor, volts = quiet.signals[:, 0], np.radians(quiet.signals[:, 1]), quiet.signals[:, 2:]
    assert np.diff(times) == pytest.approx(1 / 2000)
    assert np.degrees(np.diff(motor)[1:-1]) == pytest.approx(10 / 2000)
    way = quiet.whisks[0].forward
    for channel, moment in zip(volts.T, way.moment_Nmm.T):
        assert channel == pytest.approx(np.interp(motor, way.motor_rad, moment), abs=1e-12)
    assert volts[-1].min() > 1


def test_crosstalk(quiet, volts_with):
    volts = volts_with(("[[1.0, 0.0], [0.0, 1.0]]", "[[2.0, 0.3], [-0.2, 1.5]]"))
    assert volts @ np.array([[2.0, 0.3], [-0.2, 1.5]]).T == pytest.approx(
        quiet.signals[:, 2:], abs=1e-12
    )


def test_offset(quiet, volts_with):
    assert volts_with(("[0.0, 0.0]", "[0.3, -0.2]")) - quiet.signals[:, 2:] == pytest.approx(
        np.tile([0.3, -0.2], (len(quiet.signals), 1)), abs=1e-12
    )


def test_drift(quiet, volts_with):
    drifted = volts_with(("drift_V_per_s = 0.0", "drift_V_per_s = 0.05")) - quiet.signals[:, 2:]
    rate = drifted[-1] / quiet.signals[-1, 0]
    assert (np.abs(rate) <= 0.05).all() and np.abs(rate).max() > 0.005
    assert drifted == pytest.approx(np.outer(quiet.signals[:, 0], rate), abs=1e-12)


@pytest.mark.parametrize("mains_Hz", [50, 60])
def test_mains(quiet, volts_with, mains_Hz):
    hum = (
        volts_with(("hum_V = 0.0", "hum_V = 0.1"), ("hum_Hz = 50.0", f"hum_Hz = {mains_Hz}.0"))
        - quiet.signals[:, 2:]
    )
    wave = np.exp(2j * math.pi * mains_Hz * quiet.signals[:, 0])
    waves = np.column_stack([wave.real, wave.imag])
    fitted = waves @ np.linalg.lstsq(waves, hum, rcond=None)[0]
    assert hum == pytest.approx(fitted, abs=1e-12)
    assert 0.06 < np.abs(hum).max() <= 0.1


def test_noise(quiet, volts_with):
    noise = volts_with(("noise_V = 0.0", "noise_V = 0.02")) - quiet.signals[:, 2:]
    assert noise.std(0) == pytest.approx([0.02, 0.02], rel=0.1)  # 1200 samples each: 2 %


def test_converter_steps(quiet, volts_with):
    """Twelve bits over ±10 V: steps of 4.9 mV, off by half a step at most."""
    volts, step = (
        volts_with(("adc_bits = 0", "adc_bits = 12"), ("range_V = 1e9", "range_V = 10.0")),
        20 / 4096,
    )
    assert volts / step == pytest.approx(np.rint(volts / step), abs=1e-9)
    assert 0.4 * step < np.abs(volts - quiet.signals[:, 2:]).max() <= 0.5 * step + 1e-12


def test_saturation(quiet, volts_with):
    bare, volts = quiet.signals[:, 2:], volts_with(("range_V = 1e9", "range_V = 1.0"))
    assert (bare > 1).any(0).all()
    assert (volts == np.clip(bare, -1, 1)).all()


def test_filter(quiet, volts_with):
    """A ramp lags by 0.5 ms, one sample."""
    lag = (quiet.signals[:, 2:] - volts_with(("filter_Hz = 0.0", "filter_Hz = 800.0")))[-50:-1]
    assert lag == pytest.approx(np.diff(quiet.signals[:, 2:], axis=0)[-50:-1], rel=0.15)


def test_encoder_steps(tmp_path, quiet):
    stepped = recording(tmp_path, ("encoder_step_deg = 0.0", "encoder_step_deg = 0.04")).signals
    assert (stepped[:, 2:] == quiet.signals[:, 2:]).all()
    assert stepped[:, 1] / 0.04 == pytest.approx(np.rint(stepped[:, 1] / 0.04), abs=1e-9)
    assert 0.019 < np.abs(stepped[:, 1] - quiet.signals[:, 1]).max() <= 0.02 + 1e-9


def test_vibration_at_touch(quiet, volts_with):
    """The propped mode from touch on, dying out; nothing else rings, as neither ramps nor stick–slip are there."""
    ringing = volts_with(("vibration = false", "vibration = true")) - quiet.signals[:, 2:]
    times, touch_s = quiet.signals[:, 0], float(quiet.stroke.time_s(0, quiet.touch.motor_rad))
    assert not ringing[times < touch_s].any()
    start, mode = int(np.searchsorted(times, touch_s)), Mode.solve(quiet.rod, quiet.touch.arc_mm)
    swings = np.diff(np.sign(ringing[start : start + 200, 1])).astype(bool).sum()  # in 0.1 s
    assert swings == pytest.approx(mode.frequency_rad_s / math.pi * 0.1, abs=2)
    assert np.abs(ringing[-100:]).max() < 0.05 * np.abs(ringing).max()


def test_vibration_by_stick_slip(tmp_path):
    """What steps without vibration becomes a wave: just after a jump the volts stand where they stood, then swing
    past the step's end.
    """
    slips = ("friction = 0.18\n", "friction = 0.18\nstatic_friction = 0.3\n")
    still = recording(tmp_path, slips)
    shaken = recording(tmp_path, slips, ("vibration = false", "vibration = true"))
    way = still.whisks[0].forward
    jumps = np.nonzero(np.diff(way.motor_rad) == 0)[0]
    assert len(jumps) >= 3
    step = (way.moment_Nmm[jumps[-1] + 1] - way.moment_Nmm[jumps[-1]])[0]
    at = int(
        np.searchsorted(
            still.signals[:, 0], float(still.stroke.time_s(0, way.motor_rad[jumps[-1]]))
        )
    )
    apart = (shaken.signals[:, 2] - still.signals[:, 2]) / step
    earlier = apart[at - 1]  # what is left of the jumps before
    assert apart[at] - earlier == pytest.approx(-1, abs=0.3)
    assert (apart[at : at + 40] - earlier).max() > 0.5


def test_clock_offset_is_in_the_frames_alone(tmp_path, quiet):
    off = recording(tmp_path, ("[gauges]", "[pictures]\nclock_offset_s = 0.02\n[gauges]"))
    assert (off.signals == quiet.signals).all() and (off.frames.time_s == quiet.frames.time_s).all()
