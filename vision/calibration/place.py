"""Where the centre and axis of rotation and the encoder's zero are, by the free strokes and by the board together.

On a free stroke the whisker is a straight piece near its base that turns rigidly with the motor. All its lines meet in
the centre of rotation, their fan's axis is the motor's, and the line at motor angle 0 is rig x. So the swing gives the
rig frame (conventions: origin, z, x) by itself, as a turn w and shift v of the frame that the board gave:

    x_board_rig = Exp(w) x_rig + v

A narrow fan fixes its apex well across the whisker and badly along it; covariances say how well, and weigh the two.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2

from vision.geometry.base_lines import BaseLines
from vision.geometry.camera import Cameras
from vision.geometry.errors import Refused
from vision.geometry.rotation import compose, exp_rotation, skew

# Chance by which swing and board, both right, would disagree as much as calls for an alarm.
_FALSE_ALARM = 1e-3
# Where the swing alone places the rig it must fix the centre along the whisker at least this well.
_MOST_ALONG_SIGMA_MM = 0.05
_MIN_FRAMES = 4
# Beyond this a swing's word on the axis is none: a narrow fan may lean any way about the whisker.
_MOST_AXIS_SIGMA_DEG = 3.0
# A board is at the wrong scale where known lengths say so by this many sigmas and by more than a print's stretch.
_SCALE_SIGMAS = 4.0
_SCALE_TOLERANCE = 0.005
_COMPONENTS = ("w_x", "w_y", "w_z", "v_x", "v_y", "v_z")


_NO_LINES = BaseLines(np.zeros(0), *(np.zeros((0, 3)), np.zeros((0, 3, 3))) * 2)


@dataclass(frozen=True, eq=False)
class Placement:
    """The rig frame against the board's word of it: step (6,) = w rad, v mm, with its covariance (6, 6).

    rise_rad: elevation of the whisker's base above the plane of rotation (None where no swing was seen). width_rad: of
    the widest stroke. notes: what was learnt. alarm: how swing and board disagree, None where they do not.
    """

    step: np.ndarray
    covariance: np.ndarray
    rise_rad: float | None = None
    width_rad: float = 0.0
    notes: tuple[str, ...] = ()
    alarm: str | None = None

    @property
    def T_board_rig(self) -> np.ndarray:
        """(3, 4): rig coordinates to those of the rig frame that the board gave."""
        return np.column_stack([exp_rotation(self.step[:3]), self.step[3:]])

    @property
    def centre_mm(self) -> np.ndarray:
        """Centre of rotation in the frame that the board gave, (3,)."""
        return self.step[3:]

    @property
    def zero_rad(self) -> float:
        """Encoder's zero: the turn about the axis at which the whisker is where the board has rig x."""
        return float(self.step[2])


def by_board(T_rig_board: np.ndarray, sigma_mm: float, sigma_rad: float) -> Placement:
    """What the board alone says: no step, and the covariance of its measured pose.

    T_rig_board errs by a shift and by a turn about the board's origin, per axis; at the rig's origin that turn shifts.
    """
    lever = np.eye(6)
    lever[3:, :3] = skew(T_rig_board[:, 3])
    return Placement(np.zeros(6), lever @ np.diag(np.repeat([sigma_rad**2, sigma_mm**2], 3)) @ lever.T)


def by_strokes(strokes: Sequence[BaseLines]) -> Placement:
    """What several free strokes say together. Raises Refused where none of them is wide enough to say anything.

    What the lines of a stroke share (light, lenses) all strokes share: their mean has as much of it as one.
    """
    usable = [lines for lines in strokes if len(lines.motor_rad) >= _MIN_FRAMES and lines.width_rad > 0]
    if not usable:
        by_swing(max(strokes, key=lambda lines: len(lines.motor_rad), default=_NO_LINES))
    each = [by_swing(lines) for lines in usable]
    information = [np.linalg.inv(one.covariance) for one in each]
    whole = np.linalg.inv(sum(information))
    gains = [whole @ own for own in information]
    step = sum(gain @ one.step for gain, one in zip(gains, each))
    own = sum(g @ (one.covariance - lines.shared_covariance) @ g.T for g, one, lines in zip(gains, each, usable))
    covariance = own + np.mean([lines.shared_covariance for lines in usable], axis=0)
    widths, rise = [lines.width_rad for lines in usable], float(np.mean([one.rise_rad for one in each]))
    made = Placement(step, 0.5 * (covariance + covariance.T), rise, max(widths))
    return replace(made, notes=(_learnt(widths, made),))


