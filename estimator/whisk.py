"""What an estimator receives of one whisk, its settings, and the estimate that it returns."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import isnan, nan, sqrt

import numpy as np

from estimator.beam import Beam
from estimator.distance import felt_slip_angle
from estimator.domain import require_friction_angle, require_sigma

# [sigma] Of m_y: more is no chance. Stated.
_HELD_SIGMAS = 2.0
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
    """Readings of the other sensors of Table I at the pushing angle; NaN where there is no such
    sensor.

    force_N (3,): force (f_x, f_y, f_z) of the base on the whisker, in the hub's axes.
    force_covariance (3, 3): its covariance, N².
    scale_sigma: relative standard deviation of the force's scale against that of the moments.
    rate_Nmm (2,): derivative of (m_y, m_z) by the motor angle, N·mm per rad.
    rate_covariance (2, 2): its covariance.
    """

    force_N: np.ndarray
    force_covariance: np.ndarray
    scale_sigma: float
    rate_Nmm: np.ndarray
    rate_covariance: np.ndarray


@dataclass(frozen=True, eq=False)
class ObjectMotion:
    """Motion of an object while it is touched, per radian of the motor.

    per_rad_mm (3,): mm/rad; x along the whisker at touch, y the way it pushes, z up.
    covariance_mm2 (3, 3): its covariance.
    """

    per_rad_mm: np.ndarray
    covariance_mm2: np.ndarray


@dataclass(frozen=True, eq=False)
class Whisk:
    """One forward stroke against an object, as a robot feels it.

    time_s, theta_rad, m_y_Nmm, m_z_Nmm (n,): samples, which begin before the felt touch. theta_rad
    is the motor angle since the felt touch (negative before it), moments are above the level of the
    free stroke.
    theta_at_rad: the pushing angle at which the distance is wanted.
    m_y_at_Nmm, m_z_at_Nmm: moments at that angle.
    covariance_at (2, 2): covariance of (m_y, m_z) there, (N·mm)².
    theta_sigma_rad: standard deviation of the pushing angle, that of the felt touch included.
    theta_moment_covariance_at (2,): covariance of the pushing angle with (m_y, m_z), rad·N·mm.
    others: readings of other sensors; None where there are none.
    object_motion: None where the object stands still.
    unfiltered_Nmm (n, 2): m_y and m_z of the samples as they were recorded, where m_y_Nmm and m_z_Nmm
    are low-passed; None where they are not kept.

    Raises ValueError where shapes disagree or a sigma is negative. The arrays are read-only copies:
    no estimator can change what another one receives.
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
    unfiltered_Nmm: np.ndarray | None = None

    def __post_init__(self):
        """Raise ValueError for a wrong shape or sigma, and keep read-only copies."""
        samples = (self.time_s, self.theta_rad, self.m_y_Nmm, self.m_z_Nmm)
        shapes = set(map(np.shape, samples))
        if len(shapes) != 1 or len(shapes.pop()) != 1:
            raise ValueError(
                "time_s, theta_rad, m_y_Nmm and m_z_Nmm must be arrays (n,) of one length"
            )
        shape = np.shape(self.covariance_at)
        if shape != (2, 2):
            raise ValueError(f"covariance_at has shape {shape}: must be (2, 2)")
        if np.shape(self.theta_moment_covariance_at) != (2,):
            raise ValueError("theta_moment_covariance_at must have shape (2,)")
        require_sigma("theta_sigma_rad", self.theta_sigma_rad)
        names = _ARRAYS
        if self.unfiltered_Nmm is not None:
            if np.shape(self.unfiltered_Nmm) != (len(self.time_s), 2):
                raise ValueError("unfiltered_Nmm must have shape (n, 2), as many rows as samples")
            names = (*_ARRAYS, "unfiltered_Nmm")
        for name in names:
            kept = np.array(getattr(self, name), dtype=float)
            kept.setflags(write=False)
            object.__setattr__(self, name, kept)

    @classmethod
    def without_samples(
        cls,
        theta_at_rad: float,
        moments_at_Nmm: Sequence[float],
        covariance_at: np.ndarray,
        beam: Beam,
        *,
        theta_sigma_rad: float = 0.0,
        theta_moment_covariance_at: Sequence[float] = (0.0, 0.0),
    ) -> "Whisk":
        """Return a whisk that is known at its pushing angle alone: all that (10) needs.

        moments_at_Nmm (2,): m_y and m_z there.
        """
        m_y_Nmm, m_z_Nmm = moments_at_Nmm
        nothing = np.zeros(0)
        return cls(
            time_s=nothing,
            theta_rad=nothing,
            m_y_Nmm=nothing,
            m_z_Nmm=nothing,
            theta_at_rad=theta_at_rad,
            m_y_at_Nmm=m_y_Nmm,
            m_z_at_Nmm=m_z_Nmm,
            covariance_at=covariance_at,
            theta_sigma_rad=theta_sigma_rad,
            beam=beam,
            theta_moment_covariance_at=theta_moment_covariance_at,
        )

    @property
    def felt(self) -> tuple[float, float, float]:
        """Return the pushing angle, and m_y and m_z there."""
        return self.theta_at_rad, self.m_y_at_Nmm, self.m_z_at_Nmm

    @property
    def phi_rad(self) -> float:
        """Return the felt slip angle φ of (8) at the pushing angle."""
        return felt_slip_angle(self.m_y_at_Nmm, self.m_z_at_Nmm)

    @property
    def is_held(self) -> bool:
        """Return whether no lateral slip is felt, within two sigma of m_y."""
        return self.feels_m_y(0.0)

    def feels_m_y(self, expected_Nmm: float) -> bool:
        """Return whether m_y at the pushing angle is as expected, within _HELD_SIGMAS."""
        sigma_Nmm = sqrt(self.covariance_at[0, 0])
        return abs(self.m_y_at_Nmm - expected_Nmm) <= _HELD_SIGMAS * sigma_Nmm

    @property
    def felt_covariance(self) -> np.ndarray:
        """Return the covariance (3, 3) of the pushing angle, m_y and m_z."""
        whole = np.zeros((3, 3))
        whole[0, 0] = self.theta_sigma_rad**2
        whole[0, 1:] = self.theta_moment_covariance_at
        whole[1:, 0] = self.theta_moment_covariance_at
        whole[1:, 1:] = self.covariance_at
        return whole


