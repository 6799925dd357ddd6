"""Contact and force from the seen shape of a whisker of known rigidity, by one camera and no gauge ([38], Kaneko).

This estimator alone is allowed pictures of its own trial. It is given sights, not images: lines from one eye on which
points of the centreline lie. Up to the contact the curvature falls to zero as the lever does, beyond it the whisker is
straight: where the bend ends is the contact, how much it bends is the force. One camera does not see the bend towards
it; how far it leaves the whisking plane is taken as 0 ± 45° and fitted with the rest.

Rig frame: base at the origin, z the rotation axis, x along the whisker at motor angle 0. Lengths in mm, angles in rad.
"""

from dataclasses import dataclass
from functools import cached_property
from math import atan, hypot, nan

import numpy as np
from scipy.optimize import least_squares

from estimator import load_cell
from estimator.beam import Beam
from estimator.uncertainty import Z_95

FEW = "one camera shows too few points or frames of the whisker"
NOT_PUSHED = "one camera does not see the whisker pushed as far as the pushing angle"
ASIDE = "force and give are not told: the camera looks aside, and how the bend leaves the whisking plane is not known"
UNTOLD = "the seen shape does not tell where the bend ends"
# One sigma of what is believed before. Of the rest shape by powers of s/L, mm: clamped off centre, clamp angle, set and
# sag, change of curvature; tan φ of the bend; how fast the contact moves along the whisker, mm/rad: a bar's radius in
# rolling, or 3 mm of slip in 3° along an object that leans by 20°.
_REST_MM, _TAN_PHI, _ALONG_MM_RAD = np.array([1.0, 8.0, 5.0, 2.0]), 1.0, 20.0
_BEYOND_RAD = np.radians(1.0)  # frames past the pushing angle that still count
_FEWEST_FRAMES, _FEWEST_POINTS = 4, 30
# One sigma of the force, a share per rad pushed: what friction along the whisker, which is not modelled, adds to the
# moment is tan α times w/d, that is θ at most, over that of the force across; α is taken as 0 ± 14°.
_DRAG = 0.25
# share of the force by what tan φ may be: its square, a hundredth, is left out
_MOST_BY_PLANE = 0.1
_LEAST_LEFT = 1e-3  # of the base's diameter: a cone's point bends without end
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_TOUCH, _BEND, _BEND_2, _TAN, _ARC, _ALONG, _OWN = 8, 9, 10, 11, 12, 13, 14


@dataclass(frozen=True, eq=False)
class SeenShape:
    """What one camera sees of a stroke's centreline.

    motor_rad (f,): of each frame; frame (n,): of each point, its place among these; eye_mm (3,): where all look from;
    sight (n, 3): unit directions in which the points are seen; across (n, 3): unit normals of the planes that hold
    sight and seen line; sigma_rad (n,): of the sight, across; shared_rad (n, k): how much each moves with one sigma of
    each cause that points share. Raises ValueError where shapes disagree or a sigma is not positive.
    """

    motor_rad: np.ndarray
    frame: np.ndarray
    eye_mm: np.ndarray
    sight: np.ndarray
    across: np.ndarray
    sigma_rad: np.ndarray
    shared_rad: np.ndarray

    def __post_init__(self):
        count = len(self.frame)
        shapes = [np.shape(a) for a in (self.eye_mm, self.sight, self.across, self.sigma_rad)]
        if shapes != [(3,), (count, 3), (count, 3), (count,)] or len(self.shared_rad) != count:
            raise ValueError(
                "frame (n,), eye_mm (3,), sight and across (n, 3), sigma_rad (n,), shared_rad (n, k)"
            )
        if not (np.asarray(self.sigma_rad) > 0).all():
            raise ValueError("sigma_rad must be positive")

    def until(self, motor_rad: float) -> "SeenShape":
        """The frames up to a motor angle."""
        keep = self.motor_rad[self.frame] <= motor_rad
        rows = (
            getattr(self, name)[keep] for name in ("sight", "across", "sigma_rad", "shared_rad")
        )
        return SeenShape(self.motor_rad, self.frame[keep], self.eye_mm, *rows)

    @property
    def frames(self) -> int:
        """How many frames have points."""
        return len(np.unique(self.frame))


@dataclass(frozen=True)
class ShapeContact:
    """What a seen shape tells, each with one sigma; NaN where `status` says why.

    touch_rad: motor angle at which the whisker begins to bend. force_N: across the whisker in the whisking plane.
    moved_mm: how far the contact has gone the way it is pushed since touch: an object gives way, or the whisker slips
    along a slope, and one camera does not tell which. stiffness_N_mm: force over that way, NaN where it is within its
    noise; stiffness_low_N_mm: no less than that at 97.5 %, either way.
    """

    touch_rad: float = nan
    touch_sigma_rad: float = nan
    d_x_mm: float = nan
    d_x_sigma_mm: float = nan
    force_N: float = nan
    force_sigma_N: float = nan
    moved_mm: float = nan
    moved_sigma_mm: float = nan
    stiffness_N_mm: float = nan
    stiffness_sigma_N_mm: float = nan
    stiffness_low_N_mm: float = nan
    status: str = ""


