"""The bar's two edges in one camera: its apparent width, and so its distance.

Two cameras locate a bar by where their sights cross, and there its width adds next to nothing. One
camera has only the width. The model is linear in the shading of the rims, which is fitted for each
q = (shift, tilt, widening, taper, log blur), and the sum of squares that remains is minimised over
q. The shading is as free as for the bar's line (`vision.touched.line`). An error in a rim's shading
cancels in the middle of the two edges, but not in the width, so each edge has an error of its own,
EDGE_PX.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from vision.geometry.contact import BarAxis
from vision.geometry.newton import covariance_of, descend
from vision.geometry.polyline import normals
from vision.touched.object_view import ObjectView
from vision.touched.pieces import (
    ARM_MM,
    FEWEST_PIECES,
    NO_BAR,
    at_arms,
    bar_knots,
    bar_pieces,
    of_bar_alone,
    rims_of,
)
from vision.wire.bands import Pieces
from vision.wire.binned import binned
from vision.wire.cylinder import RIMS, WAVES
from vision.wire.points import LinePoints
from vision.wire.shading import Knots, fit_shading

# [px] An edge's error beyond its formal sigma: half widths of path-traced and painted bars show it
# (docs/ladder.md, one camera). Study: coverage.py alone.
EDGE_PX = 0.12
# [1] True over formal sigma of an edge, by the same bars. Study: coverage.py alone.
FORMAL_TO_TRUE = 2.0
# [px] Blur of the coarse search's model. By 1 or 2.2 slopes through one camera alone move by 0.3
# sigma. Study: thresholds.py touched.edges _SEARCH_BLUR_PX … --cameras 1.
_SEARCH_BLUR_PX = 1.5
# [px] Bins of the rims' pixels in the coarse search. By 0.25 or 1 slopes through one camera alone
# move by 0.3 sigma. Study: thresholds.py touched.edges _BIN_PX … --cameras 1.
_BIN_PX = 0.5
# [mm] Half the length of bar that the coarse search uses. By 14 or 30 slopes through one camera
# alone move by 0.6 or 0.3 sigma. Study: thresholds.py touched.edges _SEARCH_REACH_MM … --cameras 1.
_SEARCH_REACH_MM = 20.0
# [px] Half the range of the coarse search by shift and by tilt. Study: coverage.py alone.
_SEARCH_MOST_PX = (5.0, 5.0)
# [half widths] Half the range of the coarse search by widening and by taper, the latter of a bar
# at 20° to the sight. Study: coverage.py alone.
_SEARCH_MOST_SHARE = np.array([0.2, 0.15])
# [1] Ranges of successive passes of the coarse search, over the first. Study: coverage.py alone.
_SEARCH_RANGES = (1.0, 0.3, 0.1)
# [passes] Of fitting the edges: which pixels are rims depends on where the edges are. Study:
# coverage.py alone.
_PASSES = 2
# [px, 1] Steps of derivatives by shift, tilt, widening, taper, and log blur. Derived.
_STEPS = np.array([0.15, 0.15, 0.15, 0.15, 0.1])
# [px, 1] Largest step of the descent. Study: coverage.py alone.
_LONGEST = np.array([0.7, 0.7, 0.7, 0.7, 0.4])
# [px] Last step of the descent: a twentieth of an edge's sigma. Derived.
_CONVERGED_PX = 0.005
# [1] Shares of a step that are tried. Derived.
_STEP_SHARES = (1.0, 0.3, 0.1, 0.03)


def measure_edges(
    view: ObjectView, axis: BarAxis, *, coarse: bool = False
) -> dict[int, LinePoints] | None:
    """Measure two points of each of the bar's edges in the mean picture.

    Returns the points by side, 1 towards the pieces' normals and -1 against them; None where too
    little of the bar is clear, or the pixels show no bar. coarse: the axis and the width may be
    some pixels off.
    """
    pictures = view.pictures
    noise = pictures.noise.times(pictures.mean_share + 1.0)  # of the mean minus one background
    knots = bar_knots(view.settings)
    pieces = bar_pieces(view, axis, noise)
    if len(pieces) < FEWEST_PIECES:
        return None
    start = _search_coarse(pieces, knots) if coarse else np.zeros(4)
    start = np.append(start, 0.0)
    pieces = of_bar_alone(pieces, partial(_align, q=start), knots)
    q, covariance, chi2 = _fit_edges(pieces, knots, start)
    if chi2 > NO_BAR:
        return None
    return _points_of_edges(pieces, q[:4], covariance[:4, :4])


def _fit_edges(pieces: Pieces, knots: Knots, q) -> tuple[np.ndarray, np.ndarray, float]:
    """Fit q (5,) to the rims' pixels, with its covariance (5, 5) and chi² per pixel."""
    for _ in range(_PASSES):
        rims = rims_of(pieces, _align(pieces, q))
        misfit = partial(_fit_rims, rims, knots)
        q, chi2, curvature = descend(misfit, q, _STEPS, _LONGEST, _CONVERGED_PX, _STEP_SHARES)
    pixels = float(np.sum(rims.weight > 0))
    return q, covariance_of(curvature, chi2, pixels), chi2


