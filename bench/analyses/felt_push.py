"""The moments felt of one whisk, with a slope and a distance: what fits of the friction angle take."""

import math
from dataclasses import dataclass, replace

import numpy as np

from estimator.distance import felt_slip_angle


@dataclass(frozen=True)
class FeltPush:
    """What is felt of one whisk at a pushing angle; slope and distance are NaN where they are not known.

    shared_Nmm (k, 2): what (m_y, m_z) change by at one sigma of each cause that all whisks have in common.
    reach_mm: radii of bar and whisker together, NaN where nobody states the bar's.
    """

    beta_rad: float
    d_x_mm: float
    theta_rad: float
    m_y_Nmm: float
    m_z_Nmm: float
    shared_Nmm: np.ndarray
    trial: str = ""
    reach_mm: float = np.nan

    @property
    def beta_deg(self) -> float:
        """Return the slope in degrees."""
        return math.degrees(self.beta_rad)

    @property
    def phi_rad(self) -> float:
        """Return the slip angle (8)."""
        return felt_slip_angle(self.m_y_Nmm, self.m_z_Nmm)

    @property
    def phi_deg(self) -> float:
        """Return the slip angle in degrees."""
        return math.degrees(self.phi_rad)

    def moved(self, cause: int) -> "FeltPush":
        """Return the push with one of the shared causes off by its sigma."""
        by_y, by_z = self.shared_Nmm[cause]
        return replace(self, m_y_Nmm=float(self.m_y_Nmm + by_y), m_z_Nmm=float(self.m_z_Nmm + by_z))
