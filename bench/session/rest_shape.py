"""The shape of the unloaded whisker, as a lab traced it: a table of points in the base frame.

A shape is two polynomials in arc length over the whisker's length, in y and z, mm; what is left of
each unit of arc goes forward, along x.
"""

from pathlib import Path

import numpy as np
from numpy.polynomial import Polynomial

from bench.base.errors import BadInput
from bench.session.file_names import SESSION_TOML
from bench.session.table import (
    NumberTable,
    read_table,
    refuse_where,
    require_columns,
    require_rising,
    require_rows,
)

# Coefficients in y and z, mm, lowest power first.
RestShape = tuple[tuple[float, ...], tuple[float, ...]]
STRAIGHT: RestShape = ((0.0,), (0.0,))
# [°] Largest turn from the base: beyond, a whisker coils, and y and z no longer say where it is.
# Stated.
MOST_TURN_DEG = 60.0
# [1] The sine of it, which is the slope by arc length. Derived.
MOST_SLOPE = float(np.sin(np.radians(MOST_TURN_DEG)))

_COLUMNS = ("x_mm", "y_mm", "z_mm")
# [powers] Of the smooth curve through the points: a spiral that turns by 57° is within 0.02 % of
# its length. Study: tests/bench/session/test_rest_shape.py.
_POWERS = 5
# [rows] As many as there are powers, and one more, so that a misplaced point shows. Derived.
_LEAST_ROWS = _POWERS + 1
# [1] Of the length: how far the first point may lie from the base, and any from the smooth curve.
# Tracing in a photograph is good to some 0.2 %. Stated.
_MISPLACED = 0.01
# [1] Of the length: how far a trace may end before the tip, where the curve goes on unseen. Stated.
_SHORT = 0.1
# [1] Of the length: how far a trace may go beyond the tip, by what a ruler leaves. Stated.
_LONG = 0.01
# [1] Of the length: a coordinate beyond is in another unit, µm for mm. Stated.
_FARTHEST = 10.0
# [rounds] Of fitting the curve to points and points to the curve: what is left falls by the square of
# the noise's slope in each. Derived.
_ROUNDS = 20
# [points] Of the integral that gives arc lengths: its error is below 1e-6 of the length. Derived.
_STEPS = 401


def of_curvature(curvature_per_mm: list[float], length_mm: float) -> RestShape:
    """Return the shape that lies κ s²/2 off the x axis at arc length s, for κ in y and z, 1/mm."""
    y, z = (0.5 * curvature * length_mm**2 for curvature in curvature_per_mm)
    return (0.0, 0.0, y), (0.0, 0.0, z)


def steepest_slopes(rest_mm: RestShape, length_mm: float) -> tuple[float, ...]:
    """Return the sine of the turn from the base at places from base to tip."""
    at = np.linspace(0.0, 1.0, _STEPS)
    slopes = [Polynomial(own).deriv()(at) / length_mm for own in rest_mm]
    return tuple(np.hypot(*slopes).tolist())


def read_rest_shape(session: Path, name: str, length_mm: float) -> RestShape:
    """Read the unloaded whisker's shape from a file of the session.

    Raises BadInput, in a line with the file's name and row: no such file, a name that leads out of
    the session, text in a number, too few points, a point far beyond the tip, a first point off the base, points that do not
    go on along x, or off the smooth curve through all, a whisker that coils, or is longer or
    much shorter than length_mm.
    """
    check_is_beside(session, name, "rest_shape")
    table = read_table(session / name, name, _COLUMNS)
    require_columns(table, _COLUMNS, name)
    require_rows(table, _LEAST_ROWS, "points", name)
    _check_lengths(table, name, length_mm)
    require_rising(table, "x_mm", "points go from the base on, x rising", name)
    rest_mm, end_mm = _fit(table, name, length_mm)
    _check_length(end_mm, name, length_mm)
    return rest_mm


def check_is_beside(session: Path, name: str, key: str) -> None:
    """Raise BadInput where the file that a key of [whisker] names is not in the session's folder."""
    if name not in {file.name for file in session.iterdir() if file.is_file()}:
        found = f"{key} = {name!r}: there is no such file beside session.toml"
        raise BadInput(f"[whisker] {found}", file=SESSION_TOML)


def _check_lengths(table: NumberTable, name: str, length_mm: float) -> None:
    """Raise BadInput for points far beyond the tip, or a first point that is not at the base."""
    rule = f"far beyond the whisker's {length_mm:g} mm. Are the points in mm?"
    for column in _COLUMNS:
        refuse_where(table, column, np.abs(table[column]) > _FARTHEST * length_mm, rule, name)
    first_mm = float(np.linalg.norm([table[column][0] for column in _COLUMNS]))
    if first_mm > _MISPLACED * length_mm:
        found = f"the first point is {first_mm:.3g} mm from the base, which is [0, 0, 0]"
        allowed = f"{_MISPLACED * length_mm:.2g} mm is allowed"
        raise BadInput(f"{found}; {allowed}", file=name, row=int(table.row[0]))


