"""Truth at a wanted pushing angle: a local fit over touching frames; where slip jumps, what the frames about it leave.

A jump between two frames may lie before the wanted angle or after it, so slip is that of the one frame or of the other.
The middle with half of the difference is its mean and standard deviation where both are as likely, and no distribution
between the two has a larger one (Popoviciu). Where the contact is follows from angle and slip, and so do deflection and
the force's angle: a line in both, over the frames nearby, carries slip's sigma to them.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri, stdtrit

from vision.geometry.reasons import NO_REASON, Reason
from vision.truth.value import FIELDS, Value, WhileTouching

# [rad] To either side of the wanted angle, of the local fit. Set by eye. Study: thresholds.py
# truth.at_angle _WINDOW_RAD ….
_WINDOW_RAD = np.radians(1.6)
# [mm] A slip record that leaves its local fit by more is not smooth: stick and slip. Set by eye.
# Study: thresholds.py truth.at_angle _JUMP_MM ….
_JUMP_MM = 0.025
# [rad] Past the last frame a value is still given. Set by eye. Study: thresholds.py
# truth.at_angle _BEYOND_RAD ….
_BEYOND_RAD = np.radians(0.3)
# [sigma] Of touch: which frames surely come before a wanted angle; one in 30 000 does not.
# Derived.
# of touch: which frames surely come before a wanted angle, one of 30 000 does not
_SURE_SIGMAS = 4.0
# [share] Of frames that scatter so far about the local fit as their sigmas let them; beyond it is
# small jumps, told by Student's t. Derived.
_CHANCE = 1e-3
# [sigma] Half an interval of 95 %. Derived.
Z_95 = 1.959964
# [frames] Two more than a parabola has coefficients; fewer get a line. Derived.
_FEWEST_FOR_PARABOLA = 5
# [frames] Nine more than a parabola has coefficients: Student's t is within 15 % of the normal
# distribution there. Derived.
# frames: nine more than a parabola has coefficients, Student's t is 15 % above the normal
_FEWEST_FOR_SCATTER = 12


_NO_TOUCHING_FRAME = Reason("no_touching_frame", "the whisker does not touch")
_ANGLES = ("phi", "alpha")  # of FIELDS; the others are lengths


@dataclass(frozen=True, kw_only=True, eq=False)
class TruthAtAngle(WhileTouching):
    """Truth at one pushing angle; NaN with a status where the whisk does not hold it."""

    theta_rad: float
    status: Reason = NO_REASON


@dataclass(frozen=True)
class Smooth:
    """What `at` needs of the touching frames: values (f,), their Jacobians (f, p), and the covariance (p, p)."""

    theta_rad: np.ndarray
    touch_jacobian: np.ndarray
    values: dict[str, np.ndarray]
    jacobians: dict[str, np.ndarray]
    covariance: np.ndarray


def at_angle(smooth: Smooth | None, theta_rad: float, without: Reason) -> TruthAtAngle:
    """Slip, deflection, force angle at pushing angle theta, each with sigma; status where it cannot be had.

    without: the status where there is nothing smooth.
    """
    if smooth is None or len(smooth.theta_rad) == 0:
        return TruthAtAngle(theta_rad=theta_rad, status=without or _NO_TOUCHING_FRAME)
    if theta_rad > np.max(smooth.theta_rad) + _BEYOND_RAD or theta_rad <= 0:
        reached = np.degrees(np.max(smooth.theta_rad))
        short = Reason("pushed_short", f"pushed to {reached:.2f} deg only")
        return TruthAtAngle(theta_rad=theta_rad, status=short)
    between = _about(smooth, theta_rad)
    jumps = _jumps(smooth, theta_rad)
    values = {
        field: _between(smooth, name, theta_rad, between)
        if jumps
        else _value(smooth, name, theta_rad)
        for name, field in FIELDS.items()
    }
    first, last = np.degrees(smooth.theta_rad[between][[0, -1]])
    between_frames = f"slips in jumps: seen at {first:.2f} and {last:.2f} deg"
    status = Reason("slips_in_jumps", between_frames if jumps else "")
    return TruthAtAngle(theta_rad=theta_rad, **values, status=status)


def _value(smooth: Smooth, name: str, theta_rad: float) -> Value:
    """One smooth quantity. It is no surer than the surest frame nearby, and errs by what the local fit leaves, too."""
    value, sigma = _combine(smooth, name, *_local_fit(smooth.theta_rad, theta_rad))
    sigma = max(sigma, np.min(_sigmas(smooth, name, _near(smooth.theta_rad - theta_rad))))
    return Value(value, float(np.hypot(sigma, _scatter(smooth, name, theta_rad))))


def _jumps(smooth: Smooth, theta_rad: float) -> bool:
    """Does the slip about theta leave its local fit?"""
    slip = smooth.values["slip"]
    near = np.abs(smooth.theta_rad - theta_rad) <= _WINDOW_RAD
    smoothed = np.array([_local_fit(smooth.theta_rad, t)[0] @ slip for t in smooth.theta_rad[near]])
    return bool(np.any(np.abs(smoothed - slip[near]) > _JUMP_MM))


def _about(smooth: Smooth, theta_rad: float) -> np.ndarray:
    """Frames (k,) from the last that is surely before theta to the first that is surely past it; at the ends of the
    record the two nearest at least. How sure is the touch's doing, which moves them all."""
    order, count = np.argsort(smooth.theta_rad), len(smooth.theta_rad)
    rising, touch = smooth.theta_rad[order], smooth.touch_jacobian
    doubt = _SURE_SIGMAS * float(np.sqrt(max(touch @ smooth.covariance @ touch, 0.0)))
    first, last = (
        np.searchsorted(rising, theta_rad - doubt) - 1,
        np.searchsorted(rising, theta_rad + doubt),
    )
    return order[max(min(first, count - 2), 0) : max(last, 1) + 1]


