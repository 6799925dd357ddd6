"""The diameters of a whisker from base to tip, as measured under a microscope: a table of places.

They become one polynomial in the share of the length, so that rod, pictures and beam have one smooth
whisker.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.polynomial import Polynomial

from bench.base.errors import BadInput
from bench.session.rest_shape import check_is_beside
from bench.session.table import (
    NumberTable,
    read_table,
    refuse_where,
    require_columns,
    require_rising,
    require_rows,
)

_COLUMNS = ("arc_mm", "diameter_mm")
_SIGMA = "diameter_sigma_mm"
# [powers] Of the smooth curve through the diameters: a rat's vibrissa is a cone with a root and a tip
# that are thicker by some percent. Study: tests/bench/session/test_profile.py.
_POWERS = 4
# [rows] As many as there are coefficients, and one more, so that a misread diameter shows. Derived.
_LEAST_ROWS = _POWERS + 2
# [1] Of the base's diameter: how far a diameter may lie from the smooth curve, or be given otherwise
# elsewhere. A microscope reads edges of 0.2 mm to a few µm. Stated.
_APART = 0.05
# [1] Of the length: how far from base and tip the first and the last place may lie. Stated.
_SHORT = 0.1
# [1] Of the length: how far beyond the tip a place may lie, by what a ruler leaves. Stated.
_LONG = 0.01
# [1] Of the base's diameter: a smooth curve that is thinner somewhere is no whisker; one that ends in a
# point is taken as this thin there. Stated.
_THINNEST = 0.01
# [points] Where the smooth curve is asked to be a whisker. Stated.
_STEPS = 201


@dataclass(frozen=True)
class Profile:
    """Measured diameters as a smooth curve.

    base_mm, tip_mm: its ends. widths: the diameter over the base's, a polynomial in the share of the
    length, lowest power first. sigma_mm: of all diameters together, by the table's own sigmas; None
    without these.
    """

    base_mm: float
    tip_mm: float
    widths: tuple[float, ...]
    sigma_mm: float | None


def read_profile(session: Path, name: str, length_mm: float) -> Profile:
    """Read the whisker's diameters from a file of the session.

    Raises BadInput, in a line with the file's name and row: no such file, a name that leads out of
    the session, text in a number, too few places, places that do not go on from base to tip, a
    diameter that is none, or far from the smooth curve through all, and a curve that is no whisker.
    """
    check_is_beside(session, name, "profile")
    table = read_table(session / name, name)
    require_columns(table, _COLUMNS, name)
    require_rows(table, _LEAST_ROWS, "places", name)
    require_rising(table, "arc_mm", "places go from the base on, rising", name)
    _check_ends(table["arc_mm"], name, length_mm)
    _check_diameters(table, name)
    curve = Polynomial.fit(
        table["arc_mm"] / length_mm, table["diameter_mm"], _POWERS, domain=[-1, 1]
    )
    _check_curve(curve, table, name, length_mm)
    sigma_mm = None
    if _SIGMA in table.columns:
        sigma_mm = float(np.sqrt(np.mean(table[_SIGMA] ** 2)))
    base_mm = float(curve(0.0))
    tip_mm = max(float(curve(1.0)), _THINNEST * base_mm)
    return Profile(base_mm, tip_mm, tuple((curve.coef / base_mm).tolist()), sigma_mm)


def contradiction(key: str, stated_mm: float, sigma_mm: float, measured_mm: float) -> str:
    """Return how a stated diameter contradicts the measured one; an empty text where it does not."""
    if abs(stated_mm - measured_mm) <= max(3.0 * sigma_mm, _APART * stated_mm):
        return ""
    return (
        f"{key} = {stated_mm:g}, but profile says {measured_mm:.4g} mm there: correct one of them"
    )


def _check_ends(arc_mm: np.ndarray, name: str, length_mm: float) -> None:
    """Raise BadInput where places (n,) lack one near the base or the tip, or have one beyond the tip."""
    first, last = arc_mm[[0, -1]] / length_mm
    has_base = 0.0 <= first <= _SHORT
    has_tip = 1.0 - _SHORT <= last <= 1.0 + _LONG
    if has_base and has_tip:
        return
    found = f"goes from {arc_mm[0]:g} to {arc_mm[-1]:g} mm, length_mm is {length_mm:g}"
    needed = f"the first and the last {100 * _SHORT:g} % of the whisker need a place each"
    raise BadInput(f"{found}; {needed}, and none is beyond the tip", file=name)


def _check_diameters(table: NumberTable, name: str) -> None:
    """Raise BadInput for a diameter that is not positive, but for the last, and for a negative sigma."""
    wrong = table["diameter_mm"] <= 0
    wrong[-1] = table["diameter_mm"][-1] < 0
    refuse_where(
        table, "diameter_mm", wrong, "diameters are above 0 mm, at the tip 0 or more", name
    )
    if _SIGMA in table.columns:
        refuse_where(table, _SIGMA, table[_SIGMA] < 0, "sigmas are 0 mm or more", name)


def _check_curve(curve: Polynomial, table: NumberTable, name: str, length_mm: float) -> None:
    """Raise BadInput for the diameter farthest from the curve, where that is too far, and for a curve
    that is too thin or too thick before the tip."""
    base_mm = float(curve(0.0))
    apart_mm = np.abs(table["diameter_mm"] - curve(table["arc_mm"] / length_mm))
    farthest = int(np.argmax(apart_mm))
    if not apart_mm[farthest] <= _APART * base_mm:
        found = f"lies {apart_mm[farthest]:.3g} mm from the smooth curve through all diameters"
        row = int(table.row[farthest])
        raise BadInput(f"{found}; {_APART * base_mm:.2g} mm is allowed", file=name, row=row)
    shares = np.linspace(0.0, 1.0 - _SHORT, _STEPS)
    thinnest = int(np.argmin(curve(shares)))
    if curve(shares)[thinnest] < _THINNEST * base_mm:
        place_mm = shares[thinnest] * length_mm
        found = f"the smooth curve through all diameters has none left at {place_mm:.3g} mm"
        raise BadInput(f"{found}; is a diameter in another unit?", file=name)