def _fit(table: NumberTable, name: str, length_mm: float) -> tuple[RestShape, float]:
    """Return the smooth curve through the points, from the base on, and the arc length of the last.

    Each point belongs to the curve's nearest, so that noise of tracing does not lengthen it.
    Raises BadInput for a curve that turns too far, and for the point that is farthest off it, where
    that is too far.
    """
    points_mm = np.column_stack([table[column] for column in _COLUMNS])
    arc_mm = _arc_along_chords(points_mm)
    for _ in range(_ROUNDS):
        lateral = [_through_base(arc_mm / length_mm, points_mm[:, k]) for k in (1, 2)]
        y, z = (tuple(own.coef.tolist()) for own in lateral)
        if max(steepest_slopes((y, z), length_mm)) > MOST_SLOPE:
            found = f"the whisker turns by more than {MOST_TURN_DEG:g}° from its base"
            raise BadInput(f"{found}; such a coil is not evaluated", file=name)
        curve_mm, tangents = _curve(lateral, arc_mm, length_mm)
        off_mm = points_mm - curve_mm
        arc_mm = arc_mm + np.sum(off_mm * tangents, axis=1)
    _check_residuals(np.linalg.norm(off_mm, axis=1), table, name, length_mm)
    return (y, z), float(arc_mm[-1])


def _check_residuals(
    beside_mm: np.ndarray, table: NumberTable, name: str, length_mm: float
) -> None:
    """Raise BadInput for the point that lies farthest off the curve (n,), mm, where that is too far."""
    farthest = int(np.argmax(beside_mm))
    if beside_mm[farthest] > _MISPLACED * length_mm:
        found = f"lies {beside_mm[farthest]:.3g} mm beside the smooth curve through all points"
        allowed = f"{_MISPLACED * length_mm:.2g} mm is allowed"
        raise BadInput(f"{found}; {allowed}", file=name, row=int(table.row[farthest]))


def _arc_along_chords(points_mm: np.ndarray) -> np.ndarray:
    """Return the arc lengths (n,) of points (n, 3) along straight lines from the base."""
    steps_mm = np.linalg.norm(np.diff(points_mm, axis=0, prepend=np.zeros((1, 3))), axis=1)
    return np.cumsum(steps_mm)


def _curve(
    lateral: list[Polynomial], arc_mm: np.ndarray, length_mm: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return points and tangents, each (n, 3), of the curve at arc lengths (n,).

    lateral: its y and z by arc length over length_mm.
    """
    grid_mm = np.linspace(0.0, max(float(arc_mm.max()), length_mm), _STEPS)
    slopes = [own.deriv() for own in lateral]
    forward = _forward(slopes, grid_mm, length_mm)
    steps_mm = 0.5 * (forward[1:] + forward[:-1]) * np.diff(grid_mm)
    x_mm = np.append(0.0, np.cumsum(steps_mm))
    share = arc_mm / length_mm
    y, z = lateral
    points = [np.interp(arc_mm, grid_mm, x_mm), y(share), z(share)]
    y_slope, z_slope = (slope(share) / length_mm for slope in slopes)
    tangents = [np.interp(arc_mm, grid_mm, forward), y_slope, z_slope]
    return np.column_stack(points), np.column_stack(tangents)


def _forward(slopes: list[Polynomial], arc_mm: np.ndarray, length_mm: float) -> np.ndarray:
    """Return the x (n,) of unit tangents whose y and z are these slopes at arc lengths (n,)."""
    steepness2 = sum((slope(arc_mm / length_mm) / length_mm) ** 2 for slope in slopes)
    return np.sqrt(np.maximum(1.0 - steepness2, 1.0 - MOST_SLOPE**2))


def _through_base(at: np.ndarray, values: np.ndarray) -> Polynomial:
    """Fit a polynomial without constant to values (n,) at places (n,)."""
    powers = np.vander(at, _POWERS + 1, increasing=True)[:, 1:]
    coefficients = np.linalg.lstsq(powers, values, rcond=None)[0]
    return Polynomial([0.0, *coefficients])


def _check_length(end_mm: float, name: str, length_mm: float) -> None:
    """Raise BadInput where the points are of a longer whisker, or end much before the tip."""
    found = f"the points go to an arc length of {end_mm:.4g} mm, length_mm is {length_mm:g}"
    if end_mm > (1.0 + _LONG) * length_mm:
        raise BadInput(f"{found}: a whisker is no longer than that", file=name)
    if end_mm < (1.0 - _SHORT) * length_mm:
        share = f"{100 * (1 - _SHORT):g} %"
        raise BadInput(f"{found}; {share} of the whisker or more are needed", file=name)
