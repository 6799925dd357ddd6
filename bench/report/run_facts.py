"""The settings and findings of a run: with the trials' results, all that a report is made from."""

from dataclasses import dataclass, field

import numpy as np

from bench.base.settings import Settings
from bench.session.whisker import Whisker


@dataclass(frozen=True)
class Section:
    """A section of the summary: its code, by which programs know it, its title, its lines."""

    code: str
    title: str
    lines: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class CameraFacts:
    """A camera as it was used: size_px (width, height), matrix (3, 3), T_camera_rig (3, 4), mm."""

    name: str
    size_px: tuple[int, ...]
    matrix: np.ndarray
    distortion: np.ndarray
    T_camera_rig: np.ndarray
    rms_px: float


@dataclass(frozen=True, eq=False)
class BoardFacts:
    """The board as it stands on the rig: squares along x and y, T_rig_board (3, 4), mm."""

    squares: tuple[int, ...]
    square_mm: float
    T_rig_board: np.ndarray


@dataclass(frozen=True, eq=False)
class GaugePoints:
    """The moments at n points of one whisk that served for the coefficients.

    moments_Nmm (n, 2): known from its deflection, with their sigma. residuals_Nmm: by what the gauges
    differ from them, in the follicle's axes, turned by roll_deg.
    """

    trial: str
    whisk: int
    roll_deg: float
    moments_Nmm: np.ndarray
    residuals_Nmm: np.ndarray
    moments_sigma_Nmm: np.ndarray


@dataclass(frozen=True, eq=False)
class GaugeFacts:
    """The gauges as they were used: matrix (2, 2) from [y_V, z_V] to [m_y, m_z], and its sigma.

    certificate, points: its lines and what they rest on; empty where the coefficients were brought along.
    """

    source: str
    matrix_Nmm_per_V: np.ndarray
    matrix_sigma_Nmm_per_V: np.ndarray
    certificate: tuple[str, ...] = ()
    points: tuple[GaugePoints, ...] = ()


@dataclass(frozen=True, eq=False)
class RunRecord:
    """The findings of a run, and by what they were found.

    verdict, warnings and sections: as the summary has them. warning_codes: codes of the statuses in each
    warning. figures: names of the pictures in the folder. recordings: hash of each trial's files, by
    name. results: of each trial's result. versions: by distribution.
    """

    session: str
    whisker: Whisker
    settings: Settings
    verdict: tuple[str, ...]
    warnings: tuple[str, ...]
    warning_codes: tuple[tuple[str, ...], ...]
    sections: tuple[Section, ...]
    figures: tuple[str, ...]
    has_pictures: bool
    cameras: tuple[CameraFacts, ...] = ()
    board: BoardFacts | None = None
    gauges: GaugeFacts | None = None
    recordings: dict[str, str] = field(default_factory=dict)
    results: dict[str, str] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)

    def lines(self, code: str) -> tuple[str, ...]:
        """Return the lines of the section of this code; none where there is no such section."""
        for section in self.sections:
            if section.code == code:
                return section.lines
        return ()


def plane_name(trial: str, whisk: int) -> str:
    """Return the name of a whisk's figure in the results' folder."""
    return f"planes/{trial}_{whisk}.png"
