"""A load cell at the base: the force that the base exerts on the whisker, with noise of its own."""

import numpy as np

from bench.rig.protocol_tables import GaugesTable, LoadCellTable
from bench.rig.strain_gauges import OVERSAMPLED, low_pass


def sample_forces_N(
    cell: LoadCellTable, gauges: GaugesTable, fine_N: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Convert forces (m, 3) in the hub's axes at the gauges' `fine_times_s` to samples (n, 3).

    Rate and filter are those of the gauges.
    """
    forces = low_pass(fine_N, gauges)[::OVERSAMPLED]
    times = np.arange(len(forces))[:, None] / gauges.rate_Hz
    phase = rng.uniform(0, 2 * np.pi, 3)
    drift_sign = rng.uniform(-1, 1, 3)
    hum = cell.hum_N * np.sin(2 * np.pi * cell.hum_Hz * times + phase)
    drift = cell.drift_N_per_s * drift_sign * times
    noise = cell.noise_N * rng.standard_normal(forces.shape)
    forces = forces + hum + drift + noise
    return np.rint(forces / cell.step_N) * cell.step_N if cell.step_N else forces
