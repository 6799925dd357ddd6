"""Weights hung on the whisker: they fix the absolute scale of the gauges, and with it the rod's stiffness.

Coefficients that rest on deflections seen are in the unit of the stiffness that the session states. A force F hung at
x from the base, pulling along rig −z, asks the base for m_y = −F x. How much that differs from what the gauges say is
how far the stated stiffness is off.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.base.errors import BadInput
from bench.gauges.matrix import GaugeMatrix, to_follicle
from bench.session.signals import read_signals
from bench.session.trial import Trial

_BLOCKS = 10  # of a recording; their means scatter by hum and drift as well as by noise
_LEAST_SIGMAS = 3.0  # a weight that is felt by less tells no scale


@dataclass(frozen=True)
class Scale:
    """True newtons over those of the stated stiffness, with sigma, and the trials that it rests on."""

    factor: float
    sigma: float
    trials: tuple[str, ...]

    def of(self, value: float, value_sigma_share: float = 0.0) -> tuple[float, float]:
        """A stated stiffness or modulus put right, with its sigma; value_sigma_share: of what else it rests on."""
        return self.factor * value, value * float(
            np.hypot(self.sigma, self.factor * value_sigma_share)
        )


def scale_by_weights(
    trials: Sequence[Trial], gauges: GaugeMatrix, zero_V: np.ndarray, zero_sigma_V: np.ndarray
) -> Scale | None:
    """The scale from all weight trials; None where there are none.

    zero_V (2,) with sigma: of the free strokes, taken where no trial with force_N = 0 shows the zero.
    Raises BadInput where the gauges do not feel a weight.
    """
    weights = [t for t in trials if t.purpose == "weight" and read_signals(t).kind == "V"]
    loaded = [t for t in weights if t.force_N]
    if not loaded:
        return None
    zeros = {t.follicle_roll_deg: _reading(t) for t in weights if not t.force_N}
    scaled = [
        _one(t, gauges, *zeros.get(t.follicle_roll_deg, (zero_V, zero_sigma_V))) for t in loaded
    ]
    factors, sigmas = np.array(scaled).T
    shares = sigmas**-2.0 / np.sum(sigmas**-2.0)
    factor = float(shares @ factors)
    # Scales, balances and rulers may be common to all: their sigma is not divided by the number of weights.
    scatter = np.sqrt(np.sum(shares**2 * (factors - factor) ** 2))
    return Scale(factor, float(max(shares @ sigmas, scatter)), tuple(t.name for t in loaded))


def _one(trial: Trial, gauges: GaugeMatrix, zero_V, zero_sigma_V) -> tuple[float, float]:
    """Factor and sigma of one weight: along the moment that it should give."""
    volts, volts_sigma = _reading(trial)
    volts, variances = volts - zero_V, volts_sigma**2 + np.asarray(zero_sigma_V) ** 2
    direction = to_follicle(np.radians(trial.follicle_roll_deg)) @ [-1.0, 0.0]
    felt = float(direction @ gauges.matrix @ volts)
    covariance = gauges.matrix @ np.diag(variances) @ gauges.matrix.T + gauges.covariance_at(volts)
    felt_sigma = float(np.sqrt(direction @ covariance @ direction))
    if felt < _LEAST_SIGMAS * felt_sigma:
        raise BadInput(
            f"{trial.force_N:g} N at {trial.at_mm:g} mm should give {trial.force_N * trial.at_mm:.3g} N·mm; the gauges "
            f"say {felt:.3g}. Does it hang along rig −z, and is follicle_roll_deg right?",
            file=trial.shown("trial.toml"),
        )
    factor = trial.force_N * trial.at_mm / felt
    shares = (
        trial.force_sigma_N / trial.force_N,
        trial.at_sigma_mm / trial.at_mm,
        felt_sigma / felt,
    )
    return factor, factor * float(np.linalg.norm(shares))


def _reading(trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Mean volts (2,) of a recording and their sigma, from the scatter of its parts."""
    signals = read_signals(trial)
    parts = np.array_split(np.stack([signals.y, signals.z], axis=1), min(_BLOCKS, len(signals.y)))
    means = np.array([part.mean(axis=0) for part in parts])
    return means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(len(means)) if len(
        means
    ) > 1 else np.zeros(2)
