"""Contacts of all whiskers of an array as points of one cloud in the rig frame, each with its
covariance: felt, by each estimator, and seen."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from bench.array.surface import ObjectSurface, seen_surface
from bench.base.combined import sigma_without
from bench.base.input_problems import in_one_status
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.report.whisk_rows import Z_C_MM
from bench.session.session import Base
from estimator.distance import cartesian, contact_point
from vision import NAN, UNKNOWN, Value
from vision.geometry import Wire, skew

SEEN = "seen"  # in the place of an estimator's name


@dataclass(frozen=True, eq=False, kw_only=True)
class ContactPoint:
    """A contact at first touch: a point of the whisker's centreline in the rig frame.

    point_mm (3,), covariance_mm2 (3, 3). normal (3,): of the surface, towards the whisker, as felt;
    NaN where the estimator gives no slope. normal_sigma_rad: of its turn in the plane across the
    whisker. base_mm (3,), wire: of the whisker. by_alpha_mm: how far one sigma of the assumed friction
    angle, which all contacts share, moves the point along the whisker. has_touch: whether the angle of
    touch is sound, whatever the status says of the distance.
    Against the object, NaN where that is not known: distance_mm from its surface to the whisker's,
    positive outside; along_mm along the whisker, from the place where it comes nearest to the
    object; normal_off_rad between the normal and the object's own there. source: of the object.
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
        """Return the distance from the base."""
        return float(np.linalg.norm(self.point_mm - self.base_mm))

    @property
    def direction(self) -> np.ndarray:
        """Return the unit direction (3,) of the whisker, straight at first touch."""
        return (self.point_mm - self.base_mm) / self.arc_mm


@dataclass(frozen=True)
class Mount:
    """One whisker's base and wire, and the friction angle that is assumed with its sigma."""

    base: Base
    wire: Wire
    alpha_est_rad: float
    alpha_est_sigma_rad: float


def contacts(
    mount: Mount, results: Iterable[TrialResult], surfaces: dict[str, ObjectSurface]
) -> Iterator[ContactPoint]:
    """Yield every whisk's contact, as seen where it is and by each estimator that gives a distance.

    surfaces: by trial, as stated. Where none is, a felt contact is compared with the bar as this
    whisker's own cameras see it: an error of its base moves both alike. A seen contact lies on that
    bar by construction and is compared with none.
    """
    for result, seen, felt in whisks(results):
        trial = result.trial
        if trial.purpose != "measure":
            continue
        stated = surfaces.get(trial.name)
        if seen.has_truth and seen.truth.point_covariance_mm2 is not None:
            contact = _to_rig(_seen_contact(mount, trial.name, seen), mount.base)
            yield _compare(contact, stated) if stated else contact
        surface = stated or seen_surface(seen, result.seen.bar_radius_mm, mount.wire, mount.base)
        for estimate in (*felt.estimates, *felt.sensors):
            is_known = felt.touch_felt_rad.is_known
            if is_known and estimate.d_x_est_mm.is_known:
                contact = _felt_contact(mount, trial.name, seen.whisk, felt, estimate)
                contact = _to_rig(contact, mount.base)
                yield _compare(contact, surface) if surface else contact


def _seen_contact(mount: Mount, trial: str, seen: SeenWhisk) -> ContactPoint:
    """Return the contact that the cameras see, in the base frame."""
    return ContactPoint(
        whisker=mount.base.name,
        trial=trial,
        whisk=seen.whisk,
        estimator=SEEN,
        point_mm=seen.point_mm.value,
        covariance_mm2=seen.truth.point_covariance_mm2,
        normal=_normal(seen.touch_rad.value, seen.beta_rad.value),
        normal_sigma_rad=seen.beta_rad.sigma,
        status=seen.status,
        base_mm=np.zeros(3),
        wire=mount.wire,
    )


