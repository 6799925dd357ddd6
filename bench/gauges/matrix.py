"""Gauge coefficients: volts above the zero of each free stroke to moments, and which trial may take which."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

# [1] Of the largest calibrated moment; up to there a line is still the same line. Stated.
_BEYOND = 1.05

FROM_FILE = "gauges.toml"
FROM_MANIFEST = "session.toml [gauges]"
FROM_TRIALS = "the session's gauge trials"
FROM_ALL = "all trials that can serve (--gauges-from-all)"


@dataclass(frozen=True)
class GaugeMatrix:
    """[m_y, m_z] in the follicle's axes = matrix · [y_V, z_V] above the free stroke.

    matrix (2, 2), N·mm/V; covariance (4, 4) of its coefficients, row after row. by_camera_error (4,
    k): how they change with each unit error of the session's cameras, which is in the covariance; k
    is 0 of gauges that are not from these cameras.
    """

    matrix: np.ndarray
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((4, 4)))
    by_camera_error: np.ndarray = field(default_factory=lambda: np.zeros((4, 0)))

    @property
    def sigma(self) -> np.ndarray:
        """Return one standard deviation of each coefficient, (2, 2)."""
        return np.sqrt(np.diag(self.covariance)).reshape(2, 2)

    def scaled(self, factor: float) -> "GaugeMatrix":
        """Return the matrix in another unit of stiffness."""
        return GaugeMatrix(
            factor * self.matrix, factor**2 * self.covariance, factor * self.by_camera_error
        )

    def changes_at(self, volts: np.ndarray) -> np.ndarray:
        """Return the changes (4, 2) of the moment of `volts` (2,), each at one sigma of its cause.

        The four independent causes are the rows of the covariance's symmetric root, and so the same
        for all `volts`.
        """
        variances, axes = np.linalg.eigh(self.covariance)
        root = axes * np.sqrt(np.maximum(variances, 0.0)) @ axes.T
        return root @ _design(volts).T

    def by_camera_error_at(self, volts: np.ndarray) -> np.ndarray:
        """Return how the moment of `volts` (2,) changes with each unit error of the cameras, (k, 2)."""
        return (_design(volts) @ self.by_camera_error).T

    def covariance_at(self, volts: np.ndarray) -> np.ndarray:
        """Return the covariance (2, 2) that the coefficients' gives to the moment of `volts` (2,)."""
        changes = self.changes_at(volts)
        return changes.T @ changes


def _design(volts: np.ndarray) -> np.ndarray:
    """Return the derivatives (2, 4) of the moment of `volts` (2,) by the coefficients."""
    return np.kron(np.eye(2), np.asarray(volts)[None, :])


@dataclass(frozen=True)
class GaugeCalibration:
    """The gauges of a session: coefficients, and which trial may be evaluated with which.

    all: fitted to every gauge trial, or given. without: for each trial that took part in the fit,
    the coefficients fitted without it, None where the rest cannot fix them: no whisk is evaluated
    with gauges fitted to it. one_factor: the paper's way, one factor a channel and no cross-talk,
    NaN where a channel was not measured; at_angle: four coefficients from the same readings at one
    angle. full_scale_Nmm: the largest moment (2,) in the follicle's axes that the coefficients rest
    on; None where it is not known. notes: lines for the user.
    """

    all: GaugeMatrix
    source: str
    without: Mapping[str, GaugeMatrix | None] = field(default_factory=dict)
    one_factor: GaugeMatrix | None = None
    at_angle: GaugeMatrix | None = None
    full_scale_Nmm: np.ndarray | None = None
    notes: tuple[str, ...] = ()

    @property
    def of_wire(self) -> bool:
        """Return whether their newtons are those of this wire's bending, and go with its C."""
        return self.source in (FROM_TRIALS, FROM_ALL)

    def scaled(self, factor: float) -> "GaugeCalibration":
        """Return the gauges in another unit of stiffness: everything in N·mm times `factor`."""
        full_scale = self.full_scale_Nmm
        return replace(
            self,
            all=self.all.scaled(factor),
            without={
                name: matrix and matrix.scaled(factor) for name, matrix in self.without.items()
            },
            one_factor=self.one_factor and self.one_factor.scaled(factor),
            at_angle=self.at_angle and self.at_angle.scaled(factor),
            full_scale_Nmm=None if full_scale is None else factor * full_scale,
        )

    def for_trial(self, name: str) -> GaugeMatrix | None:
        """Return the coefficients that this trial may be evaluated with; None where there are none."""
        return self.without.get(name, self.all)

    def beyond(self, moments_Nmm: np.ndarray) -> str:
        """Return a line on moments (2,) in the follicle's axes beyond the calibrated range, or ''."""
        if self.full_scale_Nmm is None:
            return ""
        lines = []
        for name, value, most in zip(("m_y", "m_z"), moments_Nmm, self.full_scale_Nmm):
            if abs(value) > _BEYOND * most:
                limit = f"the {most:.2f} N·mm that the gauges were calibrated to"
                lines.append(f"{name} of {value:.2f} N·mm is beyond {limit}")
        return "; ".join(lines)


def to_follicle(roll_rad: float) -> np.ndarray:
    """Return the matrix (2, 2) from (m_y, m_z) in the hub's axes to those of a follicle turned about +x.

    At 90° the follicle's y axis points along rig z and its z axis along rig −y: channel y senses
    m_z, channel z −m_y.
    """
    c = np.cos(roll_rad)
    s = np.sin(roll_rad)
    return np.array([[c, s], [-s, c]])
