"""The centre and axis of rotation and the encoder's zero, by free strokes.

On a free stroke the whisker near its base is straight and rotates rigidly with the motor. All its
lines meet in the centre of rotation, their fan's axis is the motor's, and the line at motor angle 0
is rig x. A narrow fan fixes its apex well across the whisker and badly along it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtri

from vision.calibration.place import FALSE_ALARM, Placement
from vision.geometry.base_lines import BaseLines
from vision.geometry.camera import symmetric_root
from vision.geometry.refusals import Refused
from vision.geometry.rotation import exp_rotation, unit

# [frames] Six unknowns, four numbers a frame, and something left over. Derived.
_MIN_FRAMES = 4
# [rad] How far an axis leans from where the board has it, to linearise there; a swing that
# determines it better decides. Stated. Study: drawn_lines.py.
_LEAN_RAD = 0.02
# [parameters] By which an axis leans: the first of a step. A layout, no threshold.
_LEANS = 2
_SOURCE = "free stroke"


def by_strokes(strokes: Sequence[BaseLines]) -> Placement:
    """Return the placement by several free strokes. Raises Refused where none of them is wide
    enough.
    """
    usable = []
    for lines in strokes:
        if len(lines.motor_rad) >= _MIN_FRAMES and lines.width_rad > 0:
            usable.append(lines)
    if not usable:
        widest = max(strokes, key=lambda lines: len(lines.motor_rad), default=None)
        raise _too_few(widest)
    placements = [by_swing(lines) for lines in usable]
    widths = [lines.width_rad for lines in usable]
    return _with_note(_combine(placements), widths)


def _combine(placements: Sequence[Placement]) -> Placement:
    """Return the mean of placements by a stroke each, weighted by precision.

    What the lines of a stroke share (light, lenses) all strokes share: of alike strokes the mean has
    as much of it as one.
    """
    precisions = [np.linalg.inv(placement.covariance) for placement in placements]
    total = np.linalg.inv(sum(precisions))
    step = np.zeros(6)
    own = np.zeros((6, 6))
    by_shared = np.zeros((6, 6))
    for placement, precision in zip(placements, precisions):
        gain = total @ precision
        step += gain @ placement.step
        own += gain @ (placement.covariance - placement.shared) @ gain.T
        by_shared += gain @ symmetric_root(placement.shared)
    shared = by_shared @ by_shared.T
    covariance = own + shared
    return Placement(
        step,
        0.5 * (covariance + covariance.T),
        rise_rad=float(np.mean([placement.rise_rad for placement in placements])),
        width_rad=max(placement.width_rad for placement in placements),
        source=_SOURCE,
        shared=shared,
    )


def by_swing(lines: BaseLines) -> Placement:
    """Return the placement by one swing. Raises Refused with fewer than four frames or a motor at
    rest.

    A narrow swing cannot distinguish an axis that leans along the whisker from a whisker that rises, and
    the wrong one of both seems far better known. So it is linearised at the most probable place of
    an axis that hardly leans (`_LEAN_RAD`), and that prior is taken out again.
    """
    if len(lines.motor_rad) < _MIN_FRAMES or lines.width_rad == 0:
        raise _too_few(lines)
    probable, jacobian, residual = _linearised(lines)
    own = _covariance(jacobian)
    change = -own @ (jacobian.T @ residual)
    excess = _excess(residual + jacobian @ change, len(change))
    step = probable + change
    by_error = (-own @ (jacobian.T @ _residuals_by_shared(probable, lines)))[:6]
    shared = lines.shared_covariance + by_error @ by_error.T
    placement = Placement(
        step[:6],
        excess * own[:6, :6] + shared,
        rise_rad=float(step[6]),
        width_rad=lines.width_rad,
        source=_SOURCE,
        shared=shared,
    )
    return _with_note(placement, [lines.width_rad])


def _linearised(lines: BaseLines) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the most probable parameters (7,) of a swing whose axis hardly leans, and there, without
    that prior, the derivatives (n, 7) of the residuals and the residuals (n,).
    """
    elevation_rad = np.arcsin(np.clip(np.mean(lines.direction[:, 2]), -1, 1))
    first = np.append(np.zeros(6), elevation_rad)
    probable = least_squares(_residuals_and_prior, first, args=(lines,), x_scale="jac", method="lm")
    return probable.x, probable.jac[:-_LEANS], probable.fun[:-_LEANS]


