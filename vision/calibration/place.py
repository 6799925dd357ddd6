"""The place of the rig frame, by the board and by the free strokes together.

The swing gives the rig frame (conventions: origin, z, x) by itself (`vision.calibration.swing`), as
a rotation w and shift v of the frame that the board gave:

    x_board_rig = Exp(w) x_rig + v

The two are combined by their covariances.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri, expit, logit

from vision.geometry.camera import N_PARAMETERS, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply, compose, exp_rotation, log_rotation, skew

# [chance] By which swing and board, both right, would disagree as much as calls for an alarm.
# Study: chosen.
FALSE_ALARM = 1e-3
# [sigma] From here on a square is named that explains why they disagree: of squares that far off four in five are wrong, as
# _WRONG_SQUARE has it. Derived. Study: wrong_squares.py.
_CLEAR_SCALE = 3.0
# [mm] Where the swing alone places the rig it must fix the centre along the whisker as well as a
# ruler would, for d_x has it whole (`_BY_RULER_MM` of `bench/trials/placing.py`). Study: chosen.
_MOST_ALONG_SIGMA_MM = 1.0
# [mm] Beyond, the centre along the whisker is most of d_x's sigma, and a warning asks for a wider
# stroke: nine in ten of d_x's errors with an exact board are below 0.044 mm. Study:
# path_traced.py.
_HELPED_ALONG_SIGMA_MM = 0.05
# [deg] Beyond, a swing does not constrain the axis: a narrow fan may lean any way about the
# whisker. Origin not known. Study: docs/cameras.md.
_MOST_AXIS_SIGMA_DEG = 3.0
# [1] Of the free strokes' width that is asked for: a fifth over what the sigma needs. Stated.
_OVER = 1.2
# [chance] Of a square that is not as stated within its sigma: typed from the drawing, where a printer
# had scaled the page. Stated. Study: drawn_lines.py --square-off.
_WRONG_SQUARE = 0.2
# [1] By which share such a square is off, one sigma. Stated.
_WRONG_SQUARE_SIGMA = 0.01
# The components of a step, rad and mm, in words.
_COMPONENTS = (
    "the axis leans about rig x",
    "the axis leans about rig y",
    "the encoder's zero is off",
    "the centre lies along the whisker",
    "the centre lies across the whisker",
    "the centre lies along the axis",
)
# [index] Of these the one by which the axis leans along the whisker. A layout, no threshold.
_LEAN_ALONG = 1
# [sigma] From here on it is no chance. Stated.
_CLEAR_LEAN = 4.0


@dataclass(frozen=True, eq=False)
class Scale:
    """The share by which all lengths come out too long, because the board's square is smaller than
    stated; 0 where it is as stated.

    stated_sigma: of the stated square, as a share. by_share (6,): derivative of a placement's step.
    share, sigma: as board and swing together show it; None and infinity by the board alone. is_why:
    whether it explains why they disagree.
    """

    stated_sigma: float
    by_share: np.ndarray
    share: float | None = None
    sigma: float = float("inf")
    is_why: bool = False

    @property
    def variance(self) -> float:
        """Return the variance of the share about 0.

        A stated square is right within its sigma, or, with the probability _WRONG_SQUARE, wrong. The
        measured share updates that probability; the square of the correction that a wrong square
        asks for is added in proportion to it. A square stated as exact has no variance.
        """
        stated = self.stated_sigma**2
        if self.share is None or not stated:
            return stated
        as_stated = stated + self.sigma**2
        wrong = _WRONG_SQUARE_SIGMA**2 + self.sigma**2
        log_odds = 0.5 * (np.log(as_stated / wrong) + self.share**2 * (1 / as_stated - 1 / wrong))
        is_wrong = expit(log_odds + logit(_WRONG_SQUARE))  # its probability
        correction = self.share * _WRONG_SQUARE_SIGMA**2 / wrong
        return float(stated + is_wrong * correction**2)


@dataclass(frozen=True, eq=False)
class Placement:
    """The rig frame relative to the one that the board gives.

    step (6,): rotation w, rad, and shift v, mm; covariance (6, 6). rise_rad: elevation of the
    whisker's base above the plane of rotation; None without a swing. width_rad: of the widest
    stroke. notes: sentences for the report. alarm: how the two placements that it combines
    disagree; None where they agree. source: what it rests on, as sentences name it; basis: how
    much of that. shared (6, 6): the part of the covariance that all free strokes share; None
    without a swing. turn_share: how many times as far as the motor the whisker would turn, were
    that why the two disagree; None where it is not the cause. scale: by which share all lengths are
    too long, as what places the rig shows; None without a board.
    """

    step: np.ndarray
    covariance: np.ndarray
    rise_rad: float | None = None
    width_rad: float = 0.0
    notes: tuple[str, ...] = ()
    alarm: str | None = None
    source: str = "board"
    basis: str = ""
    shared: np.ndarray | None = None
    turn_share: float | None = None
    scale: Scale | None = None

    @staticmethod
    def of(T_board_rig: np.ndarray, covariance: np.ndarray) -> "Placement":
        """Return the placement of a pose (3, 4) of the rig frame, with its covariance (6, 6)."""
        return Placement(np.append(log_rotation(T_board_rig[:, :3]), T_board_rig[:, 3]), covariance)

    @property
    def T_board_rig(self) -> np.ndarray:
        """Return the transform (3, 4) from rig coordinates to those of the rig frame that the board
        gave.
        """
        return np.column_stack([exp_rotation(self.step[:3]), self.step[3:]])

    @property
    def centre_mm(self) -> np.ndarray:
        """Return the centre of rotation (3,) in the frame that the board gave."""
        return self.step[3:]

    @property
    def spread(self) -> str:
        """Return the uncertainties of centre, axis and zero, in words."""
        sigma = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        across_mm = np.hypot(sigma[4], sigma[5]) / np.sqrt(2)
        axis_deg = np.degrees(max(sigma[0], sigma[1]))
        axis = "axis not observable"
        if axis_deg < _MOST_AXIS_SIGMA_DEG:
            axis = f"axis ± {axis_deg:.3f} degrees"
        return (
            f"centre of rotation ± {across_mm:.4f} mm across and ± {sigma[3]:.4f} mm along the whisker, {axis}, "
            f"encoder's zero {np.degrees(self.step[2]):+.3f} ± "
            f"{np.degrees(sigma[2]):.3f} degrees"
        )


def by_board(
    T_rig_board: np.ndarray, sigma_mm: float, sigma_rad: float, square_sigma: float = 0.0
) -> Placement:
    """Return the placement by the board alone: no step, and the covariance of its measured pose.

    T_rig_board errs by a shift and by a rotation about the board's origin, per axis; at the rig's
    origin that rotation shifts. Where all lengths are taken too long by a share, the centre of
    rotation is seen by that share too far from the board. square_sigma: of the stated square, as a
    share.
    """
    lever = np.eye(6)
    lever[3:, :3] = skew(T_rig_board[:, 3])
    variances = np.repeat([sigma_rad**2, sigma_mm**2], 3)
    scale = Scale(square_sigma, np.append(np.zeros(3), -T_rig_board[:, 3]))
    return Placement(np.zeros(6), lever @ np.diag(variances) @ lever.T, scale=scale)


def gain_of(
    covariance: np.ndarray, by_step: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the gain (6, k) with which an observation corrects a step, and the step's covariance
    (6, 6) then (Kalman's update, in Joseph's form).

    covariance (6, 6): of the step before. by_step (k, 6): derivatives of the observed values, whose
    covariance is noise (k, k).
    """
    spread = by_step @ covariance
    gain = np.linalg.solve(spread @ by_step.T + noise, spread).T
    kept = np.eye(6) - gain @ by_step
    return gain, kept @ covariance @ kept.T + gain @ noise @ gain.T


