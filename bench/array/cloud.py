"""Contacts of all whiskers of an array as points of one cloud in the rig frame, each with its covariance: felt, as an
estimator has it, and seen."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from bench.array.surface import Surface, seen_surface
from bench.base.doubts import in_one_status
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.report.assembly import Z_C_MM
from bench.session.session import Base
from estimator.distance import cartesian, contact_point
from vision.geometry.rods import Wire
from vision.geometry.rotation import skew
from vision.truth.value import NAN, UNKNOWN, Value

SEEN = "seen"  # in the place of an estimator's name


@dataclass(frozen=True, eq=False)
class Contact:
    """A contact at first touch: the point (3,) of the whisker's centreline, rig frame, mm, and its covariance (3, 3).

    normal (3,): of the surface, towards the whisker, as felt; NaN where the estimator gives no slope. normal_sigma_rad:
    of it, in the plane across the whisker. base_mm (3,), wire: of the whisker; by_alpha_mm: how far one sigma of the
    friction angle that is assumed, which is one for all, moves the point along the whisker; has_touch: nothing is
    doubtful of the angle of touch, whatever the status says of the distance. distance_mm: from the
    object's surface to the whisker's, positive outside; along_mm: how far beyond the place where this whisker comes
    nearest to the object, along the whisker; normal_off_rad: between the normal and the object's own there. All three
    NaN where the object is not known. source: of it.
    """

    whisker: str
    trial: str
    whisk: int
    estimator: str
    point_mm: np.ndarray
    covariance_mm2: np.ndarray
    normal: np.ndarray
    normal_sigma_rad: float
    status: str
    base_mm: np.ndarray
    wire: Wire
    by_alpha_mm: float = 0.0
    has_touch: bool = True
    distance_mm: Value = UNKNOWN
    along_mm: Value = UNKNOWN
    normal_off_rad: float = NAN
    source: str = ""

    @property
    def arc_mm(self) -> float:
        """From the base."""
        return float(np.linalg.norm(self.point_mm - self.base_mm))

    @property
    def towards(self) -> np.ndarray:
        """Along the whisker, straight at first touch: (3,), unit."""
        return (self.point_mm - self.base_mm) / self.arc_mm


@dataclass(frozen=True)
class Mount:
    """What places a whisker's contacts: its base, itself, and one sigma of the friction angle that is assumed."""

    base: Base
    wire: Wire
    alpha_est_rad: float
    alpha_est_sigma_rad: float


def contacts(
    mount: Mount, results: Iterable[TrialResult], surfaces: dict[str, Surface]
) -> Iterator[Contact]:
    """Every whisk's contact, as seen where it is and by each estimator that gives a distance.

    surfaces: by trial, as stated. Where none is, a contact felt is beside the bar as this whisker's own cameras see it:
    what its base is off by moves both alike. A contact seen lies on that bar by its making, and is beside none.
    """
    for result, seen, felt in whisks(results):
        if result.trial.purpose != "measure":
            continue
        stated = surfaces.get(result.trial.name)
        surface = stated or seen_surface(seen, result.seen.bar_radius_mm, mount.wire, mount.base)
        for contact in _of_whisk(mount, result.trial.name, seen, felt):
            alone = surface is None or (stated is None and contact.estimator == SEEN)
            yield contact if alone else _beside(contact, surface)


def _of_whisk(mount: Mount, trial: str, seen: SeenWhisk, felt: FeltWhisk) -> Iterator[Contact]:
    of_whisk, whisker = (
        (mount.base.name, trial, seen.whisk),
        (mount.base.T_rig_base[:, 3], mount.wire),
    )
    if seen.has_truth and seen.truth.point_covariance_mm2 is not None:
        normal = _normal(seen.touch_rad.value, seen.beta_rad.value)
        placed = _placed(mount.base, seen.point_mm.value, seen.truth.point_covariance_mm2, normal)
        yield Contact(*of_whisk, SEEN, *placed, seen.beta_rad.sigma, seen.status, *whisker)
    for answer in (*felt.estimates, *felt.sensors):
        if math.isfinite(answer.d_x_est_mm.value) and math.isfinite(felt.touch_felt_rad.value):
            status = in_one_status(felt.status, answer.status)
            found = (
                *_felt(mount, felt, answer),
                status,
                *whisker,
                _by_alpha_mm(answer),
                not felt.status,
            )
            yield Contact(*of_whisk, answer.estimator, *found)


