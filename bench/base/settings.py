"""Settings of a run of the evaluation, in the user's units."""

import importlib.util
import math
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Self

from bench.base.errors import BadInput
from vision.geometry import VisionSettings

# The paper's 5 Hz at 10 deg/s and 45 Hz at 90 deg/s: half a hertz for each deg/s.
CUTOFF_HZ_PER_DEG_S = 0.5
# [°] Standard deviation of α_est without any other information: steel's 10.5° to sandpaper's 23.3°
# (Fig. 8) about an assumed 10° or 15°.
ALPHA_EST_SIGMA_DEG = 5.0
# [mm] Allowance of a robot for an object that it knows nothing of: as thick as the paper's bar of 6 mm, with the whisker
# of 1 mm, and leaning along the whisker as set up by hand. Both enter the sigma of (10) alone (docs/maps.md).
OBJECT_REACH_MM = 3.5
# [rad] One sigma: how upright a lab sets a bar without a level. Stated.
TILT_SIGMA_RAD = math.radians(5.0)


@dataclass(frozen=True)
class Seeing:
    """How thoroughly pictures are evaluated: the settings with their name, and the cameras (none: all)."""

    name: str = "standard"
    vision: VisionSettings = field(default_factory=VisionSettings)
    cameras: tuple[str, ...] = ()

    def asks(self, camera: str) -> bool:
        """Return whether this camera's pictures are evaluated."""
        return not self.cameras or camera in self.cameras

    def with_vision(self, **changed: Any) -> Self:
        """Return these settings with some of vision's changed, by name."""
        return replace(self, vision=replace(self.vision, **changed))


@dataclass(frozen=True)
class Settings:
    """The settings of a run.

    theta_deg: pushing angle of truth and estimates. alpha_est_deg: friction angle that (10) assumes.
    alpha_est_sigma_deg: its standard deviation; None goes by the session's surfaces
    (`alpha_est_sigma`). cutoff_Hz: of the zero-phase low-pass; None goes by speed. estimators:
    "module:function" of one's own. clock_sigma_s: how well the cameras' clock is known against the
    motor's; None goes by where frame times come from (`FrameTimes.clock_sigma_s`). gauges_from_all:
    every trial that can, calibrates the gauges. trials: pattern of the names of those that are
    evaluated. figures: whether any is drawn. seeing: how thoroughly pictures are evaluated; with
    accuracy_mm each whisk by the first preset by which d_x's stated sigma is no more. follow_links:
    pictures may lie outside of the session. one_camera: name of the camera by which alone shapes
    are evaluated, too. Raises BadInput out of range.
    """

    theta_deg: float = 3.0
    alpha_est_deg: float = 10.0
    cutoff_Hz: float | None = None
    estimators: tuple[str, ...] = ()
    clock_sigma_s: float | None = None
    alpha_est_sigma_deg: float | None = None
    gauges_from_all: bool = False
    trials: str = "*"
    figures: bool = True
    seeing: Seeing = field(default_factory=Seeing)
    accuracy_mm: float | None = None
    follow_links: bool = False
    one_camera: str | None = None

    def __post_init__(self):
        """Raise BadInput for a setting out of range."""
        _require("--theta-deg", self.theta_deg, 0.0, 20.0, above=True)
        _require("--alpha-est-deg", self.alpha_est_deg, 0.0, 89.0)
        if self.alpha_est_sigma_deg is not None:
            _require("--alpha-est-sigma-deg", self.alpha_est_sigma_deg, 0.0, 45.0)
        if self.cutoff_Hz is not None:
            _require("--cutoff-Hz", self.cutoff_Hz, 0.0, 1e5, above=True)
        if self.accuracy_mm is not None:
            _require("--accuracy-mm", self.accuracy_mm, 0.0, 100.0, above=True)
        if self.clock_sigma_s is not None:
            _require("--clock-sigma-s", self.clock_sigma_s, 0.0, 10.0)

    def with_vision(self, **changed: Any) -> Self:
        """Return these settings with some of vision's changed, by name."""
        return replace(self, seeing=self.seeing.with_vision(**changed))

    @property
    def theta_rad(self) -> float:
        """Return the pushing angle, rad."""
        return math.radians(self.theta_deg)

    @property
    def alpha_est_rad(self) -> float:
        """Return the friction angle that (10) assumes, rad."""
        return math.radians(self.alpha_est_deg)

    @property
    def first_alpha_est_sigma_deg(self) -> float:
        """Return the standard deviation of α_est as long as no surface is known."""
        return ALPHA_EST_SIGMA_DEG if self.alpha_est_sigma_deg is None else self.alpha_est_sigma_deg

    def cutoff_for(self, speed_deg_s: float) -> float:
        """Return the cut-off for a whisk at this speed, Hz."""
        return self.cutoff_Hz or CUTOFF_HZ_PER_DEG_S * speed_deg_s

    def seen(self) -> list:
        """Return the settings that the seen half of a result depends on."""
        one = [] if self.one_camera is None else [self.one_camera]
        return [
            self.theta_deg,
            self.clock_sigma_s,
            self.seeing.vision,
            self.seeing.cameras,
            self.accuracy_mm,
            *one,
        ]

    def estimated(self) -> list:
        """Return the settings that a trial's whole result depends on."""
        return [
            *self.seen(),
            self.alpha_est_deg,
            self.alpha_est_sigma_deg,
            self.cutoff_Hz,
            self.estimators,
            self.gauges_from_all,
        ]

    def takes(self, trial: str) -> bool:
        """Return whether a trial of this name is evaluated."""
        return fnmatchcase(trial, self.trials)

    def own_code(self) -> list[str]:
        """Return the sources of one's own estimators, so that a change in one changes the result."""
        return [_source_of(name.partition(":")[0]) for name in self.estimators]


def _source_of(module: str) -> str:
    """Return the source of a module; '' where there is none."""
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return ""
    if spec is None or spec.origin is None or not Path(spec.origin).is_file():
        return ""
    return Path(spec.origin).read_text(errors="replace")


def _require(option: str, value: float, low: float, high: float, *, above: bool = False) -> None:
    """Raise BadInput for an option outside of its range. above: its lower end is outside, too."""
    is_inside = low < value <= high if above else low <= value <= high
    if not is_inside:
        lower = f"{'above' if above else 'from'} {low:g}"
        raise BadInput(f"{option} {value:g}: must be {lower} and at most {high:g}")