def combine(board: Placement, swing: Placement) -> Placement:
    """Combine two placements by their covariances; with an alarm where they disagree by more than
    chance allows.

    A board taken as exact is not moved, but its disagreement with the swing is still an alarm.
    rise_rad and width_rad are the swing's.
    """
    difference = swing.step - board.step
    Sigma = board.covariance + swing.covariance  # covariance of the difference
    gain, covariance = gain_of(board.covariance, np.eye(6), swing.covariance)
    chi2 = float(difference @ np.linalg.solve(Sigma, difference))
    scale = _seen_scale(difference, Sigma, board.scale, chi2)
    is_scale = scale is not None and scale.is_why
    alarm = None
    turn_share = None
    if chi2 > chdtri(6, FALSE_ALARM) or is_scale:
        alarm = _alarm(board, swing, Sigma)
        turn_share = _turn_share(difference, np.sqrt(np.diag(Sigma)))
    combined = replace(
        swing,
        step=board.step + gain @ difference,
        covariance=covariance,
        shared=None if swing.shared is None else gain @ swing.shared @ gain.T,
        alarm=alarm,
        turn_share=turn_share,
        scale=None if scale is None else replace(scale, by_share=gain @ scale.by_share),
    )
    return replace(combined, notes=(*swing.notes, f"With the {board.source}: {combined.spread}."))


