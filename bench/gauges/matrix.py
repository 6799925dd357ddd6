"""Gauge coefficients: volts above the zero of each free stroke to moments, and which trial may take which."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

_BEYOND = 1.05  # of the largest calibrated moment; up to there a line is still the same line

FROM_FILE, FROM_MANIFEST, FROM_TRIALS = (
    "gauges.toml",
    "session.toml [gauges]",
    "the session's gauge trials",
)
FROM_ALL = "all trials that can serve (--gauges-from-all)"


@dataclass(frozen=True)
class GaugeMatrix:
    """[m_y, m_z] in the follicle's axes = matrix · [y_V, z_V] above the free stroke.

    matrix (2, 2), N·mm/V; covariance (4, 4) of its coefficients, row after row.
    """

    matrix: np.ndarray
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((4, 4)))

    @property
    def sigma(self) -> np.ndarray:
        """One standard deviation of each coefficient, (2, 2)."""
        return np.sqrt(np.diag(self.covariance)).reshape(2, 2)

    def scaled(self, factor: float) -> "GaugeMatrix":
        """In another unit of stiffness."""
        return GaugeMatrix(factor * self.matrix, factor**2 * self.covariance)

    def changes_at(self, volts: np.ndarray) -> np.ndarray:
        """(4, 2): what the moment of `volts` (2,) changes by at one sigma of each of four independent causes.

        The causes are the rows of the covariance's symmetric root, and so the same for all `volts`.
        """
        variances, axes = np.linalg.eigh(self.covariance)
        root = axes * np.sqrt(np.maximum(variances, 0.0)) @ axes.T
        return root @ np.kron(np.eye(2), np.asarray(volts)[None, :]).T

    def covariance_at(self, volts: np.ndarray) -> np.ndarray:
        """Covariance (2, 2) that the coefficients' uncertainty gives the moment of `volts` (2,)."""
        changes = self.changes_at(volts)
        return changes.T @ changes


@dataclass(frozen=True)
class Gauges:
    """A session's gauges.

    all: fitted to every gauge trial, or given. without: for each trial that took part in the fit, the coefficients
    fitted without it, None where the rest cannot fix them: no whisk is judged by gauges fitted to it. one_factor: the
    paper's way, one factor a channel and no cross-talk, NaN where a channel was not measured; at_angle: four
    coefficients from the same readings at one angle. full_scale_Nmm: the largest moment (2,) in the follicle's axes
    that the coefficients rest on; None where it is not known. notes: lines for the user.
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
        """Whether their newtons are those of this wire's bending, and go with its C."""
        return self.source in (FROM_TRIALS, FROM_ALL)

    def scaled(self, factor: float) -> "Gauges":
        """The same gauges in another unit of stiffness: everything in N·mm times `factor`."""
        without = {name: matrix and matrix.scaled(factor) for name, matrix in self.without.items()}
        one, four = (
            matrix and matrix.scaled(factor) for matrix in (self.one_factor, self.at_angle)
        )
        most = None if self.full_scale_Nmm is None else factor * self.full_scale_Nmm
        return Gauges(self.all.scaled(factor), self.source, without, one, four, most, self.notes)

    def for_trial(self, name: str) -> GaugeMatrix | None:
        """The coefficients that this trial may be judged by; None where there are none."""
        return self.without.get(name, self.all)

    def beyond(self, moments_Nmm: np.ndarray) -> str:
        """What to say of moments (2,) in the follicle's axes that exceed the calibrated range; '' within."""
        if self.full_scale_Nmm is None:
            return ""
        over = np.abs(moments_Nmm) > _BEYOND * self.full_scale_Nmm
        worst = "; ".join(
            f"{name} of {value:.2f} N·mm is beyond the {most:.2f} N·mm that the gauges were calibrated to"
            for name, value, most, is_over in zip(
                ("m_y", "m_z"), moments_Nmm, self.full_scale_Nmm, over
            )
            if is_over
        )
        return worst


def to_follicle(roll_rad: float) -> np.ndarray:
    """(2, 2): components (m_y, m_z) in the hub's axes to those in a follicle turned about +x.

    At 90° the follicle's y axis points along rig z and its z axis along rig −y: channel y senses m_z, channel z −m_y.
    """
    c, s = np.cos(roll_rad), np.sin(roll_rad)
    return np.array([[c, s], [-s, c]])
