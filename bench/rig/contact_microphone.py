"""A microphone at the base: the moment's changes within its band, and the rubbing of a rough surface."""

import numpy as np
from scipy import signal

from bench.rig.protocol_tables import GaugesTable, MicrophoneTable
from bench.rig.strain_gauges import OVERSAMPLED


def sample_pressure_Pa(
    microphone: MicrophoneTable,
    gauges: GaugesTable,
    moments_Nmm: np.ndarray,
    force_N: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """Convert moments (m, 2) and forces (m, 3) at the gauges' `fine_times_s` to samples (n, 1), Pa.

    The membrane follows m_z. A rough surface excites it as white noise does, by the force's size.
    """
    rate_Hz = gauges.rate_Hz * OVERSAMPLED
    rough = np.linalg.norm(force_N, axis=1) * rng.standard_normal(len(force_N))
    drive_Pa = microphone.Pa_per_Nmm * moments_Nmm[:, 1] + microphone.texture_Pa_per_N * rough
    band = signal.butter(2, microphone.band_Hz, btype="bandpass", fs=rate_Hz, output="sos")
    pressure_Pa = signal.sosfilt(band, drive_Pa - drive_Pa[0])[::OVERSAMPLED]
    noise_Pa = microphone.noise_Pa * rng.standard_normal(len(pressure_Pa))
    return (pressure_Pa + noise_Pa)[:, None]
