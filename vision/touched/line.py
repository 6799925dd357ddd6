"""The bar's line in one camera: two line points with their sigmas, from the evidence of both its
edges.

The bar stands still, so its frames are averaged. Its pixels near wires, clamps and the picture's
border are left out. For each transfer curve (gamma) that the camera may have, `posterior.py` gives
the posterior of shift and tilt. The cameras of a bench are of one kind, so they weigh the curves
together; the line is the mean over the curves that remain probable, and its covariance is the mean
covariance plus the scatter between curves. Where an edge is as dark as its background, or a
shadow's border may be the edge, the posterior is wide or has several peaks, and the sigma is as
wide.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.geometry.contact import BarAxis
from vision.geometry.optics import LEAST_PROBABILITY, Optics, probable, probable_gammas
from vision.geometry.rotation import unit
from vision.pictures.view import SATURATED
from vision.touched.object_view import ObjectView
from vision.touched.patches import FULL_SCALE
from vision.touched.pieces import ARM_MM, FEWEST_PIECES, at_arms, bar_pieces, beside_wires
from vision.touched.posterior import (
    Posterior,
    fit_coarse,
    fit_quick,
    refine,
)
from vision.wire.bands import Pieces
from vision.wire.points import SHARED, LinePoints

# [px] Largest error of an axis that its lines were fitted to. Study: bar_scenes.py.
NEAR_PX = 3.0
# [log] What a camera that shows the place but no edge takes from the score of a hypothesis: bars
# score 5 to 9. Study: bar_scenes.py.
_NO_EDGES = 3.0
# [px] Reach of a coarse pass: an axis fitted to coarse lines was 1.7 off at most in 61 path-traced
# scenes. Study: bar_scenes.py.
_COARSE_REACH_PX = 2.0
# [probability] Least one of a transfer curve after the first pass, which was wrong by a factor of
# 150 at most in 15 path-traced scenes. Study: chosen.
_LEAST_AT_FIRST = 1e-6
# [chi²] Largest deviance of one segment against a transfer curve: odds of 22 000 to one; a segment
# before printed squares may show anything. Study: bar_starts.py.
_LARGEST_DEVIANCE = 20.0
# [1] Least share of a bar's pixels that are there and not saturated; with fewer there is no line. 0.3
# moves nothing on the fixtures, by 0.7 a d_x moves by 0.6 sigma. Study: thresholds.py touched.line
# _LEAST_PIXEL_SHARE ….
_LEAST_PIXEL_SHARE = 0.5
# [chi²] Least tempered evidence for a bar against none: odds of 22 000 to one. Derived.
_LEAST_EVIDENCE = 20.0
# [1] Largest share of the lines that were tried first that remain: true bars leave 0.003 in the
# median and, of 147 in path-traced views, three more than this. Study: bar_scenes.py.
_LARGEST_UNRESOLVED = 1.0 / 6.0
# [px] Error of a bar's line in common to its points, by shift and by tilt, beyond its own sigma:
# times the root of the median temperature beyond 1. The true lines of 49 path-traced views are
# most probable with 0.011; 0.7 times as probable with 0.015, 0.03 times with 0.025. The second is
# half of it. Study: bar_scenes.py.
OVERSTATED_PX = np.array([0.015, 0.0075])
# [1] Sigma of a line's tilt over that of segments each with its own light: what the model of light
# lacks is alike along a bar, and cancels in its tilt. Over 147 path-traced views z of the tilt is
# 0.90 RMS with it. Where edges are not resolved, what is left open is not alike along a bar. Study:
# bar_scenes.py.
_TILT_SHARE = 0.65
# [1] Most correlation of shift and tilt that is handed on. Stated.
_MOST_CORRELATED = 0.8
# [1] Least temperature beyond 1: no light is so plain. Stated.
_LEAST_BEYOND = 0.1

# Posteriors of the bar's line by camera, then by gamma of the transfer curve.
CameraPosteriors = Mapping[str, Mapping[float, Posterior]]


@dataclass(frozen=True)
class BarLineEstimate:
    """The line of the bar's middle in one camera.

    points: two line points; `place` is mm along the axis they were expected on. line (2,): shift
    and tilt over ARM_MM, px. posteriors: by gamma of each probable transfer curve. pieces: the
    pixels it was measured in.
    evidence_for_bar, detection_score, unresolved_share: as of `Posterior`, averaged over the
    transfer curves.
    """

    points: LinePoints
    evidence_for_bar: float
    detection_score: float
    unresolved_share: float
    posteriors: Mapping[float, Posterior]
    line: np.ndarray
    pieces: Pieces

    @property
    def is_bar(self) -> bool:
        """Return whether the pixels show a bar."""
        return self.evidence_for_bar > _LEAST_EVIDENCE

    @property
    def has_edges(self) -> bool:
        """Return whether the pixels also resolve where its edges lie among the lines that were
        tried."""
        return self.is_bar and self.unresolved_share < _LARGEST_UNRESOLVED

    @property
    def joint_score(self) -> float:
        """Return what the line adds to the detection score of all cameras.

        A camera that does not resolve the edges counts against the bar. Where a highlight hides
        the edges of a bar, its score outweighs that.
        """
        score = max(self.detection_score, 0.0)
        return score if self.has_edges else score - _NO_EDGES

    def posteriors_about(self, pieces: Pieces) -> dict[float, Posterior]:
        """Return the posteriors by gamma, with their lines counted from the axis of other
        pieces."""
        place, foot, normal, _ = at_arms(pieces)
        offset = np.sum((self.points.px - foot) * normal, axis=1) / np.sum(normal**2, axis=1)
        levers = np.stack([np.ones(2), place / ARM_MM], axis=1)
        change = np.linalg.solve(levers, offset) - self.line
        moved = {}
        for gamma, posterior in self.posteriors.items():
            moved[gamma] = replace(posterior, line=posterior.line + change)
        return moved


def find_lines(views: Iterable[ObjectView], axis: BarAxis) -> dict[str, BarLineEstimate]:
    """Find the bar's line in each camera by one quick pass, for an axis that is up to NEAR_PX off,
    or no bar's.
    """
    lines = {}
    for name, pieces in clear_pieces(views, axis).items():
        posterior = fit_quick(pieces, np.zeros(2), NEAR_PX)
        lines[name] = _average_posteriors(pieces, {1.0: posterior}, np.ones(1))
    return lines


def measure_bars(
    views: Sequence[ObjectView],
    axis: BarAxis,
    before: Mapping[str, BarLineEstimate] | None = None,
) -> dict[str, BarLineEstimate]:
    """Measure the bar's line in the mean of each view's pictures, by camera.

    Cameras that show too little of the bar are left out. before: measured about an axis nearby;
    with it lines are measured finely, without it to some tenths of their sigma.
    """
    pieces = clear_pieces(views, axis)
    if not pieces:
        return {}
    optics = {view.camera.name: view.camera.optics for view in views}
    prior = probable_gammas(optics.values())
    if before:
        starts = _starts_nearby(pieces, before, optics)
    else:
        starts = _coarse_starts(pieces, prior, optics)
    refined = {}
    for name, by_gamma in starts.items():
        refined[name] = _refine(pieces[name], by_gamma, 2 if before else 1, optics[name])
    probabilities = _probable_gammas(refined, prior, LEAST_PROBABILITY)
    lines = {}
    for name, by_gamma in _under(refined, probabilities).items():
        weights = np.array(list(probabilities.values()))
        lines[name] = _average_posteriors(pieces[name], by_gamma, weights)
    return lines


def _starts_nearby(
    pieces: Mapping[str, Pieces],
    before: Mapping[str, BarLineEstimate],
    optics: Mapping[str, Optics],
) -> CameraPosteriors:
    """Return the posteriors of lines measured about an axis nearby; of other cameras new ones."""
    gammas = list(next(iter(before.values())).posteriors)
    starts = {}
    for name, some in pieces.items():
        if name in before:
            starts[name] = before[name].posteriors_about(some)
        else:
            coarse = _fit_coarse(some, gammas, optics[name])
            starts[name] = _refine(some, coarse, 1, optics[name])
    return starts


def _coarse_starts(
    pieces: Mapping[str, Pieces], prior: Mapping[float, float], optics: Mapping[str, Optics]
) -> CameraPosteriors:
    """Return the coarse posteriors under all transfer curves that are probable by these and by
    their prior probabilities."""
    starts = {name: _fit_coarse(some, prior, optics[name]) for name, some in pieces.items()}
    return _under(starts, _probable_gammas(starts, prior, _LEAST_AT_FIRST))


def _under(posteriors: CameraPosteriors, gammas: Iterable[float]) -> CameraPosteriors:
    """Return the posteriors under some of the transfer curves alone."""
    selected = {}
    for name, by_gamma in posteriors.items():
        selected[name] = {gamma: by_gamma[gamma] for gamma in gammas}
    return selected


def _fit_coarse(pieces: Pieces, gammas: Iterable[float], optics: Optics) -> dict[float, Posterior]:
    """Return the coarse posterior under each transfer curve."""
    coarse = {}
    for gamma in gammas:
        coarse[gamma] = fit_coarse(pieces, np.zeros(2), _COARSE_REACH_PX, gamma, optics)
    return coarse


def _refine(
    pieces: Pieces, posteriors: Mapping[float, Posterior], positions: int, optics: Optics
) -> dict[float, Posterior]:
    """Return the refined posterior under each transfer curve, with `positions` for each step
    across."""
    refined = {}
    for gamma, posterior in posteriors.items():
        refined[gamma] = refine(pieces, posterior, gamma, positions, optics)
    return refined


def clear_pieces(views: Iterable[ObjectView], axis: BarAxis) -> dict[str, Pieces]:
    """Return the clear pieces of the bar by camera, of cameras that show enough of it."""
    clear = {}
    for view in views:
        pieces = _read_pieces(view, axis)
        if len(pieces) < FEWEST_PIECES:
            continue
        if np.mean(pieces.weight > 0) > _LEAST_PIXEL_SHARE:
            clear[view.camera.name] = pieces
    return clear


def _probable_gammas(
    cameras: CameraPosteriors, prior: Mapping[float, float], least: float
) -> dict[float, float]:
    """Return the probability of each transfer curve that has at least so much, by its gamma.

    prior: its prior probability, by gamma.

    All segments of a bar are lit nearly alike, so that the evidence of their light counts once for
    a camera: its mean. The evidence of segments that no curve explains is tempered. The
    probabilities that are returned add up to 1.
    """
    gammas = next(iter(cameras.values()))
    total = -2.0 * np.log([prior[gamma] for gamma in gammas])
    for posteriors in cameras.values():
        temperature = np.max([one.temperature for one in posteriors.values()], axis=0)
        deviance = np.array([one.segment_deviance for one in posteriors.values()]) / temperature
        excess = deviance - deviance.min(axis=0)
        bounded = -2.0 * np.logaddexp(-0.5 * excess, -0.5 * _LARGEST_DEVIANCE)
        volume = [one.volume_deviance for one in posteriors.values()]
        total = total + bounded.mean(axis=1) + volume
    return probable(gammas, total, least)


def _average_posteriors(
    pieces: Pieces, posteriors: Mapping[float, Posterior], probabilities: np.ndarray
) -> BarLineEstimate:
    """Average the posteriors under all transfer curves, weighted by the curves' probabilities
    (g,)."""
    line, covariance = _average_lines(list(posteriors.values()), probabilities)

    def average(figure: Callable[[Posterior], float]) -> float:
        """Return the mean of a figure of the posteriors."""
        figures = [figure(one) for one in posteriors.values()]
        return float(probabilities @ np.array(figures))

    temperature = average(lambda one: float(np.median(one.temperature)))
    shared_px = np.sqrt(max(temperature - 1.0, _LEAST_BEYOND)) * OVERSTATED_PX
    unresolved_share = average(lambda one: one.unresolved_share)
    if unresolved_share < _LARGEST_UNRESOLVED:
        covariance = covariance * np.outer([1.0, _TILT_SHARE], [1.0, _TILT_SHARE])
    return BarLineEstimate(
        points=_points_of_line(pieces, line, covariance, shared_px),
        evidence_for_bar=average(lambda one: one.evidence_for_bar),
        detection_score=average(lambda one: one.detection_score),
        unresolved_share=unresolved_share,
        posteriors=posteriors,
        line=line,
        pieces=pieces,
    )


def _average_lines(
    posteriors: Sequence[Posterior], probabilities: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean line (2,) of posteriors, and its covariance (2, 2) with their scatter."""
    lines = np.array([one.line for one in posteriors])  # (g, 2)
    covariances = np.array([one.covariance for one in posteriors])
    line = probabilities @ lines
    scatter = (lines - line)[:, :, None] * (lines - line)[:, None, :]
    return line, np.tensordot(probabilities, covariances + scatter, axes=1)


