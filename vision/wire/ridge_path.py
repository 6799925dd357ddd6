"""A coarse path of a thin object between two points of one picture: its middle to a pixel or two, and
its width.

A pixel lies on the middle of a thin object where the picture has an edge at the same distance on
both sides, one rising and one falling: the weaker of the two is its medialness at that half-width.
A step alone has none, whatever its height. The path is the cheapest one in the space of place and
half-width (Li and Yezzi 2007), so that it does not change from a thick object to the border of one.
Dark and bright objects count alike.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt, maximum_filter
from skimage.graph import MCP_Geometric

from vision.geometry.refusals import Refused
from vision.geometry.robust import robust_sigma
from vision.pictures.pyramid import full_px, shrunk_picture, shrunk_px

# [px] Half-widths that are tried, each 1.4 times the one before: objects 2 to 45 px wide. Stated.
_RADII_PX = np.array([1.0, 1.4, 2.0, 2.8, 4.0, 5.7, 8.0, 11.3, 16.0, 22.6])
# [px] Half-widths above this are looked for in a picture shrunk by two, and so on. Derived.
_LARGEST_RADIUS_PX = 2.9
# [directions] Over half a turn: between two of them the edge of an object loses a fiftieth. Derived.
_DIRECTIONS = 12
# [px] Blur of the gradients. Derived.
_GRADIENT_PX = 1.0
# [1] Of the medialness at the weaker of the two ends: more counts as this, so that a stronger
# object does not draw the path of a weaker one. By 0.5 one of eight lines of path-traced wires more
# is refused, by 1 another one. Study: thresholds.py wire.ridge_path _PLAIN_SHARE ….
_PLAIN_SHARE = 0.7
# [sigma] Of the gradients over the whole picture: less is no object. By 2 the lines of path-traced
# wires are the same, by 4 one that was refused is found. Study: thresholds.py wire.ridge_path
# _PLAIN_SIGMAS ….
_PLAIN_SIGMAS = 3.0
# [1] A pixel that shows no object costs one over this, fifty times a plain one's. Half or twice it
# moves lines of path-traced wires by less than 0.01 px. Study: thresholds.py wire.ridge_path
# _LEAST_SCORE ….
_LEAST_SCORE = 0.02
# [nodes] Of the space of the path, by which memory and time are bounded: a second. Stated.
_MOST_NODES = 1_000_000
# [px] The given ends are this near to the object's middle. Stated.
_END_REACH_PX = 6.0
# [px] Nearer ends give no line: a few segments. Stated.
_LEAST_APART_PX = 20.0
# [steps] What a change to the next half-width costs, in pixels of the path. By 1 one of eight lines
# of path-traced wires more is refused; by 4 they are off by 0.174 px RMS in place of 0.187, and
# points scatter by 1.39 sigma in place of 1.32. Study: thresholds.py wire.ridge_path
# _RADIUS_STEP ….
_RADIUS_STEP = 2.0
# [1] Half-widths of one object differ by less than so much in their logarithm. Stated.
_SAME_OBJECT = 0.75
# [1] Another half-width is taken where its edges are so many times as steep. By 1.2 two of eight
# lines of path-traced wires more are refused; by 2 they are the same. Study: thresholds.py
# wire.ridge_path _MUCH_PLAINER ….
_MUCH_PLAINER = 1.5
# [pixels] Of a path, of which one is taken to say how plain it is. Stated.
_EVERY = 3
# [1] What the best path's pixels cost more where another one is looked for. Derived.
_DEAR = 50.0
# [sigma] Of the gradients: median of the weaker edge along a path that surely shows an object; noise
# and the border of two areas have 3. Study: tests/vision/wire/test_between_ends.py.
_LEAST_SIGMAS = 4.0
# [1] Mean score along a path that surely shows an object; noise has 0.15. Study:
# tests/vision/wire/test_between_ends.py.
_LEAST_MEAN_SCORE = 0.35
# [1] Another path that costs less than so many times the best is reported. It moves no line. Study:
# thresholds.py wire.ridge_path _ALIKE_COST ….
_ALIKE_COST = 1.5


@dataclass(frozen=True)
class CoarsePath:
    """A path (n, 2) px between two points and the half-width (n,) px of the object along it.

    score: mean over the path of what medialness is over that of a plain object, 0 to 1. cost: of the
    whole path over that of the cheapest one.
    """

    px: np.ndarray
    radius_px: np.ndarray
    score: float
    cost: float = 1.0


def find_paths(
    grey: np.ndarray, start_px: Sequence[float], end_px: Sequence[float]
) -> list[CoarsePath]:
    """Find the cheapest path along a thin object between two points (x, y), and one that costs
    nearly as little.

    grey (h, w). The points are up to some _END_REACH_PX from the object's middle. Raises Refused
    ("end_outside", "ends_together", "no_line") where a point lies outside the picture, both are the
    same or no object joins the two.
    """
    ends = _checked_ends(grey.shape, start_px, end_px)
    space = medialness(grey)
    plain = _PLAIN_SHARE * min(np.max(_around(space.layers, end)[0]) for end in ends)
    first = _search(space, plain, ends)
    radius_px, plain, noise = _plainest(space, first.best)
    if plain < _LEAST_SIGMAS * noise:
        raise _no_object(
            ends,
            f"weaker edge is {plain / noise:.1f} times the noise, {_LEAST_SIGMAS:g} are needed",
        )
    found = _search(space.of_object(radius_px), _PLAIN_SHARE * plain, ends)
    best = found.best
    if best.score < _LEAST_MEAN_SCORE:
        raise _no_object(
            ends,
            f"edges are {best.score:.2f} of a plain object's, {_LEAST_MEAN_SCORE:g} are needed",
        )
    other = found.other()
    return [found.refined()] + ([other] if other is not None else [])


def _no_object(ends: np.ndarray, found: str) -> Refused:
    """Return the refusal of two ends (2, 2) that no object joins; found: of the best path's edges."""
    joined = f"{_place(ends[0])} and {_place(ends[1])}"
    return Refused(
        f"no thin object joins {joined}: along the best path the {found}", code="no_line"
    )


