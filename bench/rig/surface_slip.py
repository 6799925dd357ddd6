"""Slip on an object in both directions of its surface: the way that the contact takes on it, and how far the whisker's
material slides over it, which is what friction acts against.
"""

import numpy as np

from bench.rig.bar import Bar, cross
from bench.rig.marched import Instants, MarchedWhisk
from bench.rig.rod_contact import ContactState

COLUMNS = ("along_mm", "round_mm", "slid_along_mm", "slid_round_mm")


def slips_mm(whisk: MarchedWhisk, back: bool) -> np.ndarray:
    """(n, 4), a row an instant of a way, since first touch: the contact's path on the object's surface along the
    direction of its axis there and round it (axis × normal), and the material's slide in both. Each is the sum over the
    way, so that what slides there and back is 0. NaN where the whisker is free.
    """
    begun = _summed(whisk.bar, whisk.forward, np.zeros(4))
    return _summed(whisk.bar, whisk.way(back), begun[-1]) if back else begun


def _summed(bar: Bar, way: Instants, begun: np.ndarray) -> np.ndarray:
    sums, before = [begun], way.states[0]
    for state in way.states[1:]:
        free = state is None or before is None
        sums.append(np.full(4, np.nan) if free else sums[-1] + _step(bar, before, state))
        before = state
    return np.array(sums)


def _step(bar: Bar, old: ContactState, new: ContactState) -> np.ndarray:
    """(4,): between two states, in the mean of both's directions. What is beyond the old contact was straight."""
    (touched, *ways), (touches, *now) = _at(bar, old), _at(bar, new)
    went = bar.moved_mm(new.motor_rad) - bar.moved_mm(old.motor_rad)
    path = touches - touched
    slid = new.point_mm - old.point_mm - old.tangent * (new.arc_mm - old.arc_mm) - went
    return np.array(
        [moved @ (one + other) / 2 for moved in (path, slid) for one, other in zip(ways, now)]
    )


def _at(bar: Bar, state: ContactState) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The surface's point that is touched, on the object as it stands, and the directions along and round it."""
    point = state.point_mm - bar.moved_mm(state.motor_rad)
    way, _, axis, _ = bar.around(point)
    normal = way / np.linalg.norm(way)
    return point - way + bar.radius_mm * normal, axis, cross(axis, normal)
