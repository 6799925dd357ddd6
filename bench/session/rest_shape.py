"""The shape of the unloaded whisker, as a lab traced it: a table of points in the base frame.

A shape is two polynomials in arc length over the whisker's length, in y and z, mm; what is left of
each unit of arc goes forward, along x.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.polynomial import Polynomial, polynomial

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
# [places] From base to tip, of which the steepest counts. Stated.
_PLACES = 401
# [rounds] Of Newton's method for an arc on the unloaded rod, from a turn of 60° to rounding. Derived.
_NEWTON_ROUNDS = 12
# Gauss–Legendre on −1…1: of the forward part of an unloaded shape of sixth degree. Derived.
_GAUSS = np.polynomial.legendre.leggauss(24)


@dataclass(frozen=True)
class UnloadedRod:
    """The whisker without load, as a curve."""

    rest_mm: RestShape
    length_mm: float

    def tangent(self, arc_mm: np.ndarray) -> np.ndarray:
        """Return unit tangents (..., 3) at arc lengths (...).

        Raises ArithmeticError where the shape, beyond its end, goes on as no rod can.
        """
        share = np.asarray(arc_mm) / self.length_mm
        tangent = np.empty((*share.shape, 3))
        for k, slope in enumerate(self._slopes):
            tangent[..., k + 1] = polynomial.polyval(share, slope, tensor=False)
        forward2 = 1.0 - tangent[..., 1] ** 2 - tangent[..., 2] ** 2
        if not np.all(forward2 > 0):
            raise ArithmeticError("the contact is far beyond the end of a curved rod")
        tangent[..., 0] = np.sqrt(forward2)
        return tangent

    @cached_property
    def _slopes(self) -> list[np.ndarray]:
        """Return the coefficients of y and z of the tangents, by the share of the length."""
        return [polynomial.polyder(own) / self.length_mm for own in self.rest_mm]

    def point_mm(self, arc_mm: np.ndarray) -> np.ndarray:
        """Return points (..., 3) at arc lengths (...)."""
        arc = np.asarray(arc_mm)
        at, weights = _GAUSS
        within = 0.5 * arc[..., None] * (1.0 + at)
        x = 0.5 * arc * (self.tangent(within)[..., 0] @ weights)
        y, z = (polynomial.polyval(arc / self.length_mm, own) - own[0] for own in self.rest_mm)
        return np.stack([x, y, z], axis=-1)

    def arc_along_mm(self, direction: np.ndarray, distance_mm: np.ndarray) -> np.ndarray:
        """Return the arcs (n,) whose points are so far (n,) along directions (n, 3)."""
        arc = np.array(distance_mm, dtype=float)
        for _ in range(_NEWTON_ROUNDS):
            missing = distance_mm - np.sum(self.point_mm(arc) * direction, axis=-1)
            arc = arc + missing / np.sum(self.tangent(arc) * direction, axis=-1)
        return arc

    def point_at_distance_mm(self, distance_mm: float) -> np.ndarray:
        """Return the point (3,) that is so far from the clamp."""
        arc = distance_mm
        for _ in range(_NEWTON_ROUNDS):
            point = self.point_mm(arc)
            reached = float(np.linalg.norm(point))
            arc = arc + (distance_mm - reached) * reached / float(point @ self.tangent(arc))
        return self.point_mm(arc)


def of_curvature(curvature_per_mm: list[float], length_mm: float) -> RestShape:
    """Return the shape that lies κ s²/2 off the x axis at arc length s, for κ in y and z, 1/mm."""
    y, z = (0.5 * curvature * length_mm**2 for curvature in curvature_per_mm)
    return (0.0, 0.0, y), (0.0, 0.0, z)


def steepest_slopes(rest_mm: RestShape, length_mm: float) -> tuple[float, ...]:
    """Return the sine of the turn from the base at places from base to tip."""
    at = np.linspace(0.0, 1.0, _PLACES)
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
    Raises BadInput for a curve that turns too far, for points far beyond its end, and for the point that is
    farthest off it, where that is too far.
    """
    points_mm = np.column_stack([table[column] for column in _COLUMNS])
    arc_mm = _arc_along_chords(points_mm)
    for _ in range(_ROUNDS):
        y, z = (_through_base(arc_mm / length_mm, points_mm[:, k]) for k in (1, 2))
        if max(steepest_slopes((y, z), length_mm)) > MOST_SLOPE:
            found = f"the whisker turns by more than {MOST_TURN_DEG:g}° from its base"
            raise BadInput(f"{found}; such a coil is not evaluated", file=name)
        curve = UnloadedRod((y, z), length_mm)
        try:
            off_mm = points_mm - curve.point_mm(arc_mm)
            arc_mm = arc_mm + np.sum(off_mm * curve.tangent(arc_mm), axis=1)
        except ArithmeticError:  # the curve goes on beyond the tip as no whisker can
            _check_length(float(arc_mm[-1]), name, length_mm)
            raise
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


def _through_base(at: np.ndarray, values: np.ndarray) -> tuple[float, ...]:
    """Fit a polynomial without constant to values (n,) at places (n,); return its coefficients."""
    powers = np.vander(at, _POWERS + 1, increasing=True)[:, 1:]
    coefficients = np.linalg.lstsq(powers, values, rcond=None)[0]
    return (0.0, *coefficients.tolist())


def _check_length(end_mm: float, name: str, length_mm: float) -> None:
    """Raise BadInput where the points are of a longer whisker, or end much before the tip."""
    found = f"the points go to an arc length of {end_mm:.4g} mm, length_mm is {length_mm:g}"
    if end_mm > (1.0 + _LONG) * length_mm:
        raise BadInput(f"{found}: a whisker is no longer than that", file=name)
    if end_mm < (1.0 - _SHORT) * length_mm:
        share = f"{100 * (1 - _SHORT):g} %"
        raise BadInput(f"{found}; {share} of the whisker or more are needed", file=name)