def _between(smooth: Smooth, name: str, theta_rad: float, frames: np.ndarray) -> Value:
    """One quantity where slip is anywhere between these frames (k,): by what it is of angle and slip, nearby."""
    slip, values = smooth.values["slip"], smooth.values[name]
    near = _near(smooth.theta_rad - theta_rad)
    rows = np.column_stack([np.ones(len(slip)), smooth.theta_rad - theta_rad, slip])[near]
    by, *_ = np.linalg.lstsq(rows, values[near])
    half, freedom = 0.5 * float(np.ptp(slip[frames])), max(len(rows) - rows.shape[1], 1)
    left = np.sum((values[near] - rows @ by) ** 2) / freedom
    sigma = np.max(_sigmas(smooth, name, frames, by[1]))
    return Value(
        float(by @ [1.0, 0.0, np.min(slip[frames]) + half]),
        float(np.sqrt((by[2] * half) ** 2 + left + sigma**2)),
    )


def _local_fit(theta, at):
    """Weights of a polynomial fit around `at` for its value and its slope there: quadratic where five frames
    are near, else a line, else the nearest frame."""
    near = _near(theta - at)
    degree = _degree(int(np.sum(near)))
    inverse = np.linalg.pinv(np.vander((theta - at)[near], degree + 1, increasing=True))
    value, slope = np.zeros(len(theta)), np.zeros(len(theta))
    value[near] = inverse[0]
    if degree >= 1:
        slope[near] = inverse[1]
    return value, slope


def _scatter(smooth: Smooth, name: str, theta_rad: float) -> float:
    """One sigma of how far a value between the frames may be from the local fit: as far as the frames are. Where chance
    hardly leaves them that far, small jumps do: each frame's own moves the fit, too, and so few frames tell their size
    by Student's t only."""
    found = scatter(smooth, name, theta_rad)
    if (
        not found.freedom
        or found.freedom * found.left**2 <= chdtri(found.freedom, _CHANCE) * found.expected**2
    ):
        return found.left
    weights = _local_fit(smooth.theta_rad, theta_rad)[0] * _share(smooth, name, theta_rad)
    of_jumps = (found.left**2 - found.expected**2) * (1.0 + weights @ weights)
    return float(stdtrit(found.freedom, 0.975) / Z_95 * np.sqrt(of_jumps))


