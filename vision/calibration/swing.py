"""Where free strokes have the centre and axis of rotation and the encoder's zero.

On a free stroke the whisker is a straight piece near its base that turns rigidly with the motor. All its lines meet in
the centre of rotation, their fan's axis is the motor's, and the line at motor angle 0 is rig x. A narrow fan fixes its
apex well across the whisker and badly along it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import OptimizeResult, least_squares
from scipy.special import chdtri

from vision.calibration.place import FALSE_ALARM, Placement
from vision.geometry.base_lines import BaseLines
from vision.geometry.refusals import Refused
from vision.geometry.rotation import exp_rotation

# [frames] Six unknowns, four numbers a frame, and something left over. Derived.
_MIN_FRAMES = 4
_NO_LINES = BaseLines(np.zeros(0), *(np.zeros((0, 3)), np.zeros((0, 3, 3))) * 2)


def by_strokes(strokes: Sequence[BaseLines]) -> Placement:
    """What several free strokes say together. Raises Refused where none of them is wide enough to say anything.

    What the lines of a stroke share (light, lenses) all strokes share: their mean has as much of it as one.
    """
    usable = [
        lines for lines in strokes if len(lines.motor_rad) >= _MIN_FRAMES and lines.width_rad > 0
    ]
    if not usable:
        by_swing(max(strokes, key=lambda lines: len(lines.motor_rad), default=_NO_LINES))
    each = [by_swing(lines) for lines in usable]
    information = [np.linalg.inv(one.covariance) for one in each]
    whole = np.linalg.inv(sum(information))
    gains = [whole @ own for own in information]
    step = sum(gain @ one.step for gain, one in zip(gains, each))
    own = sum(
        g @ (one.covariance - lines.shared_covariance) @ g.T
        for g, one, lines in zip(gains, each, usable)
    )
    covariance = own + np.mean([lines.shared_covariance for lines in usable], axis=0)
    widths, rise = (
        [lines.width_rad for lines in usable],
        float(np.mean([one.rise_rad for one in each])),
    )
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


def _excess(fitted: OptimizeResult) -> float:
    """By how much frames scatter more than they say (a motor angle's own noise), as variances; 1 where chance may."""
    square, left = 2 * fitted.cost, len(fitted.fun) - len(fitted.x)
    return square / left if square > chdtri(left, FALSE_ALARM) else 1.0


def _first(lines: BaseLines) -> np.ndarray:
    """The board's frame, and the whisker's mean elevation."""
    return np.append(np.zeros(6), np.arcsin(np.clip(np.mean(lines.direction[:, 2]), -1, 1)))


def _predicted(p: np.ndarray, motor_rad: np.ndarray) -> np.ndarray:
    """Directions (n, 3) of the whisker's base at these motor angles, for p = w, v, rise."""
    cosine, sine = np.cos(motor_rad), np.sin(motor_rad)
    fan = np.column_stack(
        [np.cos(p[6]) * cosine, np.cos(p[6]) * sine, np.full(len(cosine), np.sin(p[6]))]
    )
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


def _learnt(widths_rad: Sequence[float], made: Placement) -> str:
    narrow, wide = np.degrees([min(widths_rad), max(widths_rad)])
    strokes = f"A free stroke of {wide:.1f} degrees gives"
    if len(widths_rad) > 1:
        span = f"{narrow:.1f} to {wide:.1f}" if wide - narrow > 0.05 else f"{wide:.1f}"
        strokes = f"{len(widths_rad)} free strokes of {span} degrees give"
    return f"{strokes}: {made.spread}."
