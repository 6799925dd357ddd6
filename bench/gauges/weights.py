"""Weights hung on the whisker: they fix the absolute scale of the gauges, and with it the rod's stiffness.

Coefficients that rest on deflections seen are in the unit of the stiffness that the session states. A force F hung at
x from the base, pulling along rig −z, loads the base with m_y = −F x. How much that differs from what the gauges say is
how far the stated stiffness is off.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.base.combined import Measurements
from bench.base.errors import BadInput
from bench.gauges.matrix import GaugeMatrix, to_follicle
from bench.session.file_names import TRIAL_TOML
from bench.session.signals import read_signals
from bench.session.trial import Trial

# [blocks] Of a recording; their means scatter by hum and drift as well as by noise.
_BLOCKS = 10
# [sigma] A weight that is felt by less has no information on the scale. Stated.
_LEAST_SIGMAS = 3.0


@dataclass(frozen=True)
class NewtonScale:
    """True newtons over those of the stated stiffness, with sigma, and the trials that it rests on."""

    factor: float
    sigma: float
    trials: tuple[str, ...]

    def corrected(self, value: float, value_sigma_share: float = 0.0) -> tuple[float, float]:
        """Return a stated stiffness or modulus corrected by the scale, with its sigma.

        value_sigma_share: sigma over value of its other causes.
        """
        share = float(np.hypot(self.sigma, self.factor * value_sigma_share))
        return self.factor * value, value * share


def scale_by_weights(
    trials: Sequence[Trial], gauges: GaugeMatrix, zero_V: np.ndarray, zero_sigma_V: np.ndarray
) -> NewtonScale | None:
    """Return the scale from all weight trials; None where there are none.

    zero_V (2,) with sigma: of the free strokes, taken where no trial with force_N = 0 has the zero.
    Raises BadInput where the gauges do not feel a weight.
    """
    weights = [t for t in trials if t.purpose == "weight" and read_signals(t).kind == "V"]
    loaded = [t for t in weights if t.force_N]
    if not loaded:
        return None
    zeros = {t.follicle_roll_deg: _mean_volts(t) for t in weights if not t.force_N}
    found = []
    for trial in loaded:
        zero = zeros.get(trial.follicle_roll_deg, (zero_V, zero_sigma_V))
        found.append(_factor(trial, gauges, *zero))
    names = tuple(trial.name for trial in loaded)
    factors, own, common = map(np.array, zip(*found))
    mean = Measurements(factors, own, names, np.zeros(len(own)), common).mean()
    return NewtonScale(mean.value, mean.sigma, names)


def _factor(
    trial: Trial, gauges: GaugeMatrix, zero_V: np.ndarray, zero_sigma_V: np.ndarray
) -> tuple[float, float, np.ndarray]:
    """Return the factor of one weight, along the moment that it should give.

    With its own sigma, of the volts, and its change (k,) by each cause that all weights have in common:
    the gauges' coefficients, the balance, the ruler.
    """
    felt_Nmm, own_Nmm, by_gauges_Nmm = _felt_moment(trial, gauges, zero_V, zero_sigma_V)
    felt_sigma_Nmm = float(np.hypot(own_Nmm, np.linalg.norm(by_gauges_Nmm)))
    moment_Nmm = trial.force_N * trial.at_mm
    if felt_Nmm < _LEAST_SIGMAS * felt_sigma_Nmm:
        hung = f"{trial.force_N:g} N at {trial.at_mm:g} mm"
        raise BadInput(
            f"{hung} should give {moment_Nmm:.3g} N·mm; the gauges say {felt_Nmm:.3g}. Does it "
            "hang along rig −z, and is follicle_roll_deg right?",
            file=trial.label(TRIAL_TOML),
        )
    by_force = trial.force_sigma_N / trial.force_N
    by_place = trial.at_sigma_mm / trial.at_mm
    factor = moment_Nmm / felt_Nmm
    common = factor * np.array([by_force, by_place, *(by_gauges_Nmm / felt_Nmm)])
    return factor, factor * own_Nmm / felt_Nmm, common


def _felt_moment(
    trial: Trial, gauges: GaugeMatrix, zero_V: np.ndarray, zero_sigma_V: np.ndarray
) -> tuple[float, float, np.ndarray]:
    """Return the moment felt of a weight that hangs along rig −z, N·mm.

    With its sigma by the volts, and its change (k,) by each cause of the gauges' covariance.
    """
    mean_V, mean_sigma_V = _mean_volts(trial)
    volts = mean_V - zero_V
    variances = mean_sigma_V**2 + np.asarray(zero_sigma_V) ** 2
    direction = to_follicle(np.radians(trial.follicle_roll_deg)) @ [-1.0, 0.0]
    felt_Nmm = float(direction @ gauges.matrix @ volts)
    covariance = gauges.matrix @ np.diag(variances) @ gauges.matrix.T
    by_gauges_Nmm = gauges.changes_at(volts) @ direction
    return felt_Nmm, float(np.sqrt(direction @ covariance @ direction)), by_gauges_Nmm


def _mean_volts(trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean volts (2,) of a recording and their sigma, from the scatter of its blocks."""
    channels = read_signals(trial).channels
    blocks = np.array_split(channels, min(_BLOCKS, len(channels)))
    means = np.array([block.mean(axis=0) for block in blocks])
    if len(means) == 1:
        return means[0], np.zeros(2)
    return means.mean(axis=0), means.std(axis=0, ddof=1) / np.sqrt(len(means))
