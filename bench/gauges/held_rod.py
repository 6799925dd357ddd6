"""What holds a clamped rod where contacts are seen: moments at the clamp, force and direction at the contact."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class HeldRod:
    """A clamped rod held at n contacts, in the hub's axes.

    moments_Nmm (n, 2): m_y and m_z at the clamp. force_N (n, 3): of the object on the whisker.
    tangent (n, 3): unit vectors along the rod at the contact, away from the clamp.
    """

    moments_Nmm: np.ndarray
    force_N: np.ndarray
    tangent: np.ndarray
