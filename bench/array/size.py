"""The size of the object by the felt contacts alone: of its shape the size is open, and its place free.

At first touch each whisker is a straight line that just touches the surface: its gap to the surface
is known by the angle of touch, to hundredths of a millimetre, and the place along it by the felt
distance. Shape, direction of the axis and a ring's thickness are those of the manifest; place and
size are fitted to both, weighted by their covariance, in which the error of the assumed friction
angle is one for all. The whisks of one whisker share its base and its gauges, and count as one contact. Where a
distance has a warning the touch counts alone.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag
from scipy.special import chdtrc

from bench.analyses.pooling import column, grouped
from bench.array.cloud import ContactPoint
from bench.array.shape_verdict import FELT
from bench.array.surface import STATED, ObjectSurface
from bench.base.input_problems import in_one_status
from bench.base.statuses import reason
from bench.base.tables import TRIAL, Column, Kind, Table, sigma_name, status, with_sigma
from estimator.uncertainty import Z_95
from vision import UNKNOWN, Value
from vision.geometry import NO_REASON, Reason, counted

SIZE = Table(
    "size",
    "Of an array: a row a trial whose manifest names its object: how large that is by the contacts "
    "of (10), its place free ([arrays.md](arrays.md)).",
    (
        TRIAL,
        Column("shape", "as the manifest has it", Kind.TEXT),
        Column("contacts", "how many touches served"),
        Column(
            "distances", "how many of their distances served: those of the others have a warning"
        ),
        *with_sigma("radius_mm", "of a bar or sphere, or of a ring's circle"),
        Column("stated_radius_mm", "the radius as the manifest has it"),
        *with_sigma("half_angle_deg", "of a cone"),
        Column("stated_half_angle_deg", "the half angle as the manifest has it"),
        Column("chance", "that contacts on such a surface lie as far off it"),
        status("why there is none, or its warnings"),
    ),
)
# [mm, rad] Step of differences: their error goes with its square. Derived.
_STEP = 1e-3
# [1] Least probability that contacts on such a surface lie as far off it: one sound object in a thousand. Stated.
_LEAST_CHANCE = 1e-3
# [1] Condition of the information, beyond which some direction is not determined: rounding. Derived.
_MOST_CONDITION = 1e12


@dataclass(frozen=True)
class FeltSize:
    """The felt size of one trial's object, in the unit of its field of `ObjectSurface`.

    contacts, distances: numbers of touches and of distances that were used. chance: probability
    that contacts on such a surface lie as far off it.
    """

    trial: str
    surface: ObjectSurface
    contacts: int
    distances: int
    size: Value = UNKNOWN
    chance: float = np.nan
    status: str = ""

    @property
    def stated(self) -> float:
        """Return the size by the manifest."""
        return getattr(self.surface, self.surface.form.size)

    @property
    def column(self) -> str:
        """Return the name of its column of SIZE; a ring's radius is its circle's."""
        return self.surface.form.column

    def in_unit_of_column(self, size: float) -> float:
        """Convert a size to the unit of the column."""
        return self.surface.form.in_unit_of_column(size)


def fit_sizes(cloud: Iterable[ContactPoint], surfaces: dict[str, ObjectSurface]) -> list[FeltSize]:
    """Fit a size to the contacts of (10) of each trial whose object the manifest names."""
    by_trial = {}
    for contact in cloud:
        if contact.estimator == FELT and contact.has_touch:
            by_trial.setdefault(contact.trial, []).append(contact)
    sizes = []
    for trial, surface in surfaces.items():
        if surface.source == STATED and trial in by_trial:
            sizes.append(fit_size(trial, by_trial[trial], surface))
    return sizes


def fit_size(trial: str, contacts: Sequence[ContactPoint], surface: ObjectSurface) -> FeltSize:
    """Fit place and size of an object, by Gauss and Newton's method from what is stated of it."""
    distances = sum(not contact.status for contact in contacts)
    unknown = FeltSize(trial, surface, len(contacts), distances)
    of_whiskers = one_a_whisker(contacts)
    fit = _SizeFit(of_whiskers, surface)
    known = sum(not contact.status for contact in of_whiskers)
    freedom = len(of_whiskers) + known - fit.count
    if freedom < 1:
        sound = counted(distances, "sound distance")
        return replace(unknown, status=reason("contacts_few", distances=sound))
    return _as_size(unknown, fit, freedom)


