"""What a trial showed: a row a frame and a row a whisk, each number with its sigma."""

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
from vision.truth.value import UNKNOWN, UNKNOWN_POINT, Value, WhileTouching

_OPTIONAL = {"optional": True}  # a file has no key for it where it is None or empty


@dataclass(frozen=True, kw_only=True, eq=False)
class FrameTruth(WhileTouching):
    """A row a frame (n,), mm and rad; NaN where there is nothing to tell, with the reason in `status`.

    Values that exist only while touching are NaN before. point_mm: value and sigma (n, 3). arc_mm: of the contact along
    the whisker.
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
    """The wire as fitted, in the terms of `vision.geometry.centreline`: rest_mm (2, 4), and of each frame of the fit
    its index (f,), bend_rad (f, 2) and arc_mm (f,) of the contact."""

    rest_mm: np.ndarray
    index: np.ndarray
    bend_rad: np.ndarray
    arc_mm: np.ndarray


@dataclass(frozen=True, eq=False)
class GaveWay:
    """How far a bar that gives way has come in each touching frame (n,): index of the frame, pushing angle, and mm away
    from the contact (normal_mm) and across that and the bar (aside_mm), which its springs need not have."""

    index: np.ndarray
    theta_rad: np.ndarray
    normal_mm: Value
    aside_mm: Value


@dataclass(frozen=True, eq=False)
class SeenObject:
    """An object that is no straight bar, where a whisk shows it: centre of ring or sphere, or the cone's tip (3,), mm;
    the normal of the ring's plane, or where the cone points (3,); as said radius of the sphere or of the ring's bar and
    of the ring, mm, and half-angle, rad."""

    shape: str
    point_mm: np.ndarray
    axis: np.ndarray
    radius_mm: float
    ring_radius_mm: float
    half_angle_rad: float


@dataclass(frozen=True)
class WhiskTruth:
    """A whisk seen: first touch, the contact then, the bar's slopes, and a row a frame.

    d_x_mm is NaN exactly where there is no truth; `status` says why, or what is doubtful.
    overlay: lines to draw by frame and camera. budget: shares of d_x's variance by cause. base: the whisker's base in
    the frames before touch. beam: the same by a curve that is no beam. turns: the whisker's turn in each frame of the
    fit beyond the motor's. refinements: what the truth would be without each part of the model, by name. lines: what
    each camera's lines are worth. ends: by camera how far from its base, mm, the whisker is seen to end; looks: how
    thick it looks over how thick it is said to be, of a trial's first whisk.
    point_covariance_mm2 (3, 3): of point_mm; shape: the wire's curve in each frame of the fit. velocity_mm_s (3,): of
    an object that moves, as seen; None where it stands. gave: of one that gives way. rounded: one
    that is no straight bar. problem: what was fitted, from
    which `sights_of` takes what one camera shows.
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
    refinements: dict[str, LeftOut] = field(default_factory=dict)
    lines: dict[str, LineNoise] = field(default_factory=dict)
    ends: dict[str, Value] = field(default_factory=dict, metadata=_OPTIONAL)
    looks: dict[str, Value] = field(default_factory=dict, metadata=_OPTIONAL)
    point_covariance_mm2: np.ndarray | None = None
    shape: WireShape | None = None
    velocity_mm_s: Value | None = None
    gave: GaveWay | None = field(default=None, metadata=_OPTIONAL)
    rounded: SeenObject | None = field(default=None, metadata=_OPTIONAL)
    problem: Problem | None = field(default=None, metadata=_OPTIONAL)

    def at(self, theta_rad: float) -> TruthAtAngle:
        """Truth at a pushing angle, by a fit over the frames around it."""
        return at_angle(self.smooth, theta_rad, self.status)


@dataclass(frozen=True)
class TrialTruth:
    """All whisks of a trial and the bar that they shared: a point (3,) of its axis, its direction (3,), and by camera
    how thick it looks over how thick it is said to be."""

    bar_point_mm: np.ndarray
    bar_direction: np.ndarray
    whisks: tuple[WhiskTruth, ...]
    notes: tuple[str, ...] = ()
    bar_looks: dict[str, Value] = field(default_factory=dict)
