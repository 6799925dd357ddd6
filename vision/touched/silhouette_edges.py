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
from dataclasses import dataclass
from itertools import compress

import numpy as np
from scipy.special import logsumexp, softmax

from vision.geometry.optics import LEAST_PROBABILITY, probable_gammas
from vision.geometry.rounded import RoundedAxis
from vision.touched.edges import EDGE_PX, FORMAL_TO_TRUE
from vision.touched.evidence import Evidence, LitRod, compute_evidence
from vision.touched.object_view import ObjectView
from vision.touched.posterior import (
    BLURS_PX,
    QUICK_BLUR_PX,
    best_of,
    coarse_steps,
    estimate_temperature,
)
from vision.touched.profiles import compute_profiles
from vision.touched.silhouette_pixels import OutlineSide, predict_sides, read_pieces
from vision.wire.bands import Pieces
from vision.wire.points import LinePoints

# [segments] Of each side of an outline, some 60 px long each: as many as a bar has in 72 mm, and
# two. By 6 a cone's slope moves by 0.9 sigma, by 12 a ring's by 0.2. Study: thresholds.py
# touched.silhouette_edges SEGMENTS_OF_SIDE … --sessions FOLDER.
SEGMENTS_OF_SIDE = 8
# [1] Lens blurs of the fine pass, over that of the first. Stated.
_FINE_BLUR_FACTORS = np.exp(np.array([-0.2, -0.1, 0.0, 0.1, 0.2]))
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
class _EdgePass:
    """How the edges near an outline are measured in one pass.

    reach_px: how far from the outline. gammas: of the transfer curves. blurs_px (b,): of the lens.
    every: steps of the grid between positions. is_fine: with two positions a step, and with all
    priors of the light.
    """

    reach_px: float
    gammas: Sequence[float]
    blurs_px: Sequence[float] = BLURS_PX
    every: int = 1
    is_fine: bool = False


def _choose_pass(
    reach_px: float, gammas: Sequence[float], before: SilhouetteEdges | None, coarse: bool
) -> _EdgePass:
    """Return a coarse pass, a fine one where there is an earlier one, or the first one."""
    if coarse:
        return _EdgePass(reach_px, gammas, (QUICK_BLUR_PX,), coarse_steps(QUICK_BLUR_PX))
    if before is None:
        return _EdgePass(reach_px, gammas)
    return _EdgePass(_FINE_REACH_PX, gammas, before.blur_px * _FINE_BLUR_FACTORS, is_fine=True)


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
    views: Sequence[ObjectView],
    axis: RoundedAxis,
    reach_px: float,
    before: Mapping[str, SilhouetteEdges] | None = None,
    *,
    coarse: bool = False,
) -> dict[str, SilhouetteEdges]:
    """Measure by camera the edges near a predicted outline that is at most reach_px off.

    before: of an earlier pass, whose blurs allow a fine one. coarse: by one quick pass.
    """
    before = before or {}
    prior = probable_gammas(view.camera.optics for view in views)
    gammas = list(prior)[:1] if coarse else list(prior)
    outlines = {}
    for view in views:
        name = view.camera.name
        one_pass = _choose_pass(reach_px, gammas, before.get(name), coarse)
        sides = predict_sides(view, axis)
        pieces = [read_pieces(view, side, one_pass.reach_px) for side in sides]
        outlines[name] = _fit_outline(sides, pieces, one_pass)
    deviance = np.sum([outline.curve_deviances for outline in outlines.values()], axis=0)
    probabilities = _probable_alone(deviance - 2.0 * np.log([prior[gamma] for gamma in gammas]))
    return {name: outline.average(probabilities) for name, outline in outlines.items()}


def _probable_alone(deviance: np.ndarray) -> np.ndarray:
    """Return the probabilities (g,) of transfer curves, 0 of those that are hardly possible."""
    weights = np.exp(-0.5 * (deviance - deviance.min()))
    weights = np.where(weights < LEAST_PROBABILITY, 0.0, weights)
    return weights / weights.sum()