@dataclass(frozen=True)
class Medialness:
    """How steep the weaker of two opposite edges is about each pixel.

    radius_px (r,): half-widths. layers (r, h, w): grey levels per px of the picture in which a
    half-width is searched. noise (r,): of the gradients.
    """

    radius_px: np.ndarray
    layers: np.ndarray
    noise: np.ndarray

    def of_object(self, radius_px: float) -> "Medialness":
        """Return the half-widths that an object of about this one may have."""
        some = np.abs(np.log(self.radius_px / radius_px)) < _SAME_OBJECT
        return Medialness(self.radius_px[some], self.layers[some], self.noise[some])

    def scores(self, plain: float) -> np.ndarray:
        """Return the layers over those of a plain object, at most 1."""
        level = np.maximum(plain, _PLAIN_SIGMAS * self.noise).astype(np.float32)
        return np.minimum(self.layers / level[:, None, None], 1.0)


def _plainest(space: Medialness, path: CoarsePath) -> tuple[float, float, float]:
    """Return the half-width at which a path is plainest, the median medialness and the noise there.

    That of the path is kept where no other is much plainer: its middle may lie half of the half-width
    from the path.
    """
    column, row = np.rint(path.px[::_EVERY]).astype(int).T
    medians = []
    for radius_px, layer in zip(space.radius_px, space.layers):
        reach = 2 * int(np.ceil(0.5 * radius_px)) + 1
        medians.append(np.median(maximum_filter(layer, reach)[row, column]))
    own = int(np.argmin(np.abs(space.radius_px - np.median(path.radius_px))))
    best = int(np.argmax(medians))
    if medians[best] < _MUCH_PLAINER * medians[own]:
        best = own
    return float(space.radius_px[best]), float(medians[best]), float(space.noise[best])


