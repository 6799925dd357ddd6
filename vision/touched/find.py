"""The bar in space before any wire is known: the cylinders whose two edges stand out in all cameras at once.

An edge is where the picture changes across a line, to brighter or to darker, and the picture without rods does not. A
shadow is soft, or has no second edge at the bar's width in every camera; a change that the picture without rods has
under other light, such as a square of the board in shadow, does not count. Which of several cylinders is the bar, their
lines tell (see `vision.touched.search`).
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import cv2
import numpy as np
from numpy.typing import ArrayLike

from vision.geometry.camera import Camera
from vision.geometry.centreline import rotation_z
from vision.geometry.contact import BarAxis, upward
from vision.geometry.rods import Rods
from vision.pictures.change import HALF

# [half-widths, px] An edge's own blur, so that rim and highlight stay apart: with 0.1, 83 % of 53
# path-traced scenes were found within 3 px at once, with 0.06 87 %. Study: bar_scenes.py.
_EDGE_BLUR, _LEAST_BLUR_PX = 0.06, 0.7
# [half-widths] Edges are spread so far, look by look: first as far as half a step of the grid.
# Derived.
_SPREADS = (0.3, 0.12, 0.06)
# [1] Times the picture without rods: more is no other light on the same thing. Set by eye. Study:
# bar_scenes.py.
_MOST_LIGHT = 1.5
# [1, blurs] An edge is clear beside so many times the median slope, and above the mean of what is
# so near. Set by eye. Study: bar_scenes.py.
_OVER_NOISE, _ASIDE_BLURS = 1.5, 2.0
# [half-widths, 1] Where edges are looked for and how they count: a dark rim is seen as one
# farther in, one farther out speaks against. Without these 4 % of 53 path-traced scenes more were
# over 9 px off. Study: bar_scenes.py.
_AT, _COUNTS = np.array([1.0, 0.8, 0.6, 1.3, 1.6]), np.array([1.0, 0.8, 0.6, -0.5, -0.5])
# [mm] Places along the bar: bars are clamped farther out. Stated.
_ALONG_MM = np.arange(-30.0, 30.1, 6.0)
# [rad] Slopes and tilts of the grid. Study: bar_scenes.py.
_BETA_RAD, _PSI_RAD = np.radians(np.arange(-84.0, 85.0, 6.0)), np.radians([-8.0, 0.0, 8.0])
# [radii] Steps of the grid, the second along the arc in the middle of the whisker. Derived.
_X_STEP, _TOUCH_STEP = 0.7, 0.8
# [hypotheses] That go on, look by look. With 12, 4 and 4 two of 53 path-traced scenes more were
# lost. Study: bar_scenes.py.
_STARTS, _LESS, _KEPT = 24, 8, 4
# [steps, 1] Ends before; a quarter of a step is less than what lines are settled from. Study:
# bar_scenes.py.
_MOST_CLIMBS, _SHRINKS = 20, 2
# [hypotheses] Looked at together: arrays that stay in the processor's cache; no result depends on
# it. Study: tests/studies/speed/tracer.py.
_AT_ONCE = 1000


@dataclass(frozen=True)
class Clear:
    """What one camera shows of edges, at every HALF-th pixel: field (h, w, 3), see `edges_px`; and half the width, in
    these pixels, of the bar in the middle of the whisker."""

    camera: Camera
    field: np.ndarray
    half_px: float


def clear_edges(
    camera: Camera, still: np.ndarray, background: np.ndarray, rods: Rods, motor_rad: float
) -> Clear:
    """The edges of still things in a picture beside one without rods, both (h, w) at every HALF-th pixel."""
    middle = 0.5 * rods.wire.length_mm * rotation_z(motor_rad)[:, 0]
    focal_px = float(np.mean(np.diag(camera.matrix)[:2])) / HALF
    half_px = rods.bar.radius_mm * focal_px / float(np.linalg.norm(middle - camera.centre_mm))
    return Clear(
        camera, edges_px(still, background, max(_EDGE_BLUR * half_px, _LEAST_BLUR_PX)), half_px
    )


def find_bars(seen: Sequence[Clear], rods: Rods, motor_rad: tuple[float, float]) -> list[BarAxis]:
    """Coarse axes of what may be the bar, the most likely first: few pixels off, _KEPT at most.

    motor_rad: lowest and highest motor angle, between which the whisker touches.
    """
    radius, length = rods.bar.radius_mm, rods.wire.length_mm
    x = np.arange(10.0, length, _X_STEP * radius)
    count = int(np.ceil(np.ptp(motor_rad) * 0.5 * length / (_TOUCH_STEP * radius)))
    touch = np.linspace(*motor_rad, max(3, count))
    return likely(
        seen,
        (x, touch, _BETA_RAD, _PSI_RAD),
        lambda each: axis_from_angles(*each.T, rods.reach_mm(each[:, 0])),
        radius,
    )


def likely(
    seen: Sequence[Clear], values: Sequence[np.ndarray], axis_of: Callable, radius_mm: float
) -> list[BarAxis]:
    """The axes whose edges are the clearest, near a grid of hypotheses.

    values: of each of their numbers; axis_of: the axes (n, 3) of hypotheses (n, k).
    """

    def score(spread: float) -> Callable:
        near = [spread_out(one, spread * one.half_px) for one in seen]
        last = spread == _SPREADS[-1]
        counts, along_mm = (
            (_COUNTS, _ALONG_MM) if last else (np.maximum(_COUNTS, 0.0), _ALONG_MM[::2])
        )
        return partial(_clear_in_all, near, axis_of, radius_mm, counts, along_mm)

    looks = (
        (score(spread), spread / _SPREADS[0], 1.0, kept)
        for spread, kept in zip(_SPREADS, (_LESS, _LESS, _KEPT))
    )
    best = coarse_to_fine(values, half_steps(values), looks, 4.0, _STARTS)
    return [upward(BarAxis(point, along)) for point, along in zip(*vars(axis_of(best)).values())]


def half_steps(values: Sequence[np.ndarray]) -> np.ndarray:
    """Half of what each number's values (k,) are apart."""
    return 0.5 * np.array([one[1] - one[0] for one in values])


