"""Contact and force from the seen shape of a whisker of known rigidity, by one camera and no gauge
([38], Kaneko).

This estimator alone is allowed pictures of its own trial. It is given sights, not images: lines
from one eye on which points of the centreline lie. Up to the contact the curvature falls to zero as
the lever does, beyond it the whisker is straight: where the bend ends is the contact, how much it
bends is the force. One camera does not see the bend towards it; the angle at which it leaves the
whisking plane has a prior of 0 ± 45° and is fitted with the rest.

Rig frame: base at the origin, z the rotation axis, x along the whisker at motor angle 0. Lengths in
mm, angles in rad. The fit itself (`estimator.shape_fit`) takes lengths in those of the whisker and
forces in EI/length², so that it converges alike whatever the whisker's size and stiffness.
"""

from dataclasses import dataclass, replace
from math import hypot, nan

import numpy as np

from estimator.beam import Beam
from estimator.numerics import central_differences
from estimator.reasons import NamedReason
from estimator.shape_fit import TAN_PHI, ShapeFit, first_parameters
from estimator.uncertainty import Z_95

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
# [lengths] Least way of the contact by which a force is divided: rounding. Derived.
_LEAST_WAY = 1e-11
# [rad] Frames that far past the pushing angle still count. Stated.
_BEYOND_RAD = np.radians(1.0)
# [frames] Fewest with points from which a shape is fitted. Stated.
_FEWEST_FRAMES = 4
# [points] Fewest from which a shape is fitted. Stated.
_FEWEST_POINTS = 30
# [1] Largest share of the force by which tan φ may change it: its square, a hundredth, is left out. Derived.
_MOST_BY_PLANE = 0.1
# [1] Step of differences over a parameter's size. Derived.
_DIFFERENCE = 1e-5
# [1] Least size of a parameter there. Derived.
_LEAST_SIZE = 1e-2


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
    touch, begin = first_parameters(ShapeFit(seen, theta_rad, beam.taper))
    pushed_rad = touch + theta_rad
    near = seen.until(pushed_rad + _BEYOND_RAD)
    if not (near.has_frames and seen.reaches(pushed_rad)):
        return ShapeContact(status=NOT_PUSHED)
    fit = ShapeFit(near, theta_rad, beam.taper)
    try:
        vector, covariance = fit.solve(begin)
    except ArithmeticError:
        return ShapeContact(status=UNCONVERGED)
    model_share = fit.model_share(vector, reach_mm / length, tilt_sigma_rad)
    force_share = fit.force_share(rigidity_share)
    return _contact_of_fit(fit, vector, covariance, beam, model_share, force_share)


def _contact_of_fit(
    fit: ShapeFit,
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
    steps = _DIFFERENCE * np.maximum(np.abs(vector), _LEAST_SIZE)
    gradient = central_differences(fit.observables, vector, steps)  # (4, parameters)
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
    by_plane = gradient @ covariance[:, TAN_PHI] / covariance[TAN_PHI, TAN_PHI] ** 0.5  # one sigma
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
