"""The friction angle α of a whisk that slips, by pictures alone: the exact rod's force against the seen surface.

The rod of the stated whisker, bent as it is seen, shows which way the object pushes it, whatever its stiffness. The
normal of the contact stands across bar and whisker. Coulomb's friction acts against the sliding; its part across the
whisker bends the rod, that along the whisker hardly does. So tan α is the force across the whisker and the normal over
that along the normal, over the cosine of the angle at which the whisker slides along itself.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Polynomial

from bench.base.combined import sigma_without
from bench.gauges.held_rod import HeldRod
from bench.gauges.whisker_rods import SeenContacts, rod_of
from bench.records.trial_result import Deflection, SeenWhisk
from bench.session.whisker import Whisker
from vision import UNKNOWN, Value
from vision.geometry import unit

# [rad] Of a frame that is used. How the whisker slides along itself is known to second order in the pushing angle:
# at 8° α is then off by 0.06°. Derived; study: tests/studies/accuracy/combined_numbers.py.
_FARTHEST_RAD = np.radians(10.0)
# [rad] Nearer to touch the force has no direction yet: at 60 mm a whisker is bent by 0.3 mm there, whose direction
# lines known to 0.01 mm give to 2°. Derived; twice that moves α seen by 0.11 sigma: bench_thresholds.py
# trials.seen_friction _NEAREST_RAD 0.0105.
_NEAREST_RAD = np.radians(0.3)
# [frames] Near the wanted angle, at least. Stated.
_FEWEST_NEAR = 5
# [1] Sigma of α over the square of the slope at the contact of an unloaded whisker that is stated to be straight: six
# whisks of a vibrissa with s² = 0.01 to 0.016 are off by up to 0.7 s². Study: tests/studies/accuracy/species.py.
_SET_LEFT = 1 / 2
# [1] Share of what sliding along the whisker changes α by that may be wrong: two whisks of a vibrissa that slide along
# themselves at 10 and 16° are off by a tenth and a seventh of it. Study: tests/studies/accuracy/species.py.
_HEADING_LEFT = 1 / 8
# [rad] Step of differences of slope and tilt of the bar: far above rounding, far below what curves. Derived.
_STEP_RAD = 1e-5
# [mm] Less slip shows neither rest nor jump. Study: tests/bench/trials/test_phases.py, which holds at half and
# at twice of it.
_LEAST_SLIP_MM = 0.1
# [frames] Fewer show no slip: three have two intervals, of which one may rest. Derived.
_LEAST_FRAMES = 3


def with_seen_friction(seen: SeenWhisk, whisker: Whisker) -> SeenWhisk:
    """Return a whisk with its α, rad, if it slips; NaN where it hardly does, or no rod is bent so.

    It is the slope of α · size over the size of the deflection, frame by frame, so that an offset of all
    deflections drops out. Along a sphere or a ring the slope turns with the slip, so that α there is that
    at the wanted pushing angle, by the normal at the contact.
    """
    seen = replace(seen, friction_rad=UNKNOWN, friction_by_camera_error_rad=np.zeros(0))
    if not slips(seen):
        return seen
    if turns_with_slip(seen):
        return seen if seen.at is None else replace(seen, friction_rad=seen.at.alpha_rad)
    d = _near_touch(seen.deflection)
    growth = whisker.wire.radius_by_arc(d.along_mm)
    psi_rad = np.nan_to_num(seen.psi_rad.value)
    sliding = _Sliding(seen.deflection, d, growth, seen.beta_rad.value, psi_rad)
    try:
        friction_rad, by_camera_error = _of_sliding(sliding, seen, whisker)
    except ArithmeticError:
        return seen
    return replace(seen, friction_rad=friction_rad, friction_by_camera_error_rad=by_camera_error)


def slips(seen: SeenWhisk) -> bool:
    """Return whether the contact moves along the bar. Else the force may lie anywhere within the
    friction cone.
    """
    deflection = seen.deflection
    if deflection is None or not seen.has_truth or len(deflection.theta_rad) < _LEAST_FRAMES:
        return False
    return bool(np.ptp(deflection.slip_mm) >= _LEAST_SLIP_MM)


def turns_with_slip(seen: SeenWhisk) -> bool:
    """Return whether the object is curved along itself: a cone is straight there."""
    return seen.truth.rounded is not None and seen.truth.rounded.shape != "cone"


def heading(d: Deflection, theta_rad: float | np.ndarray) -> float | np.ndarray:
    """Return the angle h between the slip at θ and the bar, as seen.

    The whisker's material moves along itself, too. Friction acts against the whole motion, so that the
    force across the whisker has less than α: tan(|β| − |φ|) = tan α cos h. The slip begins in proportion
    to θ, the motion along a straight whisker to θ², along a curved one to θ, too; each has one power more.
    """
    past_per_rad = _rate(d.theta_rad, d.past_mm, (0, 2, 1, 3), theta_rad)
    slip_per_rad = _rate(d.theta_rad, d.slip_mm, (1, 2), theta_rad)
    return np.arctan(past_per_rad / slip_per_rad)


def _rate(
    theta_rad: np.ndarray, values: np.ndarray, powers: tuple[int, ...], at_rad: float | np.ndarray
) -> float | np.ndarray:
    """Return the derivative at angles of the polynomial that fits values (n,) best.

    powers: of the polynomial, the most needed ones first; of few values the last are left out.
    """
    powers = powers[: max(2, len(theta_rad) // 2)]
    columns = np.stack([theta_rad**power for power in powers], axis=1)
    coefficients = np.linalg.lstsq(columns, values, rcond=None)[0]
    return sum(c * power * at_rad ** (power - 1) for c, power in zip(coefficients, powers) if power)


def _of_sliding(sliding: "_Sliding", seen: SeenWhisk, whisker: Whisker) -> tuple[Value, np.ndarray]:
    """Return α of a contact that slides, and how it changes (k,) with each unit error of the cameras.

    Cameras move deflection and slope together: as far as they turn both alike, α stays as it is. Raises
    ArithmeticError where no rod is bent so.
    """
    d = sliding.deflection
    rod = rod_of(whisker)
    contacts = SeenContacts.of(d)
    friction = sliding.friction_along(rod.held(contacts, 0.0))
    held = rod.held(contacts, friction)
    alpha_rad = sliding.slope_rad(held)
    by_place = contacts.derivatives(
        lambda moved: sliding.alpha_rad(rod.held(moved, friction)), sliding.alpha_rad(held)
    )
    by_place = (sliding.weights[:, None] * by_place).ravel()  # (3n,)
    by_beta, by_psi = _by_direction(sliding, held)
    place_by_cameras = d.by_camera_error_mm.T @ by_place  # (k,)
    beta_by_cameras, psi_by_cameras = _direction_by_cameras(seen, len(place_by_cameras))
    by_camera_error = place_by_cameras + by_beta * beta_by_cameras + by_psi * psi_by_cameras
    place_variance = by_place @ d.covariance @ by_place - place_by_cameras @ place_by_cameras
    parts = [
        np.sqrt(max(place_variance, 0.0)),
        by_beta * sigma_without(seen.beta_rad.sigma, beta_by_cameras),
        by_psi * sigma_without(np.nan_to_num(seen.psi_rad.sigma), psi_by_cameras),
        _HEADING_LEFT * (alpha_rad - sliding.weights @ sliding.across_rad(held)),
        _left_of_set(seen, whisker),
        *by_camera_error,
    ]
    return Value(alpha_rad, float(np.linalg.norm(parts))), by_camera_error


def _direction_by_cameras(seen: SeenWhisk, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return how the object's slope and tilt change (k,) with each of k unit errors of the cameras; not at all where
    they are not seen.
    """
    by_beta = seen.beta_by_camera_error_rad
    if not len(by_beta):
        return np.zeros(count), np.zeros(count)
    return by_beta, seen.truth.shared.psi_by_camera_error_rad


