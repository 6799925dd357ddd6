"""The least-squares fit of a whisker's shape over a stroke to the sights of one camera.

Lengths are in those of the whisker, forces in EI/length², angles in rad. In the hub's frame the
whisker is its rest shape, turned at each place by the bend of one force: it grows with the angle
past touch, lies in one plane, and ends at the contact, which may move along the whisker.
"""

from dataclasses import dataclass
from functools import cached_property
from math import atan, cos, hypot, sin
from operator import itemgetter
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.polynomial.polynomial import polyval
from scipy.optimize import least_squares

from estimator import load_cell
from estimator.vectors import dot, turned_about_z

if TYPE_CHECKING:
    from estimator.seen_shape import SeenShape

# [lengths] Prior sigma of the rest shape by powers of s/L: clamped off centre, clamp angle, set and
# sag, change of curvature: of 100 mm, 1 mm, 5°, 5 mm and 2 mm. Stated.
_REST = np.array([0.01, 0.08, 0.05, 0.02])
# [1] Prior sigma of tan φ of the bend: 45°. Stated.
_TAN_PHI_SIGMA = 1.0
# [lengths/rad] Prior sigma of how fast the contact moves along the whisker: of 100 mm, several radii
# of a bar in rolling, or 3 mm of slip in 3° along an object that leans by 20°. Derived.
_ALONG_PER_RAD = 0.2
# [lengths] Nearest contact to the base. Stated.
_NEAREST = 0.01
# [evaluations] Of the residuals, by which a fit has converged: simulated strokes take 5 to 35. Stated.
_MOST_EVALUATIONS = 80
# [1/rad] Relative sigma of the force per rad pushed: friction along the whisker, which is not
# modelled, adds to the moment tan α times w/d, that is θ at most, over that of the force across; α
# is taken as 0 ± 14°. Derived.
_DRAG = 0.25
# [1] Least share of the base's diameter: a cone's point bends without end. Stated.
_LEAST_LEFT = 1e-3
# [1] Nodes and weights of Gauss–Legendre quadrature on −1 … 1, exact to the 15th power. Derived.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
# [place] Of tan φ in the parameter vector. A layout.
TAN_PHI = 11


@dataclass(frozen=True, eq=False)
class ShapeParameters:
    """The parameters of a shape, in their order in the vector.

    rest_y, rest_z (4,): rest shape, polynomials in the arc. touch: motor angle of touch. bend,
    bend_change: the tangent's angle in y at the contact over the angle past touch, and by its
    square, 1/rad. tan_phi: tangent of the angle by which the bend leaves the whisking plane.
    contact, contact_change: arc of the contact at the pushing angle, and by the angle, per rad. causes (k,): of
    the points' errors that they share, in sigmas.
    """

    rest_y: np.ndarray
    rest_z: np.ndarray
    touch: float
    bend: float
    bend_change: float
    tan_phi: float
    contact: float
    contact_change: float
    causes: np.ndarray

    @classmethod
    def of(cls, vector: np.ndarray) -> Self:
        """Return the parameters of a vector (14 + k,)."""
        return cls(vector[:4], vector[4:8], *vector[8:14].tolist(), vector[14:])

    @property
    def vector(self) -> np.ndarray:
        """Return the parameters as a vector (14 + k,)."""
        of_bend = [self.touch, self.bend, self.bend_change]
        of_contact = [self.tan_phi, self.contact, self.contact_change]
        return np.concatenate([self.rest_y, self.rest_z, of_bend, of_contact, self.causes])

    def tip_angle(self, pushed: np.ndarray | float) -> np.ndarray | float:
        """Return the tangent's angle in y at the contact, pushed so far past touch."""
        return (self.bend + self.bend_change * pushed) * pushed


def bend(arc: np.ndarray, contact: np.ndarray, taper: float) -> np.ndarray:
    """Compute ∫₀ˢ (c − t) / (1 − τt)⁴ dt: the tangent angle by a unit force at c over EI at the
    base.

    It is constant beyond c. arc: s, contact: c; taper: τ, share of the base's diameter that is lost
    per length.
    """
    s = np.minimum(arc, contact)
    w = np.maximum(1.0 - taper * s, _LEAST_LEFT)
    lever = contact * (1.0 + w + w * w) / 3.0 - s * (w + 2.0) / 6.0
    return s * lever / w**3


