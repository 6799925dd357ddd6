"""The bar's two edges in one camera: how wide it looks, and so how far away it is.

Two cameras tell where a bar is by where their sights cross, and there its width adds next to nothing. One camera has
only the width. The rims' shading is as free as for the bar's line (see `vision.touched.line`); but what a wrong rim does to
the middle cancels, and to the width it does not, so each edge has its own error.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from vision.geometry.contact import BarAxis
from vision.geometry.newton import covariance_of, descend
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View
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

# [px, 1] An edge's error beyond its formal sigma, and how many times that one counts: half-widths
# of path-traced and painted bars show it (docs/proof.md, one camera). Study: coverage.py alone.
EDGE_PX, FORMAL_TO_TRUE = 0.12, 2.0
# [px] Of the sweep and the rims' pixels. Set by eye. Study: coverage.py alone.
_SWEEP_BLUR_PX, _BIN_PX = 1.5, 0.5
# [mm] Length of bar that the sweep looks at. Set by eye. Study: coverage.py alone.
_SWEEP_REACH_MM = 20.0
# [px, half-widths] How far the sweep goes: shift and tilt; widening and taper, the latter of a
# bar at 20° to the sight. Study: coverage.py alone.
_SWEEP_MOST_PX, _SWEEP_MOST_SHARE = (5.0, 5.0), np.array([0.2, 0.15])
# [1] The sweep's window, part by part smaller. Study: coverage.py alone.
_SWEEP_PARTS = (1.0, 0.3, 0.1)
# [rounds] What counts as a rim depends on where the edges are. Study: coverage.py alone.
_ROUNDS = 2
# [px, 1] For derivatives by shift, tilt, widening, taper, and log blur. Derived.
_STEPS = np.array([0.15, 0.15, 0.15, 0.15, 0.1])
# [px, 1] A step of the descent goes no farther. Study: coverage.py alone.
_LONGEST = np.array([0.7, 0.7, 0.7, 0.7, 0.4])
# [px, 1] Where the descent ends: a twentieth of an edge's sigma; parts of a step that are tried.
# Derived.
_SETTLED_PX, _PARTS = 0.005, (1.0, 0.3, 0.1, 0.03)


def measure_edges(
    view: View,
    axis: BarAxis,
    radius_mm: float,
    wires_px: Sequence[np.ndarray],
    settings: VisionSettings,
    *,
    coarse: bool = False,
) -> dict[int, LinePoints] | None:
    """Two points of each of the bar's edges in the mean picture, by side: 1 towards the points' normals, -1
    against them. None where too little of the bar is clear, or what is seen is no bar.

    wires_px: lines (m, 2) where the wire lies in some frame. coarse: the axis may be some pixels off, and its width.
    """
    noise, knots = (
        view.noise.times(view.mean_share + 1.0),
        bar_knots(settings),
    )  # of the mean beside one background
    pieces = bar_pieces(view, noise, axis, radius_mm, wires_px, settings)
    if len(pieces) < FEWEST_PIECES:
        return None
    found = np.append(_sweep(pieces, knots) if coarse else np.zeros(4), 0.0)
    pieces = of_bar_alone(pieces, lambda some: _placed(some, found), knots)
    for _ in range(_ROUNDS):
        rims = rims_of(pieces, _placed(pieces, found))
        found, left, curvature = descend(
            partial(_misfit, rims, knots), found, _STEPS, _LONGEST, _SETTLED_PX, _PARTS
        )
    if left > NO_BAR:
        return None
    return _edges(
        pieces, found, covariance_of(curvature, left, float(np.sum(rims.weight > 0)))[:4, :4]
    )


def _misfit(rims: Pieces, knots: Knots, q) -> float:
    """Of rims placed by q[:4] under a lens blur of exp(q[4]) px."""
    return fit_shading(_placed(rims, q), float(np.exp(q[4])), RIMS, knots)[1]


def _placed(pieces: Pieces, q) -> Pieces:
    """The same pixels about a rod that is shifted by q[0] px and tilted by q[1] px over ARM_MM, whose half-width is
    larger by q[2] px and grows by q[3] px over ARM_MM."""
    lever = pieces.place / ARM_MM
    moved = pieces.moved(q[0] + q[1] * lever)
    return replace(moved, radius_px=np.maximum(moved.radius_px + q[2] + q[3] * lever, 1.0))


def _sweep(pieces: Pieces, knots) -> np.ndarray:
    """Coordinate descent over shift, widening, tilt and taper, with a coarse, blurred model, near the contact."""
    near = np.abs(pieces.place) < _SWEEP_REACH_MM
    some, _ = binned(pieces.select(near) if np.sum(near) >= FEWEST_PIECES else pieces, _BIN_PX)
    found = np.zeros(4)

    def misfit(q) -> float:
        return fit_shading(_placed(some, q), _SWEEP_BLUR_PX, WAVES, knots)[1]

    most = np.array([*_SWEEP_MOST_PX, *np.median(pieces.radius_px) * _SWEEP_MOST_SHARE])
    for part in _SWEEP_PARTS:
        for _ in range(2):
            for k in (0, 2, 1, 3):
                steps = part * most[k] * np.linspace(-1.0, 1.0, 9)
                tries = [np.clip(found + step * np.eye(4)[k], -most, most) for step in steps]
                found = min(tries, key=misfit)
    return found


def _edges(pieces: Pieces, found, covariance) -> dict[int, LinePoints]:
    """Points at ± ARM_MM of both edges, each with its sigma."""
    place, foot, normal, radius = at_arms(pieces)
    points = {}
    for side in (-1, 1):
        across = np.stack(
            [np.ones(2), place / ARM_MM, np.full(2, side), side * place / ARM_MM], axis=1
        )
        formal = np.sqrt(np.einsum("ni,ij,nj->n", across, covariance, across))
        off = across @ found[:4] + side * radius
        px = foot + off[:, None] * normal
        points[side] = LinePoints(
            px, _across(px, normal), np.hypot(EDGE_PX, FORMAL_TO_TRUE * formal), place
        )
    return points


def _across(px, normal) -> np.ndarray:
    """Unit normals (2, 2) of the line through two points, on the side of the given ones."""
    along = (px[1] - px[0]) / np.linalg.norm(px[1] - px[0])
    across = np.array([-along[1], along[0]])
    return np.tile(across * np.sign(across @ normal.sum(axis=0)), (2, 1))
