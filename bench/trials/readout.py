"""Channels of a stroke as moments: felt touch and the whisk that an estimator may know."""

import math
from dataclasses import dataclass

import numpy as np

from bench.gauges.drift import allow_drift
from bench.gauges.felt import FeltStroke
from bench.gauges.matrix import GaugeMatrix, to_follicle
from bench.session.trial import Trial
from estimator.beam import Beam
from estimator.signal import FeltTouch
from estimator.whisk import Whisk
from vision.geometry import Reason, as_reason


@dataclass(frozen=True, eq=False)
class RawMoments:
    """The samples of a stroke as recorded, unfiltered; NaN where the gauges were at their rail.

    time_s, theta_rad (n,): pushing angles since felt touch. moments_Nmm (n, 2): m_y, m_z.
    """

    time_s: np.ndarray
    theta_rad: np.ndarray
    moments_Nmm: np.ndarray


@dataclass(frozen=True)
class Readout:
    """Conversion of a trial's channels to moments in the hub's axes: the gauges, and the follicle's
    turn with its sigma.

    Moments that were recorded as such need neither (`Readout.bare`). scale_sigma: relative sigma of
    the moments' newtons against those of the whisker's stiffness, where each are its own.
    """

    gauges: GaugeMatrix
    roll_rad: float = 0.0
    roll_sigma_rad: float = 0.0
    is_gauged: bool = False
    scale_sigma: float = 0.0

    @classmethod
    def bare(cls, gain_sigma: float = 0.0) -> "Readout":
        """Return the readout of signals that are moments already; gain_sigma: of each channel."""
        return cls(GaugeMatrix(np.eye(2), np.diag(gain_sigma**2 * np.eye(2).ravel())))

    @classmethod
    def of(cls, trial: Trial, gauges: GaugeMatrix) -> "Readout":
        """Return the readout of the trial's follicle with these gauges."""
        roll_rad = math.radians(trial.follicle_roll_deg)
        roll_sigma_rad = math.radians(trial.follicle_roll_sigma_deg)
        return cls(gauges, roll_rad, roll_sigma_rad, is_gauged=True)

    @property
    def matrix(self) -> np.ndarray:
        """Return the matrix (2, 2) from channels to (m_y, m_z) in the hub's axes."""
        return to_follicle(self.roll_rad).T @ self.gauges.matrix

    def in_follicle(self, whisk: Whisk) -> np.ndarray:
        """Return the whisk's moments (2,) at the wanted angle, in the axes of the gauges."""
        return to_follicle(self.roll_rad) @ [whisk.m_y_at_Nmm, whisk.m_z_at_Nmm]

    def raw(self, stroke: FeltStroke, touch: FeltTouch) -> RawMoments:
        """Return the moments of the stroke's samples as recorded, unfiltered."""
        moments_Nmm = (stroke.channels - touch.offset) @ self.matrix.T
        return RawMoments(stroke.time_s, stroke.motor_rad - touch.motor_rad, moments_Nmm)

    def covariance(self, channels: np.ndarray, channels_covariance: np.ndarray) -> np.ndarray:
        """Return the covariance (2, 2) of the moments of `channels` (2,).

        It adds those of the channels (2, 2), of the gauges and of the follicle's turn.
        """
        changes = self._shared_changes(channels)
        return self.matrix @ channels_covariance @ self.matrix.T + changes.T @ changes

    def shared_Nmm(self, whisk: Whisk) -> np.ndarray:
        """Return the change (6, 2) of a whisk's moments at one sigma of each cause that all whisks
        of a session have in common: four of the gauges, the follicle's turn, and the stiffness.
        """
        return self._shared_changes(self._channels(whisk))

    def by_camera_error_Nmm(self, whisk: Whisk) -> np.ndarray:
        """Return how a whisk's moments change with each unit error of the cameras that the gauges
        were calibrated with, (k, 2); it is part of `shared_Nmm`.
        """
        by_follicle = self.gauges.by_camera_error_at(self._channels(whisk))
        return by_follicle @ to_follicle(self.roll_rad)

    def _channels(self, whisk: Whisk) -> np.ndarray:
        """Return the channels (2,) that a whisk's moments were read from."""
        return np.linalg.solve(self.matrix, [whisk.m_y_at_Nmm, whisk.m_z_at_Nmm])

    def _shared_changes(self, channels: np.ndarray) -> np.ndarray:
        """Return the change (6, 2) of the moments of `channels` (2,) at one sigma of each cause."""
        by_gauges = self.gauges.changes_at(channels) @ to_follicle(self.roll_rad)
        per_rad = to_follicle(self.roll_rad + np.pi / 2).T @ self.gauges.matrix @ channels
        by_scale = self.scale_sigma * (self.matrix @ channels)
        return np.vstack([by_gauges, per_rad * self.roll_sigma_rad, by_scale])


def felt_whisk(
    stroke: FeltStroke, readout: Readout, drift_rate: np.ndarray, beam: Beam, theta_rad: float
) -> tuple[FeltTouch, Whisk | Reason]:
    """Return felt touch, and the whisk, or the reason why the stroke does not hold it.

    drift_rate (2,): RMS drift of the channels per second.
    """
    touch = allow_drift(stroke.touch, drift_rate, stroke.speed_rad_s)
    if touch.status:
        return touch, as_reason(touch.status)
    return touch, whisk_at(stroke, readout, touch, beam, theta_rad)


def whisk_at(
    stroke: FeltStroke, readout: Readout, touch: FeltTouch, beam: Beam, theta_rad: float
) -> Whisk | Reason:
    """Return the whisk at a pushing angle, or the reason why the stroke does not hold it."""
    at = stroke.at(theta_rad, touch)
    if at.status:
        return as_reason(at.status)
    moments = (stroke.filtered - touch.offset) @ readout.matrix.T  # (n, 2) N·mm
    raw = readout.raw(stroke, touch)
    m_y, m_z = readout.matrix @ at.values
    of_angles = stroke.angle_sigma.of_push(stroke.motor_rad, touch.motor_rad, theta_rad)
    return Whisk(
        time_s=raw.time_s,
        theta_rad=raw.theta_rad,
        m_y_Nmm=moments[:, 0],
        m_z_Nmm=moments[:, 1],
        theta_at_rad=theta_rad,
        m_y_at_Nmm=float(m_y),
        m_z_at_Nmm=float(m_z),
        covariance_at=readout.covariance(at.values, at.covariance),
        theta_sigma_rad=math.hypot(touch.sigma_rad, of_angles),
        beam=beam,
        theta_moment_covariance_at=readout.matrix @ at.theta_covariance,
        unfiltered_Nmm=raw.moments_Nmm,
    )