def check_swing_suffices(placement: Placement, marker: str = "") -> str:
    """Return a warning where the swing does not fix the centre of rotation well along the whisker,
    where distances begin; '' where it does.

    The warning says how wide a stroke would suffice. marker: what a marker on the hub gave besides,
    in words; no width is named then, as it depends on the marker's print. Raises Refused where a
    ruler would do better.
    """
    along_mm = float(np.sqrt(placement.covariance[3, 3]))
    if along_mm <= _HELPED_ALONG_SIGMA_MM:
        return ""
    width_deg = np.degrees(placement.width_rad)
    # An apex is fixed as the fan is wide, and as the root of its frames, of which a wider one has more.
    needed_deg = np.ceil(_OVER * width_deg * (along_mm / _HELPED_ALONG_SIGMA_MM) ** (2 / 3))
    cure = f"record free strokes of about {needed_deg:.0f} degrees"
    found = f"the free strokes are what places the rig, and {width_deg:.1f} degrees fix the centre of rotation"
    if marker:
        cure = "let the motor turn further in the pictures, before touch above all"
        found = f"free strokes of {width_deg:.1f} degrees and {marker} fix the centre of rotation"
    advice = f"{cure}, or measure T_rig_board better"
    if along_mm > _MOST_ALONG_SIGMA_MM:
        raise Refused(
            f"{found} to {along_mm:.2f} mm along the whisker; {_MOST_ALONG_SIGMA_MM:g} mm is needed: {advice}"
        )
    return (
        f"{found} to {along_mm:.3f} mm along the whisker only, which every d_x is off by: {advice}"
    )


def _alarm(first: Placement, second: Placement, Sigma: np.ndarray) -> str:
    """Return the component in which two placements disagree most, in words.

    Sigma: covariance (6, 6) of their difference.
    """
    difference = second.step - first.step
    sigma = np.sqrt(np.diag(Sigma))
    worst = int(np.argmax(np.abs(difference) / sigma))
    scale, unit = (np.degrees(1.0), "degrees") if worst < 3 else (1.0, "mm")
    return (
        f"{first.source} and {second.source} disagree: by the {second.source} {_COMPONENTS[worst]} by "
        f"{scale * difference[worst]:+.3f} ± {scale * sigma[worst]:.3f} {unit} from where the {first.source} has it; "
        "check T_rig_board, the board's square_mm and the encoder"
    )