@dataclass(frozen=True)
class EstimatorSettings:
    """What an estimator assumes: the friction cone angle and its uncertainty, and limits of the
    object.

    object_reach_mm: radii of object and whisker together, at most; it enters the sigma alone.
    tilt_sigma_rad: standard deviation of the object's lean along the whisker; it enters the sigma
    alone. object_radius_mm: radius of the object where it is known, NaN elsewhere.
    whisker_radius_mm: radius of the whisker at its base.
    """

    alpha_est_rad: float
    alpha_est_sigma_rad: float = 0.0
    object_reach_mm: float = 0.0
    tilt_sigma_rad: float = 0.0
    object_radius_mm: float = nan
    whisker_radius_mm: float = 0.0

    def __post_init__(self):
        """Raise ValueError unless the friction angle lies in [0°, 90°) and no sigma is negative."""
        require_friction_angle("alpha_est_rad", self.alpha_est_rad)
        for name in ("alpha_est_sigma_rad", "object_reach_mm", "tilt_sigma_rad"):
            require_sigma(name, getattr(self, name))

    @property
    def is_radius_known(self) -> bool:
        """Return whether the object's radius is known."""
        return not isnan(self.object_radius_mm)

    @property
    def unknown_reach_mm(self) -> float:
        """Return the most that the object's radius may be, 0 where it is known."""
        return 0.0 if self.is_radius_known else self.object_reach_mm

    def reach_mm(self, thickness: float) -> float:
        """Return how far the axes of object and whisker are apart, where the whisker has this diameter
        over its base's; the most that is allowed where the object's radius is not known.
        """
        if self.is_radius_known:
            return self.object_radius_mm + self.whisker_radius_mm * thickness
        return self.object_reach_mm


@dataclass(frozen=True)
class Estimate:
    """A distance with its standard deviation, both in mm; NaN where there is none, and status says
    why.

    low_mm, high_mm: the 95 % interval; NaN where it is d_x ± 1.96 sigma. A low end of 0 and a high
    end at the whisker's length are open ends.
    alpha_est_rad, beta_rad: the assumed friction angle and the slope that follows from it; NaN
    where the estimator uses none.
    deflection_mm: where the contact is at the pushing angle, (d_y, d_z) from the unbent whisker,
    with deflection_sigma_mm; None where it is to be computed from distance and moments.
    gradient (4,): derivative of the distance by (θ, m_y, m_z, alpha_est), from which the covariance
    of the contact point follows; None where the estimator has none.
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

    def times(self, factor: float) -> "Estimate":
        """Return the estimate with the distance, and the ends of its interval, so many times as large."""
        return replace(
            self,
            d_x_mm=self.d_x_mm * factor,
            low_mm=self.low_mm * factor,
            high_mm=self.high_mm * factor,
        )