def _deflection(arc: np.ndarray, contact: np.ndarray, taper: float) -> np.ndarray:
    """Compute ∫₀ˢ of `bend`: the deflection (n,) at arcs (n,) by a unit force over EI at the base."""
    half = 0.5 * np.minimum(arc, contact)[:, None]
    slopes = bend(half * (1.0 + _NODES), contact[:, None], taper)  # (n, nodes)
    inner = np.sum(half * _WEIGHTS * slopes, axis=1)
    beyond = np.maximum(arc - contact, 0.0)
    return inner + beyond * bend(contact, contact, taper)


@dataclass(frozen=True, eq=False)
class _Shapes:
    """Bent shapes of one rest shape, one for each of n points.

    contact (n,): arc of the contact. per_force (n,): force over EI at the base. taper: share of the
    base's diameter that is lost up to the tip.
    """

    parameters: ShapeParameters
    contact: np.ndarray
    per_force: np.ndarray
    taper: float

    def points(self, arc: np.ndarray) -> np.ndarray:
        """Return the centrelines' points (n, 3) at arcs (n,)."""
        bent = np.minimum(arc, self.contact)
        # The third derivative jumps at the contact: each side is integrated by itself.
        points = self._integral(np.zeros_like(arc), bent) + self._integral(bent, arc)
        points[:, 1] += self.parameters.rest_y[0]
        points[:, 2] += self.parameters.rest_z[0]
        return points

    def tangents(self, arc: np.ndarray) -> np.ndarray:
        """Return the unit tangents (n, …, 3) at arcs (n, …): the rest shape's, turned by the bend."""
        parameters = self.parameters
        of_shape = (-1, *[1] * (arc.ndim - 1))
        contact = self.contact.reshape(of_shape)
        per_force = self.per_force.reshape(of_shape)
        secant = hypot(1.0, parameters.tan_phi)  # of φ
        bend_rad = per_force * bend(arc, contact, self.taper) * secant
        turn_y = np.sin(bend_rad) / secant
        y = _slope(parameters.rest_y, arc) + turn_y
        z = _slope(parameters.rest_z, arc) + turn_y * parameters.tan_phi
        x = np.sqrt(np.maximum(1.0 - y * y - z * z, 0.01))
        return np.stack([x, y, z], axis=-1)

    def _integral(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return the integral (n, 3) of the tangents from arcs `first` to arcs `last` (n,)."""
        half = 0.5 * (last - first)[:, None]
        arcs = first[:, None] + half * (1.0 + _NODES)  # (n, nodes)
        weights = (half * _WEIGHTS)[..., None]
        return np.sum(weights * self.tangents(arcs), axis=1)


def _slope(rest: np.ndarray, arc: np.ndarray) -> np.ndarray:
    """Return the slopes (…) of a rest shape (4,) at arcs (…)."""
    return rest[1] + 2 * rest[2] * arc + 3 * rest[3] * arc * arc


@dataclass(frozen=True, eq=False)
class ShapeFit:
    """Least squares of a stroke's shape by `ShapeParameters`.

    seen: its eye in lengths. theta_rad: the pushing angle. taper: share of the base's diameter that
    is lost up to the tip.
    """

    seen: "SeenShape"
    theta_rad: float
    taper: float

    @cached_property
    def prior(self) -> np.ndarray:
        """Return one prior sigma of each parameter; infinite where there is no prior."""
        return ShapeParameters(
            rest_y=_REST,
            rest_z=_REST,
            touch=np.inf,
            bend=np.inf,
            bend_change=np.inf,
            tan_phi=_TAN_PHI_SIGMA,
            contact=np.inf,
            contact_change=_ALONG_PER_RAD,
            causes=np.ones(self.seen.shared_rad.shape[1]),
        ).vector

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

    def _shapes(self, parameters: ShapeParameters, pushed: np.ndarray) -> _Shapes:
        """Return the shapes of whiskers pushed (n,) past touch, in the hub's frame."""
        moved = parameters.contact_change * (pushed - self.theta_rad)
        contact = np.clip(parameters.contact + moved, _NEAREST, 1.0)
        per_force = parameters.tip_angle(pushed) / bend(contact, contact, self.taper)
        return _Shapes(parameters, contact, per_force, self.taper)

    def residuals(self, vector: np.ndarray) -> np.ndarray:
        """Compute, in sigmas, the points' residuals from their sights and the parameters' from
        their priors.

        Returns (n + parameters,).
        """
        seen = self.seen
        parameters = ShapeParameters.of(vector)
        pushed = np.maximum(self.motor - parameters.touch, 0.0)
        shapes = self._shapes(parameters, pushed)
        points = shapes.points(self.along)
        tangents = shapes.tangents(self.along)
        eye = turned_about_z(seen.eye_mm, -self.motor)
        along = turned_about_z(np.cross(seen.across, seen.sight), -self.motor)
        across = turned_about_z(seen.across, -self.motor)
        # The whisker is straight over a step of a thousandth of its length.
        step = dot(along, eye - points) / dot(along, tangents)
        from_eye = points + step[:, None] * tangents - eye
        lateral_rad = dot(across, from_eye) / np.linalg.norm(from_eye, axis=1)
        own_rad = lateral_rad - seen.shared_rad @ parameters.causes
        return np.concatenate([own_rad / seen.sigma_rad, vector / self.prior])

    def observables(self, vector: np.ndarray) -> np.ndarray:
        """Compute (4,): touch in rad, d_x, force, and how far the contact has moved."""
        parameters = ShapeParameters.of(vector)
        theta = self.theta_rad
        arc = np.array([parameters.contact])
        point = self._shapes(parameters, np.array([theta])).points(arc)[0]
        x = point[0]
        y = point[1] - polyval(parameters.contact, parameters.rest_y)
        force = -parameters.tip_angle(theta) / bend(arc, arc, self.taper)[0]
        d_x = x * cos(theta) - y * sin(theta)
        moved = x * sin(theta) + y * cos(theta)
        return np.array([parameters.touch, d_x, force, moved])

    def model_share(self, vector: np.ndarray, reach: float, tilt_sigma_rad: float) -> float:
        """Return the relative sigma of d_x by thickness and lean of the object."""
        phi = atan(abs(ShapeParameters.of(vector).tan_phi))
        d_x = self.observables(vector)[1]
        rolling = load_cell.rolling(self.theta_rad, reach, 0.0, d_x, 1.0 - self.taper * d_x)
        leaning = load_cell.leaning(self.theta_rad, tilt_sigma_rad, phi, 0.0)
        return hypot(rolling, leaning)

    def force_share(self, rigidity_share: float) -> float:
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


def first_parameters(fit: ShapeFit) -> tuple[float, np.ndarray]:
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
    first = ShapeParameters(
        rest_y=values[:4],
        rest_z=np.zeros(4),
        touch=float(touch),
        bend=values[4],
        bend_change=0.0,
        tan_phi=0.0,
        contact=contact,
        contact_change=0.0,
        causes=np.zeros(fit.seen.shared_rad.shape[1]),
    )
    return first.touch, first.vector


class _PlanarShape:
    """The seen shape to first order: rest shape and bend in the whisking plane, for given touch and
    contact.
    """

    def __init__(self, fit: ShapeFit):
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

    def best_of_grid(
        self, touches: np.ndarray, contacts: np.ndarray
    ) -> tuple[np.ndarray, float, float]:
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
        without_prior = np.append(by_bend, np.zeros(4))
        design = np.column_stack([self.rest, without_prior])
        values = np.linalg.lstsq(design, self.aim, rcond=None)[0]
        if values[4] >= 0:
            return np.inf, values
        misfit = design @ values - self.aim
        return float(np.sum(misfit**2)), values
