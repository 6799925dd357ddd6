"""All that an estimator may know of one whisk, what it is told, and what it answers."""

from dataclasses import dataclass, field

import numpy as np

from estimator.beam import Beam
from estimator.domain import require_friction_angle, require_sigma


@dataclass(frozen=True)
class Whisk:
    """One forward stroke against an object, as a robot feels it.

    time_s, theta_rad, m_y_Nmm, m_z_Nmm: (n,) samples from before felt touch on; theta_rad is the motor
    angle since felt touch (negative before it), moments are above the free stroke's level. theta_at_rad:
    the pushing angle wanted; m_y_at_Nmm, m_z_at_Nmm: moments there; covariance_at (2, 2): theirs, in the
    order y, z, in (N·mm)²; theta_sigma_rad: of the pushing angle, felt touch included;
    theta_moment_covariance_at (2,): of the pushing angle with m_y and m_z, in rad·N·mm. Raises ValueError
    where shapes disagree or a sigma is negative.
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

    def __post_init__(self):
        shapes = {np.shape(a) for a in (self.time_s, self.theta_rad, self.m_y_Nmm, self.m_z_Nmm)}
        if len(shapes) != 1 or len(shapes.pop()) != 1:
            raise ValueError("time_s, theta_rad, m_y_Nmm and m_z_Nmm must be arrays (n,) of one length")
        if np.shape(self.covariance_at) != (2, 2):
            raise ValueError(f"covariance_at has shape {np.shape(self.covariance_at)}: must be (2, 2)")
        if np.shape(self.theta_moment_covariance_at) != (2,):
            raise ValueError("theta_moment_covariance_at must have shape (2,)")
        require_sigma("theta_sigma_rad", self.theta_sigma_rad)


@dataclass(frozen=True)
class EstimatorSettings:
    """What an estimator is told beforehand: the assumed friction cone angle, and how far it is trusted."""

    alpha_est_rad: float
    alpha_est_sigma_rad: float = 0.0

    def __post_init__(self):
        require_friction_angle("alpha_est_rad", self.alpha_est_rad)
        require_sigma("alpha_est_sigma_rad", self.alpha_est_sigma_rad)


@dataclass(frozen=True)
class Estimate:
    """A distance with its standard deviation, both in mm; NaN where there is none, and status says why."""

    d_x_mm: float
    sigma_mm: float
    status: str = ""
