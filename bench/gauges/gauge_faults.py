"""Faults of gauges: silence, a rail, channels swapped, a sign reversed. Each is refused by name."""

from collections.abc import Sequence

import numpy as np

from bench.base.errors import BadInput
from bench.gauges.felt import FeltStroke
from bench.gauges.gauge_readings import Pairs
from bench.gauges.matrix import GaugeMatrix

_CHANNELS = "yz"
# [sigmas] A channel that stays within so many of its own noise hears nothing. In thousands of readings noise reaches
# four; twice that, for a sigma that may be too small. Derived; study: bench_thresholds.py gauges.gauge_faults
# _HEARD_SIGMAS 4 20 100 changes nothing.
_HEARD_SIGMAS = 8.0
# [1] Of the samples; a whisk that saturates late can still be used. Stated.
_LEAST_UNSATURATED = 0.2


class Undetermined(BadInput):
    """Sound readings, but too few to fix the four coefficients."""


def check_alive(strokes: Sequence[FeltStroke]) -> None:
    """Raise BadInput where a channel stands still in every stroke, or is saturated throughout."""
    if not strokes:
        return
    channels = np.concatenate([stroke.channels for stroke in strokes])  # (samples, 2)
    for channel, values in zip(_CHANNELS, channels.T):
        unsaturated = values[np.isfinite(values)]
        is_saturated = len(unsaturated) < _LEAST_UNSATURATED * len(values)
        if len(values) and (is_saturated or np.ptp(unsaturated) == 0.0):
            reads = f"reads {unsaturated[0]:g} V" if len(unsaturated) else "is saturated"
            found = f"channel {channel} {reads} throughout: at its rail, or not connected"
            raise BadInput(found, file="trials")


def check_heard(pairs: Sequence[Pairs]) -> None:
    """Raise BadInput where a channel stays within its noise while its moments are large."""
    volts = np.concatenate([p.volts for p in pairs])  # (n, 2)
    sigma = np.concatenate([np.sqrt(np.diag(p.volts_covariance)).reshape(-1, 2) for p in pairs])
    largest_V = np.abs(volts).max(axis=0)
    largest_Nmm = np.abs(np.concatenate([p.moments for p in pairs])).max(axis=0)
    is_silent = np.all(np.abs(volts) < _HEARD_SIGMAS * sigma, axis=0)
    for channel, silent, most_V, most_Nmm in zip(_CHANNELS, is_silent, largest_V, largest_Nmm):
        if silent:
            raise BadInput(
                f"channel {channel} stays within its noise ({most_V * 1e3:.2g} mV) while "
                f"m_{channel} reaches {most_Nmm:.3g} N·mm: is its gauge connected?",
                file="trials",
            )


def check_channels(fitted: GaugeMatrix) -> None:
    """Raise BadInput where the channels' sensitivity to the moments seen is swapped or reversed."""
    sensitivity = np.linalg.inv(fitted.matrix)  # (2, 2) V per N·mm
    magnitude = np.abs(sensitivity)
    if np.all(np.diag(np.fliplr(magnitude)) > np.diag(magnitude)):
        raise BadInput(
            "channel y answers m_z and channel z answers m_y: swapped? Exchange y_V and z_V, or "
            "mend follicle_roll_deg",
            file="trials",
        )
    for channel, gain in zip(_CHANNELS, np.diag(sensitivity)):
        if gain < 0:
            raise BadInput(
                f"channel {channel} falls where m_{channel}, as seen, rises: reversed sign? "
                f"Exchange its wires, or write -{channel}_V",
                file="trials",
            )