def _place(px: np.ndarray) -> str:
    """Return a point as text."""
    return f"({px[0]:.0f}, {px[1]:.0f})"


def _checked_ends(
    shape: tuple[int, ...], start_px: Sequence[float], end_px: Sequence[float]
) -> np.ndarray:
    """Return both ends (2, 2); raises Refused where one lies outside the picture."""
    ends = np.array([start_px, end_px], dtype=float)
    most = np.array([shape[1], shape[0]]) - 1.0
    for end in ends:
        if not np.all((end >= 0.0) & (end <= most)):
            raise Refused(
                f"the end {_place(end)} lies outside the picture of {shape[1]} x {shape[0]} px",
                code="end_outside",
            )
    apart_px = float(np.linalg.norm(ends[1] - ends[0]))
    if apart_px < _LEAST_APART_PX:
        raise Refused(
            f"the ends are {apart_px:.0f} px apart, {_LEAST_APART_PX:g} are needed",
            code="ends_together",
        )
    return ends


def medialness(grey: np.ndarray) -> Medialness:
    """Return how plainly each pixel of a picture (h, w) is the middle of a thin object."""
    layers = []
    noises = []
    for radius_px in _RADII_PX:
        scale = 1
        while radius_px / scale > _LARGEST_RADIUS_PX:
            scale *= 2
        small = shrunk_picture(grey.astype(np.float32), scale)
        layer, noise = _medialness_at(small, float(radius_px) / scale)
        layers.append(_enlarged(layer, scale, grey.shape))
        noises.append(noise)
    return Medialness(_RADII_PX, np.stack(layers), np.array(noises))


def _around(
    layers: np.ndarray, px: np.ndarray, reach_px: float = _END_REACH_PX
) -> tuple[np.ndarray, int, int]:
    """Return the layers (r, …) within some pixels of a point (x, y), and their first row and column."""
    _, height, width = layers.shape
    reach = max(1, int(np.ceil(reach_px)))
    row = int(np.clip(round(px[1]), 0, height - 1))
    column = int(np.clip(round(px[0]), 0, width - 1))
    rows = slice(max(row - reach, 0), row + reach + 1)
    columns = slice(max(column - reach, 0), column + reach + 1)
    return layers[:, rows, columns], rows.start, columns.start


def _enlarged(layer: np.ndarray, scale: int, shape: tuple[int, ...]) -> np.ndarray:
    """Return a layer of a shrunk picture at the full picture's (h, w)."""
    if scale == 1:
        return layer
    size = (layer.shape[1] * scale, layer.shape[0] * scale)
    large = cv2.resize(layer, size, interpolation=cv2.INTER_LINEAR)
    missing = [(0, shape[0] - size[1]), (0, shape[1] - size[0])]
    return np.pad(large, missing, mode="edge")


def _medialness_at(grey: np.ndarray, radius_px: float) -> tuple[np.ndarray, float]:
    """Return the medialness (h, w) at one half-width, grey levels per px, and the gradients' noise."""
    smooth = cv2.GaussianBlur(grey, (0, 0), _GRADIENT_PX, borderType=cv2.BORDER_REPLICATE)
    down, right = np.gradient(smooth)
    noise = np.hypot(robust_sigma(down), robust_sigma(right)) / np.sqrt(2.0)
    best = np.zeros_like(grey)
    for angle in np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS:
        normal = np.array([np.cos(angle), np.sin(angle)])
        slope_across = normal[0] * right + normal[1] * down
        here = _weaker_edge(slope_across, radius_px * normal)
        best = np.maximum(best, here)
    return best, max(float(noise), 1e-6)


def _weaker_edge(gradient: np.ndarray, to_edge_px: np.ndarray) -> np.ndarray:
    """Return the weaker of two gradients (h, w), to_edge_px (x, y) before and behind each pixel, where
    one rises and the other falls; 0 elsewhere.
    """
    one = _moved(gradient, to_edge_px)
    other = _moved(gradient, -to_edge_px)
    weaker = np.minimum(np.abs(one), np.abs(other))
    return np.where(one * other < 0.0, weaker, 0.0)