@dataclass(frozen=True)
class _OutlinePosterior:
    """Both sides of an outline in one camera, their pieces, and their edges' posteriors.

    posteriors: by transfer curve, then by side. measured: how they were.
    """

    sides: Sequence[OutlineSide]
    pieces: Sequence[Pieces]
    posteriors: Sequence[Sequence[_EdgePosterior]]
    measured: _EdgePass

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
            return SilhouetteEdges(none, 0, BLURS_PX[1])
        weights = self._blur_weights(probabilities)
        segments = 0
        edges = []
        for number in range(len(self.sides)):
            points, is_edge = self._average_side(number, probabilities, weights)
            edges.append(points.select(is_edge))
            segments += len(is_edge)
        edges = LinePoints.join(edges)
        log_blurs = np.log(self.measured.blurs_px)
        blur_px = float(np.exp(log_blurs @ np.sum(weights, axis=0)))
        density = 2.0 * self.measured.reach_px / (np.sqrt(2.0 * np.pi) * edges.sigma_px)
        return SilhouetteEdges(edges, segments, blur_px, float(np.sum(np.log(density))))

    def _blur_weights(self, probabilities: np.ndarray) -> list[np.ndarray]:
        """Return by transfer curve the probability (b,) of curve and blur."""
        weights = []
        for probability, curve in zip(probabilities, self.posteriors):
            deviance = sum(side.deviance for side in curve)
            weights.append(probability * softmax(-0.5 * deviance))
        return weights

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
        station = _middle_stations(self.pieces[number], len(mean))
        is_sharp = formal_px < _LARGEST_SIGMA_SHARE * self.measured.reach_px
        return side.points(station, mean, sigma_px), is_sharp & (evidence > _LEAST_EVIDENCE)


def _fit_outline(
    sides: Sequence[OutlineSide], pieces: Sequence[Pieces], one_pass: _EdgePass
) -> _OutlinePosterior:
    """Return the posteriors of the edges near those sides of an outline that have enough pieces."""
    is_used = [len(of_side) >= _FEWEST_PIECES for of_side in pieces]
    sides = list(compress(sides, is_used))
    pieces = list(compress(pieces, is_used))
    posteriors = []
    for gamma in one_pass.gammas:
        posteriors.append([_fit_side(of_side, one_pass, gamma) for of_side in pieces])
    return _OutlinePosterior(sides, pieces, posteriors, one_pass)


def _fit_side(pieces: Pieces, one_pass: _EdgePass, gamma: float) -> _EdgePosterior:
    """Return the posterior of the edge in each segment of a side, under one transfer curve."""
    profiles = compute_profiles(pieces, SEGMENTS_OF_SIDE, one_pass.reach_px, gamma)
    rod = LitRod(profiles)
    evidences = []
    for blur_px in one_pass.blurs_px:
        evidence = compute_evidence(
            rod,
            one_pass.reach_px,
            float(blur_px),
            positions=2 if one_pass.is_fine else 1,
            with_smooth_priors=one_pass.is_fine,
            every=one_pass.every,
        )
        evidences.append(evidence)
    best = best_of(evidences)
    temperature = estimate_temperature(best, profiles)
    moments = [_moments_of_edge(evidence, temperature) for evidence in evidences]
    deviances, means, variances = map(np.array, zip(*moments))
    return _EdgePosterior(
        deviances,
        means,
        variances,
        (best.no_bar_deviance - best.least_deviance) / temperature,
        float(np.mean(best.least_deviance / temperature)),
    )


def _moments_of_edge(
    evidence: Evidence, temperature: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Return the deviance of one blur, and mean and variance (k,) of the edge's shift under it."""
    log_density = -0.5 * evidence.bar_deviance / temperature[:, None, None]  # (k, g, r)
    total = logsumexp(log_density, axis=(1, 2))
    probability = np.sum(np.exp(log_density - total[:, None, None]), axis=2)
    mean = probability @ evidence.shift_px
    return -2.0 * total.sum(), mean, probability @ evidence.shift_px**2 - mean**2


def _middle_stations(pieces: Pieces, segments: int) -> np.ndarray:
    """Return the station (segments,) in the middle of each segment, divided as by
    `compute_profiles`."""
    members = np.array_split(np.argsort(pieces.place), segments)
    return np.array([int(np.median(pieces.source[some])) for some in members])
