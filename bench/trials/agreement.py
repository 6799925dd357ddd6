"""Felt against seen, whisk by whisk: the moments at the base that follow from the seen shape, and
those that were felt.

The former are the exact rod's through the contact (`bench.gauges.whisker_rods`), frame by frame; the
latter are the channels at the same motor angles. Both rise from nothing at touch on a line, so
their slopes are compared, two numbers with one covariance: of pictures, distance, friction along
the rod, noise, zero, gauges and the follicle's turn.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from bench.gauges.gauge_readings import Pairs
from bench.gauges.matrix import GaugeMatrix
from bench.trials.differences import LEAST_CHANCE, Cause, Difference, constant_message
from vision.geometry import NO_REASON, Reason

_EXPLAINED = 0.01  # of the chance that a cause must leave
# [1] Of the seen moment, by which the felt one in another unit may miss it: no fault of a gauge is a
# factor of 1000, so that beside one another fault may stand. Stated.
_UNIT_MISS = 0.5
_UNEXPLAINED = (
    "no fault of the gauges alone explains it; look whether these are another trial's signals"
)
_NOTHING = np.zeros(2)


@dataclass(frozen=True)
class OtherReading:
    """Another reading of the channels: the matrix that makes moments of them, and the sentence on it."""

    gauges: GaugeMatrix
    sentence: str


def other_units(gauges: GaugeMatrix, is_gauged: bool) -> list[OtherReading]:
    """Return the readings of the channels in other units: volts of gauges, or moments as such."""
    if is_gauged:
        return [
            OtherReading(
                gauges.scaled(1e-3),
                "y_V and z_V look like millivolts, or the gauges' factors like those of millivolts",
            ),
            OtherReading(gauges.scaled(1e3), "the gauges' factors look like N·m per volt"),
        ]
    units = {"N·m": 1e3, "kN·m": 1e6, "N·µm": 1e-3, "nN·m": 1e-6}
    readings = []
    for unit, Nmm in units.items():
        sentence = f"m_y_Nmm and m_z_Nmm look like {unit}: multiply them by {Nmm:g}"
        readings.append(OtherReading(gauges.scaled(Nmm), sentence))
    return readings


@dataclass(frozen=True)
class MomentAgreement:
    """χ² of felt less seen moments, 2 degrees of freedom, and its chance.

    cause: sentence on the fault where both disagree, '' where they agree. is_explained: a fault of
    the gauges or of the stated stiffness is that cause.
    """

    chi2: float
    chance: float
    cause: str = ""
    is_explained: bool = False

    @property
    def status(self) -> Reason:
        """Return the status of the whisk; NO_REASON where both agree."""
        if self.chance >= LEAST_CHANCE:
            return NO_REASON
        found = f"(χ² {self.chi2:.0f}, 2 degrees of freedom)"
        sentence = f"felt moments are not those of the seen shape {found}: {self.cause}"
        return Reason("gauge_fault" if self.is_explained else "shape_not_felt", sentence)


def agreement(
    pairs: Pairs,
    gauges: GaugeMatrix,
    scale_sigma: float = 0.0,
    others: Sequence[OtherReading] = (),
) -> MomentAgreement:
    """Compare a whisk's felt moments with its seen ones, per radian of pushing.

    scale_sigma: share by which all moments may be wrong together, beyond that of the pairs: of C,
    where the gauges bring newtons of their own. others: what the channels may be instead.
    """
    weights = pairs.theta_rad / (pairs.theta_rad @ pairs.theta_rad)  # (n,): slope through zero
    volts = weights @ pairs.volts
    seen = weights @ pairs.moments
    scale = pairs.scale_sigma**2 + scale_sigma**2
    covariance = _covariance(pairs, gauges, weights, volts) + scale * np.outer(seen, seen)
    felt = gauges.matrix @ volts
    difference = Difference(felt - seen, np.linalg.inv(covariance), 2)
    chi2 = difference.chi2
    chance = float(chdtrc(2, chi2))
    if chance >= LEAST_CHANCE:
        return MomentAgreement(chi2, chance)
    sentence = _other_reading(volts, seen, others)
    sentence = sentence or _explanation(difference, volts, gauges.matrix, seen)
    return MomentAgreement(chi2, chance, sentence or _UNEXPLAINED, is_explained=bool(sentence))


def _explanation(
    difference: Difference, volts: np.ndarray, matrix: np.ndarray, seen: np.ndarray
) -> str:
    """Return the sentence on the fault of channels or gauges that explains the difference; '' without one.

    volts, seen (2,): slopes of volts and of the seen moments over the pushing angle.
    """
    causes = [
        *_exchanges(volts, matrix),
        *_turns(matrix @ volts, seen),
        *_possible_scales(difference, volts, matrix),
    ]
    return difference.explained_by(causes, _EXPLAINED)


def _other_reading(volts: np.ndarray, seen: np.ndarray, others: Sequence[OtherReading]) -> str:
    """Return the sentence on the reading that brings volts (2,) nearest to the seen moments (2,).

    It is '' where none does by far.
    """
    nearest, sentence = _UNIT_MISS * float(np.linalg.norm(seen)), ""
    for other in others:
        miss = float(np.linalg.norm(other.gauges.matrix @ volts - seen))
        if miss < nearest:
            nearest, sentence = miss, other.sentence
    return sentence


def _covariance(
    pairs: Pairs, gauges: GaugeMatrix, weights: np.ndarray, volts: np.ndarray
) -> np.ndarray:
    """Return the covariance (2, 2) of the slopes, felt less seen, from the pairs and the gauges.

    weights (n,), volts (2,): of the slopes. The cameras' errors are in both, and partly cancel.
    """
    to_moments = np.kron(np.eye(len(pairs)), gauges.matrix)  # (2n, 2n)
    of_slopes = np.kron(weights, np.eye(2))  # (2, 2n)
    felt = to_moments @ pairs.volts_covariance @ to_moments.T
    felt_by_cameras = gauges.by_camera_error_at(volts).T
    seen_by_cameras = of_slopes @ pairs.by_camera_error
    apart = seen_by_cameras.copy()
    apart[:, : felt_by_cameras.shape[1]] -= felt_by_cameras
    of_gauges = gauges.covariance_at(volts) - felt_by_cameras @ felt_by_cameras.T
    own = of_slopes @ (pairs.moments_covariance + felt) @ of_slopes.T
    return own + of_gauges + apart @ apart.T


def _exchanges(volts: np.ndarray, matrix: np.ndarray) -> Iterator[Cause]:
    """Yield the faults of channels that are exchanged or reversed."""
    exchanged = {
        "y_V and z_V look exchanged": volts[::-1],
        "y_V looks reversed": volts * [-1, 1],
        "z_V looks reversed": volts * [1, -1],
        "y_V and z_V look reversed": -volts,
    }
    for sentence, right in exchanged.items():
        yield Cause(constant_message(sentence), matrix @ (volts - right), None, 0)


def _turns(felt: np.ndarray, seen: np.ndarray) -> Iterator[Cause]:
    """Yield the fault of a follicle that is turned otherwise than stated."""
    cross = felt[0] * seen[1] - felt[1] * seen[0]
    turn = np.arctan2(cross, felt @ seen)
    cos = np.cos(turn)
    sin = np.sin(turn)
    turned = np.array([[cos, -sin], [sin, cos]]) @ felt
    message = f"the follicle looks turned by {np.degrees(turn):+.1f}° more than stated"
    yield Cause(constant_message(message), felt - turned, None, 1)


def _possible_scales(
    difference: Difference, volts: np.ndarray, matrix: np.ndarray
) -> Iterator[Cause]:
    """Yield the faults of scale that would explain a difference without reversing a moment."""
    for cause in _scales(volts, matrix):
        _, excess = difference.without(cause)
        if excess < 1.0:
            yield cause


def _scales(volts: np.ndarray, matrix: np.ndarray) -> Iterator[Cause]:
    """Yield the faults of one gauge's factor and of the stated stiffness.

    The size of each is the share of these moments that is felt in excess.
    """
    for channel, name in enumerate(("y_V", "z_V")):
        yield Cause(_slipped_message(name), _NOTHING, matrix[:, channel] * volts[channel], 1)
    yield Cause(_stiffness_message, _NOTHING, matrix @ volts, 1)


def _slipped_message(name: str) -> Callable[[float], str]:
    """Return the message on a gauge that gives more or less than it should."""
    return lambda excess: (
        f"gauge {name} looks slipped, it gives {100 / (1.0 - excess):.0f} % of what it should, "
        "or drifts while the whisker pushes"
    )


def _stiffness_message(excess: float) -> str:
    """Return the sentence on a whisker of another stiffness."""
    percent = 100 * (1.0 - excess)
    return f"the whisker looks {percent:.1f} % as stiff in the gauges' newtons as its E says"
