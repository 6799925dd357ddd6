"""What a run of the evaluation is told, in the user's units."""

import importlib.util
import math
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

from bench.base.errors import BadInput
from vision.geometry.vision_settings import VisionSettings

# The paper's 5 Hz at 10 deg/s and 45 Hz at 90 deg/s: half a hertz for each deg/s.
CUTOFF_HZ_PER_DEG_S = 0.5
# How far α_est may be off where nothing tells: steel's 10.5° to sandpaper's 23.3° (Fig. 8) about an assumed 10° or 15°.
ALPHA_EST_SIGMA_DEG = 5.0
# What a robot allows for in an object that it is told nothing of: as thick as the paper's bar of 6 mm, with the whisker
# of 1 mm, and leaning along the whisker as set up by hand. Both enter the sigma of (10) alone (docs/maps.md).
OBJECT_REACH_MM = 3.5
TILT_SIGMA_RAD = math.radians(5.0)  # rad, one sigma: how upright a bar is set by eye


@dataclass(frozen=True)
class Seeing:
    """How hard pictures are looked at: the settings' name, what they are, and which cameras are asked (none named:
    all)."""

    name: str = "standard"
    vision: VisionSettings = field(default_factory=VisionSettings)
    cameras: tuple[str, ...] = ()

    def asks(self, camera: str) -> bool:
        """Whether this camera's pictures are looked at."""
        return not self.cameras or camera in self.cameras


@dataclass(frozen=True)
class Settings:
    """theta_deg: pushing angle of truth and estimates. alpha_est_deg: friction angle that (10) assumes.

    alpha_est_sigma_deg: how far that may be off, one sigma; None goes by the session's surfaces (`alpha_est_sigma`).
    cutoff_Hz: of the zero-phase low-pass; None goes by speed. estimators: "module:function" of one's own.
    clock_sigma_s: how well the cameras' clock is known against the motor's; None goes by where frame times come from
    (`FrameTimes.clock_sigma_s`). gauges_from_all: every trial that can, calibrates the gauges. trials: pattern of the
    names of those that are evaluated. figures: whether any is drawn. seeing: how hard pictures are looked at; with
    accuracy_mm each whisk by the first preset by which d_x's stated sigma is no more. follow_links: pictures may lie
    outside of the session. one_camera: name of the camera by which alone shapes are judged, too. Raises BadInput out of
    range.
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

    @property
    def theta_rad(self) -> float:
        """The pushing angle, rad."""
        return math.radians(self.theta_deg)

    @property
    def alpha_est_rad(self) -> float:
        """The friction angle that (10) assumes, rad."""
        return math.radians(self.alpha_est_deg)

    @property
    def first_alpha_est_sigma_deg(self) -> float:
        """What α_est may be off by as long as no surface is known."""
        return ALPHA_EST_SIGMA_DEG if self.alpha_est_sigma_deg is None else self.alpha_est_sigma_deg

    def cutoff_for(self, speed_deg_s: float) -> float:
        """Cut-off in Hz for a whisk at this speed."""
        return self.cutoff_Hz or CUTOFF_HZ_PER_DEG_S * speed_deg_s

    def seen(self) -> list:
        """The settings that what is seen depends on."""
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
        """The settings that a trial's whole result depends on."""
        own = (
            self.alpha_est_deg,
            self.alpha_est_sigma_deg,
            self.cutoff_Hz,
            self.estimators,
            self.gauges_from_all,
        )
        return [*self.seen(), *own]

    def takes(self, trial: str) -> bool:
        """Whether a trial of this name is evaluated."""
        return fnmatchcase(trial, self.trials)

    def own_code(self) -> list[str]:
        """Sources of one's own estimators, so that a change in one is a change of the result."""
        return [_source_of(name.partition(":")[0]) for name in self.estimators]


def _source_of(module: str) -> str:
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return ""
    is_file = spec is not None and spec.origin is not None and Path(spec.origin).is_file()
    return Path(spec.origin).read_text(errors="replace") if is_file else ""


def _require(option: str, value: float, low: float, high: float, *, above: bool = False) -> None:
    inside = low < value <= high if above else low <= value <= high
    if not inside:
        raise BadInput(
            f"{option} {value:g}: must be {'above' if above else 'from'} {low:g} and at most {high:g}"
        )
