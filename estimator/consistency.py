"""Friction from consistency (section VII, way 2): the α whose contact points make the smoothest object.

With a wrong α the distances are off by a factor that depends on the slip angle, so contacts of one object
scatter unless all have the same slip angle: then any α fits alike, and the answer says so.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from estimator import distance
from estimator.domain import require_positive

CURVES = ("line", "spline")
ONE_SLOPE = "the contacts do not span two slopes, so any friction angle fits alike"
TOO_FEW = "too few contacts for the curve"
AT_BOUND = "at the bound of the search"
STEEPEST_SHARE = 0.99
GRID_SIZE = 121
SMALL_SPREAD = 0.05
FEWEST = 6
TOLERANCE_RAD = 1e-10


@dataclass(frozen=True)
class Contacts:
    """Whisks against one object, a row each, arrays (n,).

    theta [rad], m_y, m_z [N·mm] at the pushing angle, C = 3EI [N·mm²], touch [rad] the motor angle of first touch,
    z_c [mm] the height of the plane of rotation, poses (n, 3, 4) from each whisker's rig frame to the object's frame
    (none: all alike), weights, taper_per_mm: share of its diameter that the whisker loses a mm. Raises ValueError where
    shapes disagree or a row is no push against an object.
    """

    theta: np.ndarray
    m_y: np.ndarray
    m_z: np.ndarray
    C: float
    touch: np.ndarray
    z_c: np.ndarray
    poses: np.ndarray | None = None
    weights: np.ndarray | None = field(default=None)
    taper_per_mm: float = 0.0

    def __post_init__(self):
        require_positive("C", self.C, "N·mm²")
        shape = np.shape(self.theta)
        if len(shape) != 1 or any(np.shape(a) != shape for a in (self.m_y, self.m_z, self.touch, self.z_c)):
            raise ValueError("theta, m_y, m_z, touch and z_c must be arrays (n,) of one length")
        if self.poses is not None and np.shape(self.poses) != (*shape, 3, 4):
            raise ValueError(f"poses has shape {np.shape(self.poses)}: must be {(*shape, 3, 4)}")
        if not np.isfinite(self.distances(0.0)).all():
            raise ValueError("a contact is no push against an object (see distance.why_not): leave it out")

    def without(self, index: int) -> "Contacts":
        """All contacts but one."""
        rows = ("theta", "m_y", "m_z", "touch", "z_c", "poses", "weights")
        kept = {name: getattr(self, name) for name in rows}
        return replace(self, **{name: np.delete(a, index, axis=0) for name, a in kept.items() if a is not None})

    @property
    def shares(self) -> np.ndarray:
        """Weights (n,) that sum to one."""
        weights = np.ones(len(self.theta)) if self.weights is None else np.asarray(self.weights, dtype=float)
        return weights / weights.sum()

    @property
    def phi(self) -> np.ndarray:
        """Slip angles (n,), rad."""
        return distance.felt_slip_angle(self.m_y, self.m_z)

    def distances(self, alpha: float) -> np.ndarray:
        """d_x (n,) in mm for an assumed friction angle."""
        return 1 / (1 / distance.with_friction(self.theta, self.m_y, self.m_z, alpha, self.C) + self.taper_per_mm)

    def points(self, alpha: float) -> np.ndarray:
        """Contact points (n, 3) in mm, in the object's frame."""
        r_c, theta_c, z_c = distance.contact_point(self.distances(alpha), self.touch, self.z_c)
        points = np.stack(distance.cartesian(r_c, theta_c, z_c), axis=-1)
        if self.poses is None:
            return points
        poses = np.asarray(self.poses, dtype=float)
        return np.einsum("nij,nj->ni", poses[:, :, :3], points) + poses[:, :, 3]


@dataclass(frozen=True)
class Consistency:
    """The α of the most consistent contacts, its sigma, the rms distance [mm] from the curve, and any doubt."""

    alpha_rad: float
    sigma_rad: float
    rms_mm: float
    status: str = ""


