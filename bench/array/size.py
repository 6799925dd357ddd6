"""How large the object is by the contacts felt alone: the size that its shape leaves open, its place being free.

At first touch each whisker is a straight line that just touches the surface: how far the line passes off it is known by
the angle of touch, to hundredths of a millimetre, and where along it by the distance felt. Shape, direction of the axis
and a ring's thickness are taken from the manifest; place and size are fitted to both, weighted by their covariance, in
which the error of the friction angle that is assumed is one for all. Where a distance is doubtful the touch counts
alone.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.special import chdtrc

from bench.array.cloud import Contact
from bench.array.shape_verdict import FELT
from bench.array.surface import STATED, Surface
from bench.base.doubts import in_one_status
from bench.base.tables import TRIAL, Column, Kind, Table, sigma_name, status, with_sigma
from estimator.uncertainty import Z_95
from vision.geometry.counted import counted
from vision.truth.value import UNKNOWN, Value

SIZE = Table(
    "size",
    "Of an array: a row a trial whose manifest names its object: how large that is by the contacts "
    "of (10), its place free ([arrays.md](arrays.md)).",
    (
        TRIAL,
        Column("shape", "as the manifest has it", Kind.TEXT),
        Column("contacts", "how many touches served"),
        Column("distances", "how many of their distances served: those of the others are doubtful"),
        *with_sigma("radius_mm", "of a bar or sphere, or of a ring's circle"),
        Column("stated_radius_mm", "the radius as the manifest has it"),
        *with_sigma("half_angle_deg", "of a cone"),
        Column("stated_half_angle_deg", "the half angle as the manifest has it"),
        Column("chance", "that contacts on such a surface lie as far off it"),
        status("why there is none, or what is doubtful of it"),
    ),
)
_SIZES = {
    "bar": "radius_mm",
    "sphere": "radius_mm",
    "ring": "ring_radius_mm",
    "cone": "half_angle_rad",
}
_STEP = 1e-3  # mm, rad: of differences
# that contacts on such a surface lie as far off it: one sound object in a thousand
_LEAST_CHANCE = 1e-3


@dataclass(frozen=True)
class Felt:
    """The size felt of one trial's object, in the unit of the field of `Surface` that it is, `key`. contacts,
    distances: how many touches served, and distances; chance: that contacts lie as far off such a surface.
    """

    trial: str
    surface: Surface
    contacts: int
    distances: int
    size: Value = UNKNOWN
    chance: float = np.nan
    status: str = ""

    @property
    def key(self) -> str:
        """The field of `Surface`."""
        return _SIZES[self.surface.shape]

    @property
    def stated(self) -> float:
        """By the manifest."""
        return getattr(self.surface, self.key)


def felt_sizes(cloud: Iterable[Contact], surfaces: dict[str, Surface]) -> list[Felt]:
    """A size a trial whose object the manifest names, by the contacts of (10)."""
    mine = [contact for contact in cloud if contact.estimator == FELT and contact.has_touch]
    return [
        felt_size(trial, [contact for contact in mine if contact.trial == trial], surface)
        for trial, surface in surfaces.items()
        if surface.source == STATED and any(contact.trial == trial for contact in mine)
    ]


def felt_size(trial: str, contacts: Sequence[Contact], surface: Surface) -> Felt:
    """Gauss and Newton's method from where and how large the object is said to be."""
    from scipy.optimize import (
        least_squares,
    )  # not before it is needed: it takes longer than an evaluation's tables

    free, distances = _free(surface), sum(not contact.status for contact in contacts)
    served = trial, surface, len(contacts), distances
    freedom = len(contacts) + distances - len(free) - 1
    if freedom < 1:
        return Felt(*served, status=f"too few, of {counted(distances, 'sound distance')}")
    root = np.linalg.cholesky(_covariance(contacts, surface))

    def off(numbers: np.ndarray) -> np.ndarray:
        return np.linalg.solve(root, _off(contacts, _placed(surface, free, numbers)))

    def slopes(numbers: np.ndarray) -> np.ndarray:
        return np.linalg.solve(root, _slopes(contacts, surface, free, numbers))

    start = np.zeros(len(free) + 1)
    found = least_squares(off, start, method="lm", jac=slopes)
    information = found.jac.T @ found.jac
    if not np.isfinite(information).all() or np.linalg.cond(information) > 1e12:
        return Felt(*served, status="contacts leave the size open")
    size = Value(
        getattr(surface, _SIZES[surface.shape]) + float(found.x[-1]),
        float(np.sqrt(np.linalg.inv(information)[-1, -1])),
    )
    chance = float(chdtrc(freedom, 2 * found.cost))
    return Felt(*served, size, chance, _status(size, chance))


def _status(size: Value, chance: float) -> str:
    if chance < _LEAST_CHANCE:
        return f"contacts lie farther off such a surface than their sigmas let them (chance {chance:.1g})"
    return "not told: the interval holds 0" if size.value < Z_95 * size.sigma else ""


def _free(surface: Surface) -> np.ndarray:
    """Directions (k, 3) in which the place is free: all, but for a bar those across it."""
    if surface.shape != "bar":
        return np.eye(3)
    return np.linalg.svd(surface.axis[None])[2][1:]