def _as_size(unknown: FeltSize, fit: "_SizeFit", freedom: int) -> FeltSize:
    """Return the size with what the fit finds; with a status where the contacts leave it open."""
    change, information, cost = fit.solve()
    if not np.isfinite(information).all() or np.linalg.cond(information) > _MOST_CONDITION:
        return replace(unknown, status=reason("size_open"))
    sigma = float(np.sqrt(np.linalg.inv(information)[-1, -1]))
    size = Value(unknown.stated + change, sigma)
    chance = float(chdtrc(freedom, cost))
    return replace(unknown, size=size, chance=chance, status=_status(size, chance))


def one_a_whisker(contacts: Sequence[ContactPoint]) -> list[ContactPoint]:
    """Return the mean contact of each whisker, with the mean covariance of one contact.

    Contacts with a warning count where a whisker has no others.
    """
    found = []
    for of_whisker in grouped(contacts, lambda contact: contact.whisker).values():
        sound = [contact for contact in of_whisker if not contact.status] or of_whisker
        mean = replace(
            sound[0],
            point_mm=column(sound, "point_mm").mean(axis=0),
            covariance_mm2=column(sound, "covariance_mm2").mean(axis=0),
            by_alpha_mm=float(column(sound, "by_alpha_mm").mean()),
        )
        found.append(mean)
    return found


def _status(size: Value, chance: float) -> Reason:
    """Return the warnings about a fitted size."""
    if chance < _LEAST_CHANCE:
        return reason("contacts_off_surface", chance=chance)
    return reason("size_may_be_zero") if size.value < Z_95 * size.sigma else NO_REASON