def _read_pieces(view: ObjectView, axis: BarAxis) -> Pieces:
    """Read the pieces of the bar in the view's mean picture, in grey levels of 8 bit; saturated
    pixels weigh nothing."""
    pictures = view.pictures
    noise = pictures.noise.times(pictures.mean_share)
    pieces = bar_pieces(view, axis, noise)
    if len(pieces) < FEWEST_PIECES and len(view.crossing_px):
        crossed = bar_pieces(replace(view, wires_px=()), axis, noise)
        pieces = beside_wires(crossed, view.wires_px)
    pieces = pieces.below(SATURATED * pictures.full_scale)
    scale = FULL_SCALE / pictures.full_scale
    return replace(
        pieces,
        grey=pieces.grey * scale,
        background=pieces.background * scale,
        slope=pieces.slope * scale,
        weight=pieces.weight / scale,
        noise_behind=np.full(len(pieces), 1.0 / pictures.mean_share),
    )


def _points_of_line(pieces: Pieces, line, covariance, shared_px) -> LinePoints:
    """Return the line as two points at ± ARM_MM with their sigmas.

    line (2,), covariance (2, 2): shift and tilt, px. shared_px (2,): sigma of a further shift and
    tilt in common. Two points that err by themselves shift and tilt their line by as much; what
    either does more is in common to both.
    """
    place, foot, normal, _ = at_arms(pieces)
    lever = place / ARM_MM
    variance = np.diag(covariance)
    own = np.min(variance)
    most = _MOST_CORRELATED * own
    correlated = np.clip(covariance[0, 1], -most, most)
    sigma = np.sqrt(2.0 * (own + correlated * lever))
    normal = unit(normal)
    jacobian = np.stack([np.ones(2), lever], axis=1)  # of the points' offsets by shift and tilt
    in_common_px = np.sqrt(variance - own + shared_px**2)
    shared = np.hstack([jacobian * in_common_px, np.zeros((2, SHARED - 2))])
    offset = line[0] + line[1] * lever
    return LinePoints(foot + offset[:, None] * normal, normal, sigma, place, shared)
