"""Slip on an object in both directions of its surface.

The contact's path on the surface, and how far the whisker's material slides over it, which is what
friction acts against.
"""

import itertools

import numpy as np

from bench.rig.linear import cross
from bench.rig.rod_contact import ContactState
from bench.rig.touched_object import TouchedObject
from bench.rig.whisk_mechanics import WhiskMechanics

COLUMNS = ("along_mm", "round_mm", "slid_along_mm", "slid_round_mm")


def slips_mm(whisk: WhiskMechanics, back: bool) -> np.ndarray:
    """Return (n, 4), a row for each instant of a stroke: path of the contact and slide of the
    material since first touch, each along the object's axis there and round it (axis × normal).

    Each is the sum over the path, so that what slides there and back is 0. NaN where the whisker
    is free.
    """
    slips = _sum_slips(whisk.bar, whisk.forward.states, np.zeros(4))
    return _sum_slips(whisk.bar, whisk.back.states, slips[-1]) if back else slips


def _sum_slips(bar, states, start):
    """Return the slips (n, 4) at states, from their value (4,) at the first of them."""
    slips = [start]
    for before, state in itertools.pairwise(states):
        is_free = state is None or before is None
        slips.append(np.full(4, np.nan) if is_free else slips[-1] + _step(bar, before, state))
    return np.array(slips)


def _step(bar: TouchedObject, old: ContactState, new: ContactState) -> np.ndarray:
    """Return the slips (4,) between two states, in the mean of both's directions.

    The whisker beyond the old contact was straight.
    """
    old_point, old_directions = _surface_point(bar, old)
    new_point, new_directions = _surface_point(bar, new)
    directions = (old_directions + new_directions) / 2  # (2, 3)
    bar_moved = bar.moved_mm(new.motor_rad) - bar.moved_mm(old.motor_rad)
    slid = new.point_mm - old.point_mm - old.tangent * (new.arc_mm - old.arc_mm) - bar_moved
    return np.concatenate([directions @ (new_point - old_point), directions @ slid])


def _surface_point(bar, state):
    """Return the point (3,) of the surface that is touched, on the object where it stands at
    touch, and the directions (2, 3) along and round it."""
    point = state.point_mm - bar.moved_mm(state.motor_rad)
    local = bar.local_bar(point)
    normal = local.offset_mm / np.linalg.norm(local.offset_mm)
    surface_point = point - local.offset_mm + bar.radius_mm * normal
    return surface_point, np.array([local.axis, cross(local.axis, normal)])
