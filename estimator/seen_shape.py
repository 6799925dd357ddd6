"""Contact and force from the seen shape of a whisker of known rigidity, by one camera and no gauge
([38], Kaneko).

This estimator alone is allowed pictures of its own trial. It is given sights, not images: lines
from one eye on which points of the centreline lie. Up to the contact the curvature falls to zero as
the lever does, beyond it the whisker is straight: where the bend ends is the contact, how much it
bends is the force. One camera does not see the bend towards it; the angle at which it leaves the
whisking plane has a prior of 0 ± 45° and is fitted with the rest.

Rig frame: base at the origin, z the rotation axis, x along the whisker at motor angle 0. Lengths in
mm, angles in rad. The fit itself takes lengths in those of the whisker and forces in EI/length², so
that it converges alike whatever the whisker's size and stiffness.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import atan, cos, hypot, nan, sin
from operator import itemgetter

import numpy as np
from numpy.polynomial.polynomial import polyval
from scipy.optimize import least_squares

from estimator import load_cell
from estimator.beam import Beam
from estimator.numerics import central_differences
from estimator.reasons import NamedReason
from estimator.uncertainty import Z_95
from estimator.vectors import dot, turned_about_z

FEW = NamedReason("whisker_points_few", "one camera shows too few points or frames of the whisker")
NOT_PUSHED = NamedReason(
    "pushing_angle_unseen",
    "one camera does not see the whisker pushed as far as the pushing angle",
)
PLANE_UNKNOWN = NamedReason(
    "bending_plane_unknown",
    "force and give are not told: the camera looks aside, "
    "and how the bend leaves the whisking plane is not known",
)
UNCONVERGED = NamedReason("shape_unconverged", "the fit of the seen shape does not converge")
NO_END = NamedReason("bend_end_unseen", "the seen shape does not tell where the bend ends")
# [lengths] Prior sigma of the rest shape by powers of s/L: clamped off centre, clamp angle, set and
# sag, change of curvature.
_REST = np.array([0.01, 0.08, 0.05, 0.02])
# Prior sigma of tan φ of the bend: 45°.
_TAN_PHI = 1.0
# [lengths/rad] Prior sigma of how fast the contact moves along the whisker: of 100 mm, several radii
# of a bar in rolling, or 3 mm of slip in 3° along an object that leans by 20°.
_ALONG_PER_RAD = 0.2
# [lengths] Nearest contact to the base.
_NEAREST = 0.01
# [lengths] Least way of the contact by which a force is divided: rounding.
_LEAST_WAY = 1e-11
# [rad] Frames that far past the pushing angle still count.
_BEYOND_RAD = np.radians(1.0)
# Evaluations of the residuals by which a fit has converged: simulated strokes take 5 to 35.
_MOST_EVALUATIONS = 80
# Fewest frames with points, and fewest points, from which a shape is fitted.
_FEWEST_FRAMES = 4
_FEWEST_POINTS = 30
# [1/rad] Relative sigma of the force per rad pushed: friction along the whisker, which is not
# modelled, adds to the moment tan α times w/d, that is θ at most, over that of the force across; α
# is taken as 0 ± 14°.
_DRAG = 0.25
# Largest share of the force by which tan φ may change it: its square, a hundredth, is left out.
_MOST_BY_PLANE = 0.1
# Least share of the base's diameter: a cone's point bends without end.
_LEAST_LEFT = 1e-3
# Nodes and weights of Gauss–Legendre quadrature on −1 … 1.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
# Places in the parameter vector: the rest shape in y (4) and z (4) stands before these, the shared
# causes after them.
_TOUCH = 8  # rad
_BEND = 9  # tangent angle at the contact, by the angle past touch
_BEND_2 = 10  # 1/rad, by its square
_TAN = 11  # tan φ
_ARC = 12  # lengths, contact at the pushing angle
_ALONG = 13  # lengths/rad, its change
_OWN = 14


@dataclass(frozen=True, eq=False)
class SeenShape:
    """Centreline of a whisker during a stroke, as one camera sees it.

    motor_rad (f,): of each frame. frame (n,): index of each point's frame among these.
    eye_mm (3,): centre of projection.
    sight (n, 3): unit directions in which the points are seen.
    across (n, 3): unit normals of the planes that hold sight and seen line.
    sigma_rad (n,): standard deviation of the sight along `across`.
    shared_rad (n, k): change of each point's sight with one sigma of each cause that points share.
    Raises ValueError where shapes disagree or a sigma is not positive.
    """

    motor_rad: np.ndarray
    frame: np.ndarray
    eye_mm: np.ndarray
    sight: np.ndarray
    across: np.ndarray
    sigma_rad: np.ndarray
    shared_rad: np.ndarray

    def __post_init__(self):
        """Raise ValueError where shapes disagree or a sigma is not positive."""
        count = len(self.frame)
        arrays = (self.eye_mm, self.sight, self.across, self.sigma_rad)
        shapes = list(map(np.shape, arrays))
        if shapes != [(3,), (count, 3), (count, 3), (count,)] or len(self.shared_rad) != count:
            raise ValueError(
                "frame (n,), eye_mm (3,), sight and across (n, 3), "
                "sigma_rad (n,), shared_rad (n, k)"
            )
        if not (np.asarray(self.sigma_rad) > 0).all():
            raise ValueError("sigma_rad must be positive")

    def until(self, motor_rad: float) -> "SeenShape":
        """Select the points of the frames up to a motor angle."""
        keep = self.motor_rad[self.frame] <= motor_rad
        return replace(
            self,
            frame=self.frame[keep],
            sight=self.sight[keep],
            across=self.across[keep],
            sigma_rad=self.sigma_rad[keep],
            shared_rad=self.shared_rad[keep],
        )

    def reaches(self, motor_rad: float) -> bool:
        """Check that a frame at a motor angle, or as good as at it, has points."""
        last = self.motor_rad[self.frame].max()
        return motor_rad <= last + 1e-3

    @property
    def frames(self) -> int:
        """Count the frames that have points."""
        return len(np.unique(self.frame))

    @property
    def has_frames(self) -> bool:
        """Check that there are frames enough to fit a shape."""
        return self.frames >= _FEWEST_FRAMES

    @property
    def suffices(self) -> bool:
        """Check that there are frames and points enough to fit a shape."""
        return self.has_frames and len(self.frame) >= _FEWEST_POINTS


@dataclass(frozen=True)
class ShapeContact:
    """Contact and force that follow from a seen shape, each with one sigma; NaN where `status` says
    why.

    touch_rad: motor angle at which the whisker begins to bend. force_N: across the whisker in the
    whisking plane. moved_mm: how far the contact has gone the way it is pushed since touch: an
    object gives way, or the whisker slips along a slope, and one camera cannot distinguish them.
    stiffness_N_mm: force over that way, NaN where it is within its noise. stiffness_low_N_mm: bound
    below which the stiffness is not at 97.5 %, either way.
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
    """Estimate touch, distance, force and give at a pushing angle, from all frames up to it and a
    little beyond.

    reach_mm, tilt_sigma_rad: how thick the object may be and how far it may lean, as in
    `EstimatorSettings`: they enter the sigma of d_x. rigidity_share: one sigma of EI as a share of
    it, which enters the force alone.
    """
    if not seen.suffices:
        return ShapeContact(status=FEW)
    length = beam.length_mm
    seen = replace(seen, eye_mm=np.asarray(seen.eye_mm) / length)
    touch, begin = _initial_parameters(_ShapeFit(seen, theta_rad, beam.taper))
    pushed_rad = touch + theta_rad
    near = seen.until(pushed_rad + _BEYOND_RAD)
    if not (near.has_frames and seen.reaches(pushed_rad)):
        return ShapeContact(status=NOT_PUSHED)
    fit = _ShapeFit(near, theta_rad, beam.taper)
    try:
        vector, covariance = fit.solve(begin)
    except ArithmeticError:
        return ShapeContact(status=UNCONVERGED)
    model_share = fit.model_share(vector, reach_mm / length, tilt_sigma_rad)
    force_share = fit.force_share(rigidity_share)
    return _contact_of_fit(fit, vector, covariance, beam, model_share, force_share)