def contact_of_shape(
    seen: SeenShape,
    theta_rad: float,
    beam: Beam,
    *,
    reach_mm: float = 0.0,
    tilt_sigma_rad: float = 0.0,
    rigidity_share: float = 0.0,
) -> ShapeContact:
    """Touch, distance, force and give at a pushing angle, from all frames up to it and a little beyond.

    reach_mm, tilt_sigma_rad: how thick the object may be and how far it may lean, as in `EstimatorSettings`: they enter
    the sigma of d_x. rigidity_share: one sigma of EI as a share of it, which enters the force alone.
    """
    if seen.frames < _FEWEST_FRAMES or len(seen.frame) < _FEWEST_POINTS:
        return ShapeContact(status=FEW)
    touch, begin = _begun(seen, theta_rad, beam)
    near = seen.until(touch + theta_rad + _BEYOND_RAD)
    if near.frames < _FEWEST_FRAMES or touch + theta_rad > seen.motor_rad[seen.frame].max() + 1e-3:
        return ShapeContact(status=NOT_PUSHED)
    fit = _Fit(near, theta_rad, beam)
    vector, covariance = fit.solved(begin)
    told = fit.told(vector)
    by = _slopes(fit.told, vector)
    of_told = by @ covariance @ by.T
    by_plane = abs(by[2] @ covariance[:, _TAN]) / covariance[_TAN, _TAN] ** 0.5 / max(told[2], 1e-9)
    answer = _answer(
        told, of_told, vector, theta_rad, beam, (reach_mm, tilt_sigma_rad, rigidity_share)
    )
    return answer if answer.status or by_plane < _MOST_BY_PLANE else _without_force(answer)


def _without_force(answer: ShapeContact) -> ShapeContact:
    """Touch and distance alone."""
    known = {
        name: getattr(answer, name)
        for name in ("touch_rad", "touch_sigma_rad", "d_x_mm", "d_x_sigma_mm")
    }
    return ShapeContact(**known, status=ASIDE)


def _answer(told, covariance, vector, theta, beam, doubts) -> ShapeContact:
    touch, d_x, force, moved = told.tolist()
    reach, tilt, rigidity_share = doubts
    sigmas = np.sqrt(np.diag(covariance))
    if not (0 < d_x <= beam.length_mm and sigmas[1] < 0.25 * beam.length_mm and force > 0):
        return ShapeContact(status=UNTOLD)
    phi, left = atan(abs(vector[_TAN])), beam.left(d_x)
    share = hypot(
        load_cell.rolling(theta, reach, 0.0, d_x, left), load_cell.leaning(theta, tilt, phi, 0.0)
    )
    of_force = hypot(rigidity_share, _DRAG * theta) * force
    spread = (
        float(sigmas[0]),
        hypot(sigmas[1], share * d_x),
        hypot(sigmas[2], of_force),
        float(sigmas[3]),
    )
    pairs = [number for pair in zip((touch, d_x, force, moved), spread) for number in pair]
    return ShapeContact(*pairs, *_stiffness(force, spread[2], moved, spread[3], covariance[2, 3]))


def _stiffness(force, force_sigma, moved, moved_sigma, together) -> tuple[float, float, float]:
    """(stiffness, its sigma, its low end), N/mm; the first two NaN where the way is within its noise."""
    low = force / max(moved + Z_95 * moved_sigma, 1e-9)
    if moved <= Z_95 * moved_sigma:
        return nan, nan, low
    k = force / moved
    variance = (
        (force_sigma / force) ** 2 + (moved_sigma / moved) ** 2 - 2 * together / (force * moved)
    )
    return k, k * max(variance, 0.0) ** 0.5, low


def bend(arc_mm: np.ndarray, contact_mm: np.ndarray, taper_per_mm: float) -> np.ndarray:
    """∫₀ˢ (c − t) / (1 − τt)⁴ dt, mm²: tangent angle by a unit force at c over EI at the base, constant beyond c."""
    s = np.minimum(arc_mm, contact_mm)
    w = np.maximum(1.0 - taper_per_mm * s, _LEAST_LEFT)
    return s * (contact_mm * (1.0 + w + w * w) / 3.0 - s * (w + 2.0) / 6.0) / w**3


