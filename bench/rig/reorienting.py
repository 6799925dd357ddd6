"""A motor with a second axis: between rotations it turns its plane so that the whisker slips less.

The controller goes by what the gauges give, as a robot would: noise, hum and ringing are in it. It
turns the plane by the direction of the deflection, which is slope less friction angle.
"""

from collections.abc import Callable

import numpy as np

from bench.rig.protocol import ProtocolRun
from bench.rig.recording import Recording

# [1] Of the push, from its end: the samples that the controller takes. Before, the moment is small.
# Stated.
_SHARE_TAKEN = 0.5


def turned_plane(run: ProtocolRun, stream: Callable[[int], np.random.Generator]) -> ProtocolRun:
    """Return a run with its plane turned by all rotations before it.

    stream: the random stream of each rotation, by its number. Raises ArithmeticError where the whisker
    slips off in one of them.
    """
    turned = run.turned(0.0)
    for rotation in range(1, run.rotation):
        recording = Recording.make(turned, stream(rotation))
        slip_deg = felt_slip_deg(recording)
        turned = run.turned(turned.plane_turn_deg + slip_deg)
    return turned


def felt_slip_deg(recording: Recording) -> float:
    """Return the direction of the deflection, degrees from the plane of rotation, by the gauges."""
    _, motor_deg, y_V, z_V = recording.signals.T[:4]
    volts = np.stack([y_V, z_V], axis=-1)
    touch_deg = np.degrees(recording.touch.motor_rad)
    free = motor_deg < touch_deg
    pushing = motor_deg > motor_deg.max() - _SHARE_TAKEN * (motor_deg.max() - touch_deg)
    change_V = volts[pushing].mean(axis=0) - volts[free].mean(axis=0)
    m_y, m_z = np.array(recording.run.protocol.gauges.matrix_Nmm_per_V) @ change_V
    return float(np.degrees(np.arctan2(m_y, m_z)))