def _contact_of_fit(
    fit: "_ShapeFit",
    vector: np.ndarray,
    covariance: np.ndarray,
    beam: Beam,
    model_share: float,
    force_share: float,
) -> ShapeContact:
    """Return the contact of fitted parameters, in mm and N, without a force where the plane of bending
    is not known.

    model_share, force_share: relative sigmas of d_x and force by models.
    """
    length = beam.length_mm
    values = fit.observables(vector)
    gradient = _derivatives(fit.observables, vector)  # (4, parameters)
    spread = gradient @ covariance @ gradient.T
    unit = np.array([1.0, length, beam.rigidity_Nmm2 / length**2, length])
    spread_in_mm = spread * np.outer(unit, unit)
    contact = _with_sigmas(unit * values, spread_in_mm, length, model_share, force_share)
    if contact.status or _is_plane_known(values[2], gradient[2], covariance):
        return contact
    return _without_force(contact)


def _is_plane_known(force: float, gradient: np.ndarray, covariance: np.ndarray) -> bool:
    """Check that tan φ changes the force, which is above zero, by a small share.

    gradient: of the force by the parameters.
    """
    by_plane = gradient @ covariance[:, _TAN] / covariance[_TAN, _TAN] ** 0.5  # one sigma
    return abs(by_plane) < _MOST_BY_PLANE * force


