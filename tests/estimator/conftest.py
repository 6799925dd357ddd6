"""Synthetic strokes: a level, a rise of known slope from a known touch, and every disturbance that gauges show."""

from dataclasses import dataclass

import numpy as np
import pytest


@dataclass(frozen=True)
class Stroke:
    """Samples of one forward stroke with their truth; moments (n, 2) in volts, slopes in V per degree."""

    time_s: np.ndarray
    motor_rad: np.ndarray
    moments: np.ndarray
    touch_deg: float
    slopes: np.ndarray

    @property
    def arrays(self):
        return self.motor_rad, self.moments


def make_stroke(
    rng,
    *,
    speed=10.0,
    start=0.75,
    end=7.0,
    touch=2.3,
    slopes=(0.08, 0.25),
    noise=0.0065,
    hum=0.001,
    drift=0.0,
    vibration=0.0,
    stick_slip=0.0,
    encoder=0.005,
):
    """2 kHz, as the protocol's DAQ: white noise, 50 Hz hum, drift in V/s, the free whisker's ring of 43 Hz, and a saw
    of sticking and slipping along the surface that grows with the pushing angle."""
    time = np.arange(0, (end - start) / speed, 1 / 2000)
    motor = start + speed * time
    pushing, slopes = np.maximum(0.0, motor - touch), np.array(slopes)
    moments = pushing[:, None] * slopes
    saw = (np.log(np.maximum(pushing, 1e-6)) / 0.05 + rng.uniform()) % 1 - 0.5
    moments = moments + stick_slip * (pushing * saw)[:, None] * np.array([slopes[1], -slopes[0]])
    ring = np.sin(2 * np.pi * 43 * time + rng.uniform(0, 6.28)) * np.exp(-time / 0.3)
    moments = moments + vibration * ring[:, None] * np.array([0.3, 1.0]) + [-0.015, -0.026]
    moments = moments + hum * np.sin(2 * np.pi * 50 * time + rng.uniform(0, 6.28))[:, None]
    moments = moments + drift * time[:, None] + noise * rng.normal(size=moments.shape)
    return Stroke(time, np.radians(np.round(motor / encoder) * encoder), moments, touch, slopes)


@pytest.fixture
def stroke():
    """The factory, called with a seeded generator and the disturbances wanted."""
    return make_stroke