def _felt_contact(
    mount: Mount, trial: str, whisk: int, felt: FeltWhisk, estimate: EstimateRow
) -> ContactPoint:
    """Return the contact (r_c, θ_c, z_c) that an estimator gives, in the base frame."""
    touch_rad = felt.touch_felt_rad.value
    polar = contact_point(estimate.d_x_est_mm.value, touch_rad, Z_C_MM.value)
    normal_sigma = NAN
    if estimate.alpha_est_rad == mount.alpha_est_rad:
        normal_sigma = math.hypot(felt.phi_felt_rad.sigma, mount.alpha_est_sigma_rad)
    return ContactPoint(
        whisker=mount.base.name,
        trial=trial,
        whisk=whisk,
        estimator=estimate.estimator,
        point_mm=np.array(cartesian(*polar)),
        covariance_mm2=_covariance_mm2(felt.touch_felt_rad, estimate),
        normal=_normal(touch_rad, estimate.beta_est_rad),
        normal_sigma_rad=normal_sigma,
        status=in_one_status(felt.status, estimate.status),
        base_mm=np.zeros(3),
        wire=mount.wire,
        by_alpha_mm=_by_alpha_mm(estimate),
        has_touch=not felt.status,
    )


def _covariance_mm2(touch_rad: Value, estimate: EstimateRow) -> np.ndarray:
    """Return the covariance (3, 3) of a contact in the base frame by that of (r_c, θ_c, z_c)."""
    r_c = estimate.d_x_est_mm
    covariance = np.diag([r_c.sigma**2, touch_rad.sigma**2, Z_C_MM.sigma**2])
    if math.isfinite(estimate.touch_covariance_mm_rad):
        covariance[[0, 1], [1, 0]] = estimate.touch_covariance_mm_rad
    cos = math.cos(touch_rad.value)
    sin = math.sin(touch_rad.value)
    jacobian = np.array(
        [[cos, -r_c.value * sin, 0.0], [sin, r_c.value * cos, 0.0], [0.0, 0.0, 1.0]]
    )
    return jacobian @ covariance @ jacobian.T


def _by_alpha_mm(estimate: EstimateRow) -> float:
    """Return the change of the distance by one sigma of the assumed friction angle: a larger angle
    brings it nearer."""
    sigma_alpha_exact_mm = estimate.d_x_est_sigma_alpha_exact_mm
    if not math.isfinite(sigma_alpha_exact_mm):
        return 0.0
    return -sigma_without(estimate.d_x_est_mm.sigma, np.array([sigma_alpha_exact_mm]))


def _normal(touch_rad: float, beta_rad: float) -> np.ndarray:
    """Return the normal (3,) of a surface of slope β in the base frame, towards the whisker and
    across it."""
    across = -math.cos(beta_rad)
    return np.array(
        [-math.sin(touch_rad) * across, math.cos(touch_rad) * across, math.sin(beta_rad)]
    )


def _to_rig(contact: ContactPoint, base: Base) -> ContactPoint:
    """Convert a contact from the base frame to the rig's, and add the covariance of the base's place."""
    turn = base.T_rig_base[:, :3]
    origin = base.T_rig_base[:, 3]
    arm = turn @ contact.point_mm
    lever = skew(arm)
    of_base = base.sigma_mm**2 * np.eye(3) + base.sigma_rad**2 * lever @ lever.T
    return replace(
        contact,
        point_mm=arm + origin,
        covariance_mm2=turn @ contact.covariance_mm2 @ turn.T + of_base,
        normal=turn @ contact.normal,
        base_mm=origin,
    )


def _compare(contact: ContactPoint, surface: ObjectSurface) -> ContactPoint:
    """Return a contact with its distance from the object, across and along the whisker, and the angle
    between the normals.

    Across, an error of d_x hardly counts: at first touch the whisker lies along the surface.
    """
    direction = contact.direction
    wire = contact.wire
    nearest = surface.nearest_arc_mm(contact.base_mm, direction, wire.length_mm)
    points = np.array([contact.point_mm, contact.base_mm + nearest * direction])
    (outside, _), (normal, normal_at_nearest) = surface.distance_mm(points)
    covariance = contact.covariance_mm2 + surface.covariance_mm2
    across_sigma = float(np.sqrt(normal @ covariance @ normal))
    along_sigma = float(np.sqrt(direction @ covariance @ direction))
    cosine = np.clip(contact.normal @ normal_at_nearest, -1.0, 1.0)
    distance = float(outside - wire.radius_mm(contact.arc_mm))
    return replace(
        contact,
        distance_mm=Value(distance, across_sigma),
        along_mm=Value(contact.arc_mm - nearest, along_sigma),
        normal_off_rad=float(np.arccos(cosine)),
        source=surface.source,
    )