class _SizeFit:
    """Whiskers, straight at first touch, against a surface whose place and size are free.

    Parameters (count,): the place's shift along each of `free` (k, 3), mm, and the change of the
    size. Residuals (2 n,), mm, by contact: the gap between whisker and surface, and the contact's
    place along the whisker from where that comes nearest.
    """

    def __init__(self, contacts: Sequence[ContactPoint], surface: ObjectSurface):
        self.contacts = contacts
        self.surface = surface
        self.bases = np.array([contact.base_mm for contact in contacts])
        self.directions = np.array([contact.direction for contact in contacts])
        self.free = surface.form.free_axes(surface)
        self.count = len(self.free) + 1

    def solve(self) -> tuple[float, np.ndarray, float]:
        """Return the change of the size, the information (count, count), and the cost, χ²."""
        from scipy.optimize import least_squares  # it takes longer than an evaluation's tables

        root = np.linalg.cholesky(self.covariance())
        found = least_squares(
            lambda parameters: np.linalg.solve(root, self.residuals(parameters)),
            np.zeros(self.count),
            method="lm",
            jac=lambda parameters: np.linalg.solve(root, self.jacobian(parameters)),
        )
        return float(found.x[-1]), found.jac.T @ found.jac, 2 * found.cost

    def surface_at(self, parameters: np.ndarray) -> ObjectSurface:
        """Return the surface with these parameters."""
        point = self.surface.point_mm + parameters[:-1] @ self.free
        name = self.surface.form.size
        size = getattr(self.surface, name) + float(parameters[-1])
        return replace(self.surface, point_mm=point, **{name: size})

    def nearest_arcs(self, surface: ObjectSurface) -> np.ndarray:
        """Return the arcs (n,), mm, at which each whisker comes nearest to a surface."""
        arcs = []
        for contact in self.contacts:
            length = contact.wire.length_mm
            arcs.append(surface.nearest_arc_mm(contact.base_mm, contact.direction, length))
        return np.array(arcs)

    def distances(self, surface: ObjectSurface, arcs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return each whisker's distance from a surface at arcs (n,), mm, and the cosine between it
        and the normal there."""
        outside, normals = surface.distance_mm(self.bases + arcs[:, None] * self.directions)
        return outside, np.sum(normals * self.directions, axis=1)

    def residuals(self, parameters: np.ndarray) -> np.ndarray:
        """Return the residuals (2 n,)."""
        surface = self.surface_at(parameters)
        arcs = self.nearest_arcs(surface)
        outside, _ = self.distances(surface, arcs)
        gaps = []
        along = []
        for contact, distance, arc in zip(self.contacts, outside, arcs):
            gaps.append(distance - contact.wire.radius_mm(arc))
            along.append(contact.arc_mm - arc)
        return np.stack([gaps, along], -1).ravel()

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """Return the derivatives (2 n, count) of the residuals.

        Where the whisker comes nearest its distance does not change along it, and that place moves
        so that the normal stays across the whisker.
        """
        surface = self.surface_at(parameters)
        arcs = self.nearest_arcs(surface)
        cosine_by_arc = _derivative(lambda step: self.distances(surface, arcs + step)[1])
        columns = []
        for axis in np.eye(self.count):

            def distances_after(step, axis=axis):
                """Return distances and cosines at the same arcs, one parameter a step farther."""
                return np.array(self.distances(self.surface_at(parameters + step * axis), arcs))

            outside, cosine = _derivative(distances_after)
            columns.append(np.stack([outside, cosine / cosine_by_arc], -1).ravel())
        return np.stack(columns, -1)

    def covariance(self) -> np.ndarray:
        """Return the covariance (2 n, 2 n), mm², of the residuals where the surface is as stated.

        It has each contact's own, and the friction angle's, which is one for all.
        """
        arcs = self.nearest_arcs(self.surface)
        _, normals = self.surface.distance_mm(self.bases + arcs[:, None] * self.directions)
        blocks = []
        shared = []
        for contact, normal in zip(self.contacts, normals):
            direction = contact.direction
            axes = np.stack([normal, direction])
            by_alpha = contact.by_alpha_mm * direction
            own = contact.covariance_mm2 - np.outer(by_alpha, by_alpha)
            if contact.status:  # its distance is any that the whisker has
                own = own + contact.wire.length_mm**2 * np.outer(direction, direction)
            blocks.append(axes @ own @ axes.T)
            shared.append(axes @ by_alpha)
        return block_diag(*blocks) + np.outer(shared, shared)


def _derivative(function) -> np.ndarray:
    """Return the derivative at 0 of a function of one step, by central differences."""
    return (function(_STEP) - function(-_STEP)) / (2 * _STEP)


def write_sizes(out: Path, sizes: Iterable[FeltSize]) -> None:
    """Write size.csv into a folder: a row a trial."""
    SIZE.write(out, map(_row, sizes))


def _row(felt: FeltSize) -> dict:
    """Return the row of a size."""
    column = felt.column
    return {
        "trial": felt.trial,
        "shape": felt.surface.shape,
        "contacts": felt.contacts,
        "distances": felt.distances,
        column: felt.in_unit_of_column(felt.size.value),
        sigma_name(column): felt.in_unit_of_column(felt.size.sigma),
        f"stated_{column}": felt.in_unit_of_column(felt.stated),
        "chance": felt.chance,
        "status": felt.status,
    }


def size_lines(sizes: Iterable[FeltSize]) -> Iterator[str]:
    """Yield a line a trial."""
    for felt in sizes:
        subject = f"{felt.trial}: {felt.surface.shape}, {counted(felt.contacts, 'contact')}"
        if not felt.size.is_known:
            yield f"{subject}: no size; {felt.status}"
            continue
        name, _, unit = felt.column.rpartition("_")
        value = felt.in_unit_of_column(felt.size.value)
        sigma = felt.in_unit_of_column(felt.size.sigma)
        stated = felt.in_unit_of_column(felt.stated)
        size = f"{name.replace('_', '-')} {value:.2f} ± {sigma:.2f} {unit}, stated {stated:.2f}"
        yield in_one_status(f"{subject}: {size}", felt.status)
