"""Strain gauges, amplifier and converter: from moments to the volts of signals.csv."""

from dataclasses import dataclass

import numpy as np
from scipy import signal

OVERSAMPLED = 4  # times the sampling rate, ahead of the filter against aliases


@dataclass(frozen=True, eq=False)
class Gauges:
    """Two channels (y, z) of one follicle. [m_y, m_z] = matrix · (volts − offset) in the follicle's own axes."""

    matrix_Nmm_per_V: np.ndarray
    offset_V: np.ndarray
    noise_V: float
    hum_V: float
    hum_Hz: float
    drift_V_per_s: float
    filter_Hz: float
    rate_Hz: float
    adc_bits: int
    range_V: float

    def times_s(self, end_s: float) -> np.ndarray:
        """Sample times of a recording, from 0."""
        return np.arange(int(np.ceil(end_s * self.rate_Hz - 1e-6))) / self.rate_Hz

    def fine_times_s(self, end_s: float) -> np.ndarray:
        """Finer times, at which the moments are wanted so that the filter sees them before the converter does."""
        return np.arange(len(self.times_s(end_s)) * OVERSAMPLED) / (self.rate_Hz * OVERSAMPLED)

    def volts(
        self, moments_Nmm: np.ndarray, roll_rad: float, rng: np.random.Generator
    ) -> np.ndarray:
        """(n, 2) as converted, from the hub's moments at `fine_times_s`, the follicle turned about the whisker by
        `roll_rad`.
        """
        cos, sin = np.cos(roll_rad), np.sin(roll_rad)
        own = moments_Nmm @ np.array([[cos, -sin], [sin, cos]])
        volts = low_passed(
            own @ np.linalg.inv(self.matrix_Nmm_per_V).T, self.filter_Hz, self.rate_Hz
        )[::OVERSAMPLED]
        times = np.arange(len(volts))[:, None] / self.rate_Hz
        volts = volts + self.offset_V + self._disturbed(times, rng)
        return self._converted(volts)

    def _disturbed(self, times, rng):
        """White noise, the mains, and a drift of either sign."""
        phase, swing, way = (
            rng.uniform(0, 2 * np.pi, 2),
            rng.uniform(0.7, 1.0, 2),
            rng.uniform(-1, 1, 2),
        )
        hum = self.hum_V * swing * np.sin(2 * np.pi * self.hum_Hz * times + phase)
        return (
            hum
            + self.drift_V_per_s * way * times
            + self.noise_V * rng.standard_normal((len(times), 2))
        )

    def _converted(self, volts):
        """Clipped at the rails and rounded to the converter's steps."""
        if not self.adc_bits:
            return np.clip(volts, -self.range_V, self.range_V)
        step = 2 * self.range_V / 2**self.adc_bits
        return np.clip(np.rint(volts / step) * step, -self.range_V, self.range_V - step)


def low_passed(fine: np.ndarray, filter_Hz: float, rate_Hz: float) -> np.ndarray:
    """Channels (n, k) at OVERSAMPLED times the sampling rate, behind a fourth-order Butterworth low-pass that was at
    rest before the recording; as they are where `filter_Hz` is 0."""
    if not filter_Hz:
        return fine
    sos = signal.butter(4, filter_Hz, fs=rate_Hz * OVERSAMPLED, output="sos")
    settled = signal.sosfilt_zi(sos)[:, :, None] * fine[0]
    return signal.sosfilt(sos, fine, axis=0, zi=settled)[0]
