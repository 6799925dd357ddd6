"""What no gauge should show: silence, a rail, channels swapped, a sign reversed. Each is refused by name."""

from collections.abc import Sequence

import numpy as np

from bench.base.errors import BadInput
from bench.gauges.felt import Stroke
from bench.gauges.gauge_readings import Pairs
from bench.gauges.matrix import GaugeMatrix

_CHANNELS = "yz"
# a channel within so many of its own noise throughout hears nothing. Set by eye
_HEARD_SIGMAS = 8.0
_LEAST_UNSATURATED = 0.2  # of the samples; a whisk that saturates late can still be used


class Undetermined(BadInput):
    """Sound readings, but too few to fix the four coefficients."""


def check_alive(strokes: Sequence[Stroke]) -> None:
    """Raises BadInput where a channel stands still in every stroke, or is saturated throughout."""
    for column, channel in enumerate(_CHANNELS):
        values = (
            np.concatenate([stroke.channels[:, column] for stroke in strokes])
            if strokes
            else np.zeros(0)
        )
        unsaturated = values[np.isfinite(values)]
        if len(values) and (
            len(unsaturated) < _LEAST_UNSATURATED * len(values) or np.ptp(unsaturated) == 0.0
        ):
            at = f"reads {unsaturated[0]:g} V" if len(unsaturated) else "is saturated"
            raise BadInput(
                f"channel {channel} {at} throughout: at its rail, or not connected", file="trials"
            )


def check_heard(pairs: Sequence[Pairs]) -> None:
    """Raises BadInput where a channel stays within its noise while the moments that it should sense are large."""
    for column, channel in enumerate(_CHANNELS):
        volts = np.concatenate([p.volts[:, column] for p in pairs])
        sigma = np.concatenate([np.sqrt(np.diag(p.volts_covariance))[column::2] for p in pairs])
        if np.all(np.abs(volts) < _HEARD_SIGMAS * sigma):
            most = np.abs(np.concatenate([p.moments[:, column] for p in pairs])).max()
            raise BadInput(
                f"channel {channel} stays within its noise ({np.abs(volts).max() * 1e3:.2g} mV) while m_{channel} "
                f"reaches {most:.3g} N·mm: is its gauge connected?",
                file="trials",
            )


def check_channels(fitted: GaugeMatrix) -> None:
    """Raises BadInput where the channels' answer to the moments seen shows them swapped or reversed."""
    answer = np.linalg.inv(fitted.matrix)
    own, other = np.abs(np.diag(answer)), np.abs(answer[[0, 1], [1, 0]])
    if np.all(other > own):
        raise BadInput(
            "channel y answers m_z and channel z answers m_y: swapped? Exchange y_V and z_V, or mend follicle_roll_deg",
            file="trials",
        )
    for channel, gain in zip(_CHANNELS, np.diag(answer)):
        if gain < 0:
            raise BadInput(
                f"channel {channel} falls where m_{channel}, as seen, rises: reversed sign? Exchange its wires, or "
                f"write -{channel}_V",
                file="trials",
            )