def _by_alpha_mm(answer: EstimateRow) -> float:
    """Of the distance, by one sigma of the friction angle that is assumed: a larger one brings it nearer."""
    own = answer.d_x_est_sigma_alpha_exact_mm
    return -math.sqrt(max(answer.d_x_est_mm.sigma**2 - own**2, 0.0)) if math.isfinite(own) else 0.0


def _felt(
    mount: Mount, felt: FeltWhisk, answer: EstimateRow
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Point, covariance and normal of the contact (r_c, θ_c, z_c) that an estimator gives, and the normal's sigma."""
    touch, r_c = felt.touch_felt_rad, answer.d_x_est_mm
    point = np.array(cartesian(*contact_point(r_c.value, touch.value, Z_C_MM.value)))
    both = answer.touch_covariance_mm_rad
    both = both if math.isfinite(both) else 0.0
    polar = np.array(
        [[r_c.sigma**2, both, 0.0], [both, touch.sigma**2, 0.0], [0.0, 0.0, Z_C_MM.sigma**2]]
    )
    cos, sin = math.cos(touch.value), math.sin(touch.value)
    by_polar = np.array(
        [[cos, -r_c.value * sin, 0.0], [sin, r_c.value * cos, 0.0], [0.0, 0.0, 1.0]]
    )
    assumed = answer.alpha_est_rad == mount.alpha_est_rad
    sigma = math.hypot(felt.phi_felt_rad.sigma, mount.alpha_est_sigma_rad) if assumed else NAN
    normal = _normal(touch.value, answer.beta_est_rad)
    return *_placed(mount.base, point, by_polar @ polar @ by_polar.T, normal), sigma


def _normal(touch_rad: float, beta_rad: float) -> np.ndarray:
    """(3,): of a surface of slope β, towards the whisker, in the base frame: it stands across the whisker."""
    cos, sin = math.cos(touch_rad), math.sin(touch_rad)
    across = -math.cos(beta_rad)
    return np.array([-sin * across, cos * across, math.sin(beta_rad)])


def _placed(base: Base, point, covariance, normal) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From the base frame to the rig's; the covariance with that of the base's place."""
    turn, arm = base.T_rig_base[:, :3], base.T_rig_base[:, :3] @ point
    lever = skew(arm)
    of_base = base.sigma_mm**2 * np.eye(3) + base.sigma_rad**2 * lever @ lever.T
    return arm + base.T_rig_base[:, 3], turn @ covariance @ turn.T + of_base, turn @ normal


def _beside(contact: Contact, surface: Surface) -> Contact:
    """The contact with its distance from the object, across and along the whisker, and the angle of the normals.

    Across, an error of d_x hardly counts: at first touch the whisker lies along the surface.
    """
    start, arc, towards, wire = contact.base_mm, contact.arc_mm, contact.towards, contact.wire
    nearest = surface.nearest_arc_mm(start, towards, wire.length_mm)
    (outside, _), (normal, own) = surface.distance_mm(
        np.array([contact.point_mm, start + nearest * towards])
    )
    across, along = (
        float(np.sqrt(way @ (contact.covariance_mm2 + surface.covariance_mm2) @ way))
        for way in (normal, towards)
    )
    cosine = np.clip(contact.normal @ own, -1.0, 1.0)
    return replace(
        contact,
        distance_mm=Value(float(outside - wire.radius_mm(arc)), across),
        along_mm=Value(arc - nearest, along),
        normal_off_rad=float(np.arccos(cosine)),
        source=surface.source,
    )