def _fit_rims(rims: Pieces, knots: Knots, q) -> float:
    """Fit the shading of rims aligned by q[:4] under a lens blur of exp(q[4]) px, and return chi²
    per pixel."""
    return fit_shading(_align(rims, q), float(np.exp(q[4])), RIMS, knots)[1]


def _align(pieces: Pieces, q) -> Pieces:
    """Return the pieces about a rod of another place and width.

    It is shifted by q[0] px and tilted by q[1] px over ARM_MM; its half width is larger by q[2] px
    and grows by q[3] px over ARM_MM.
    """
    lever = pieces.place / ARM_MM
    shifted = pieces.moved(q[0] + q[1] * lever)
    radius_px = np.maximum(shifted.radius_px + q[2] + q[3] * lever, 1.0)
    return replace(shifted, radius_px=radius_px)


def _search_coarse(pieces: Pieces, knots: Knots) -> np.ndarray:
    """Find shift, tilt, widening and taper (4,) by coordinate descent with a blurred model, near
    the contact."""
    is_near = np.abs(pieces.place) < _SEARCH_REACH_MM
    is_enough = np.sum(is_near) >= FEWEST_PIECES
    bins, _ = binned(pieces.select(is_near) if is_enough else pieces, _BIN_PX)

    def misfit(q) -> float:
        """Return chi² per pixel of the blurred model."""
        return fit_shading(_align(bins, q), _SEARCH_BLUR_PX, WAVES, knots)[1]

    most = np.array([*_SEARCH_MOST_PX, *np.median(pieces.radius_px) * _SEARCH_MOST_SHARE])
    best = np.zeros(4)
    for share in _SEARCH_RANGES:
        for _ in range(2):
            for k in (0, 2, 1, 3):
                tries = []
                for step in share * most[k] * np.linspace(-1.0, 1.0, 9):
                    tries.append(np.clip(best + step * np.eye(4)[k], -most, most))
                best = min(tries, key=misfit)
    return best


def _points_of_edges(pieces: Pieces, q, covariance) -> dict[int, LinePoints]:
    """Return points at ± ARM_MM of both edges, by side, each with its sigma. q (4,) and its
    covariance (4, 4)."""
    place, foot, normal, radius = at_arms(pieces)
    lever = place / ARM_MM
    points = {}
    for side in (-1, 1):
        jacobian = np.stack([np.ones(2), lever, np.full(2, side), side * lever], axis=1)
        formal_px = np.sqrt(np.einsum("ni,ij,nj->n", jacobian, covariance, jacobian))
        offset = jacobian @ q + side * radius
        px = foot + offset[:, None] * normal
        sigma_px = np.hypot(EDGE_PX, FORMAL_TO_TRUE * formal_px)
        points[side] = LinePoints(px, _normals_of_line(px, normal), sigma_px, place)
    return points


def _normals_of_line(px, normal) -> np.ndarray:
    """Return the unit normals (2, 2) of the line through two points, on the side of the given
    ones."""
    across = normals(px)
    return across * np.sign(across[0] @ normal.sum(axis=0))
