"""The truth of a trial: one row per frame and one per whisk, each number with its sigma."""

from dataclasses import dataclass, field

import numpy as np

from vision.fit.beam_check import BeamCheck
from vision.fit.line_noise import LineNoise
from vision.fit.problem import Problem
from vision.fit.refinements import LeftOut
from vision.fit.turns import Turns
from vision.geometry.base_lines import BaseLines
from vision.geometry.reasons import NO_REASON, Reason
from vision.truth.at_angle import Smooth, TruthAtAngle, at_angle
from vision.truth.kept_fit import KeptFit
from vision.truth.value import UNKNOWN, UNKNOWN_POINT, Value, WhileTouching
from vision.wire.one_sided import SeenWidth

_OPTIONAL = {"optional": True}  # a file has no key for it where it is None or empty


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameTruth(WhileTouching):
    """The frames (n,) of a whisk, mm and rad; NaN where a value is unknown, with the reason in
    `status`.

    Values that exist only while touching are NaN before. point_mm: value and sigma (n, 3). arc_mm:
    the contact's place along the whisker.
    """

    index: np.ndarray
    time_s: np.ndarray
    motor_rad: np.ndarray
    theta_rad: Value
    touching: np.ndarray
    point_mm: Value
    arc_mm: np.ndarray
    status: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class WireShape:
    """The fitted wire, as `vision.geometry.centreline` describes it.

    rest_mm (2, k): with what is stated of it; of each frame of the fit its index (f,), bend_rad (f, 2), and arc_mm (f,) of the
    contact.
    """

    rest_mm: np.ndarray
    index: np.ndarray
    bend_rad: np.ndarray
    arc_mm: np.ndarray


@dataclass(frozen=True, eq=False)
class GaveWay:
    """The displacement of a bar that gives way, in each touching frame (n,).

    index: of the frame. theta_rad: pushing angle. normal_mm: away from the contact. lateral_mm:
    across that direction and the bar, where springs need not move it.
    """

    index: np.ndarray
    theta_rad: np.ndarray
    normal_mm: Value
    lateral_mm: Value


@dataclass(frozen=True, eq=False)
class SeenObject:
    """An object that is no straight bar, where a whisk shows it.

    point_mm (3,): centre of ring or sphere, or the cone's tip. axis (3,): normal of the ring's
    plane, or the cone's direction. As stated: radius_mm of the sphere or of the ring's bar,
    ring_radius_mm, half_angle_rad of the cone.
    """

    shape: str
    point_mm: np.ndarray
    axis: np.ndarray
    radius_mm: float
    ring_radius_mm: float
    half_angle_rad: float


@dataclass(frozen=True, eq=False)
class SharedSigmas:
    """Standard deviations of the errors that all whisks of a session have in common, by diameters,
    light, cameras, placement and the clock: parts of the sigmas of a whisk's truth. point_mm (3,).
    d_x_by_camera_error_mm, beta_by_camera_error_rad, psi_by_camera_error_rad (k,): how they change
    with each unit error of the session's cameras, by which they are correlated with what else was
    measured with them.
    """

    touch_rad: float
    d_x_mm: float
    beta_rad: float
    psi_rad: float
    point_mm: np.ndarray
    d_x_by_camera_error_mm: np.ndarray = field(default_factory=lambda: np.zeros(0))
    beta_by_camera_error_rad: np.ndarray = field(default_factory=lambda: np.zeros(0))
    psi_by_camera_error_rad: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class WhiskTruth:
    """The truth of one whisk: first touch, the contact then, the bar's slopes, and one row per
    frame.

    d_x_mm is NaN exactly where there is no truth; `status` says why, or holds warnings.
    overlay: lines to draw by frame and camera. budget: shares of d_x's variance by cause. base: the
    whisker's base in the frames before touch. beam: the comparison with a curve that is no beam.
    turns: the whisker's rotation in each frame of the fit beyond the motor's. delays: by camera, by how
    many frames it shows the whisker later than the others. refinements: what the
    truth would be without each part of the model, by name. lines: the precision of each camera's
    lines. Of a trial's first whisk, by camera: ends, how far from its base, mm, the whisker is seen to end;
    widths, its width in the pictures over the stated one. point_covariance_mm2 (3, 3): of
    point_mm. shared: parts of the sigmas. shape: the wire's curve in each frame of the fit. velocity_mm_s (3,): of an object
    that moves, as seen; None where it stands. gave: of one that gives way. rounded: one that is no
    straight bar. problem: what was fitted, from which `sights_of` takes one camera's share.
    """

    whisk: int
    frames: FrameTruth | None = None
    touch_rad: Value = UNKNOWN
    point_mm: Value = UNKNOWN_POINT
    d_x_mm: Value = UNKNOWN
    beta_rad: Value = UNKNOWN
    psi_rad: Value = UNKNOWN
    cameras: int = 0
    frames_used: int = 0
    status: Reason = NO_REASON
    overlay: dict[int, dict[str, dict[str, np.ndarray]]] = field(
        default_factory=dict, metadata=_OPTIONAL
    )
    smooth: Smooth | None = field(default=None, metadata=_OPTIONAL)
    budget: dict[str, float] = field(default_factory=dict)
    base: BaseLines | None = None
    beam: BeamCheck | None = None
    turns: Turns | None = None
    delays: dict[str, Value] = field(default_factory=dict, metadata=_OPTIONAL)
    refinements: dict[str, LeftOut] = field(default_factory=dict)
    lines: dict[str, LineNoise] = field(default_factory=dict)
    ends: dict[str, Value] = field(default_factory=dict, metadata=_OPTIONAL)
    widths: dict[str, Value] = field(default_factory=dict, metadata=_OPTIONAL)
    point_covariance_mm2: np.ndarray | None = None
    shared: SharedSigmas | None = None
    shape: WireShape | None = None
    velocity_mm_s: Value | None = None
    gave: GaveWay | None = field(default=None, metadata=_OPTIONAL)
    rounded: SeenObject | None = field(default=None, metadata=_OPTIONAL)
    problem: Problem | None = field(default=None, metadata=_OPTIONAL)

    def at(self, theta_rad: float) -> TruthAtAngle:
        """Return the truth at a pushing angle, by a fit over the frames around it."""
        smooth = self.smooth if self.d_x_mm.is_known else None
        return at_angle(smooth, theta_rad, self.status)


@dataclass(frozen=True)
class TrialTruth:
    """All whisks of a trial and the bar that they shared: a point (3,) of its axis, its direction
    (3,), and by camera its width in the pictures over the stated one.

    one_sided_light: the width of the wire that is seen, by camera that sees light from one side.
    fits: those from which whisks can be fitted again.
    """

    bar_point_mm: np.ndarray
    bar_direction: np.ndarray
    whisks: tuple[WhiskTruth, ...]
    one_sided_light: dict[str, SeenWidth] = field(default_factory=dict)
    bar_widths: dict[str, Value] = field(default_factory=dict)
    fits: tuple[KeptFit, ...] = ()
