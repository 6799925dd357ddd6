"""The lens: camera coordinates to pixels and back (Brown–Conrady, OpenCV's order), with analytic
Jacobians.

The nine lens parameters are fx fy cx cy k1 k2 p1 p2 k3. With a = x/z, b = y/z, r² = a² + b²:

    radial = 1 + k1 r² + k2 r⁴ + k3 r⁶
    a' = a radial + 2 p1 a b + p2 (r² + 2a²),   u = fx a' + cx
    b' = b radial + p1 (r² + 2b²) + 2 p2 a b,   v = fy b' + cy
"""

import numpy as np

LENS_TERMS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
# [steps] Newton's, which end before; where they do not, the pixel has no direction. Derived.
_MOST_STEPS = 30
# [px] To which a projection is inverted: rounding. Derived.
_TOLERANCE_PX = 1e-9


def distort(ab: np.ndarray, distortion: np.ndarray) -> np.ndarray:
    """Return normalised picture coordinates (n, 2) as the lens distorts them, (n, 2)."""
    _, _, p1, p2, _ = distortion
    a, b = ab.T
    r2, scale = _scale(ab, distortion)
    return _as_rows(scale * a + r2 * p2, scale * b + r2 * p1)


def _scale(ab: np.ndarray, distortion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return r² (n,), and by what (n,) coordinates (n, 2) are multiplied."""
    _, _, p1, p2, _ = distortion
    a, b = ab.T
    r2 = a * a + b * b
    return r2, _radial(r2, distortion) + 2.0 * (p1 * b + p2 * a)


def distort_jacobian(ab: np.ndarray, distortion: np.ndarray) -> np.ndarray:
    """Return d distort / d ab, (n, 2, 2); symmetric, since both coordinates come from one
    potential.
    """
    k1, k2, p1, p2, k3 = distortion
    r2, scale = _scale(ab, distortion)
    slope = k1 + r2 * (2 * k2 + 3 * r2 * k3)  # d radial / d r²
    half_gradient = slope[:, None] * ab + [2 * p2, 2 * p1]  # of the scale, (n, 2)
    half = half_gradient[:, :, None] * ab[:, None]  # (n, 2, 2)
    return scale[:, None, None] * np.eye(2) + half + np.swapaxes(half, 1, 2)


def project(x_camera: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """Project points in camera coordinates (n, 3) to pixels (n, 2); NaN where a point is not in
    front of the camera.
    """
    fx, fy, cx, cy = lens[:4]
    x, y = distort(_normalise(x_camera), lens[4:]).T
    return _as_rows(x * fx + cx, y * fy + cy)


def project_with_jacobians(
    x_camera: np.ndarray, lens: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pixels (n, 2) with their derivatives by the point (n, 2, 3) and by the nine lens
    parameters (n, 2, 9).
    """
    ab = _normalise(x_camera)
    distorted = distort(ab, lens[4:])
    px = distorted * lens[:2] + lens[2:4]
    return px, _by_point(ab, x_camera[:, 2], lens), _by_lens(ab, distorted, lens)


def unproject(px: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """Return the normalised coordinates (n, 2) whose projection is px (n, 2), by Newton's method;
    NaN where none is found.

    Newton needs four to six steps for the lenses of a bench; past the lens's fold there is no
    solution.
    """
    target = (px - lens[2:4]) / lens[:2]
    ab = target.copy()
    tolerance = _TOLERANCE_PX / min(lens[:2])
    for _ in range(_MOST_STEPS):
        residual = distort(ab, lens[4:]) - target
        if not np.any(np.abs(residual) > tolerance):
            break
        ab = ab - _solve_2x2(distort_jacobian(ab, lens[4:]), residual)
    converged = np.all(np.abs(distort(ab, lens[4:]) - target) <= 1e3 * tolerance, axis=1)
    return np.where(converged[:, None], ab, np.nan)


def fold_radius(distortion: np.ndarray) -> float:
    """Return how far from the principal point the picture reaches before the lens folds it back, in
    distorted normalised coordinates (px over focal length); inf where it never does.

    The radial curve r (1 + k1 r² + k2 r⁴ + k3 r⁶) stops rising there. Beyond, two directions share
    a pixel: a lens that folds inside its own picture is over-fitted.
    """
    k1, k2, _, _, k3 = distortion
    roots = np.roots(np.trim_zeros([7 * k3, 5 * k2, 3 * k1, 1.0], "f"))
    squares = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real
    if not len(squares):
        return np.inf
    r2 = squares.min()
    return float(np.sqrt(r2) * _radial(r2, distortion))


def _radial(r2: np.ndarray, distortion: np.ndarray) -> np.ndarray:
    """Return the radial factor 1 + k1 r² + k2 r⁴ + k3 r⁶ at squared radii."""
    k1, k2, _, _, k3 = distortion
    return 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))


def _normalise(x_camera: np.ndarray) -> np.ndarray:
    """Return (x/z, y/z) (n, 2) of points (n, 3); NaN where z is not positive."""
    x, y, z = x_camera.T
    z = np.where(z > 0, z, np.nan)
    return _as_rows(x / z, y / z)


def _as_rows(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return two coordinates (n,) as points (n, 2).

    Each is computed by itself: NumPy takes several times as long over an axis of two.
    """
    points = np.empty((len(x), 2))
    points[:, 0] = x
    points[:, 1] = y
    return points


def _by_point(ab: np.ndarray, z: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """Return d px / d point (n, 2, 3), by the chain rule through a = x/z, b = y/z."""
    by_ab = distort_jacobian(ab, lens[4:]) * lens[:2, None] / z[:, None, None]
    return np.concatenate([by_ab, -(by_ab @ ab[:, :, None])], axis=2)


def _by_lens(ab: np.ndarray, distorted: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """Return d px / d lens parameters (n, 2, 9), columns as in LENS_TERMS."""
    a, b = ab.T
    r2 = a * a + b * b
    jacobian = np.zeros((len(ab), 2, 9))
    jacobian[:, [0, 1], [0, 1]] = distorted
    jacobian[:, [0, 1], [2, 3]] = 1.0
    # Each distortion term moves a point along (a, b); p1 and p2 also along one axis, by r².
    factors = np.stack([r2, r2 * r2, 2.0 * b, 2.0 * a, r2 * r2 * r2], axis=1)  # k1 k2 p1 p2 k3
    by_distortion = ab[:, :, None] * factors[:, None]  # (n, 2, 5)
    by_distortion[:, [1, 0], [2, 3]] += r2[:, None]
    jacobian[:, :, 4:] = lens[:2, None] * by_distortion
    return jacobian


def _solve_2x2(J: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return x (n, 2) with J x = y, by Cramer's rule; NaN where J (n, 2, 2) is singular."""
    a, b, c, d = J.reshape(-1, 4).T
    y0, y1 = y.T
    determinant = a * d - b * c
    is_singular = np.abs(determinant) <= 1e-12
    divisor = np.where(is_singular, np.nan, determinant)
    first = (d * y0 - b * y1) / divisor
    second = (a * y1 - c * y0) / divisor
    return _as_rows(first, second)