def _placed(surface: Surface, free: np.ndarray, numbers: np.ndarray) -> Surface:
    key = _SIZES[surface.shape]
    point = surface.point_mm + numbers[:-1] @ free
    return replace(surface, point_mm=point, **{key: getattr(surface, key) + float(numbers[-1])})


def _off(contacts: Sequence[Contact], surface: Surface) -> np.ndarray:
    """(2 n,) mm: of each contact how far the whisker passes off the surface, and how far it lies along from there."""
    nearest = _nearest(contacts, surface)
    outside, _ = _beside(contacts, surface, nearest)
    radii = [contact.wire.radius_mm(arc) for contact, arc in zip(contacts, nearest)]
    return np.stack(
        [outside - radii, [contact.arc_mm for contact in contacts] - nearest], -1
    ).ravel()


def _slopes(
    contacts: Sequence[Contact], surface: Surface, free: np.ndarray, numbers: np.ndarray
) -> np.ndarray:
    """(2 n, k): their derivatives. Where the whisker comes nearest its distance does not change along it, and the place
    moves so that the normal stays across it."""
    here = _placed(surface, free, numbers)
    nearest = _nearest(contacts, here)
    by_arc = _difference(lambda step: _beside(contacts, here, nearest + step)[1])
    columns = []
    for axis in np.eye(len(numbers)):
        moved = (
            _beside(contacts, _placed(surface, free, numbers + step * axis), nearest)
            for step in (_STEP, -_STEP)
        )
        outside, leaning = (np.subtract(*pair) / (2 * _STEP) for pair in zip(*moved))
        columns.append(np.stack([outside, leaning / by_arc], -1).ravel())
    return np.stack(columns, -1)


def _difference(at) -> np.ndarray:
    return (at(_STEP) - at(-_STEP)) / (2 * _STEP)


def _nearest(contacts: Sequence[Contact], surface: Surface) -> np.ndarray:
    """Where each whisker, straight at first touch, comes nearest to the surface: arcs (n,), mm."""
    lines = ((contact.base_mm, contact.towards, contact.wire.length_mm) for contact in contacts)
    return np.array([surface.nearest_arc_mm(*line) for line in lines])


def _beside(
    contacts: Sequence[Contact], surface: Surface, arc_mm: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """How far each whisker is off the surface there (n,), mm, and the cosine (n,) between it and the normal."""
    towards = np.array([contact.towards for contact in contacts])
    points = np.array([contact.base_mm for contact in contacts]) + arc_mm[:, None] * towards
    outside, normals = surface.distance_mm(points)
    return outside, np.sum(normals * towards, axis=1)


def _covariance(contacts: Sequence[Contact], surface: Surface) -> np.ndarray:
    """(2 n, 2 n) mm² of what they are off by: each contact's own, and the friction angle's, which is one for all."""
    towards = np.array([contact.towards for contact in contacts])
    places = (
        np.array([contact.base_mm for contact in contacts])
        + _nearest(contacts, surface)[:, None] * towards
    )
    whole, shared = np.zeros((2 * len(contacts),) * 2), []
    for number, (contact, normal) in enumerate(zip(contacts, surface.distance_mm(places)[1])):
        axes, by_alpha = np.stack([normal, contact.towards]), contact.by_alpha_mm * contact.towards
        own = contact.covariance_mm2 - np.outer(by_alpha, by_alpha)
        if contact.status:  # its distance is any that the whisker has
            own = own + contact.wire.length_mm**2 * np.outer(contact.towards, contact.towards)
        both = slice(2 * number, 2 * number + 2)
        whole[both, both] = axes @ own @ axes.T
        shared += [*axes @ by_alpha]
    return whole + np.outer(shared, shared)


def write_sizes(out: Path, found: Iterable[Felt]) -> None:
    """Write size.csv into a folder: a row a trial."""
    SIZE.write(out, map(_row, found))


def _row(felt: Felt) -> dict:
    row = {"trial": felt.trial, "shape": felt.surface.shape, "chance": felt.chance}
    row |= {"contacts": felt.contacts, "distances": felt.distances}
    name, to_shown = _shown(felt)
    sizes = {
        name: felt.size.value,
        sigma_name(name): felt.size.sigma,
        f"stated_{name}": felt.stated,
    }
    return row | {"status": felt.status} | {key: to_shown * value for key, value in sizes.items()}


def _shown(felt: Felt) -> tuple[str, float]:
    """Column and factor to its unit. A ring's radius is its circle's."""
    return (
        ("half_angle_deg", np.degrees(1.0)) if felt.surface.shape == "cone" else ("radius_mm", 1.0)
    )


def size_lines(found: Iterable[Felt]) -> Iterator[str]:
    """A line a trial."""
    for felt in found:
        name, to_shown = _shown(felt)
        unit = "mm" if name.endswith("mm") else "deg"
        value, sigma, stated = (
            to_shown * number for number in (felt.size.value, felt.size.sigma, felt.stated)
        )
        what = f"{felt.trial}: {felt.surface.shape}, {counted(felt.contacts, 'contact')}"
        if not np.isfinite(value):
            yield f"{what}: no size; {felt.status}"
            continue
        told = f"{name.rpartition('_')[0].replace('_', '-')} {value:.2f} ± {sigma:.2f} {unit}, stated {stated:.2f}"
        yield in_one_status(f"{what}: {told}", felt.status)