def coarse_to_fine(
    values: Sequence[np.ndarray],
    steps: np.ndarray,
    looks: Iterable[tuple[Callable, float, float, int]],
    apart: float,
    starts: int,
) -> np.ndarray:
    """The best hypotheses (n, k) by the last look, climbed to from so many of the grid of all values that are so many
    steps (k,) apart. looks: of each the score, what share of the steps it climbs by and may end apart, and how many it
    keeps."""
    grid = np.stack(np.meshgrid(*values, indexing="ij"), axis=-1).reshape(-1, len(values))
    best = grid
    for score, share, ends, kept in looks:
        if best is grid:
            best = apart_from_others(grid, score(grid), apart * steps, starts)
        best = apart_from_others(*climb(best, steps * share, score), ends * steps, kept)
    return best


def spread_out(seen: Clear, blur_px: float) -> Clear:
    """The same, blurred; with no edges at the picture's border, where lines end that leave it."""
    bell, _ = _kernels(blur_px)
    field = _filtered(seen.field, bell, bell)
    field[[0, -1]] = field[:, [0, -1]] = 0.0
    return replace(seen, field=field)


def _clear_in_all(
    seen: Sequence[Clear], axis_of: Callable, radius_mm: float, counts, along_mm, each
) -> np.ndarray:
    """How clear both edges of hypotheses (n, k) are, mean (n,) over the cameras; see `likely` and `both_edges`."""
    return np.mean(
        [both_edges(axis_of(each), one, radius_mm, counts, along_mm) for one in seen], axis=0
    )


def apart_from_others(
    each: np.ndarray, score: np.ndarray, apart: np.ndarray, most: int
) -> np.ndarray:
    """At most so many of the hypotheses (n, k), the best, of which no two lie within so much of each other (k,)."""
    left, chosen = each[np.argsort(score)[::-1]], []
    while len(left) and len(chosen) < most:
        chosen.append(left[0])
        left = left[np.any(np.abs(left - left[0]) > apart, axis=1)]
    return np.array(chosen)


def edges_px(grey: np.ndarray, background: np.ndarray, blur_px: float) -> np.ndarray:
    """Edges (h, w, 3) of a picture that its background does not have: how clear, by direction across (xx, xy, yy).

    From 0 to 1: beside the noise, and more than the light changes a little aside.
    """
    pictures = (np.asarray(picture, dtype=np.float32) for picture in (grey, background))
    bell, slope = _kernels(blur_px)
    seen, behind = (
        np.stack([_filtered(picture, *by) for by in ((slope, bell), (bell, slope))])
        for picture in pictures
    )
    light = np.sum(seen * behind, axis=0) / np.maximum(np.sum(behind**2, axis=0), 1e-12)
    left = seen - np.clip(light, 0.0, _MOST_LIGHT) * behind
    size = np.hypot(*left)
    aside, _ = _kernels(_ASIDE_BLURS * blur_px)
    clear = np.maximum(size - _filtered(size, aside, aside), 0.0)
    x, y = left / np.maximum(size, 1e-12)
    share = clear**2 / (clear**2 + (_OVER_NOISE * np.median(size)) ** 2 + 1e-12)
    return share[..., None] * np.stack([x * x, x * y, y * y], axis=-1)


def _kernels(blur_px: float) -> tuple[np.ndarray, np.ndarray]:
    """A Gaussian (n,) out to four blurs, and what takes the slope of a picture that it blurs."""
    reach = int(4.0 * blur_px + 0.5)
    place = np.arange(-reach, reach + 1)
    bell = np.exp(-0.5 * (place / blur_px) ** 2)
    bell /= np.sum(bell)
    return bell, place / blur_px**2 * bell


def _filtered(picture, along_rows, along_columns) -> np.ndarray:
    return cv2.sepFilter2D(picture, -1, along_rows, along_columns, borderType=cv2.BORDER_REFLECT)


