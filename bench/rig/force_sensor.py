"""A load cell at the base: the force that the base exerts on the whisker, with noise of its own."""

from dataclasses import dataclass

import numpy as np

from bench.rig.strain_gauges import OVERSAMPLED, low_passed


@dataclass(frozen=True)
class LoadCell:
    """Three channels (x, y, z), N, in the hub's axes; noise, mains and drift in N. The filter is that of the gauges."""

    noise_N: float
    hum_N: float
    hum_Hz: float
    drift_N_per_s: float
    step_N: float
    filter_Hz: float
    rate_Hz: float

    def forces_N(self, fine_N: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(n, 3) as converted, from the forces at the gauges' `fine_times_s`."""
        forces = low_passed(fine_N, self.filter_Hz, self.rate_Hz)[::OVERSAMPLED]
        times = np.arange(len(forces))[:, None] / self.rate_Hz
        phase, way = rng.uniform(0, 2 * np.pi, 3), rng.uniform(-1, 1, 3)
        hum = self.hum_N * np.sin(2 * np.pi * self.hum_Hz * times + phase)
        forces = (
            forces
            + hum
            + self.drift_N_per_s * way * times
            + self.noise_N * rng.standard_normal(forces.shape)
        )
        return np.rint(forces / self.step_N) * self.step_N if self.step_N else forces