def _too_few(lines: BaseLines | None) -> Refused:
    """Return the refusal of a stroke with too few frames or a motor at rest; None: of no stroke."""
    frames = 0 if lines is None else len(lines.motor_rad)
    width_rad = 0.0 if lines is None else lines.width_rad
    return Refused(
        f"{frames} frames of free stroke over {np.degrees(width_rad):.2f} degrees: the centre "
        f"of rotation needs {_MIN_FRAMES} frames at different motor angles"
    )


def _excess(residual: np.ndarray, unknowns: int) -> float:
    """Return the variance of the residuals (n,) over the stated one (a motor angle's own noise); 1
    where chance explains the difference.
    """
    chi2 = float(residual @ residual)
    freedom = len(residual) - unknowns
    return chi2 / freedom if chi2 > chdtri(freedom, FALSE_ALARM) else 1.0


def _predict(p: np.ndarray, motor_rad: np.ndarray) -> np.ndarray:
    """Return directions (n, 3) of the whisker's base at these motor angles, for p = w, v, rise."""
    forward = np.cos(p[6])
    upward = np.full(len(motor_rad), np.sin(p[6]))
    fan = np.column_stack([forward * np.cos(motor_rad), forward * np.sin(motor_rad), upward])
    return fan @ exp_rotation(p[:3]).T


def _residuals_and_prior(p: np.ndarray, lines: BaseLines) -> np.ndarray:
    """Return the residuals of the lines, and of an axis that hardly leans."""
    return np.append(_residuals(p, lines), p[:_LEANS] / _LEAN_RAD)


def _residuals(p: np.ndarray, lines: BaseLines) -> np.ndarray:
    """Return two residuals of the line's place and two of its direction per frame, across the line,
    in their sigmas.
    """
    across = _across(_predict(p, lines.motor_rad))
    off_mm = (lines.point_mm - p[3:6])[:, :, None]
    place = _whiten(across, off_mm, lines.point_covariance)
    direction = _whiten(across, lines.direction[:, :, None], lines.direction_covariance)
    return np.concatenate([place, direction])[:, 0]


def _residuals_by_shared(p: np.ndarray, lines: BaseLines) -> np.ndarray:
    """Return how the residuals change with each error that frames share, (4 n, k)."""
    across = _across(_predict(p, lines.motor_rad))
    place = _whiten(across, lines.point_by_shared, lines.point_covariance)
    direction = _whiten(across, lines.direction_by_shared, lines.direction_covariance)
    return np.concatenate([place, direction])


def _across(along: np.ndarray) -> np.ndarray:
    """Return two unit vectors across each direction (n, 3), as rows (n, 2, 3). Whiskers are not
    along z.
    """
    first = unit(np.cross([0.0, 0.0, 1.0], along))
    return np.stack([first, np.cross(along, first)], axis=1)


def _whiten(across: np.ndarray, vectors: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return the components (2 n, k) of vectors (n, 3, k) along `across` (n, 2, 3), whitened by
    their covariance.
    """
    root = np.linalg.cholesky(across @ covariance @ np.swapaxes(across, 1, 2))
    return np.concatenate(np.linalg.solve(root, across @ vectors))


def _covariance(J: np.ndarray) -> np.ndarray:
    """Return (JᵀJ)⁻¹, by the triangular factor of J."""
    inverse = np.linalg.inv(np.linalg.qr(J, mode="r"))
    return inverse @ inverse.T


def _basis(widths_rad: Sequence[float]) -> str:
    """Return in words how many strokes there are, and how wide they are."""
    narrow, wide = np.degrees([min(widths_rad), max(widths_rad)])
    if len(widths_rad) == 1:
        return f"a free stroke of {wide:.1f} degrees"
    span = f"{narrow:.1f} to {wide:.1f}" if wide - narrow > 0.05 else f"{wide:.1f}"
    return f"{len(widths_rad)} free strokes of {span} degrees"


def _with_note(placement: Placement, widths_rad: Sequence[float]) -> Placement:
    """Return the placement with a sentence for the report on the strokes and what they give."""
    basis = _basis(widths_rad)
    verb = "gives" if len(widths_rad) == 1 else "give"
    note = f"{basis[0].upper()}{basis[1:]} {verb}: {placement.spread}."
    return replace(placement, basis=basis, notes=(note,))
