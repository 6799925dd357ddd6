"""The silhouette edges of a rounded object in one camera: line points beside a predicted outline.

The outline (occluding contour) of a ring, sphere or cone has two sides. Each side is divided into
segments of some 60 px, and the edge of each segment is measured by itself, with the model of
`vision.touched.evidence`: light on the object is free, beyond the edge lies the picture without
rods, and the lens blurs both. The deviance D = −2 log evidence of each shift u, under a blur β and
a transfer curve gamma, gives the mean and variance of the edge's position:

    p(u | β, gamma) ∝ exp(−D(u) / 2T)

Blur and transfer curve are shared by the whole camera; positions are averaged over both by their
probabilities. Which outlines are possible is left to the fit of the object.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from vision.geometry.rounded import RoundedAxis
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import SATURATED, View
from vision.touched.edges import EDGE_PX, FORMAL_TO_TRUE
from vision.touched.evidence import LitRod, compute_evidence
from vision.touched.posterior import estimate_temperature
from vision.touched.profiles import FULL_SCALE, OUTSIDE_PX, compute_profiles
from vision.wire.bands import Pieces
from vision.wire.points import LinePoints

# [segments] Of each side of an outline, some 60 px long each: as many as a bar has in 72 mm, and
# two. Set by eye. Study: rounded_seen.py.
SEGMENTS_OF_SIDE = 8
# [px] Depth inside an edge that is read: that of a thick bar, and one pixel more. Stated.
_INSIDE_PX = 9.0
# [px] Least half width: what is thinner has both edges in one. Stated.
_LEAST_HALF_PX = 5.0
# [px] Largest half width in the model: the light of what is wider changes no faster beside its
# edge, and profiles grow no longer. Stated.
_LARGEST_HALF_PX = 40.0
# [px] Lens blurs of the first pass, as of a bar. Stated.
_BLURS_PX = (0.6, 0.85, 1.2, 1.7)
# [1] Lens blurs of the fine pass, over that of the first. Stated.
_FINE_BLUR_FACTORS = np.exp(np.array([-0.2, -0.1, 0.0, 0.1, 0.2]))
# [px] The one lens blur of a coarse pass, as of a bar. Stated.
_COARSE_BLURS_PX = (1.0,)
# [steps] Of the grid between positions of a coarse pass, as of a bar. Stated.
_COARSE_EVERY = 2
# [px] Distance outside an edge within which nothing else of the object may lie: where the
# background is read. Stated.
_CLEAR_PX = 5.0
# [1] Transfer curves, as of a bar's line. Under the wrong one an outline is read half a pixel too
# far out. Study: rounded_seen.py.
_GAMMAS = (1.0, 2.2)
# [probability] Least one of a transfer curve, over the most probable one's. Study: chosen.
_LEAST_PROBABILITY = 0.001
# [pieces] Of a side, each of 12 px: fewer constrain no texture. Stated.
_FEWEST_PIECES = 4
# [px] How far off a fitted outline may be. Stated.
_FINE_REACH_PX = 1.5
# [1] Largest sigma over reach of an edge: it is 0.58 where the edge may be anywhere, which is
# none. Such points would hold an outline at its prediction. Derived.
_LARGEST_SIGMA_SHARE = 0.4
# [chi²] Least tempered evidence for an edge in a segment against none: odds of 20 to one. Derived.
_LEAST_EVIDENCE = 6.0


@dataclass(frozen=True)
class SilhouetteEdges:
    """The edges beside an outline in one camera.

    points: line points, their `place` is the distance at which the sight grazes, mm. segments: how
    many were tried.
    blur_px: of the lens. log_evidence: of these edges against edges anywhere within reach.
    """

    points: LinePoints
    segments: int
    blur_px: float
    log_evidence: float = 0.0


@dataclass(frozen=True)
class _OutlineSide:
    """One side of a predicted outline as n stations, about a pixel apart.

    px, normal (n, 2): in the picture, normals outwards. distance_mm (n,): from the camera. is_clear
    (n,): whether only background lies outside. half_px (n,): half the object's width.
    """

    px: np.ndarray
    normal: np.ndarray
    distance_mm: np.ndarray
    is_clear: np.ndarray
    half_px: np.ndarray

    @property
    def arc_px(self) -> np.ndarray:
        """Return the length (n,) along the side up to each station."""
        steps = np.linalg.norm(np.diff(self.px, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])


@dataclass(frozen=True)
class _EdgePosterior:
    """The edge of k segments of one side under one transfer curve and b blurs.

    deviance (b,): of each blur. mean, variance (b, k): of the edge's shift, px. evidence (k,): 2
    log of the odds of an edge against none. curve_deviance: of the transfer curve.
    """

    deviance: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
    evidence: np.ndarray
    curve_deviance: float


def measure_silhouette_edges(
    views: Sequence[View],
    axis: RoundedAxis,
    radius_mm: float,
    wires_px: Mapping[str, Sequence[np.ndarray]],
    settings: VisionSettings,
    reach_px: float,
    before: Mapping[str, SilhouetteEdges] | None = None,
    *,
    coarse: bool = False,
) -> dict[str, SilhouetteEdges]:
    """Measure by camera the edges beside a predicted outline that is at most reach_px off.

    before: of an earlier pass, whose blurs allow a fine one. coarse: by one quick pass. wires_px:
    by camera lines (m, 2) where the wire lies in some frame.
    """
    before = before or {}
    outlines = []
    for view in views:
        name = view.camera.name
        sides = _predict_sides(view, axis, radius_mm, settings)
        wires = wires_px.get(name, [])
        outlines.append(
            _fit_outline(view, sides, wires, settings, reach_px, before.get(name), coarse)
        )
    deviance = np.sum([outline.curve_deviances for outline in outlines], axis=0)
    weights = np.exp(-0.5 * (deviance - deviance.min()))
    weights = np.where(weights < _LEAST_PROBABILITY * weights.max(), 0.0, weights)
    probabilities = weights / weights.sum()
    edges = {}
    for view, outline in zip(views, outlines):
        edges[view.camera.name] = outline.average(probabilities)
    return edges


@dataclass(frozen=True)
class _OutlinePosterior:
    """Both sides of an outline in one camera, their pieces, and their edges' posteriors.

    posteriors: by transfer curve, then by side. blurs_px (b,): of these. reach_px: how far edges
    were tried.
    """

    sides: Sequence[_OutlineSide]
    pieces: Sequence[Pieces]
    posteriors: Sequence[Sequence[_EdgePosterior]]
    blurs_px: Sequence[float]
    reach_px: float

    @property
    def curve_deviances(self) -> list[float]:
        """Return −2 log evidence of each transfer curve.

        All segments of a side are lit nearly alike, so that their evidence counts once.
        """
        return [sum(side.curve_deviance for side in curve) for curve in self.posteriors]

    def average(self, probabilities: np.ndarray) -> SilhouetteEdges:
        """Return the edges averaged over transfer curves, with these probabilities, and over
        blurs."""
        if not self.sides:
            none = LinePoints(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0))
            return SilhouetteEdges(none, 0, _BLURS_PX[1])
        weights = []  # by transfer curve the weight (b,) of each blur
        for probability, curve in zip(probabilities, self.posteriors):
            weights.append(probability * _normalise(sum(side.deviance for side in curve)))
        segments = 0
        points = []
        for number in range(len(self.sides)):
            of_side, is_edge = self._average_side(number, probabilities, weights)
            points.append(of_side.select(is_edge))
            segments += len(is_edge)
        joined = {}
        for field in fields(LinePoints):
            joined[field.name] = np.concatenate([getattr(one, field.name) for one in points])
        joined = LinePoints(**joined)
        blur_px = float(np.exp(np.log(self.blurs_px) @ np.sum(weights, axis=0)))
        density = 2.0 * self.reach_px / (np.sqrt(2.0 * np.pi) * joined.sigma_px)
        return SilhouetteEdges(joined, segments, blur_px, float(np.sum(np.log(density))))

    def _average_side(self, number: int, probabilities, weights) -> tuple[LinePoints, np.ndarray]:
        """Return the line points of one side's segments, and which of them (k,) show an edge."""
        side = self.sides[number]
        mean = 0.0
        square = 0.0
        evidence = 0.0
        for probability, weight, curve in zip(probabilities, weights, self.posteriors):
            posterior = curve[number]
            mean = mean + weight @ posterior.mean
            square = square + weight @ (posterior.variance + posterior.mean**2)
            evidence = evidence + probability * posterior.evidence
        formal_px = np.sqrt(np.maximum(square - mean**2, 0.0))
        sigma_px = np.hypot(FORMAL_TO_TRUE * formal_px, EDGE_PX)
        at = _middle_stations(self.pieces[number], len(mean))
        normal = side.normal[at]
        px = side.px[at] + mean[:, None] * normal
        points = LinePoints(px, normal, sigma_px, side.distance_mm[at])
        is_edge = (evidence > _LEAST_EVIDENCE) & (formal_px < _LARGEST_SIGMA_SHARE * self.reach_px)
        return points, is_edge


