"""All that an estimator may know of one whisk, what it is told, and what it answers."""

from dataclasses import dataclass, field
from math import nan

import numpy as np

from estimator.beam import Beam
from estimator.domain import require_friction_angle, require_sigma

_ARRAYS = (
    "time_s",
    "theta_rad",
    "m_y_Nmm",
    "m_z_Nmm",
    "covariance_at",
    "theta_moment_covariance_at",
)


@dataclass(frozen=True, eq=False)
class OtherSensors:
    """What other sensors of Table I tell of a whisk at its pushing angle; NaN where there is no such sensor.

    force_N (3,): f_x, f_y, f_z of the base on the whisker, hub's axes, with covariance (3, 3); scale_sigma: share by
    which the force's newtons and the moments' may disagree. rate_Nmm (2,): rate of m_y and m_z over the motor angle,
    per rad, with covariance (2, 2).
    """

    force_N: np.ndarray
    force_covariance: np.ndarray
    scale_sigma: float
    rate_Nmm: np.ndarray
    rate_covariance: np.ndarray


@dataclass(frozen=True, eq=False)
class ObjectMotion:
    """How an object moves while it is touched: (3,) mm per radian of the motor, with covariance (3, 3); x along the
    whisker at touch, y the way it pushes, z up."""

    per_rad_mm: np.ndarray
    covariance_mm2: np.ndarray


@dataclass(frozen=True)
class Whisk:
    """One forward stroke against an object, as a robot feels it.

    time_s, theta_rad, m_y_Nmm, m_z_Nmm: (n,) samples from before felt touch on; theta_rad is the motor
    angle since felt touch (negative before it), moments are above the free stroke's level. theta_at_rad:
    the pushing angle wanted; m_y_at_Nmm, m_z_at_Nmm: moments there; covariance_at (2, 2): theirs, in the
    order y, z, in (N·mm)²; theta_sigma_rad: of the pushing angle, felt touch included;
    theta_moment_covariance_at (2,): of the pushing angle with m_y and m_z, in rad·N·mm. others: what other sensors
    tell, None where nobody asked. object_motion: None where the object stands. Raises ValueError where shapes disagree
    or a sigma is negative. The arrays are copies that cannot be written to: what one estimator does with them is no
    other's concern.
    """

    time_s: np.ndarray
    theta_rad: np.ndarray
    m_y_Nmm: np.ndarray
    m_z_Nmm: np.ndarray
    theta_at_rad: float
    m_y_at_Nmm: float
    m_z_at_Nmm: float
    covariance_at: np.ndarray
    theta_sigma_rad: float
    beam: Beam
    theta_moment_covariance_at: np.ndarray = field(default_factory=lambda: np.zeros(2))
    others: OtherSensors | None = None
    object_motion: ObjectMotion | None = None

    def __post_init__(self):
        shapes = {np.shape(a) for a in (self.time_s, self.theta_rad, self.m_y_Nmm, self.m_z_Nmm)}
        if len(shapes) != 1 or len(shapes.pop()) != 1:
            raise ValueError(
                "time_s, theta_rad, m_y_Nmm and m_z_Nmm must be arrays (n,) of one length"
            )
        if np.shape(self.covariance_at) != (2, 2):
            raise ValueError(
                f"covariance_at has shape {np.shape(self.covariance_at)}: must be (2, 2)"
            )
        if np.shape(self.theta_moment_covariance_at) != (2,):
            raise ValueError("theta_moment_covariance_at must have shape (2,)")
        require_sigma("theta_sigma_rad", self.theta_sigma_rad)
        for name in _ARRAYS:
            kept = np.array(getattr(self, name), dtype=float)
            kept.setflags(write=False)
            object.__setattr__(self, name, kept)


@dataclass(frozen=True)
class EstimatorSettings:
    """What an estimator is told beforehand: the assumed friction cone angle, and how far it is trusted.

    object_reach_mm is how thick the object may be (radii of object and whisker together), and
    tilt_sigma_rad how far it may lean along the whisker. Both enter the sigma alone. Who is told its radius has it in
    object_radius_mm, NaN else; whisker_radius_mm is the whisker's own at its base.
    """

    alpha_est_rad: float
    alpha_est_sigma_rad: float = 0.0
    object_reach_mm: float = 0.0
    tilt_sigma_rad: float = 0.0
    object_radius_mm: float = nan
    whisker_radius_mm: float = 0.0

    def __post_init__(self):
        require_friction_angle("alpha_est_rad", self.alpha_est_rad)
        for name in ("alpha_est_sigma_rad", "object_reach_mm", "tilt_sigma_rad"):
            require_sigma(name, getattr(self, name))


@dataclass(frozen=True)
class Estimate:
    """A distance with its standard deviation, both in mm; NaN where there is none, and status says why.

    low_mm, high_mm: its 95 % interval, NaN where that is 1.96 sigma to either side; a low end of 0 and a high one at
    the whisker's length are open. alpha_est_rad, beta_rad: the friction angle that was assumed and the slope that came
    of it, NaN where the estimator knows of none. deflection_mm, deflection_sigma_mm: where it says itself where the
    contact is at the pushing angle, (d_y, d_z) from the unbent whisker; None: worked out from distance and moments.
    gradient (4,): of the distance by θ, m_y, m_z and alpha_est, where the estimator knows it: so the contact point's
    errors hang together.
    """

    d_x_mm: float
    sigma_mm: float
    status: str = ""
    low_mm: float = nan
    high_mm: float = nan
    alpha_est_rad: float = nan
    beta_rad: float = nan
    deflection_mm: tuple[float, float] | None = None
    deflection_sigma_mm: tuple[float, float] | None = None
    gradient: np.ndarray | None = field(default=None, compare=False)
