"""Strain gauges, amplifier and converter: from moments to the volts of signals.csv."""

import numpy as np
from scipy import signal

from bench.rig.linear import rotation_about_z
from bench.rig.protocol_tables import GaugesTable

OVERSAMPLED = 4  # times the sampling rate, ahead of the filter against aliases


def sample_times_s(gauges: GaugesTable, end_s: float) -> np.ndarray:
    """Return the sample times (n,) of a recording, from 0."""
    return np.arange(int(np.ceil(end_s * gauges.rate_Hz - 1e-6))) / gauges.rate_Hz


def fine_times_s(gauges: GaugesTable, end_s: float) -> np.ndarray:
    """Return the finer times (n · OVERSAMPLED,) at which the filter takes moments and forces."""
    count = len(sample_times_s(gauges, end_s)) * OVERSAMPLED
    return np.arange(count) / (gauges.rate_Hz * OVERSAMPLED)


def sample_volts(
    gauges: GaugesTable, moments_Nmm: np.ndarray, roll_rad: float, rng: np.random.Generator
) -> np.ndarray:
    """Convert the hub's moments (m, 2) at `fine_times_s` to volts (n, 2) of channels y and z.

    [m_y, m_z] = matrix · (volts − offset) in the axes of the follicle, which is turned about the
    whisker by `roll_rad`.
    """
    follicle_Nmm = moments_Nmm @ rotation_about_z(roll_rad)[:2, :2]
    volts = follicle_Nmm @ np.linalg.inv(gauges.matrix_Nmm_per_V).T
    volts = low_pass(volts, gauges)[::OVERSAMPLED] + gauges.offset_V
    return _digitise(gauges, volts + _draw_disturbance(gauges, len(volts), rng))


def _draw_disturbance(gauges, count, rng):
    """Draw hum, drift and noise (count, 2), V, of both channels."""
    times = np.arange(count)[:, None] / gauges.rate_Hz
    phase = rng.uniform(0, 2 * np.pi, 2)
    swing = rng.uniform(0.7, 1.0, 2)
    drift_sign = rng.uniform(-1, 1, 2)
    hum = gauges.hum_V * swing * np.sin(2 * np.pi * gauges.hum_Hz * times + phase)
    drift = gauges.drift_V_per_s * drift_sign * times
    return hum + drift + gauges.noise_V * rng.standard_normal((count, 2))


def low_pass(fine: np.ndarray, gauges: GaugesTable) -> np.ndarray:
    """Filter channels (m, k) at OVERSAMPLED times the sampling rate by the gauges' fourth-order
    Butterworth low-pass, at rest before the recording; it does nothing where filter_Hz is 0."""
    if not gauges.filter_Hz:
        return fine
    rate_Hz = gauges.rate_Hz * OVERSAMPLED
    sections = signal.butter(4, gauges.filter_Hz, fs=rate_Hz, output="sos")
    at_rest = signal.sosfilt_zi(sections)[:, :, None] * fine[0]
    return signal.sosfilt(sections, fine, axis=0, zi=at_rest)[0]


def _digitise(gauges, volts):
    """Clip volts at the rails and round them to the converter's steps."""
    if not gauges.adc_bits:
        return np.clip(volts, -gauges.range_V, gauges.range_V)
    step = 2 * gauges.range_V / 2**gauges.adc_bits
    return np.clip(np.rint(volts / step) * step, -gauges.range_V, gauges.range_V - step)
