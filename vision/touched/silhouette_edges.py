"""The silhouette edges of a rounded object in one camera: line points near a predicted outline.

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
from scipy.special import logsumexp

from vision.geometry.rounded import RoundedAxis
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View
from vision.touched.edges import EDGE_PX, FORMAL_TO_TRUE
from vision.touched.evidence import LitRod, compute_evidence
from vision.touched.posterior import estimate_temperature
from vision.touched.profiles import compute_profiles
from vision.touched.silhouette_pixels import OutlineSide, predict_sides, read_pieces
from vision.wire.bands import Pieces
from vision.wire.points import LinePoints

# [segments] Of each side of an outline, some 60 px long each: as many as a bar has in 72 mm, and
# two. Set by eye. Study: rounded_seen.py.
SEGMENTS_OF_SIDE = 8
# [px] Lens blurs of the first pass, as of a bar. Stated.
_BLURS_PX = (0.6, 0.85, 1.2, 1.7)
# [1] Lens blurs of the fine pass, over that of the first. Stated.
_FINE_BLUR_FACTORS = np.exp(np.array([-0.2, -0.1, 0.0, 0.1, 0.2]))
# [px] The one lens blur of a coarse pass, as of a bar. Stated.
_COARSE_BLURS_PX = (1.0,)
# [steps] Of the grid between positions of a coarse pass, as of a bar. Stated.
_COARSE_EVERY = 2
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
    """The edges near an outline in one camera.

    points: line points, their `place` is the distance at which the sight grazes, mm. segments: how
    many were tried.
    blur_px: of the lens. log_evidence: of these edges against edges anywhere within reach.
    """

    points: LinePoints
    segments: int
    blur_px: float
    log_evidence: float = 0.0


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
    """Measure by camera the edges near a predicted outline that is at most reach_px off.

    before: of an earlier pass, whose blurs allow a fine one. coarse: by one quick pass. wires_px:
    by camera lines (m, 2) where the wire lies in some frame.
    """
    before = before or {}
    outlines = []
    for view in views:
        name = view.camera.name
        sides = predict_sides(view, axis, radius_mm, settings)
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

    sides: Sequence[OutlineSide]
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
    sides: Sequence[OutlineSide],
    wires_px: Sequence[np.ndarray],
    settings: VisionSettings,
    reach_px: float,
    before: SilhouetteEdges | None,
    coarse: bool,
) -> _OutlinePosterior:
    """Return the posteriors of the edges near predicted sides in one camera, as of
    `measure_silhouette_edges`."""
    is_fine = before is not None
    reach_px = _FINE_REACH_PX if is_fine else reach_px
    used = []
    pieces = []
    for side in sides:
        of_side = read_pieces(view, side, wires_px, settings, reach_px)
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