def axis_from_angles(
    x_mm: ArrayLike,
    touch_rad: ArrayLike,
    beta_rad: ArrayLike,
    psi_rad: ArrayLike,
    reach_mm: ArrayLike,
) -> BarAxis:
    """The bar that a straight whisker first touches at distance x, at motor angle touch, with these slopes.

    All arguments (n,); reach_mm: between the axes of bar and whisker where they touch.
    """
    turn = rotation_z(np.asarray(touch_rad, dtype=float))
    zero = np.zeros_like(turn[..., 0, 0])
    a = np.stack(
        np.broadcast_arrays(
            np.sin(psi_rad) + zero,
            np.cos(psi_rad) * np.sin(beta_rad) + zero,
            np.cos(psi_rad) * np.cos(beta_rad) + zero,
        ),
        axis=-1,
    )
    n = np.stack([zero, np.cos(beta_rad) + zero, -np.sin(beta_rad) + zero], axis=-1)
    p = np.stack([x_mm + zero, zero, zero], axis=-1) + np.asarray(reach_mm)[..., None] * n
    return BarAxis(*(np.einsum("...ij,...j->...i", turn, v) for v in (p, a)))


def both_edges(
    axis: BarAxis, seen: Clear, radius_mm: float, counts: np.ndarray, along_mm: np.ndarray
) -> np.ndarray:
    """How clear both edges are of bars (n,) in a camera, up to 1, at these places beside each axis's point.

    counts: see _COUNTS.
    """
    groups = np.array_split(np.arange(len(axis.point_mm)), -(-len(axis.point_mm) // _AT_ONCE))
    return np.concatenate(
        [
            _both_edges(
                BarAxis(axis.point_mm[some], axis.direction[some]),
                seen,
                radius_mm,
                counts,
                along_mm,
            )
            for some in groups
        ]
    )


def _both_edges(axis: BarAxis, seen: Clear, radius_mm: float, counts, along_mm) -> np.ndarray:
    camera = seen.camera
    along = axis.point_mm[:, None] + along_mm[:, None] * axis.direction[:, None]
    sideways = np.cross(axis.direction, axis.point_mm - camera.centre_mm)
    sideways = radius_mm * sideways / np.linalg.norm(sideways, axis=-1, keepdims=True)
    px = camera.project(np.stack([along, along + sideways[:, None]]).reshape(-1, 3)).reshape(
        2, *along.shape[:2], 2
    )
    middle, aside = (
        np.stack([px[0], px[1] - px[0]]).transpose(0, 3, 1, 2).astype(np.float32) / HALF
    )  # by x and y
    x, y = np.gradient(middle, axis=-1)  # both edges run nearly as the middle does
    shares = np.stack([y * y, -2.0 * x * y, x * x], axis=-1) / (x * x + y * y)[..., None]
    at, counts = _AT[counts != 0.0].astype(np.float32), counts[counts != 0.0]
    px = middle + np.concatenate([at, -at])[:, None, None, None] * aside
    sides = _across(seen.field, px, shares).reshape(2, len(at), -1) * counts[:, None]
    best = np.max(sides, axis=1) + np.min(sides, axis=1, initial=0.0)
    return np.sqrt(np.prod(np.maximum(best, 0.0), axis=0))


def _across(field, px, shares) -> np.ndarray:
    """Mean (a, n) of the edges along lines of pixels (a, 2, n, t), by x and y. shares (n, t, 3): of the field's three
    parts across the line. Outside the picture, and at its very border, there is none."""
    height, width = field.shape[:2]
    column, row = (
        np.fmin(np.fmax(px[:, k], 0.0), size - 1.0) + 0.5 for k, size in enumerate((width, height))
    )
    seen = field.reshape(-1, 3).take(row.astype(np.intp) * width + column.astype(np.intp), axis=0)
    return np.einsum("antk,ntk->an", seen, shares) / px.shape[-1]


def climb(
    starts: np.ndarray, first_step: np.ndarray, score: Callable
) -> tuple[np.ndarray, np.ndarray]:
    """Best hypotheses (n, k) and their scores (n,): from each start to the best neighbour, by ever smaller steps.

    A neighbour differs in two numbers at most.
    """
    size = len(first_step)
    steps = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * size, indexing="ij"), axis=-1).reshape(
        -1, size
    )
    steps = first_step * steps[np.sum(steps != 0.0, axis=1) <= 2]
    best, part = starts.copy(), np.ones(len(starts))
    highest = np.full(len(starts), -np.inf)
    for _ in range(_MOST_CLIMBS):
        going = np.flatnonzero(part >= 0.5**_SHRINKS)
        if not len(going):
            break
        around = best[going, None] + part[going, None, None] * steps
        scores = score(around.reshape(-1, size)).reshape(len(going), -1)
        chosen, rows = np.argmax(scores, axis=1), np.arange(len(going))
        better = scores[rows, chosen]
        part[going] = np.where(better > highest[going] + 1e-3, part[going], 0.5 * part[going])
        best[going], highest[going] = around[rows, chosen], better
    return best, highest