@dataclass(frozen=True, eq=False)
class _Fit:
    """Least squares of a stroke's shape. Parameters: rest shape (2, 4), touch, bend in y by the angle past touch and
    by its square, tan φ, contact arc at the pushing angle and its change by angle, what points share."""

    seen: SeenShape
    theta_rad: float
    beam: Beam

    @cached_property
    def _taper_per_mm(self) -> float:
        return self.beam.taper / self.beam.length_mm

    @cached_property
    def prior(self) -> np.ndarray:
        """One sigma of each parameter; infinite where nothing is believed."""
        shape = [np.inf, np.inf, np.inf, _TAN_PHI, np.inf, _ALONG_MM_RAD]
        return np.concatenate([_REST_MM, _REST_MM, shape, np.ones(self.seen.shared_rad.shape[1])])

    @cached_property
    def motor(self) -> np.ndarray:
        """Motor angle (n,) at each point."""
        return self.seen.motor_rad[self.seen.frame]

    @cached_property
    def along_mm(self) -> np.ndarray:
        """How far out (n,) each point is where the sight is nearest to the unbent whisker."""
        c, s = np.cos(self.motor), np.sin(self.motor)
        along = np.cross(self.seen.across, self.seen.sight)
        return (along @ self.seen.eye_mm) / (along[:, 0] * c + along[:, 1] * s)

    def points(
        self, vector: np.ndarray, arc: np.ndarray, pushed: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Centreline points and tangents (n, 3), hub frame, at arcs (n,) of shapes pushed (n,) past touch."""
        contact = np.clip(
            vector[_ARC] + vector[_ALONG] * (pushed - self.theta_rad), 1.0, self.beam.length_mm
        )
        size = (vector[_BEND] + vector[_BEND_2] * pushed) * pushed
        per_force, ends = (
            size / bend(contact, contact, self._taper_per_mm),
            np.minimum(arc, contact),
        )
        points = np.zeros((len(arc), 3))
        for first, last in (
            (0.0 * arc, ends),
            (ends, arc),
        ):  # the third derivative jumps at the contact
            half = 0.5 * (last - first)[:, None]
            places = first[:, None] + half * (1.0 + _NODES)
            tangents = self._slope(vector, places, contact[:, None], per_force[:, None])
            points += ((half * _WEIGHTS)[..., None] * tangents).sum(axis=1)
        outer = self._slope(vector, arc, contact, per_force)
        points[:, 1:] += vector[[0, 4]]
        return points, outer

    def _slope(self, vector, arc, contact, per_force):
        """Unit tangents (…, 3): those of the rest shape, turned by the bend."""
        u = arc[..., None] / self.beam.length_mm
        powers = np.concatenate([0 * u, 1 + 0 * u, 2 * u, 3 * u * u], axis=-1) / self.beam.length_mm
        turn = np.sin(per_force * bend(arc, contact, self._taper_per_mm) * hypot(1.0, vector[_TAN]))
        turn = turn / hypot(1.0, vector[_TAN])
        y = powers @ vector[:4] + turn
        z = powers @ vector[4:8] + turn * vector[_TAN]
        return np.stack([np.sqrt(np.maximum(1.0 - y * y - z * z, 0.01)), y, z], axis=-1)

    def residuals(self, vector: np.ndarray) -> np.ndarray:
        """By how many sigmas (n + parameters,) points lie off their sights, and parameters off what was believed."""
        seen, motor = self.seen, self.motor
        pushed = np.maximum(motor - vector[_TOUCH], 0.0)
        arc = self.along_mm
        points, tangents = self.points(vector, arc, pushed)
        eye = _turned(seen.eye_mm, -motor)
        along = _turned(np.cross(seen.across, seen.sight), -motor)
        step = np.einsum("ni,ni->n", along, eye - points) / np.einsum("ni,ni->n", along, tangents)
        off = points + step[:, None] * tangents - eye  # straight over a step of a fraction of a mm
        sideways = np.einsum("ni,ni->n", _turned(seen.across, -motor), off) / np.linalg.norm(
            off, axis=1
        )
        sideways = sideways - seen.shared_rad @ vector[_OWN:]
        return np.concatenate([sideways / seen.sigma_rad, vector / self.prior])

    def told(self, vector: np.ndarray) -> np.ndarray:
        """(4,): touch, d_x, force in N, and how far the contact has moved."""
        arc, theta = vector[[_ARC]], np.array([self.theta_rad])
        (x, y, _), _ = (a[0] for a in self.points(vector, arc, theta))
        u = arc[0] / self.beam.length_mm
        y = y - np.array([1.0, u, u * u, u**3]) @ vector[:4]
        c, s = np.cos(self.theta_rad), np.sin(self.theta_rad)
        size = (vector[_BEND] + vector[_BEND_2] * self.theta_rad) * self.theta_rad
        force = -self.beam.rigidity_Nmm2 * size / bend(arc, arc, self._taper_per_mm)[0]
        return np.array([vector[_TOUCH], x * c - y * s, force, x * s + y * c])

    def solved(self, begin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(parameters, covariance); points count as much as their residuals scatter and are alike."""
        found = least_squares(self.residuals, begin, x_scale="jac", method="trf", max_nfev=40)
        count = len(self.seen.frame)
        wide = self._wider(found.fun[:count])
        jacobian = found.jac.copy()
        jacobian[:count] /= wide
        return found.x, np.linalg.pinv(jacobian.T @ jacobian)

    def _wider(self, residuals: np.ndarray) -> float:
        """Factor on sigmas, at least 1: by scatter, and by how much of its error a point shares with the next one."""
        same = np.diff(self.seen.frame) == 0
        alike = (residuals[1:] * residuals[:-1])[same].mean() / np.mean(residuals**2)
        alike = float(np.clip(alike, 0.0, 0.95))
        scatter = np.sum(residuals**2) / max(len(residuals) - len(self.prior), 1)
        return float(np.sqrt(max(scatter * (1 + alike) / (1 - alike), 1.0)))


def _turned(vectors: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Vectors (…, 3), each turned by its angle (n,) about z."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = np.broadcast_arrays(*np.moveaxis(np.asarray(vectors), -1, 0), c)[:3]
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


def _begun(seen: SeenShape, theta: float, beam: Beam) -> tuple[float, np.ndarray]:
    """(touch, parameters to begin with): the best of straight least squares over a grid of touch and contact, and over
    a finer one about that."""
    line = _Line(_Fit(seen, theta, beam))
    low, high = line.motor.min(), line.motor.max()
    touches, contacts = (
        np.linspace(low, high, 26)[2:-2],
        np.linspace(0.1, 0.98, 19) * beam.length_mm,
    )
    for _ in range(3):
        grid = [
            (line.fit(touch, contact), touch, contact) for touch in touches for contact in contacts
        ]
        (_, values), touch, contact = min(grid, key=lambda one: one[0][0])
        steps = touches[1] - touches[0], contacts[1] - contacts[0]
        touches = touch + np.linspace(-1.0, 1.0, 7) * steps[0]
        contacts = np.clip(
            contact + np.linspace(-1.0, 1.0, 7) * steps[1], 1.0, 0.999 * beam.length_mm
        )
    vector = np.zeros(len(line.of.prior))
    vector[:4], vector[_TOUCH], vector[_BEND], vector[_ARC] = values[:4], touch, values[4], contact
    return float(touch), vector


class _Line:
    """The seen shape to first order: rest shape and bend in the whisking plane, of touch and contact given."""

    def __init__(self, of: _Fit):
        self.of, seen = of, of.seen
        self.motor, self.arc = of.motor, of.along_mm
        self._taper = of.beam.taper / of.beam.length_mm
        straight = np.stack([self.arc, 0 * self.arc, 0 * self.arc], axis=1)
        eye, across = (_turned(a, -self.motor) for a in (seen.eye_mm, seen.across))
        self._weight = 1.0 / (seen.sigma_rad * np.linalg.norm(eye - straight, axis=1))
        self._side = across[:, 1] * self._weight
        aim = np.einsum("ni,ni->n", across, eye - straight) * self._weight
        self._aim = np.append(aim, np.zeros(4))
        powers = (self.arc[:, None] / of.beam.length_mm) ** np.arange(4)
        self._rest = powers * self._side[:, None]

    def fit(self, touch: float, contact: float) -> tuple[float, np.ndarray]:
        """(cost, (5,): rest shape and bend by the angle past touch); infinite for a whisker that is pulled."""
        reach = np.full(len(self.arc), contact)
        shape = _deflection(self.arc, reach, self._taper) / bend(reach, reach, self._taper)
        column = self._side * shape * np.maximum(self.motor - touch, 0.0)
        design = np.vstack(
            [np.column_stack([self._rest, column]), np.diag([*1.0 / _REST_MM, 0.0])[:4]]
        )
        values = np.linalg.lstsq(design, self._aim, rcond=None)[0]
        return (
            float(np.sum((design @ values - self._aim) ** 2)) if values[4] < 0 else np.inf
        ), values


def _deflection(arc, contact, taper):
    """∫₀ˢ of `bend`, mm³."""
    half = 0.5 * np.minimum(arc, contact)[:, None]
    inner = (half * _WEIGHTS * bend(half * (1.0 + _NODES), contact[:, None], taper)).sum(axis=1)
    return inner + np.maximum(arc - contact, 0.0) * bend(contact, contact, taper)


def _slopes(of, vector: np.ndarray) -> np.ndarray:
    """Derivatives (4, parameters) by central differences."""
    steps = 1e-5 * np.maximum(np.abs(vector), 1e-2)
    return np.stack(
        [(of(vector + d) - of(vector - d)) / (2 * d.sum()) for d in np.diag(steps)], axis=1
    )