def _fit_outline(
    view: View,
    sides: Sequence[_OutlineSide],
    wires_px: Sequence[np.ndarray],
    settings: VisionSettings,
    reach_px: float,
    before: SilhouetteEdges | None,
    coarse: bool,
) -> _OutlinePosterior:
    """Return the posteriors of the edges beside predicted sides in one camera, as of
    `measure_silhouette_edges`."""
    is_fine = before is not None
    reach_px = _FINE_REACH_PX if is_fine else reach_px
    used = []
    pieces = []
    for side in sides:
        of_side = _read_pieces(view, side, wires_px, settings, reach_px)
        if len(of_side) >= _FEWEST_PIECES:
            used.append(side)
            pieces.append(of_side)
    blurs_px = before.blur_px * _FINE_BLUR_FACTORS if is_fine else _BLURS_PX
    gammas = _GAMMAS
    every = 1
    if coarse:
        blurs_px = _COARSE_BLURS_PX
        gammas = _GAMMAS[:1]
        every = _COARSE_EVERY
    posteriors = []
    for gamma in gammas:
        curve = [_fit_side(some, reach_px, blurs_px, gamma, every, is_fine) for some in pieces]
        posteriors.append(curve)
    return _OutlinePosterior(used, pieces, posteriors, blurs_px, reach_px)


