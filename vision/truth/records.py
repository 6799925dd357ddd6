"""What a trial showed: a row a frame and a row a whisk, each number with its sigma."""

from dataclasses import dataclass, field

import numpy as np

from vision.fit.beam_check import BeamCheck
from vision.geometry.base_lines import BaseLines
from vision.truth.at_angle import NAN, Smooth, TruthAtAngle, at_angle


@dataclass(frozen=True)
class FrameTruth:
    """A row a frame (n,), mm and rad; NaN where there is nothing to tell, with the reason in `status`.

    Values that exist only while touching are NaN before. *_sigma: one standard deviation.
    """

    index: np.ndarray
    time_s: np.ndarray
    motor_rad: np.ndarray
    theta_rad: np.ndarray
    theta_sigma_rad: np.ndarray
    touching: np.ndarray
    point_mm: np.ndarray
    point_sigma_mm: np.ndarray
    slip_mm: np.ndarray
    slip_sigma_mm: np.ndarray
    longitudinal_slip_mm: np.ndarray
    longitudinal_slip_sigma_mm: np.ndarray
    d_y_mm: np.ndarray
    d_y_sigma_mm: np.ndarray
    d_z_mm: np.ndarray
    d_z_sigma_mm: np.ndarray
    phi_rad: np.ndarray
    phi_sigma_rad: np.ndarray
    alpha_rad: np.ndarray
    alpha_sigma_rad: np.ndarray
    arc_mm: np.ndarray
    status: tuple[str, ...]


@dataclass(frozen=True)
class WhiskTruth:
    """A whisk seen: first touch, the contact then, the bar's slopes, and a row a frame.

    d_x_mm is NaN exactly where there is no truth; `status` says why, or what is doubtful.
    budget: shares of d_x's variance by cause. base: the whisker's base in the frames before touch. beam: the same by a
    curve that is no beam.
    """

    whisk: int
    frames: FrameTruth | None
    touch_rad: float = NAN
    touch_sigma_rad: float = NAN
    point_mm: np.ndarray = field(default_factory=lambda: np.full(3, NAN))
    point_sigma_mm: np.ndarray = field(default_factory=lambda: np.full(3, NAN))
    d_x_mm: float = NAN
    d_x_sigma_mm: float = NAN
    beta_rad: float = NAN
    beta_sigma_rad: float = NAN
    psi_rad: float = NAN
    psi_sigma_rad: float = NAN
    cameras: int = 0
    frames_used: int = 0
    status: str = ""
    overlay: dict = field(default_factory=dict)
    smooth: Smooth | None = None
    budget: dict = field(default_factory=dict)
    base: BaseLines | None = None
    beam: BeamCheck | None = None

    def at(self, theta_rad: float) -> TruthAtAngle:
        """Truth at a pushing angle, by a fit over the frames around it."""
        return at_angle(self.smooth, theta_rad, self.status)


@dataclass(frozen=True)
class TrialTruth:
    """All whisks of a trial and the bar they shared: point (3,), direction (3,), covariance (4, 4) of two shifts
    (mm) and two tilts across it."""

    bar_point_mm: np.ndarray
    bar_direction: np.ndarray
    bar_covariance: np.ndarray
    whisks: tuple[WhiskTruth, ...]
    notes: tuple[str, ...] = ()