@dataclass(frozen=True)
class Scatter:
    """How far frames are from a smooth curve, RMS at the wanted angle; how far where nothing jumps and they err as
    their covariance says; degrees of freedom, 0 where there are no more frames than the curve has coefficients."""

    left: float = 0.0
    expected: float = 0.0
    freedom: float = 0.0


def scatter(smooth: Smooth, name: str, theta_rad: float) -> Scatter:
    """Of frames about theta, further than the local fit where those are few: small jumps are in no frame's sigma, but
    in what lies between.

    Teeth go from one friction angle to another: the force's angle jumps by as much in all of them, and lengths by as
    much for their pushing angle. Each frame weighs as it is known. With weights W and the projection M off the curve,
    what scatters by τ in all of them leaves τ² tr(M W²), with tr(M W²)² / tr((M W²)²) degrees of freedom.
    """
    near = _near(smooth.theta_rad - theta_rad, _FEWEST_FOR_SCATTER) & (smooth.theta_rad > 0)
    degree = _degree(int(np.sum(near)))
    if np.sum(near) <= degree + 1:
        return Scatter()
    grows = 1.0 / _share(smooth, name, theta_rad)[near]
    rows = grows[:, None] * smooth.jacobians[name][near]
    covariance = rows @ smooth.covariance @ rows.T
    weights = 1.0 / np.sqrt(np.diag(covariance))
    design = weights[:, None] * np.vander(smooth.theta_rad[near] / theta_rad - 1.0, degree + 1)
    off = np.eye(len(design)) - design @ np.linalg.pinv(design)
    left, by_noise = (
        off @ (weights * grows * smooth.values[name][near]),
        off * np.outer(weights, weights) * covariance,
    )
    alike = off * weights**2
    total = np.trace(alike)
    freedom = total**2 / np.sum(alike * alike.T)
    return Scatter(
        float(np.sqrt(left @ left / total)),
        float(np.sqrt(np.sum(by_noise) / total)),
        float(freedom),
    )


def _share(smooth: Smooth, name: str, theta_rad: float) -> np.ndarray:
    """What each frame (f,) has of a quantity's size at theta where the force keeps its direction."""
    return np.ones(len(smooth.theta_rad)) if name in _ANGLES else smooth.theta_rad / theta_rad


def _sigmas(smooth: Smooth, name: str, frames: np.ndarray, slope: float = 0.0) -> np.ndarray:
    """Sigma of each of the frames (k,) by itself: what stands behind the wire errs in all of them alike. slope:
    per rad, by which the error of touch moves it."""
    rows = smooth.jacobians[name][frames] + slope * smooth.touch_jacobian
    return np.sqrt(np.maximum(np.einsum("fi,ij,fj->f", rows, smooth.covariance, rows), 0.0))


def _near(x, fewest: int = 2) -> np.ndarray:
    """Frames (f,) within the window of the angle, so many of the nearest where there are fewer."""
    near = np.abs(x) <= _WINDOW_RAD
    if np.sum(near) < fewest:
        near = np.zeros(len(x), dtype=bool)
        near[np.argsort(np.abs(x))[:fewest]] = True
    return near


def _degree(count: int) -> int:
    return min(2 if count >= _FEWEST_FOR_PARABOLA else 1, count - 1)


def _combine(smooth: Smooth, name: str, weights, slope_weights):
    """Weighted value and its sigma; the error of touch moves all pushing angles together."""
    values, jacobian = smooth.values[name], smooth.jacobians[name]
    total = weights @ jacobian + (slope_weights @ values) * smooth.touch_jacobian
    return float(weights @ values), float(np.sqrt(max(total @ smooth.covariance @ total, 0.0)))