def _moved(picture: np.ndarray, by_px: np.ndarray) -> np.ndarray:
    """Return for each pixel the value at a place by_px (x, y) farther on."""
    matrix = np.array([[1.0, 0.0, by_px[0]], [0.0, 1.0, by_px[1]]])
    size = picture.shape[::-1]
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(picture, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)


def _pooled(layer: np.ndarray, scale: int) -> np.ndarray:
    """Return the largest of each square of `scale` pixels."""
    if scale == 1:
        return layer
    height = layer.shape[0] // scale
    width = layer.shape[1] // scale
    squares = layer[: height * scale, : width * scale].reshape(height, scale, width, scale)
    return squares.max(axis=(1, 3))


def _nearest_middles(scores: np.ndarray, px: np.ndarray, scale: int) -> list[tuple[int, ...]]:
    """Return the nodes (radius, row, column) within _END_REACH_PX of a point that are the best
    middles there, one a half-width.
    """
    near, top, left = _around(scores, px, _END_REACH_PX / scale)
    nodes = []
    for k, layer in enumerate(near):
        down, right = np.unravel_index(np.argmax(layer), layer.shape)
        nodes.append((k, top + int(down), left + int(right)))
    return nodes


def _cheapest(
    cost: np.ndarray, first: list[tuple[int, ...]], last: list[tuple[int, ...]]
) -> tuple[np.ndarray, float]:
    """Return the nodes (n, 3) of the cheapest path from any of some nodes to any of others, and its
    cost.
    """
    search = MCP_Geometric(cost, fully_connected=True, sampling=(_RADIUS_STEP, 1.0, 1.0))
    costs, _ = search.find_costs(first, last, find_all_ends=False)
    end = min(last, key=lambda node: costs[node])
    return np.array(search.traceback(end)), float(costs[end])