def _fit_side(
    pieces: Pieces,
    reach_px: float,
    blurs_px: Sequence[float],
    gamma: float,
    every: int,
    is_fine: bool,
) -> _EdgePosterior:
    """Return the posterior of the edge in each segment of a side, under one transfer curve."""
    profiles = compute_profiles(pieces, SEGMENTS_OF_SIDE, reach_px, gamma)
    rod = LitRod(profiles)
    evidences = []
    for blur_px in blurs_px:
        evidence = compute_evidence(
            rod,
            reach_px,
            float(blur_px),
            positions=2 if is_fine else 1,
            with_smooth_priors=is_fine,
            every=every,
        )
        evidences.append(evidence)
    best = min(evidences, key=lambda evidence: evidence.least_deviance.sum())
    temperature = estimate_temperature(best, profiles)
    deviances = []
    means = []
    variances = []
    for evidence in evidences:
        log_density = -0.5 * evidence.bar_deviance / temperature[:, None, None]  # (k, g, r)
        total = logsumexp(log_density, axis=(1, 2))
        probability = np.sum(np.exp(log_density - total[:, None, None]), axis=2)
        mean = probability @ evidence.shift_px
        deviances.append(-2.0 * total.sum())
        means.append(mean)
        variances.append(probability @ evidence.shift_px**2 - mean**2)
    return _EdgePosterior(
        np.array(deviances),
        np.array(means),
        np.array(variances),
        (best.no_bar_deviance - best.least_deviance) / temperature,
        float(np.mean(best.least_deviance / temperature)),
    )