def _without_force(contact: ShapeContact) -> ShapeContact:
    """Return touch and distance alone."""
    return ShapeContact(
        contact.touch_rad,
        contact.touch_sigma_rad,
        contact.d_x_mm,
        contact.d_x_sigma_mm,
        status=PLANE_UNKNOWN,
    )


def _with_sigmas(values, covariance, length_mm, model_share, force_share) -> ShapeContact:
    """Return the contact of observables (4,) with covariance (4, 4), and relative sigmas of d_x and
    force by models.
    """
    touch, d_x, force, moved = values.tolist()
    touch_sigma, d_x_sigma, force_sigma, moved_sigma = np.sqrt(np.diag(covariance)).tolist()
    if not (0 < d_x <= length_mm and d_x_sigma < 0.25 * length_mm and force > 0):
        return ShapeContact(status=NO_END)
    force_sigma = hypot(force_sigma, force_share * force)
    stiffness, stiffness_sigma, low = _stiffness(
        force, force_sigma, moved, moved_sigma, covariance[2, 3], _LEAST_WAY * length_mm
    )
    return ShapeContact(
        touch_rad=touch,
        touch_sigma_rad=touch_sigma,
        d_x_mm=d_x,
        d_x_sigma_mm=hypot(d_x_sigma, model_share * d_x),
        force_N=force,
        force_sigma_N=force_sigma,
        moved_mm=moved,
        moved_sigma_mm=moved_sigma,
        stiffness_N_mm=stiffness,
        stiffness_sigma_N_mm=stiffness_sigma,
        stiffness_low_N_mm=low,
    )


def _stiffness(
    force, force_sigma, moved, moved_sigma, covariance, least_way
) -> tuple[float, float, float]:
    """Return (stiffness, its sigma, its low end), N/mm; the first two NaN where the way is within
    its noise.
    """
    low = force / max(moved + Z_95 * moved_sigma, least_way)
    if moved <= Z_95 * moved_sigma:
        return nan, nan, low
    stiffness = force / moved
    shares = (force_sigma / force) ** 2 + (moved_sigma / moved) ** 2
    variance = shares - 2 * covariance / (force * moved)  # relative
    return stiffness, stiffness * max(variance, 0.0) ** 0.5, low


