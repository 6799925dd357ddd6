"""The filter has no delay, and bridges what is missing."""

import numpy as np
import pytest

from estimator.lowpass import zero_phase_lowpass

pytestmark = pytest.mark.filterwarnings("error")


@pytest.mark.parametrize("cutoff_Hz", [5.0, 45.0])
def test_half_power_at_the_cutoff_without_delay(cutoff_Hz):
    """A sine at the cut-off keeps its phase and 1/√2 of its height; far from the ends to 1e-3."""
    time = np.arange(0, 40 / cutoff_Hz, 1 / 2000)
    sine = np.sin(2 * np.pi * cutoff_Hz * time)
    filtered = zero_phase_lowpass(sine, 2000.0, cutoff_Hz)
    inside = slice(len(time) // 4, 3 * len(time) // 4)
    np.testing.assert_allclose(filtered[inside], sine[inside] / np.sqrt(2), atol=1e-3)


def test_slow_passes_and_fast_does_not():
    time = np.arange(0, 4, 1 / 2000)
    slow, fast = np.sin(2 * np.pi * 0.5 * time), np.sin(2 * np.pi * 50 * time)
    filtered = zero_phase_lowpass(np.stack([slow, fast], axis=1), 2000.0, 5.0)[2000:6000]
    np.testing.assert_allclose(filtered[:, 0], slow[2000:6000], atol=2e-3)
    assert np.abs(filtered[:, 1]).max() < 2e-3


def test_lines_pass_unchanged_to_their_ends():
    """Odd padding continues a line as a line."""
    line = np.linspace(0.0, 3.0, 1240)
    np.testing.assert_allclose(zero_phase_lowpass(line, 2000.0, 5.0), line, atol=1e-3)


@pytest.mark.parametrize("cutoff_Hz", [0.0, -5.0, 1000.0, np.nan])
def test_impossible_cutoffs_are_refused(cutoff_Hz):
    with pytest.raises(ValueError, match="cutoff_Hz"):
        zero_phase_lowpass(np.zeros(100), 2000.0, cutoff_Hz)


def test_missing_samples_stay_missing_and_harm_no_others(stroke):
    """Five samples of 2 kHz bridged by a line are 2.5 ms, a hundredth of the 5 Hz filter's reach."""
    s = stroke(np.random.default_rng(1))
    whole = zero_phase_lowpass(s.moments, 2000.0, 5.0)
    s.moments[100:105, 1] = np.nan
    filtered = zero_phase_lowpass(s.moments, 2000.0, 5.0)
    assert np.isnan(filtered[100:105, 1]).all()
    assert np.isnan(filtered).sum() == 5
    np.testing.assert_allclose(
        filtered[~np.isnan(filtered)], whole[~np.isnan(filtered)], atol=0.0065 * 5 / 200
    )
    assert np.isnan(zero_phase_lowpass(np.full(100, np.nan), 2000.0, 5.0)).all()


@pytest.mark.parametrize("cutoff_Hz, n", [(5.0, 4000), (45.0, 700), (900.0, 300), (5.0, 40)])
def test_the_low_pass_is_scipy_s(rng, cutoff_Hz, n):
    """Loading scipy.signal takes longer than all else that one whisk needs of this package."""
    from scipy.signal import butter, sosfiltfilt

    x = np.cumsum(rng.standard_normal((n, 2)), axis=0)
    each_way = min(cutoff_Hz / (np.sqrt(2) - 1) ** 0.25, 0.499 * 2000.0)
    sections = butter(2, each_way, fs=2000.0, output="sos")
    theirs = sosfiltfilt(sections, x, axis=0, padlen=min(n - 1, int(3 * 2000.0 / cutoff_Hz)))
    np.testing.assert_allclose(
        zero_phase_lowpass(x, 2000.0, cutoff_Hz), theirs, atol=1e-9 * np.ptp(x)
    )