def by_swing(lines: BaseLines) -> Placement:
    """What one swing says. Raises Refused with fewer than four frames or a motor that stood still."""
    if len(lines.motor_rad) < _MIN_FRAMES or lines.width_rad == 0:
        raise Refused(
            f"{len(lines.motor_rad)} frames of free stroke over {np.degrees(lines.width_rad):.2f} degrees: the centre "
            f"of rotation needs {_MIN_FRAMES} frames at different motor angles"
        )
    fitted = least_squares(_residuals, _first(lines), args=(lines,), x_scale="jac", method="lm")
    covariance = _excess(fitted) * _covariance(fitted.jac)[:6, :6] + lines.shared_covariance
    made = Placement(fitted.x[:6], covariance, float(fitted.x[6]), lines.width_rad)
    return replace(made, notes=(_learnt([lines.width_rad], made),))


def _excess(fitted) -> float:
    """By how much frames scatter more than they say (a motor angle's own noise), as variances; 1 where chance may."""
    square, left = 2 * fitted.cost, len(fitted.fun) - len(fitted.x)
    return square / left if square > chi2.isf(_FALSE_ALARM, left) else 1.0


def _first(lines: BaseLines) -> np.ndarray:
    """The board's frame, and the whisker's mean elevation."""
    return np.append(np.zeros(6), np.arcsin(np.clip(np.mean(lines.direction[:, 2]), -1, 1)))


def _predicted(p: np.ndarray, motor_rad: np.ndarray) -> np.ndarray:
    """Directions (n, 3) of the whisker's base at these motor angles, for p = w, v, rise."""
    cosine, sine = np.cos(motor_rad), np.sin(motor_rad)
    fan = np.column_stack([np.cos(p[6]) * cosine, np.cos(p[6]) * sine, np.full(len(cosine), np.sin(p[6]))])
    return fan @ exp_rotation(p[:3]).T


def _residuals(p: np.ndarray, lines: BaseLines) -> np.ndarray:
    """Two of the line's place and two of its direction a frame, across the line, each in its own sigma."""
    along = _predicted(p, lines.motor_rad)
    across = _across(along)
    place = _whitened(across, lines.point_mm - p[3:6], lines.point_covariance)
    return np.concatenate([place, _whitened(across, lines.direction, lines.direction_covariance)])


def _across(along: np.ndarray) -> np.ndarray:
    """Two unit vectors across each direction (n, 3), as rows (n, 2, 3). Whiskers are not along z."""
    first = np.cross([0.0, 0.0, 1.0], along)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(along, first)], axis=1)


