"""Truth at a wanted pushing angle: a local fit over touching frames, or the nearest frame where it jumps."""

from dataclasses import dataclass

import numpy as np

from vision.truth.value import FIELDS, Value, WhileTouching

_WINDOW_RAD = np.radians(1.6)
_JUMP_MM = 0.025  # a slip record that leaves its local fit by more is not smooth
_BEYOND_RAD = np.radians(0.3)
_FEWEST_FOR_PARABOLA = 5  # frames: two more than it has coefficients


@dataclass(frozen=True, kw_only=True, eq=False)
class TruthAtAngle(WhileTouching):
    """Truth at one pushing angle; NaN with a status where the whisk does not hold it."""

    theta_rad: float
    status: str = ""


@dataclass(frozen=True)
class Smooth:
    """What `at` needs of the touching frames: values (f,), their Jacobians (f, p), and the covariance (p, p)."""

    theta_rad: np.ndarray
    touch_jacobian: np.ndarray
    values: dict[str, np.ndarray]
    jacobians: dict[str, np.ndarray]
    covariance: np.ndarray


def at_angle(smooth: Smooth | None, theta_rad: float, without: str) -> TruthAtAngle:
    """Slip, deflection, force angle at pushing angle theta, each with sigma; status where it cannot be had.

    without: the status where there is nothing smooth.
    """
    if smooth is None or len(smooth.theta_rad) == 0:
        return TruthAtAngle(theta_rad=theta_rad, status=without or "the whisker does not touch")
    if theta_rad > np.max(smooth.theta_rad) + _BEYOND_RAD or theta_rad <= 0:
        reached = np.degrees(np.max(smooth.theta_rad))
        return TruthAtAngle(theta_rad=theta_rad, status=f"pushed to {reached:.2f} deg only")
    weights, slope, jumps = _weights(smooth, theta_rad)
    values = {field: _value(smooth, name, theta_rad, weights, slope, jumps) for name, field in FIELDS.items()}
    if jumps:
        nearest = float(smooth.theta_rad[int(np.argmax(weights))])
        status = f"slips in jumps: seen at {np.degrees(nearest):.2f} deg"
        return TruthAtAngle(theta_rad=nearest, **values, status=status)
    return TruthAtAngle(theta_rad=theta_rad, **values)


def _value(smooth: Smooth, name: str, theta_rad: float, weights, slope_weights, jumps: bool) -> Value:
    """One quantity by these weights (f,). A smooth one is no surer than the surest frame nearby, and errs by what the
    local fit leaves, too."""
    value, sigma = _combine(smooth, name, weights, slope_weights)
    if jumps:
        return Value(value, sigma)
    sigma = max(sigma, _least_sigma(smooth, name, theta_rad))
    return Value(value, float(np.hypot(sigma, _unfitted(smooth, name, theta_rad))))


def _weights(smooth: Smooth, theta_rad: float):
    """Weights (f,) that give a value at theta, weights of its slope, and whether the slip jumps."""
    value, slope = _local_fit(smooth.theta_rad, theta_rad)
    slip = smooth.values["slip"]
    near = np.abs(smooth.theta_rad - theta_rad) <= _WINDOW_RAD
    smoothed = np.array([_local_fit(smooth.theta_rad, t)[0] @ slip for t in smooth.theta_rad[near]])
    if np.any(np.abs(smoothed - slip[near]) > _JUMP_MM):
        nearest = np.zeros(len(slip))
        nearest[int(np.argmin(np.abs(smooth.theta_rad - theta_rad)))] = 1.0
        return nearest, np.zeros(len(slip)), True
    return value, slope, False


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


def _unfitted(smooth: Smooth, name: str, theta_rad: float) -> float:
    """How far the frames scatter about the local fit: small jumps are in no frame's sigma, but in what lies between."""
    near = _near(smooth.theta_rad - theta_rad)
    x, values = smooth.theta_rad[near] - theta_rad, smooth.values[name][near]
    degree = _degree(len(x))
    if len(x) <= degree + 1:
        return 0.0
    left = values - np.polyval(np.polyfit(x, values, degree), x)
    return float(np.sqrt(np.sum(left**2) / (len(x) - degree - 1)))


def expected_scatter(smooth: Smooth, name: str, theta_rad: float) -> float:
    """What `_unfitted` is, RMS, where nothing jumps and frames err as their covariance says."""
    near = _near(smooth.theta_rad - theta_rad)
    x, rows = smooth.theta_rad[near] - theta_rad, smooth.jacobians[name][near]
    degree = _degree(len(x))
    if len(x) <= degree + 1:
        return 0.0
    powers = np.vander(x, degree + 1)
    left = rows - powers @ np.linalg.lstsq(powers, rows, rcond=None)[0]
    return float(np.sqrt(np.einsum("fi,ij,fj->", left, smooth.covariance, left) / (len(x) - degree - 1)))


def _least_sigma(smooth: Smooth, name: str, theta_rad: float) -> float:
    """Sigma of the surest of the frames nearby: what stands behind the wire errs in all of them alike."""
    rows = smooth.jacobians[name][_near(smooth.theta_rad - theta_rad)]
    return float(np.sqrt(np.min(np.einsum("fi,ij,fj->f", rows, smooth.covariance, rows))))


def _near(x) -> np.ndarray:
    """Frames (f,) within the window of the angle, the two nearest where there are fewer."""
    near = np.abs(x) <= _WINDOW_RAD
    if np.sum(near) >= 2:
        return near
    near = np.zeros(len(x), dtype=bool)
    near[np.argsort(np.abs(x))[:2]] = True
    return near


def _degree(count: int) -> int:
    return min(2 if count >= _FEWEST_FOR_PARABOLA else 1, count - 1)


def _combine(smooth: Smooth, name: str, weights, slope_weights):
    """Weighted value and its sigma; the error of touch moves all pushing angles together."""
    values, jacobian = smooth.values[name], smooth.jacobians[name]
    total = weights @ jacobian + (slope_weights @ values) * smooth.touch_jacobian
    return float(weights @ values), float(np.sqrt(max(total @ smooth.covariance @ total, 0.0)))