def _normalise(deviance: np.ndarray) -> np.ndarray:
    """Return the probabilities (b,) that belong to deviances."""
    density = np.exp(-0.5 * (deviance - deviance.min()))
    return density / density.sum()


def _middle_stations(pieces: Pieces, segments: int) -> np.ndarray:
    """Return the station (segments,) in the middle of each segment, divided as by
    `compute_profiles`."""
    members = np.array_split(np.argsort(pieces.place), segments)
    return np.array([int(np.median(pieces.source[some])) for some in members])


def _predict_sides(
    view: View, axis: RoundedAxis, radius_mm: float, settings: VisionSettings
) -> list[_OutlineSide]:
    """Predict both sides of the outline, a station every pixel or so; none where a part is not
    before the camera."""
    camera = view.camera
    points, normals = axis.silhouette(camera.centre_mm, radius_mm, settings.bar_reach_mm, 400)
    px = camera.project(points.reshape(-1, 3)).reshape(2, -1, 2)
    if not np.all(np.isfinite(px)):
        return []
    half_px = 0.5 * np.linalg.norm(px[0] - px[1], axis=1)
    sides = []
    for side_points, outwards, side_px in zip(points, normals, px):
        jacobians = camera.project_with_jacobians(side_points)[1]
        normal = np.einsum("nij,nj->ni", jacobians, outwards)
        px_per_mm = np.linalg.norm(normal, axis=1)
        outside = side_points + (_CLEAR_PX / px_per_mm)[:, None] * outwards
        is_hidden = axis.hides_itself(camera.centre_mm, outside, radius_mm)
        is_clear = (half_px > _LEAST_HALF_PX) & ~is_hidden
        distance_mm = np.linalg.norm(side_points - camera.centre_mm, axis=1)
        normal = normal / px_per_mm[:, None]
        sides.append(_OutlineSide(side_px, normal, distance_mm, is_clear, half_px))
    return sides


def _read_pieces(
    view: View,
    side: _OutlineSide,
    wires_px: Sequence[np.ndarray],
    settings: VisionSettings,
    reach_px: float,
) -> Pieces:
    """Read the pixels beside one side that lie clear of the wires, as pieces along it."""
    inside_px = reach_px + _INSIDE_PX
    outside_px = reach_px + OUTSIDE_PX + 1.0
    pixels = _pixels_near(view.mean.shape, side, inside_px, outside_px)
    if not len(pixels):
        return _no_pieces()
    _, nearest = cKDTree(side.px).query(pixels)
    displacement = pixels - side.px[nearest]
    offset = np.sum(displacement * side.normal[nearest], axis=1)
    tangent = np.stack([-side.normal[:, 1], side.normal[:, 0]], axis=1)
    forward = np.sum(np.gradient(side.px, axis=0) * tangent, axis=1)
    tangent *= np.sign(forward)[:, None]
    arc_px = side.arc_px
    along = arc_px[nearest] + np.sum(displacement * tangent[nearest], axis=1)
    keep = side.is_clear[nearest] & (offset < outside_px)
    keep &= offset > -np.minimum(inside_px, side.half_px[nearest])
    keep &= (along >= 0.0) & (along <= arc_px[-1])
    if len(wires_px) and view.itself is None:
        wire = np.concatenate([_dense(line) for line in wires_px])
        margin_px = settings.bar_piece_px / 2 + 5.0
        distance, _ = cKDTree(wire).query(pixels, distance_upper_bound=margin_px)
        keep &= ~np.isfinite(distance)
    return _as_rows(view, side, pixels[keep], offset[keep], along[keep], settings.bar_piece_px)


def _dense(line: np.ndarray) -> np.ndarray:
    """Return a line (m, 2) sampled every two pixels, without points that are not finite."""
    line = line[np.all(np.isfinite(line), axis=1)]
    if len(line) < 2:
        return line
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    arc_px = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.arange(0.0, arc_px[-1], 2.0)
    return np.stack([np.interp(at, arc_px, line[:, k]) for k in range(2)], axis=1)