def most_consistent_alpha(contacts: Contacts, *, curve: str = "line", stiffness: float = 1e-3) -> Consistency:
    """`smoothest_alpha` with its sigma and the distance from the curve."""
    alpha, status = smoothest_alpha(contacts, curve=curve, stiffness=stiffness)
    if np.isnan(alpha):
        return Consistency(np.nan, np.nan, np.nan, status)
    sigma = _jackknife(contacts, alpha, _grid(contacts), curve, stiffness)
    off = _from_curve(contacts.points(alpha), curve, stiffness, contacts.shares)
    return Consistency(alpha, sigma, float(np.sqrt(np.mean(np.sum(off**2, axis=1)))), status)


def smoothest_alpha(contacts: Contacts, *, curve: str = "line", stiffness: float = 1e-3) -> tuple[float, str]:
    """(α, any doubt): minimises the weighted distance of the contact points to their best line or smoothing spline.

    Distances count as shares of d_x, so that a larger α, which shrinks all of them, is not preferred for
    that. `stiffness` is the spline's: curvature against distance, over the cube of the object's extent. α
    is NaN where the contacts do not span two slip angles. Raises ValueError for another `curve`.
    """
    if curve not in CURVES:
        raise ValueError(f"curve = {curve!r}: must be one of {', '.join(CURVES)}")
    if len(np.unique(contacts.points(0.0).round(6), axis=0)) < FEWEST:
        return np.nan, TOO_FEW
    if not np.ptp(np.abs(np.tan(contacts.phi))) > SMALL_SPREAD:
        return np.nan, ONE_SLOPE
    grid = _grid(contacts)
    best = int(np.argmin([_roughness(contacts, alpha, curve, stiffness) for alpha in grid]))
    bracket = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    return _smoothest(contacts, bracket, curve, stiffness), AT_BOUND if best in (0, len(grid) - 1) else ""


def _grid(contacts):
    """Friction angles (GRID_SIZE,) up to where the steepest contact would lose its distance."""
    return np.linspace(0.0, STEEPEST_SHARE * (np.pi / 2 - np.abs(contacts.phi).max()), GRID_SIZE)


def _roughness(contacts, alpha, curve, stiffness):
    """Weighted mean square of the distances from the curve, as shares of d_x."""
    off = _from_curve(contacts.points(alpha), curve, stiffness, contacts.shares)
    return contacts.shares @ ((off**2).sum(axis=1) / contacts.distances(alpha) ** 2)


def _smoothest(contacts, bracket, curve, stiffness, tolerance=TOLERANCE_RAD):
    from scipy.optimize import minimize_scalar

    def cost(alpha):
        return _roughness(contacts, alpha, curve, stiffness)

    return float(minimize_scalar(cost, bounds=bracket, method="bounded", options={"xatol": tolerance}).x)


def _jackknife(contacts, alpha, grid, curve, stiffness):
    """Sigma of α from leaving out each contact in turn, so that steep contacts may scatter more than others."""
    reach = 5 * grid[1]
    bracket = max(0.0, alpha - reach), min(grid[-1], alpha + reach)
    count = len(contacts.theta)
    without = [_smoothest(contacts.without(i), bracket, curve, stiffness, 1e-6) for i in range(count)]
    return float(np.sqrt((count - 1) * np.var(without)))


def _from_curve(points, curve, stiffness, weights):
    """Offsets (n, 2) of points from their best line, or from their smoothing spline along it."""
    centred = points - np.average(points, axis=0, weights=weights)
    axes = np.linalg.svd(np.sqrt(weights)[:, None] * centred, full_matrices=False)[2]
    along, across = centred @ axes[0], centred @ axes[1:].T
    if curve == "line":
        return across
    order = np.argsort(along, kind="stable")
    smooth = np.empty_like(across)
    smooth[order] = _spline(along[order], across[order], weights[order], stiffness * np.ptp(along) ** 3)
    return across - smooth


def _spline(x, y, weights, stiffness):
    """Values at x of the smoothing splines of y (n, k); contacts at one place are averaged."""
    from scipy.interpolate import make_smoothing_spline

    _, member = np.unique(np.round(x / np.ptp(x), 6), return_inverse=True)
    total = np.bincount(member, weights)
    centres = np.bincount(member, weights * x) / total
    columns = []
    for column in y.T:
        mean = np.bincount(member, weights * column) / total
        columns.append(make_smoothing_spline(centres, mean, w=total, lam=stiffness)(centres)[member])
    return np.stack(columns, axis=-1)