def _whitened(across: np.ndarray, vectors: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    values = np.einsum("nij,nj->ni", across, vectors)
    root = np.linalg.cholesky(across @ covariance @ np.swapaxes(across, 1, 2))
    return np.linalg.solve(root, values[:, :, None]).ravel()


def _covariance(J: np.ndarray) -> np.ndarray:
    scale = 1.0 / np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    return np.linalg.inv((J * scale).T @ (J * scale)) * np.outer(scale, scale)


def combine(board: Placement, swing: Placement) -> Placement:
    """Both, each by its covariance; with an alarm where they disagree by more than chance allows.

    A board taken as exact stays as it is; the alarm still speaks.
    """
    both = board.covariance + swing.covariance
    gain = np.linalg.solve(both, board.covariance).T
    step = board.step + gain @ (swing.step - board.step)
    covariance = board.covariance - gain @ board.covariance
    apart = swing.step - board.step
    square = float(apart @ np.linalg.solve(both, apart))
    alarm = _alarm(apart, np.sqrt(np.diag(both))) if square > chi2.isf(_FALSE_ALARM, 6) else None
    made = replace(swing, step=step, covariance=0.5 * (covariance + covariance.T), alarm=alarm)
    return replace(made, notes=(*swing.notes, f"With the board: {_spread(made)}."))


def check_swing_suffices(made: Placement) -> None:
    """Refuses a placement that rests on the swing alone where that does not fix the centre along the whisker, which is
    what distances count from; says how wide a stroke would do. Raises Refused."""
    along = float(np.sqrt(made.covariance[3, 3]))
    if along <= _MOST_ALONG_SIGMA_MM:
        return
    width = np.degrees(made.width_rad)
    # An apex is fixed as the fan is wide, and as the root of its frames, of which a wider one has more. A fifth over.
    needed = np.ceil(1.2 * width * (along / _MOST_ALONG_SIGMA_MM) ** (2 / 3))
    raise Refused(
        f"the free strokes are what places the rig, and {width:.1f} degrees fix the centre of rotation to {along:.2f} "
        f"mm along the whisker; {_MOST_ALONG_SIGMA_MM} mm is needed: record free strokes of about {needed:.0f} "
        "degrees, or measure T_rig_board better"
    )


def _alarm(apart: np.ndarray, sigma: np.ndarray) -> str:
    """The component that disagrees most, in words."""
    worst = int(np.argmax(np.abs(apart) / sigma))
    words = {
        "w_x": "the axis leans about rig x", "w_y": "the axis leans about rig y", "w_z": "the encoder's zero is off",
        "v_x": "the centre lies along the whisker", "v_y": "the centre lies across the whisker",
        "v_z": "the centre lies along the axis",
    }  # fmt: skip
    scale, unit = (np.degrees(1.0), "degrees") if worst < 3 else (1.0, "mm")
    return (
        f"board and free stroke disagree: by the stroke {words[_COMPONENTS[worst]]} by {scale * apart[worst]:+.3f} ± "
        f"{scale * sigma[worst]:.3f} {unit} from where T_rig_board has it; check T_rig_board, the board's square_mm "
        "and the encoder"
    )


def _learnt(widths_rad: Sequence[float], made: Placement) -> str:
    narrow, wide = np.degrees([min(widths_rad), max(widths_rad)])
    strokes = f"A free stroke of {wide:.1f} degrees gives"
    if len(widths_rad) > 1:
        span = f"{narrow:.1f} to {wide:.1f}" if wide - narrow > 0.05 else f"{wide:.1f}"
        strokes = f"{len(widths_rad)} free strokes of {span} degrees give"
    return f"{strokes}: {_spread(made)}."


def _spread(made: Placement) -> str:
    sigma = np.sqrt(np.maximum(np.diag(made.covariance), 0.0))
    across = np.hypot(sigma[4], sigma[5]) / np.sqrt(2)
    axis = np.degrees(max(sigma[0], sigma[1]))
    lean = f"axis ± {axis:.3f} degrees" if axis < _MOST_AXIS_SIGMA_DEG else "axis not told"
    return (
        f"centre of rotation ± {across:.4f} mm across and ± {sigma[3]:.4f} mm along the whisker, {lean}, "
        f"encoder's zero {np.degrees(made.step[2]):+.3f} ± "
        f"{np.degrees(sigma[2]):.3f} degrees"
    )


def placed(cameras: Cameras, before: Placement, after: Placement) -> Cameras:
    """The cameras in the rig frame of `after`, whose poses were made in that of `before` (see `by_board`).

    Their covariance loses the placement error that `before` gave to all of them in common and gains that of `after`.
    The swing is seen by the same cameras; that link is left out, which errs to the wide side.
    """
    moved = tuple(
        replace(camera, T_camera_rig=compose(camera.T_camera_rig, after.T_board_rig)) for camera in cameras
    )
    shared = cameras.by_placement
    change = shared @ (after.covariance - before.covariance) @ shared.T
    covariance = _positive(cameras.covariance + change, np.sqrt(np.diag(cameras.covariance)))
    turned = np.kron(np.eye(2), after.T_board_rig[:, :3])  # `after` counts along the old axes, the cameras along theirs
    return Cameras(moved, covariance, turned.T @ after.covariance @ turned)


def _positive(covariance: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Without what rounding left below zero where nearly all of a variance was taken off; scale: of each parameter."""
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return (vectors * np.maximum(values, 0.0)) @ vectors.T * np.outer(scale, scale)


def check_known_lengths(lengths: Mapping[str, tuple[float, float, float, float]]) -> None:
    """Refuses a board at the wrong scale, by lengths known otherwise (bar diameter, whisker length).

    lengths: name to (seen mm, its sigma, known mm, its sigma). Everything in space scales with the square's size, so
    one factor must explain all; the factor is named, never applied. Raises Refused.
    """
    ratio = np.array([seen / known for seen, _, known, _ in lengths.values()])
    sigma = np.array([np.hypot(s / seen, k / known) for seen, s, known, k in lengths.values()]) * ratio
    weight = sigma**-2.0
    factor, factor_sigma = float(weight @ ratio / weight.sum()), float(weight.sum() ** -0.5)
    if abs(factor - 1) < _SCALE_SIGMAS * factor_sigma or abs(factor - 1) < _SCALE_TOLERANCE:
        return
    seen = ", ".join(f"{name} seen as {s:.3f} mm, known as {k:.3f} mm" for name, (s, _, k, _) in lengths.items())
    raise Refused(
        f"the board's squares seem to be {1 / factor:.4f} ± {factor_sigma:.4f} times as large as square_mm says "
        f"({seen}): measure a square and enter it"
    )