def _pixels_near(
    shape: tuple[int, int], side: _OutlineSide, inside_px: float, outside_px: float
) -> np.ndarray:
    """Return the whole pixels (n, 2), x and y, up to inside_px within and outside_px beyond the
    stations."""
    height, width = shape
    steps = np.arange(-inside_px, outside_px + 0.5, 0.5)
    near = np.round(side.px[:, None] + steps[:, None] * side.normal[:, None])
    near = near.astype(int).reshape(-1, 2)
    is_within = np.all((near >= 0) & (near < np.array([width, height])), axis=1)
    index = np.unique(near[is_within, 1] * width + near[is_within, 0])
    return np.stack([index % width, index // width], axis=1).astype(float)


def _no_pieces() -> Pieces:
    """Return pieces without any pixel."""
    empty = np.zeros((0, 1))
    none = np.zeros(0)
    points = np.zeros((0, 2))
    source = np.zeros(0, dtype=int)
    return Pieces(empty, empty, empty, empty, empty, empty, none, none, points, points, source)


def _as_rows(view: View, side: _OutlineSide, pixels, offset, along, length_px: int) -> Pieces:
    """Return pieces of length_px along the side, with their pixels as rows, filled up with pixels
    of no weight.

    pixels (n, 2): whole, x and y. offset, along (n,): across and along the side, px. `place` of a
    piece is along it, px; `source` is its station.
    """
    column, row = pixels.astype(int).T
    grey = view.mean[row, column]
    background = view.background[row, column]
    arc_px = side.arc_px
    station = np.clip(np.searchsorted(arc_px, along), 0, len(arc_px) - 1)
    gradient = _gradient(view.background, row, column)
    slope = np.sum(gradient * side.normal[station], axis=1)
    noise = view.noise.times(view.mean_share)
    is_used = np.isfinite(grey) & np.isfinite(background)
    is_used &= np.nan_to_num(grey) < SATURATED * view.full_scale
    scale = FULL_SCALE / view.full_scale
    weight = np.where(is_used, 1.0 / noise.sigma(np.where(is_used, grey, 0.0)), 0.0) / scale
    piece = (along // length_px).astype(int)
    order = np.argsort(piece, kind="stable")
    numbers, first, count = np.unique(piece[order], return_index=True, return_counts=True)
    if not len(numbers):
        return _no_pieces()
    rows = np.repeat(np.arange(len(numbers)), count)
    places = np.arange(len(order)) - np.repeat(first, count)

    def table(values: np.ndarray, empty: float) -> np.ndarray:
        """Return the pixels' values as a table (pieces, pixels)."""
        filled = np.full((len(numbers), int(count.max())), empty)
        filled[rows, places] = np.nan_to_num(values[order], nan=empty)
        return filled

    half_px = min(float(np.median(side.half_px[side.is_clear])), _LARGEST_HALF_PX)
    middle = (numbers + 0.5) * length_px
    station = np.clip(np.searchsorted(arc_px, middle), 0, len(arc_px) - 1)
    slopes = table(slope * scale, 0.0)
    return Pieces(
        offset_px=table(offset + half_px, 0.0),
        grey=table(grey * scale, 1.0),
        background=table(background * scale, 1.0),
        slope=slopes,
        curvature=np.zeros_like(slopes),
        weight=table(weight, 0.0),
        place=middle,
        radius_px=np.full(len(numbers), half_px),
        foot_px=side.px[station],
        normal=side.normal[station],
        source=station,
    )


def _gradient(picture, row, column) -> np.ndarray:
    """Return the central differences (n, 2) of a picture by x and y at whole pixels."""
    height, width = picture.shape
    right = picture[row, np.minimum(column + 1, width - 1)]
    left = picture[row, np.maximum(column - 1, 0)]
    below = picture[np.minimum(row + 1, height - 1), column]
    above = picture[np.maximum(row - 1, 0), column]
    return 0.5 * np.stack([right - left, below - above], axis=1)