def _turn_share(difference: np.ndarray, sigma: np.ndarray) -> float | None:
    """Return how many times as far as the motor the whisker turns, where that may be the cause.

    A whisker that turns by cos a of the motor's angle is seen as one whose axis leans along it by the
    angle a, to either side.
    """
    if abs(difference[_LEAN_ALONG]) < _CLEAR_LEAN * sigma[_LEAN_ALONG]:
        return None
    return float(np.cos(difference[_LEAN_ALONG]))


def _seen_scale(
    difference: np.ndarray, Sigma: np.ndarray, scale: Scale | None, chi2: float
) -> Scale | None:
    """Return the scale that explains a difference (6,) of this covariance (6, 6) best, with `is_why`
    where it does and chance does not; None without a board, or one in the centre.

    chi2: of the difference. A test of this one number finds what that of six does not: a board that
    is 2 % too large, placed to 0.2 mm and 0.2 degrees, leaves χ² of six degrees of freedom within
    what chance allows.
    """
    if scale is None or not scale.by_share.any():
        return None
    weights = np.linalg.solve(Sigma, scale.by_share)
    precision = float(weights @ scale.by_share)
    share = float(weights @ difference) / precision
    explained = precision * share**2
    sigma = np.sqrt(scale.stated_sigma**2 + 1.0 / precision)
    is_why = abs(share) > _CLEAR_SCALE * sigma and chi2 - explained < chdtri(5, FALSE_ALARM)
    return replace(scale, share=share, sigma=precision**-0.5, is_why=bool(is_why))


def rescale(cameras: Cameras, board_mm: np.ndarray, placement: Placement) -> Cameras:
    """Return cameras placed by board and swing with the uncertainty that the scale gives them.

    With the scale, the cameras move away from the board and the rig frame moves between them. The
    calibration by the board has counted the first of these, by the stated square's sigma alone: it
    is taken off, and both together are added. board_mm (3,): the board's origin in the rig frame.
    """
    scale = placement.scale
    if scale is None or not scale.stated_sigma:
        return cameras
    by_share = np.zeros((len(cameras), N_PARAMETERS))
    for camera, own in zip(cameras, by_share):
        own[-3:] = apply(camera.T_camera_rig, board_mm)
    about_board = by_share.ravel()
    about_rig = about_board + cameras.by_placement @ scale.by_share
    covariance = cameras.covariance + scale.variance * np.outer(about_rig, about_rig)
    covariance -= scale.stated_sigma**2 * np.outer(about_board, about_board)
    sigma = np.sqrt(np.diag(cameras.covariance))
    return replace(cameras, covariance=_clip_eigenvalues(covariance, sigma), by_error=None)


def move_rig_frame(cameras: Cameras, before: Placement, after: Placement) -> Cameras:
    """Return the cameras in the rig frame of `after`, whose poses were made in that of `before`
    (see `by_board`).

    Their covariance loses the placement error that `before` gave to all of them in common and gains
    that of `after`. The swing was seen by the same cameras; of this correlation only the scale is
    counted (`rescale`).
    """
    moved = []
    for camera in cameras:
        T = compose(camera.T_camera_rig, after.T_board_rig)
        moved.append(replace(camera, T_camera_rig=T))
    by_placement = cameras.by_placement
    change = by_placement @ (after.covariance - before.covariance) @ by_placement.T
    scale = np.sqrt(np.diag(cameras.covariance))
    covariance = _clip_eigenvalues(cameras.covariance + change, scale)
    # `after` counts along the old axes, the cameras along theirs
    rotation = np.kron(np.eye(2), after.T_board_rig[:, :3])
    return Cameras(tuple(moved), covariance, rotation.T @ after.covariance @ rotation)


def _clip_eigenvalues(covariance: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return a covariance without the negative eigenvalues that rounding leaves where nearly all of
    a variance was taken off.

    scale: of each parameter.
    """
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return (vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(scale, scale)