def _by_direction(sliding: "_Sliding", held: HeldRod) -> tuple[float, float]:
    """Return the derivatives of α by the object's slope and by its tilt."""
    alpha_rad = sliding.slope_rad(held)
    steeper = replace(sliding, beta_rad=sliding.beta_rad + _STEP_RAD)
    leaning = replace(sliding, psi_rad=sliding.psi_rad + _STEP_RAD)
    by_beta = (steeper.slope_rad(held) - alpha_rad) / _STEP_RAD
    by_psi = (leaning.slope_rad(held) - alpha_rad) / _STEP_RAD
    return by_beta, by_psi


@dataclass(frozen=True, eq=False)
class _Sliding:
    """n frames of a contact that slides along a straight object.

    whole: the deflection of all touching frames; deflection: that of the n frames. growth (n,): change of the whisker's
    radius per arc length. beta_rad, psi_rad: slope and tilt of the object.
    """

    whole: Deflection
    deflection: Deflection
    growth: np.ndarray | float
    beta_rad: float
    psi_rad: float

    @property
    def weights(self) -> np.ndarray:
        """Return the weights (n,) by which angles make the slope of angle · size over the deflection's size."""
        size = np.hypot(self.deflection.across_z_mm, self.deflection.across_y_mm)
        centred = size - size.mean()
        return centred * size / np.sum(centred**2)

    def slope_rad(self, held: HeldRod) -> float:
        """Return α of all frames by the forces of a rod."""
        return float(self.weights @ self.alpha_rad(held))

    def alpha_rad(self, held: HeldRod) -> np.ndarray:
        """Return α (n,) by the forces of a rod in these frames."""
        along_bar, cosine = self._across_whisker(held)
        return np.arctan(along_bar / cosine)

    def across_rad(self, held: HeldRod) -> np.ndarray:
        """Return the angle (n,) of the force across the whisker: α, were nothing sliding along it."""
        return np.arctan(self._across_whisker(held)[0])

    def friction_along(self, held: HeldRod) -> np.ndarray:
        """Return the friction along the whisker over the force across it (n,), below 0: away from the clamp.

        A whisker that bends is drawn towards its clamp over the object, and friction acts against that.
        """
        along_bar, cosine = self._across_whisker(held)
        sine = np.sqrt(1.0 - cosine**2)
        return -np.abs(along_bar / cosine) * sine / np.hypot(1.0, along_bar)

    def _across_whisker(self, held: HeldRod) -> tuple[np.ndarray, np.ndarray]:
        """Return the friction across the whisker over the normal force (n,), against the slip positive, and the
        cosine (n,) of the angle at which the whisker slides along itself.
        """
        bar = self._bar_directions()
        normal = unit(np.cross(bar, held.tangent))
        across = np.cross(normal, held.tangent)
        slip = np.sign(self.deflection.slip_mm.sum())
        press = _dot(held.force_N, normal)
        share = _dot(bar, across)
        leans = _dot(bar, held.tangent)
        # Where the whisker tapers and the bar leans along it, the normal has a part across the whisker.
        of_normal = -np.sign(press) * self.growth * leans * share / (1.0 - leans**2)
        friction = -slip * (_dot(held.force_N, across) / press - of_normal)
        friction = np.sign(share) * np.sign(press) * friction
        return friction, self._cosine_across(share, leans)

    def _cosine_across(self, share: np.ndarray, leans: np.ndarray) -> np.ndarray:
        """Return the cosine (n,) of the angle at which the whisker slides along itself.

        share, leans (n,): parts of the bar's direction across the whisker and along it.
        """
        past = np.tan(heading(self.whole, self.deflection.theta_rad)) + leans - np.sin(self.psi_rad)
        return np.abs(share) / np.hypot(share, past)

    def _bar_directions(self) -> np.ndarray:
        """Return the object's direction (n, 3) in the axes of the hub."""
        lean = np.cos(self.psi_rad)
        x = np.sin(self.psi_rad)
        y = lean * np.sin(self.beta_rad)
        z = lean * np.cos(self.beta_rad)
        cos = np.cos(self.deflection.theta_rad)
        sin = np.sin(self.deflection.theta_rad)
        return np.stack([cos * x + sin * y, cos * y - sin * x, np.full_like(cos, z)], axis=1)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar products (n,) of vectors (n, 3)."""
    return np.sum(a * b, axis=1)


def _near_touch(d: Deflection) -> Deflection:
    """Return the frames from `_NEAREST_RAD` to `_FARTHEST_RAD`, those beyond too where the former are few."""
    bent = d.theta_rad > _NEAREST_RAD
    near = bent & (d.theta_rad <= _FARTHEST_RAD)
    chosen = near if np.sum(near) >= _FEWEST_NEAR else bent
    return d.part(chosen)


def _left_of_set(seen: SeenWhisk, whisker: Whisker) -> float:
    """Return what α seen may be off by because a whisker that is stated to be straight is curved, rad.

    Where it slopes by s at the contact, as much as s² of a push goes sideways and into twist.
    """
    if seen.truth.shape is None or whisker.turn_rad > 0:
        return 0.0
    share = seen.deflection.d_x_mm / whisker.length_mm
    slopes = [Polynomial(own).deriv()(share) for own in seen.truth.shape.rest_mm]
    return float(_SET_LEFT * np.sum(np.square(slopes)) / whisker.length_mm**2)