@dataclass(frozen=True)
class _PathSearch:
    """A search of the cheapest path, in a picture shrunk by `scale`.

    scores (r, h, w): of the full picture. cost (r, h / scale, w / scale). nodes (n, 3): of the path.
    firsts, lasts: nodes about the two ends.
    """

    radius_px: np.ndarray
    scores: np.ndarray
    scale: int
    cost: np.ndarray
    firsts: list[tuple[int, ...]]
    lasts: list[tuple[int, ...]]
    nodes: np.ndarray
    total: float

    @property
    def best(self) -> CoarsePath:
        """Return the cheapest path."""
        return self._path(self.nodes, 1.0)

    def _path(self, nodes: np.ndarray, share: float) -> CoarsePath:
        """Return the path of nodes (n, 3) in the full picture; share: its cost over the least."""
        changes_pixel = np.any(np.diff(nodes[:, 1:], axis=0) != 0, axis=1)
        is_first_in_pixel = np.append(True, changes_pixel)
        radius, row, column = nodes[is_first_in_pixel].T
        shrunk = np.stack([column, row], axis=1).astype(float)
        scores = _score_of(self.cost[tuple(nodes.T)])
        return CoarsePath(
            px=full_px(shrunk, self.scale),
            radius_px=self.radius_px[radius],
            score=float(np.mean(scores)),
            cost=share,
        )

    def refined(self) -> CoarsePath:
        """Return the cheapest path at full resolution, within some pixels of the coarse one."""
        path = self.best
        if self.scale == 1:
            return path
        row, column = self._pixels_of(path)
        distance, layer = self._from_path(row, column, path.radius_px)
        score = np.take_along_axis(self.scores, layer[None], axis=0)[0]
        cost = np.where(distance <= 2.0 * self.scale, _cost_of(score), -1.0)  # −1: never crossed
        search = MCP_Geometric(cost, fully_connected=True)
        first = (int(row[0]), int(column[0]))
        last = (int(row[-1]), int(column[-1]))
        search.find_costs([first], [last])
        nodes = np.array(search.traceback(last))
        radius_px = self.radius_px[layer[tuple(nodes.T)]]
        return CoarsePath(nodes[:, ::-1].astype(float), radius_px, path.score)

    def _pixels_of(self, path: CoarsePath) -> tuple[np.ndarray, np.ndarray]:
        """Return rows (n,) and columns (n,) of a path in the full picture."""
        height, width = self.scores.shape[1:]
        column, row = np.rint(path.px).astype(int).T
        return np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)

    def _from_path(
        self, row: np.ndarray, column: np.ndarray, radius_px: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return how far each pixel of the full picture is from a path, (h, w) px, and the number
        (h, w) of the half-width at the path's nearest pixel.

        row, column, radius_px (n,): of the path.
        """
        shape = self.scores.shape[1:]
        off_path = np.ones(shape, dtype=bool)
        off_path[row, column] = False
        layer_on_path = np.zeros(shape, dtype=int)
        layer_on_path[row, column] = np.searchsorted(self.radius_px, radius_px)
        distance, nearest = distance_transform_edt(off_path, return_indices=True)
        return distance, layer_on_path[tuple(nearest)]

    def other(self) -> CoarsePath | None:
        """Return the cheapest path off the best one; None where it costs much more.

        Off it is farther than the object's width, but for a quarter of it at either end.
        """
        near = self._near_middle()
        dear = np.where(near[None], _DEAR * self.cost, self.cost)
        nodes, _ = _cheapest(dear, self.firsts, self.lasts)
        share = self._cost_along(nodes) / max(self.total, 1e-9)
        if np.any(near[nodes[:, 1], nodes[:, 2]]) or share > _ALIKE_COST:
            return None
        return self._path(nodes, share)

    def _near_middle(self) -> np.ndarray:
        """Return which pixels (h / scale, w / scale) lie within the object's width of the middle half
        of the best path, bool.
        """
        quarter = len(self.nodes) // 4
        middle = self.nodes[quarter : len(self.nodes) - quarter]
        off_path = np.ones(self.cost.shape[1:], dtype=bool)
        off_path[middle[:, 1], middle[:, 2]] = False
        usual_radius_px = float(np.median(self.radius_px[self.nodes[:, 0]]))
        width = 2.0 * usual_radius_px / self.scale
        return distance_transform_edt(off_path) <= width + 2.0

    def _cost_along(self, nodes: np.ndarray) -> float:
        """Return the cost of a path of nodes (n, 3), changes of the half-width not counted."""
        along = np.linalg.norm(np.diff(nodes[:, 1:], axis=0), axis=1)
        values = self.cost[tuple(nodes.T)]
        return float(np.sum(0.5 * (values[1:] + values[:-1]) * along))


def _cost_of(score: np.ndarray) -> np.ndarray:
    """Return what a pixel of a score costs."""
    return 1.0 / (score**2 + _LEAST_SCORE)


def _score_of(cost: np.ndarray) -> np.ndarray:
    """Return the score of a pixel that costs so much."""
    return np.sqrt(np.maximum(1.0 / cost - _LEAST_SCORE, 0.0))


def _search(space: Medialness, plain: float, ends: np.ndarray) -> _PathSearch:
    """Find the cheapest path between two ends (2, 2) where an object of medialness `plain` scores 1."""
    scores = space.scores(plain)
    scale = max(1, int(np.ceil(np.sqrt(scores.size / _MOST_NODES))))
    coarse = np.stack([_pooled(layer, scale) for layer in scores])
    cost = _cost_of(coarse)
    firsts, lasts = (_nearest_middles(coarse, shrunk_px(end, scale), scale) for end in ends)
    nodes, total = _cheapest(cost, firsts, lasts)
    return _PathSearch(space.radius_px, scores, scale, cost, firsts, lasts, nodes, total)
