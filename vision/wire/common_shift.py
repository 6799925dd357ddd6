"""By how much all of a rod's segments may lie to one side of where they were found.

Only the rod's rims show such a shift, and shading can stand in for it: where the background is even
and one rim is dark, pixels alone allow shifts of a third of the rod. What is known of light decides
then: its Fourier coefficients fall with their order, some lights' sooner than others' (`LightPrior`).
The posterior of the shift is summed over such priors and over blurs; its mean is the line, for where
it is wide its highest point may be far from most of it.

Light that hides an edge hides a share of the width: a common shift is in proportion to each
segment's half-width (`Pieces.relative_radius`), and its px are those at the mean half-width.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline
from scipy.special import logsumexp

from vision.geometry.robust import mean_and_sigma
from vision.wire.bands import Pieces
from vision.wire.gathered import GatheredEquations, exactly_if_needed
from vision.wire.light_prior import LightPrior
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import Knots, contrast_of

# [1] Lights whose evidence is averaged: diffuse or with a highlight, even along the rod or not. 36 lights
# of strengths 0.3 to 1.2, decays of 1 to 2 and changes of 0.05 to 0.6 leave errors of lines as they are;
# without those that change along the rod a wire that a bar shades lies 0.5 px beside its place at a
# stated 0.1. Study: wire_scenes.py.
_LIGHTS = tuple(
    LightPrior(strength=1.2, decay=decay, change=change)
    for decay, change in product((1.0, 2.0), (0.05, 0.3))
)
# [1] Of the widest shift: the grid below. Derived.
_PARTS = np.linspace(-1.0, 1.0, 15)
# [px] Shifts, densest about none; lines were off by 0.9 px at most. With nodes ten times finer means move
# by 0.06 sigma at most in nine of ten views. Study: wire_scenes.py.
_SHIFTS_PX = 1.5 * _PARTS * np.sqrt(np.abs(_PARTS))
# [1] Logarithms of blurs over the one found: over shifts up to 1 px the most probable blur changes
# by a tenth. Study: wire_scenes.py.
_LOG_BLURS = np.linspace(-0.3, 0.3, 5)
# [nodes] Of the spline through the grid, each way. Derived.
_FINE = 301
# [1] Of the evidence: what the model lacks is alike in all segments. In 153 views of 65 path-traced
# scenes lines are then 0.18 px RMS off and 1.1 sigma; with all of it sigmas are half as wide, with an
# eighth an even wire is stated at 0.2 px. Study: wire_scenes.py, lines.py.
EVIDENCE_COUNTS = 0.25


@dataclass(frozen=True)
class CommonShift:
    """The posterior of a shift of all segments, counted from where they lie.

    mean_px, sigma_px: of the shift. log_blur: mean logarithm of the blur over the one found there.
    """

    mean_px: float
    sigma_px: float
    log_blur: float


def common_shift(task: ShadedSegments, robust: np.ndarray, blur_px: float) -> CommonShift:
    """Return the posterior of a common shift of segments, over all probable lights and blurs.

    robust (s,): weight of each segment. blur_px: found where they lie.
    """
    blurs_px = blur_px * np.exp(_LOG_BLURS)
    evidences = EVIDENCE_COUNTS * evidences_of(task, robust, _SHIFTS_PX, blurs_px)[0]
    evidences += task.blur_deviation(np.log(blurs_px)) ** 2
    shift = np.linspace(_SHIFTS_PX[0], _SHIFTS_PX[-1], _FINE)
    log_blur = np.linspace(_LOG_BLURS[0], _LOG_BLURS[-1], _FINE)
    fine = RectBivariateSpline(_SHIFTS_PX, _LOG_BLURS, evidences)(shift, log_blur)
    density = np.exp(-0.5 * (fine - fine.min()))  # (shifts, blurs)
    mean_px, sigma_px = mean_and_sigma(shift, density.sum(axis=1))
    mean_log_blur, _ = mean_and_sigma(log_blur, density.sum(axis=0))
    return CommonShift(mean_px, sigma_px, mean_log_blur)


def best_evidences(
    task: ShadedSegments,
    shifts_px: np.ndarray,
    blurs_px: np.ndarray,
    *,
    wider: Sequence[float] = (1.0,),
) -> np.ndarray:
    """Return minus twice the log evidence (w,) of widths, at the best common shift and blur of each.

    Arguments as of `evidences_of`; here the prior of the blur is counted.
    """
    every = np.ones(len(task.pieces))
    evidences = evidences_of(task, every, shifts_px, blurs_px, wider=wider)
    evidences += task.blur_deviation(np.log(blurs_px)) ** 2
    fine = np.linspace(shifts_px[0], shifts_px[-1], _FINE)
    return np.min(CubicSpline(shifts_px, evidences, axis=1)(fine), axis=(1, 2))


def evidences_of(
    task: ShadedSegments,
    robust: np.ndarray,
    shifts_px: np.ndarray,
    blurs_px: np.ndarray,
    *,
    wider: Sequence[float] = (1.0,),
) -> np.ndarray:
    """Return minus twice the log evidence (w, m, b) of widths, common shifts and blurs.

    The evidence is averaged over _LIGHTS. The prior of the blur is not counted.
    robust (s,): weight of each segment. shifts_px (m,), blurs_px (b,). wider (w,): how many times as
    thick the rods are.
    """
    pieces = task.pieces
    knots = _spread(task.knots)
    models = list(product(wider, blurs_px))
    contrast = np.tile(_contrasts(pieces, models), len(shifts_px))

    def compute(each_pixel: bool) -> np.ndarray:
        """Return the evidences (m w b,), from summed pixels or from each pixel."""
        gathered = GatheredEquations(pieces, knots.weights(pieces), robust, each_pixel=each_pixel)
        normal = gathered.normal(shifts_px, models, task.terms)
        evidences = []
        for light in _LIGHTS:
            precision = light.precision(knots, task.terms)
            evidences.append(normal.evidences(precision, contrast))
        return _average(np.array(evidences))

    evidences = exactly_if_needed(compute)
    return evidences.reshape(len(shifts_px), len(wider), len(blurs_px)).transpose(1, 0, 2)


def _spread(knots: Knots) -> Knots:
    """Return knots of all turns, and so many fewer places along the rod that there are as many in all."""
    places = len(knots.place_mm)
    count = max(int(np.ceil(places / len(knots.turn_rad))), min(2, places))
    place_mm = np.linspace(knots.place_mm[0], knots.place_mm[-1], count)
    return Knots(place_mm, knots.turn_rad, knots.turns)


def _average(evidences: np.ndarray) -> np.ndarray:
    """Return minus twice the log of the mean evidence (g,) of lights, by those of each (k, g).

    Each counts as much as the evidence does.
    """
    log_mean = logsumexp(-0.5 * EVIDENCE_COUNTS * evidences, axis=0) - np.log(len(evidences))
    return -2.0 * log_mean / EVIDENCE_COUNTS


def _contrasts(pieces: Pieces, models: Sequence[tuple[float, float]]) -> np.ndarray:
    """Return the contrast (models,) of the rod, as many times as thick as each model says, grey
    levels.
    """
    contrasts = []
    for wider, _ in models:
        contrasts.append(contrast_of(replace(pieces, radius_px=wider * pieces.radius_px)))
    return np.array(contrasts)
