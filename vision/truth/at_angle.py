"""Truth at a wanted pushing angle: a local fit over touching frames; where slip jumps, bounds by
the frames around it.

A jump between two frames may lie before the wanted angle or after it, so slip is that of the one
frame or of the other. The middle with half of the difference is its mean and standard deviation
where both are as likely, and no distribution between the two has a larger one (Popoviciu). Where
the contact is follows from angle and slip, and so do deflection and the force's angle: a line in
both, over the frames nearby, carries slip's sigma to them.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import chdtri, stdtrit

from vision.geometry.reasons import NO_REASON, Reason
from vision.truth.value import FIELDS, NAN, Value, WhileTouching, propagated_sigma

# [rad] To either side of the wanted angle, of the local fit. By 1.1° or 2.3° a slip moves by 0.1
# sigma. Study: thresholds.py truth.at_angle _WINDOW_RAD ….
_WINDOW_RAD = np.radians(1.6)
# [mm] A slip record that leaves its local fit by more is not smooth: stick and slip. Half or
# twice it moves nothing on the fixtures. Study: thresholds.py truth.at_angle _JUMP_MM ….
_JUMP_MM = 0.025
# [sigma] Of the frames' own scatter about that fit, beyond which it is no chance: 1 in 15 000. Of 0.3 px in traces
# slip scatters by 0.02 mm. Derived.
_JUMP_SIGMAS = 4.0
# [rad] Past the last frame a value is still given. Half a step of frames that are 0.6° apart.
# Stated.
_BEYOND_RAD = np.radians(0.3)
# [sigma] Of touch, by which a frame lies before or past the wanted angle beyond doubt: 1 in 30 000 errs.
# Derived.
_SURE_SIGMAS = 4.0
# [1] Probability by chance alone of a scatter about the local fit that is taken for small jumps; their
# size then enters by Student's t. Derived.
_CHANCE = 1e-3
# [sigma] Half an interval of 95 %. Derived.
Z_95 = 1.959964
# [frames] Two more than a parabola has coefficients; fewer get a line. Derived.
_FEWEST_FOR_PARABOLA = 5
# [frames] Nine more than a parabola has coefficients: Student's t is within 15 % of the normal
# distribution there. Derived.
_FEWEST_FOR_SCATTER = 12
_NO_TOUCHING_FRAME = Reason("no_touching_frame", "the whisker does not touch")
_ANGLES = ("phi", "alpha")  # of FIELDS; the others are lengths


@dataclass(frozen=True, kw_only=True, eq=False)
class TruthAtAngle(WhileTouching):
    """Truth at one pushing angle; NaN with a status where the whisk does not reach it.

    slip_shared_mm: the part of slip's sigma that all whisks of a session have in common.
    """

    theta_rad: float
    slip_shared_mm: float = NAN
    status: Reason = NO_REASON


@dataclass(frozen=True)
class Smooth:
    """The touching frames, for interpolation: values (f,) by name, their Jacobians (f, p) by the
    parameters, that of the angle of touch (p,), and the parameters' covariance (p, p), with the
    part of it that all whisks of a session share.

    d_x_mm: radial distance by the fit, which need not be known as well as a truth is.
    by_camera_error (p, k): how the parameters change with each unit error of the session's cameras.
    """

    theta_rad: np.ndarray
    touch_jacobian: np.ndarray
    values: dict[str, np.ndarray]
    jacobians: dict[str, np.ndarray]
    covariance: np.ndarray
    shared_covariance: np.ndarray
    by_camera_error: np.ndarray
    d_x_mm: float = NAN


def at_angle(smooth: Smooth | None, theta_rad: float, without: Reason) -> TruthAtAngle:
    """Return slip, deflection and force angle at a pushing angle, each with sigma; a status where
    they are not known.

    without: the status where there are no touching frames.
    """
    if smooth is None or len(smooth.theta_rad) == 0:
        return TruthAtAngle(theta_rad=theta_rad, status=without or _NO_TOUCHING_FRAME)
    largest_rad = np.max(smooth.theta_rad)
    if theta_rad > largest_rad + _BEYOND_RAD or theta_rad <= 0:
        sentence = f"pushed to {np.degrees(largest_rad):.2f} deg only"
        return TruthAtAngle(theta_rad=theta_rad, status=Reason("pushed_short", sentence))
    near = NearAngle(smooth, theta_rad)
    return near.in_jump() if near.slip_jumps else near.between_jumps()


@dataclass(frozen=True, eq=False)
class NearAngle:
    """A whisk's touching frames, for what is at one pushing angle: a local fit over the frames nearby."""

    smooth: Smooth
    theta_rad: float

    def between_jumps(self) -> TruthAtAngle:
        """Return the quantities by the local fit."""
        values = {}
        for name, field in FIELDS.items():
            values[field] = self._smooth_value(name)
        shared_mm = self._shared_slip_mm(values["slip_mm"])
        return TruthAtAngle(theta_rad=self.theta_rad, slip_shared_mm=shared_mm, **values)

    def in_jump(self) -> TruthAtAngle:
        """Return the quantities where slip jumps nearby, with the status that says so."""
        values = {}
        for name, field in FIELDS.items():
            values[field] = self._value_in_jump(name)
        first, last = np.degrees(self.smooth.theta_rad[self._frames_around][[0, -1]])
        sentence = f"slips in jumps: seen at {first:.2f} and {last:.2f} deg"
        return TruthAtAngle(
            theta_rad=self.theta_rad,
            slip_shared_mm=self._shared_slip_mm(values["slip_mm"]),
            **values,
            status=Reason("slips_in_jumps", sentence),
        )

    @property
    def slip_jumps(self) -> bool:
        """Return whether the slip in a frame nearby is away from its local fit, by more than frames scatter."""
        smooth = self.smooth
        slip_mm = smooth.values["slip"]
        by_parameter = smooth.jacobians["slip"]
        for frame in np.flatnonzero(np.abs(self._beyond_rad) <= _WINDOW_RAD):
            weights, _ = _local_fit(smooth.theta_rad, smooth.theta_rad[frame])
            weights[frame] -= 1.0
            sigma_mm = propagated_sigma(weights @ by_parameter, smooth.covariance)
            if abs(weights @ slip_mm) > max(_JUMP_MM, _JUMP_SIGMAS * sigma_mm):
                return True
        return False

    @property
    def _beyond_rad(self) -> np.ndarray:
        """Return how far (f,) the frames are pushed beyond the angle, rad."""
        return self.smooth.theta_rad - self.theta_rad

    @cached_property
    def _is_near(self) -> np.ndarray:
        """Return the mask (f,) of the frames nearby."""
        return _near(self._beyond_rad)

    @cached_property
    def _fit(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the local fit's weights (f,), for a value and for its slope."""
        return _local_fit(self.smooth.theta_rad, self.theta_rad)

    def _by_parameter(self, name: str) -> np.ndarray:
        """Return the derivatives (p,) of a quantity by the local fit.

        The error of touch moves all pushing angles together.
        """
        weights, slope_weights = self._fit
        slope = slope_weights @ self.smooth.values[name]
        return weights @ self.smooth.jacobians[name] + slope * self.smooth.touch_jacobian

    def _shared_slip_mm(self, slip_mm: Value) -> float:
        """Return the part of slip's sigma that all whisks of a session share, at most the whole."""
        shared_mm = propagated_sigma(self._by_parameter("slip"), self.smooth.shared_covariance)
        return float(min(shared_mm, slip_mm.sigma))

    def _smooth_value(self, name: str) -> Value:
        """Return a smooth quantity by the local fit.

        Its sigma is not below that of the best frame nearby; the fit's residuals are added to it.
        """
        smooth = self.smooth
        rows = smooth.jacobians[name][self._is_near]
        least = np.min(propagated_sigma(rows, smooth.covariance))
        sigma = max(propagated_sigma(self._by_parameter(name), smooth.covariance), least)
        weights, _ = self._fit
        value = float(weights @ smooth.values[name])
        return Value(value, float(np.hypot(sigma, self.between_frames_sigma(name))))

    @cached_property
    def _frames_around(self) -> np.ndarray:
        """Return the frames (k,) from the last that is surely before the angle to the first that is surely
        past it.

        The uncertainty is that of touch, which moves them all. At the ends of the record they are the
        two nearest at least.
        """
        smooth = self.smooth
        order = np.argsort(smooth.theta_rad)
        rising = smooth.theta_rad[order]
        margin_rad = _SURE_SIGMAS * propagated_sigma(smooth.touch_jacobian, smooth.covariance)
        first = np.searchsorted(rising, self.theta_rad - margin_rad) - 1
        last = np.searchsorted(rising, self.theta_rad + margin_rad)
        return order[max(min(first, len(order) - 2), 0) : max(last, 1) + 1]

    def _value_in_jump(self, name: str) -> Value:
        """Return a quantity where slip is anywhere between the frames around, by its linear dependence
        on angle and slip nearby.
        """
        smooth = self.smooth
        frames = self._frames_around
        coefficients, residual_variance = self._linear_in_slip(name)
        _, by_angle, by_slip = coefficients
        rows = smooth.jacobians[name][frames] + by_angle * smooth.touch_jacobian
        sigma = np.max(propagated_sigma(rows, smooth.covariance))
        slip_mm = smooth.values["slip"][frames]
        half_mm = 0.5 * float(np.ptp(slip_mm))
        value = coefficients @ [1.0, 0.0, np.min(slip_mm) + half_mm]
        variance = (by_slip * half_mm) ** 2 + residual_variance + sigma**2
        return Value(float(value), float(np.sqrt(variance)))

    def _linear_in_slip(self, name: str) -> tuple[np.ndarray, float]:
        """Fit a quantity nearby by a constant, the angle beyond the wanted one and the slip.

        Returned are the coefficients (3,) and the variance of the residuals.
        """
        angle_rad = self._beyond_rad
        near = self._is_near
        columns = [np.ones(len(angle_rad)), angle_rad, self.smooth.values["slip"]]
        design = np.column_stack(columns)[near]
        values = self.smooth.values[name][near]
        coefficients, *_ = np.linalg.lstsq(design, values)
        freedom = max(len(design) - design.shape[1], 1)
        return coefficients, np.sum((values - design @ coefficients) ** 2) / freedom

    def between_frames_sigma(self, name: str) -> float:
        """Return by how much a quantity between two frames may be off the local fit, one sigma.

        It is the scatter of the frames about the fit. A scatter larger than their sigmas explain is of
        small jumps. Then each frame's jump moves the fit, too, and Student's t allows for how few
        frames it is estimated from.
        """
        found = self.scatter(name)
        chi2_limit = np.inf
        if found.freedom:
            chi2_limit = chdtri(found.freedom, _CHANCE) * found.expected**2
        if found.freedom * found.rms**2 <= chi2_limit:
            return found.rms
        weights = self._fit[0] * self._share(name)
        jump_variance = (found.rms**2 - found.expected**2) * (1.0 + weights @ weights)
        return float(stdtrit(found.freedom, 0.975) / Z_95 * np.sqrt(jump_variance))

    def scatter(self, name: str) -> "Scatter":
        """Return the scatter of frames nearby, by twelve frames at least where there are as many.

        Small jumps are in no frame's sigma. Stick and slip goes from one friction angle to another, so
        that the force's angle jumps by the same amount everywhere and lengths in proportion to the
        pushing angle: these are compared as shares of it. Frames are weighted by their precision.
        """
        smooth = self.smooth
        near = _near(self._beyond_rad, _FEWEST_FOR_SCATTER) & (smooth.theta_rad > 0)
        degree = _degree(int(np.sum(near)))
        if np.sum(near) <= degree + 1:
            return Scatter()
        size = 1.0 / self._share(name)[near]
        rows = size[:, None] * smooth.jacobians[name][near]
        covariance = rows @ smooth.covariance @ rows.T
        curve = np.vander(smooth.theta_rad[near] / self.theta_rad - 1.0, degree + 1)
        return _scatter_about(curve, size * smooth.values[name][near], covariance)

    def _share(self, name: str) -> np.ndarray:
        """Return each frame's (f,) share of a quantity's size at the angle where the force keeps its
        direction.
        """
        if name in _ANGLES:
            return np.ones(len(self.smooth.theta_rad))
        return self.smooth.theta_rad / self.theta_rad


@dataclass(frozen=True)
class Scatter:
    """The scatter of frames about a smooth curve.

    rms: at the wanted angle. expected: the same where nothing jumps and frames err as their
    covariance says. freedom: degrees of freedom, 0 where there are no more frames than the curve
    has coefficients.
    """

    rms: float = 0.0
    expected: float = 0.0
    freedom: float = 0.0


def _local_fit(theta, at):
    """Return the weights (f,) of a polynomial fit around `at` for its value there, and for its
    slope.

    It is quadratic where five frames are near, else a line, else the nearest frame.
    """
    near = _near(theta - at)
    degree = _degree(int(np.sum(near)))
    inverse = np.linalg.pinv(np.vander((theta - at)[near], degree + 1, increasing=True))
    value = np.zeros(len(theta))
    slope = np.zeros(len(theta))
    value[near] = inverse[0]
    if degree >= 1:
        slope[near] = inverse[1]
    return value, slope


def _scatter_about(curve: np.ndarray, values: np.ndarray, covariance: np.ndarray) -> Scatter:
    """Return the scatter of values (n,) of this covariance (n, n) about a curve, columns (n, k).

    With weights W and the projection M off the curve, a scatter of τ in all of them leaves τ²
    tr(M W²), with tr(M W²)² / tr((M W²)²) degrees of freedom.
    """
    weights = 1.0 / np.sqrt(np.diag(covariance))
    design = weights[:, None] * curve
    M = np.eye(len(design)) - design @ np.linalg.pinv(design)
    residual = M @ (weights * values)
    noise = np.sum(M * np.outer(weights, weights) * covariance)
    MW2 = M * weights**2
    total = np.trace(MW2)
    freedom = total**2 / np.sum(MW2 * MW2.T)
    rms = np.sqrt(residual @ residual / total)
    return Scatter(float(rms), float(np.sqrt(noise / total)), float(freedom))


def _near(distance_rad, fewest: int = 2) -> np.ndarray:
    """Return the mask (f,) of frames within the window of the angle, of so many of the nearest
    where there are fewer.
    """
    near = np.abs(distance_rad) <= _WINDOW_RAD
    if np.sum(near) < fewest:
        near = np.zeros(len(distance_rad), dtype=bool)
        near[np.argsort(np.abs(distance_rad))[:fewest]] = True
    return near


def _degree(count: int) -> int:
    """Return the degree of the local polynomial for so many frames."""
    return min(2 if count >= _FEWEST_FOR_PARABOLA else 1, count - 1)
