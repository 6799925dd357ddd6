"""The rod that a whisker is to its gauges: straight, or curved; chosen once, by what is stated of it."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bench.gauges.clamped_rod import load_at_clamp
from bench.gauges.curved_rod import KirchhoffRods
from bench.gauges.held_rod import HeldRod
from bench.records.trial_result import Deflection
from bench.session.rest_shape import UnloadedRod
from bench.session.whisker import Whisker

# [1] Step of differences over the contact's distance: far above rounding, far below what curves. Derived.
_STEP_SHARE = 1e-5


@dataclass(frozen=True, eq=False)
class SeenContacts:
    """Where contacts of one whisk are, as `bench.records.trial_result.Deflection` has them.

    along_mm (n,), across_mm (n, 2), along z and y: relative to the unbent whisker. theta_rad (n,):
    pushing angles. d_x_mm: radial distance of first touch.
    """

    along_mm: np.ndarray
    across_mm: np.ndarray
    theta_rad: np.ndarray
    d_x_mm: float

    @classmethod
    def of(cls, deflection: Deflection) -> "SeenContacts":
        """Return the contacts of a deflection."""
        across_mm = np.stack([deflection.across_z_mm, deflection.across_y_mm], axis=1)
        return cls(deflection.along_mm, across_mm, deflection.theta_rad, deflection.d_x_mm)

    def moved(self, step_mm: np.ndarray) -> "SeenContacts":
        """Return the contacts moved by a step (3,): along, across z and across y."""
        return replace(
            self, along_mm=self.along_mm + step_mm[0], across_mm=self.across_mm + step_mm[1:]
        )

    def derivatives(
        self, values_at: Callable[["SeenContacts"], np.ndarray], here: np.ndarray
    ) -> np.ndarray:
        """Return the derivatives (n, ..., 3), per mm, of what each contact has by where it is.

        The last axis is along, across z and across y. values_at: of contacts, the values (n, ...);
        here: those of these contacts.
        """
        step_mm = _STEP_SHARE * float(self.along_mm.max())
        moved = [values_at(self.moved(step)) for step in step_mm * np.eye(3)]
        return (np.stack(moved, axis=-1) - here[..., None]) / step_mm


class WhiskerRod(ABC):
    """A clamped rod of which it is seen where a contact holds it."""

    def moments_Nmm(self, contacts: SeenContacts, friction: float | np.ndarray) -> np.ndarray:
        """Return m_y and m_z (n, 2) at the clamp, N·mm, in the hub's axes; see `held`."""
        return self.held(contacts, friction).moments_Nmm

    def loads(self, contacts: SeenContacts, friction: float | np.ndarray) -> np.ndarray:
        """Return moments, N·mm, and the force on the whisker, N: (n, 5), in the hub's axes; see `held`."""
        held = self.held(contacts, friction)
        return np.hstack([held.moments_Nmm, held.force_N])

    @abstractmethod
    def held(self, contacts: SeenContacts, friction: float | np.ndarray) -> HeldRod:
        """Return what holds the rod at its contacts.

        friction: friction over the force across the rod at the contact, one or (n,), positive
        where it pulls towards the clamp. Raises ArithmeticError where no equilibrium is found.
        """


def _pull(whisker: Whisker, contacts: SeenContacts, friction: float | np.ndarray) -> np.ndarray:
    """Return the force (n,) towards the clamp over that across the rod: friction, and what the normal of a surface that
    tapers has along the rod."""
    of_taper = whisker.wire.radius_by_arc(contacts.along_mm)
    return np.broadcast_to(friction - of_taper, contacts.along_mm.shape)


@dataclass(frozen=True)
class StraightRod(WhiskerRod):
    """A whisker that is straight without load: it bends in the plane of clamp and force."""

    whisker: Whisker

    def held(self, contacts: SeenContacts, friction: float | np.ndarray) -> HeldRod:
        """Return what holds the rod at its contacts."""
        size = np.linalg.norm(contacts.across_mm, axis=1)
        pull = _pull(self.whisker, contacts, friction)
        load = load_at_clamp(contacts.along_mm, size, self._rigidity_Nmm2, pull)
        across = contacts.across_mm / size[:, None]
        return HeldRod(
            load.moment_Nmm[:, None] * across,
            _in_bending_plane(*load.force_N, across),
            _in_bending_plane(np.cos(load.end_rad), np.sin(load.end_rad), across),
        )

    def _rigidity_Nmm2(self, arc_mm: np.ndarray) -> np.ndarray:
        """Return EI at arc lengths."""
        whisker = self.whisker
        return whisker.EI_Nmm2 * self.whisker.beam.width(arc_mm / whisker.length_mm) ** 4


def _in_bending_plane(along: np.ndarray, aside: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) in the hub's axes of components (n,) along the clamp and in the bending direction.

    across (n, 2): the unit vectors of that direction, along z and against y.
    """
    z, y = across.T
    return np.column_stack([along, -aside * y, aside * z])


@dataclass(frozen=True)
class CurvedRod(WhiskerRod):
    """A whisker that is stated to be curved without load: it bends and twists in space."""

    whisker: Whisker

    def held(self, contacts: SeenContacts, friction: float | np.ndarray) -> HeldRod:
        """Return what holds the rod at its contacts."""
        whisker = self.whisker
        rest = UnloadedRod(whisker.unloaded_mm, whisker.length_mm)
        unbent, deflection = _in_hub(rest, contacts)
        rods = KirchhoffRods(rest, whisker.beam.width, whisker.EI_Nmm2, unbent + deflection)
        return rods.held(_pull(whisker, contacts, friction), deflection)


def _in_hub(rest: UnloadedRod, contacts: SeenContacts) -> tuple[np.ndarray, np.ndarray]:
    """Return the virtual points of the unbent whisker and the contacts less these (n, 3), hub's axes.

    The virtual point is as far along the contact frame's x axis as the contact at touch, that is as
    the whisker at d_x. What the seen unbent whisker differs from the stated one by has cancelled.
    """
    c = np.cos(contacts.theta_rad)
    s = np.sin(contacts.theta_rad)
    back_mm = contacts.along_mm - contacts.d_x_mm / c
    across_z_mm, across_y_mm = contacts.across_mm.T
    d_y_mm = c * across_y_mm - s * back_mm
    first_mm = rest.point_at_distance_mm(contacts.d_x_mm)[0]
    beyond_mm = s * across_y_mm + c * back_mm + contacts.d_x_mm - first_mm
    forward = np.stack([c, -s, 0.0 * c], axis=1)  # the contact frame's x axis
    virtual = rest.point_mm(rest.arc_along_mm(forward, np.full_like(c, first_mm)))
    deflection = [c * beyond_mm - s * d_y_mm, -s * beyond_mm - c * d_y_mm, across_z_mm]
    return virtual, np.stack(deflection, axis=1)


def rod_of(whisker: Whisker) -> WhiskerRod:
    """Return the rod of a whisker as it is stated to be."""
    return CurvedRod(whisker) if whisker.turn_rad > 0 else StraightRod(whisker)