def bend(arc: np.ndarray, contact: np.ndarray, taper: float) -> np.ndarray:
    """Compute ∫₀ˢ (c − t) / (1 − τt)⁴ dt: the tangent angle by a unit force at c over EI at the
    base.

    It is constant beyond c. arc: s, contact: c; taper: τ, share of the base's diameter that is lost
    per length.
    """
    s = np.minimum(arc, contact)
    w = np.maximum(1.0 - taper * s, _LEAST_LEFT)
    return s * (contact * (1.0 + w + w * w) / 3.0 - s * (w + 2.0) / 6.0) / w**3


def _deflection(arc, contact, taper):
    """Compute ∫₀ˢ of `bend`: the deflection (n,) at arcs (n,) by a unit force over EI at the base."""
    half = 0.5 * np.minimum(arc, contact)[:, None]
    inner = (half * _WEIGHTS * bend(half * (1.0 + _NODES), contact[:, None], taper)).sum(axis=1)
    return inner + np.maximum(arc - contact, 0.0) * bend(contact, contact, taper)


@dataclass(frozen=True, eq=False)
class _ShapeFit:
    """Least squares of a stroke's shape, in lengths of the whisker and forces of EI/length².

    seen: its eye in lengths. taper: share of the base's diameter that is lost up to the tip.
    Parameters: rest shape (2, 4), touch, bend in y by the angle past touch and by its square, tan
    φ, contact arc at the pushing angle and its change by angle, then the shared causes of the
    points.
    """

    seen: SeenShape
    theta_rad: float
    taper: float

    @cached_property
    def prior(self) -> np.ndarray:
        """Return one prior sigma of each parameter; infinite where there is no prior."""
        shape = [np.inf, np.inf, np.inf, _TAN_PHI, np.inf, _ALONG_PER_RAD]
        return np.concatenate([_REST, _REST, shape, np.ones(self.seen.shared_rad.shape[1])])

    @cached_property
    def motor(self) -> np.ndarray:
        """Return the motor angle (n,) at each point."""
        return self.seen.motor_rad[self.seen.frame]

    @cached_property
    def along(self) -> np.ndarray:
        """Compute how far out (n,) on the unbent whisker its nearest place to each sight is."""
        along = np.cross(self.seen.across, self.seen.sight)
        on_whisker = along[:, 0] * np.cos(self.motor) + along[:, 1] * np.sin(self.motor)
        return (along @ self.seen.eye_mm) / on_whisker

    def points(
        self, vector: np.ndarray, arc: np.ndarray, pushed: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute centreline points and tangents (n, 3), hub frame, at arcs (n,) of shapes pushed
        (n,) past touch.
        """
        contact = vector[_ARC] + vector[_ALONG] * (pushed - self.theta_rad)
        contact = np.clip(contact, _NEAREST, 1.0)
        size = (vector[_BEND] + vector[_BEND_2] * pushed) * pushed
        per_force = size / bend(contact, contact, self.taper)
        bent = np.minimum(arc, contact)
        # The third derivative jumps at the contact: each side is integrated by itself.
        points = self._integral(vector, 0.0 * arc, bent, contact, per_force)
        points += self._integral(vector, bent, arc, contact, per_force)
        points[:, 1:] += vector[[0, 4]]
        return points, self._tangents(vector, arc, contact, per_force)

    def _integral(self, vector, first, last, contact, per_force):
        """Integrate the tangents from arc `first` to arc `last` (n,), which gives (n, 3)."""
        half = 0.5 * (last - first)[:, None]
        arcs = first[:, None] + half * (1.0 + _NODES)  # (n, nodes)
        tangents = self._tangents(vector, arcs, contact[:, None], per_force[:, None])
        return ((half * _WEIGHTS)[..., None] * tangents).sum(axis=1)

    def _tangents(self, vector, arc, contact, per_force):
        """Compute unit tangents (…, 3): those of the rest shape, turned by the bend."""
        secant = hypot(1.0, vector[_TAN])  # of φ
        bend_rad = per_force * bend(arc, contact, self.taper) * secant
        turn_y = np.sin(bend_rad) / secant
        turn_z = turn_y * vector[_TAN]
        # Slopes of the rest shape's polynomials, whose first coefficient is an offset.
        slopes = np.stack([0 * arc, 1 + 0 * arc, 2 * arc, 3 * arc * arc], axis=-1)
        y = slopes @ vector[:4] + turn_y
        z = slopes @ vector[4:8] + turn_z
        x = np.sqrt(np.maximum(1.0 - y * y - z * z, 0.01))
        return np.stack([x, y, z], axis=-1)

    def residuals(self, vector: np.ndarray) -> np.ndarray:
        """Compute, in sigmas, the points' residuals from their sights and the parameters' from
        their priors.

        Returns (n + parameters,).
        """
        seen = self.seen
        pushed = np.maximum(self.motor - vector[_TOUCH], 0.0)
        points, tangents = self.points(vector, self.along, pushed)
        eye = turned_about_z(seen.eye_mm, -self.motor)
        along = turned_about_z(np.cross(seen.across, seen.sight), -self.motor)
        across = turned_about_z(seen.across, -self.motor)
        # The whisker is straight over a step of a thousandth of its length.
        step = dot(along, eye - points) / dot(along, tangents)
        from_eye = points + step[:, None] * tangents - eye
        lateral_rad = dot(across, from_eye) / np.linalg.norm(from_eye, axis=1)
        own_rad = lateral_rad - seen.shared_rad @ vector[_OWN:]
        return np.concatenate([own_rad / seen.sigma_rad, vector / self.prior])

    def observables(self, vector: np.ndarray) -> np.ndarray:
        """Compute (4,): touch in rad, d_x, force, and how far the contact has moved."""
        theta = self.theta_rad
        arc = vector[[_ARC]]
        points, _ = self.points(vector, arc, np.array([theta]))
        x = points[0, 0]
        y = points[0, 1] - polyval(vector[_ARC], vector[:4])
        size = (vector[_BEND] + vector[_BEND_2] * theta) * theta
        force = -size / bend(arc, arc, self.taper)[0]
        d_x = x * cos(theta) - y * sin(theta)
        moved = x * sin(theta) + y * cos(theta)
        return np.array([vector[_TOUCH], d_x, force, moved])

    def model_share(self, vector, reach, tilt_sigma_rad) -> float:
        """Return the relative sigma of d_x by thickness and lean of the object."""
        phi = atan(abs(vector[_TAN]))
        d_x = self.observables(vector)[1]
        rolling = load_cell.rolling(self.theta_rad, reach, 0.0, d_x, 1.0 - self.taper * d_x)
        return hypot(rolling, load_cell.leaning(self.theta_rad, tilt_sigma_rad, phi, 0.0))

    def force_share(self, rigidity_share) -> float:
        """Return the relative sigma of the force by EI's own and by friction along the whisker."""
        return hypot(rigidity_share, _DRAG * self.theta_rad)

    def solve(self, begin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Fit the parameters, and return them with their covariance.

        The points' sigmas are widened by their residuals' scatter and correlation. Raises
        ArithmeticError where the fit does not converge.
        """
        found = least_squares(
            self.residuals, begin, x_scale="jac", method="trf", max_nfev=_MOST_EVALUATIONS
        )
        if not found.success:
            raise ArithmeticError("the fit of the seen shape does not converge")
        count = len(self.seen.frame)
        jacobian = found.jac.copy()
        jacobian[:count] /= self._sigma_factor(found.fun[:count])
        return found.x, np.linalg.pinv(jacobian.T @ jacobian)

    def _sigma_factor(self, residuals: np.ndarray) -> float:
        """Return the factor on sigmas, at least 1, by the residuals' scatter and the correlation of
        neighbours.
        """
        are_neighbours = np.diff(self.seen.frame) == 0
        products = (residuals[1:] * residuals[:-1])[are_neighbours]
        correlation = float(np.clip(products.mean() / np.mean(residuals**2), 0.0, 0.95))
        freedom = max(len(residuals) - len(self.prior), 1)
        scatter = np.sum(residuals**2) / freedom
        widening = scatter * (1 + correlation) / (1 - correlation)
        return float(np.sqrt(max(widening, 1.0)))


def _initial_parameters(fit: _ShapeFit) -> tuple[float, np.ndarray]:
    """Find (touch, parameters to begin with) by linear least squares over a grid of touch and
    contact.

    Two finer grids follow, each about the best of the grid before.
    """
    plane = _PlanarShape(fit)
    touches = np.linspace(fit.motor.min(), fit.motor.max(), 26)[2:-2]
    contacts = np.linspace(0.1, 0.98, 19)
    around = np.linspace(-1.0, 1.0, 7)
    for _ in range(3):
        values, touch, contact = plane.best_of_grid(touches, contacts)
        touches = touch + around * (touches[1] - touches[0])
        contacts = contact + around * (contacts[1] - contacts[0])
        contacts = np.clip(contacts, _NEAREST, 0.999)
    vector = np.zeros(len(fit.prior))
    vector[:4] = values[:4]
    vector[[_TOUCH, _BEND, _ARC]] = [touch, values[4], contact]
    return float(touch), vector


class _PlanarShape:
    """The seen shape to first order: rest shape and bend in the whisking plane, for given touch and
    contact.
    """

    def __init__(self, fit: _ShapeFit):
        """Compute the weighted aim (n + 4,) and the columns (n + 4, 4) of the rest shape, its
        priors last.
        """
        seen = fit.seen
        self.motor = fit.motor
        self.arc = fit.along
        self.taper = fit.taper
        straight = np.zeros((len(self.arc), 3))
        straight[:, 0] = self.arc
        to_eye = turned_about_z(seen.eye_mm, -self.motor) - straight
        across = turned_about_z(seen.across, -self.motor)
        weight = 1.0 / (seen.sigma_rad * np.linalg.norm(to_eye, axis=1))  # 1/length
        aim = dot(across, to_eye) * weight
        powers = self.arc[:, None] ** np.arange(4)
        self.side = across[:, 1] * weight
        self.aim = np.append(aim, np.zeros(4))
        self.rest = np.vstack([powers * self.side[:, None], np.diag(1.0 / _REST)])

    def best_of_grid(self, touches, contacts) -> tuple[np.ndarray, float, float]:
        """Find (rest shape and bend (5,), touch, contact) of least cost on a grid."""
        tries = []
        for touch in touches:
            for contact in contacts:
                cost, values = self.fit(touch, contact)
                tries.append((cost, values, touch, contact))
        return min(tries, key=itemgetter(0))[1:]

    def fit(self, touch: float, contact: float) -> tuple[float, np.ndarray]:
        """Fit (5,): rest shape, and bend by the angle past touch; return them after their cost.

        The cost is infinite for a whisker that is pulled.
        """
        reach = np.full(len(self.arc), contact)
        shape = _deflection(self.arc, reach, self.taper) / bend(reach, reach, self.taper)
        by_bend = self.side * shape * np.maximum(self.motor - touch, 0.0)
        design = np.column_stack([self.rest, np.append(by_bend, np.zeros(4))])
        values = np.linalg.lstsq(design, self.aim, rcond=None)[0]
        if values[4] >= 0:
            return np.inf, values
        return float(np.sum((design @ values - self.aim) ** 2)), values


def _derivatives(function: Callable, vector: np.ndarray) -> np.ndarray:
    """Compute the derivatives (values, parameters) of a function of the parameters."""
    return central_differences(function, vector, 1e-5 * np.maximum(np.abs(vector), 1e-2))
