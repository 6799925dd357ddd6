"""Line points of the wire in every frame, read in narrow bands beside where it is expected."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.newton import descend
from vision.geometry.rods import Wire
from vision.geometry.silhouette import outline
from vision.lines.bands import Pieces, cut_pieces, read_band
from vision.lines.binned import binned, without
from vision.lines.cylinder import WAVES
from vision.lines.points import LinePoints, Observed
from vision.lines.shading import Knots, Located, fit_shading, line_points, locate, wave_prior
from vision.pictures.view import View

_BLURS_PX = (0.5, 0.65, 0.8, 0.95, 1.1, 1.3, 1.6, 2.0, 2.5, 3.2)
_ALL_WAVES = 11
_BIN_PX = 0.3
_NODES = 81  # of a curve, a millimetre apart: in between it is straight to a thousandth of a pixel
_STEPS, _LONGEST = np.array([0.1, 0.1, 0.1, 0.08]), np.array([0.5, 0.4, 0.4, 0.3])  # shift, tilt, bow (px), log blur
_SETTLED = 0.05
_FEW_PIECES, _ENOUGH_PIECES = 30, 100
_STILL_SIGMAS = 0.7  # of a piece's own, below which another round would only trade its shift for shading
_WORST_SIGMA_PX = 0.5
# A piece whose misfit is this many times the median piece's is not a picture of the rod alone.
_WORST_MISFIT = 6.0
_PLAIN_MISFIT = 3.0  # the same, for what the light is learnt from


def wire_pieces(view: View, curves: Mapping[int, Curves], wire: Wire, length_px: int, margin_px: int) -> Pieces:
    """Pieces of the wire in all frames of one camera; curves: predicted centreline of each frame."""
    outlines = [_outline(view.camera, curve, wire) for curve in curves.values()]
    # one width for all bands: a wire may pass from one whole pixel of radius to the next within a whisk
    half = int(np.ceil(max(np.nanmax(radius) for *_, radius in outlines))) + margin_px
    bands = [read_band(view.frames[frame], view.background, middle, arc, radius, half)
             for frame, (arc, middle, radius) in zip(curves, outlines)]
    pieces = cut_pieces(bands, length_px, view.noise)
    return replace(pieces, source=np.array(list(curves))[pieces.source])  # the frame's index, not the band's number


def _outline(camera: Camera, curve: Curves, wire: Wire) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arc (n,) in mm, middle (n, 2) and half-width (n,) in px of the wire."""
    arc = np.linspace(2.0, wire.length_mm - 1.0, _NODES)
    points, tangents = curve.at(arc)
    directions = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
    return arc, *outline(camera, points, directions, wire.radius_mm(arc))


def clear_of_bar(pieces: Pieces, middle_px, radius_px, margin_px: float) -> np.ndarray:
    """Which pieces (s,) lie outside the bar's outline, given by its middle (m, 2) and half-width (m,); NaN where it
    passes behind the camera and hides nothing."""
    away = np.linalg.norm(pieces.foot_px[:, None] - middle_px[None], axis=2)
    return np.fmin.reduce(away - radius_px[None], axis=1, initial=np.inf) > margin_px


def _best_blur(pieces: Pieces, knots: Knots) -> float:
    """The lens blur, px: the one under which the shading explains the pieces best."""
    pieces = _some(pieces, _ENOUGH_PIECES * len(knots.turn_rad))
    prior = wave_prior(pieces, WAVES)
    return min(_BLURS_PX, key=lambda blur: fit_shading(pieces, blur, WAVES, knots, prior=prior)[1])


def settle(pieces: Pieces, knots: Knots, search_px: float) -> tuple[Pieces, float]:
    """Pieces brought from a rough curve to where they are, all within search_px, and the lens blur in px.

    A rough curve passes for a wider blur, and a blur that is wrong by a sixth moves the whole wire by up to a pixel
    before an even wall, where shading takes up the rest. So the pieces are first brought in line with each other;
    then blur and what all frames share, shift, tilt and bow, are looked for together, with all waves that a narrow
    highlight has: what they lack passes for blur.
    """
    rough, blurred = binned(pieces, _BIN_PX)
    near, found, typical = _by_turns(rough, _best_blur(rough, knots), WAVES, knots, 2)
    near = near.moved(found.shift_px)
    misfit = _shared_misfit(near, found, typical, knots)
    starts = [np.array([shift, 0.0, 0.0, np.log(blur)]) for shift in np.arange(-search_px, search_px + 0.01, 0.375)
              for blur in _BLURS_PX[1:8:2]]
    best = min(starts, key=lambda start: misfit(start[:3], np.exp(start[3]), _FEW_PIECES))
    best, _, _ = descend(lambda q: misfit(q[:3], np.exp(q[3]), _ENOUGH_PIECES), best, _STEPS, _LONGEST, _SETTLED)
    return pieces.moved(_apart(near, pieces) + _bow(near) @ best[:3]), without(np.exp(best[3]), blurred)


def settle_again(pieces: Pieces, blur_px: float, knots: Knots) -> Pieces:
    """Pieces brought from a near curve to where they are, under a lens blur that is known.

    Shading and positions by turns hardly move what all frames share: before an even background, shading takes up the
    rest. Left to them, a line stays where the fit, misled by another camera, puts its curve.
    """
    rough, blurred = binned(pieces, _BIN_PX)
    blur = float(np.hypot(blur_px, np.sqrt(blurred)))
    _, found, typical = _by_turns(rough, blur, WAVES, knots, 1)
    misfit = _shared_misfit(rough, found, typical, knots)
    moves, _, _ = descend(lambda q: misfit(q, blur, _ENOUGH_PIECES), np.zeros(3), _STEPS[:3], _LONGEST[:3], _SETTLED)
    return pieces.moved(_bow(pieces) @ moves)


def _bow(pieces: Pieces) -> np.ndarray:
    """How far each piece moves (s, 3) by a shift, a tilt and a bow of one pixel that all frames share."""
    lever = 2.0 * (pieces.place - pieces.place.min()) / max(np.ptp(pieces.place), 1e-9) - 1.0
    return np.stack([np.ones(len(pieces)), lever, lever**2 - 1.0 / 3.0], axis=1)


def _shared_misfit(near: Pieces, found: Located, typical: float, knots: Knots) -> Callable:
    """Misfit by shift, tilt and bow (3,) of all frames in px, blur in px, and by how many pieces a turn; of those whose
    own misfit is an ordinary one."""
    plain = found.chi2 < _PLAIN_MISFIT * max(typical, 0.5)
    shown, bow = near.select(plain), _bow(near)[plain]
    prior, turns = wave_prior(shown, _ALL_WAVES), len(knots.turn_rad)

    def misfit(moves, blur_px: float, count: int) -> float:
        every = slice(None, None, max(1, round(len(shown) / (count * turns))))
        some = shown.select(every).moved(bow[every] @ moves)
        return fit_shading(some, blur_px, _ALL_WAVES, knots, prior=prior)[1]

    return misfit


def _some(pieces: Pieces, count: int) -> Pieces:
    """About `count` of them, spread over all: what a camera's pieces have in common shows in these."""
    return pieces.select(slice(None, None, max(1, round(len(pieces) / count))))


def trace(pieces: Pieces, blur_px: float, terms: int, knots: Knots, rounds: int = 5, *,
          last: bool = True) -> tuple[Pieces, Located, float]:
    """Shading and positions by turns; the pieces come back as near as they were brought, with what is left to move.

    Also the median misfit (chi² per pixel). The pieces must be near; from a rough curve, see `settle`. All turns are
    taken with averaged pixels, but for the last where this is the last look.
    """
    rough, blurred = binned(pieces, _BIN_PX)
    near, found, misfit = _by_turns(rough, np.hypot(blur_px, np.sqrt(blurred)), terms, knots, rounds - 1)
    there = pieces.moved(_apart(near, pieces))
    if not last:
        return there, found, misfit
    return _by_turns(there.moved(found.shift_px), blur_px, terms, knots, 1, _robust(found.chi2))


def _by_turns(pieces: Pieces, blur_px: float, terms: int, knots: Knots, rounds: int,
              robust=None) -> tuple[Pieces, Located, float]:
    """`trace` with the pixels as they are. robust (s,): weights of the pieces to begin with."""
    prior, found = wave_prior(pieces, terms), None
    for _ in range(rounds):
        pieces = pieces if found is None else pieces.moved(found.shift_px)
        shading, _ = fit_shading(pieces, blur_px, terms, knots, robust, prior)
        found = locate(pieces, shading, rounds=1)
        robust = _robust(found.chi2)
        if np.quantile(np.abs(found.shift_px) / found.sigma_px, 0.9) < _STILL_SIGMAS:
            break
    return pieces, found, float(np.median(found.chi2))


def _apart(near: Pieces, pieces: Pieces) -> np.ndarray:
    """How far (s,) the same pieces lie from each other along their normals, px."""
    return np.sum((near.foot_px - pieces.foot_px) * pieces.normal, axis=1)


def _robust(misfit) -> np.ndarray:
    """Weights (s,) that leave out pieces whose misfit is well above the median."""
    return 1.0 / np.maximum(misfit / max(np.median(misfit), 1e-9), 1.0) ** 2


def to_points(pieces: Pieces, found: Located, misfit: float) -> tuple[LinePoints, np.ndarray]:
    """Trusted line points and the source of each, with sigmas that hold the misfit."""
    return line_points(pieces, found, worst_chi2=_WORST_MISFIT * max(misfit, 0.5),
                       worst_sigma_px=_WORST_SIGMA_PX)


def observed(points: LinePoints, source, camera: int, frames: Sequence[int]) -> list[Observed]:
    """One Observed per frame that has points; frames: the frame index of each position of the whisk."""
    return [Observed(position, camera, points.select(source == frame))
            for position, frame in enumerate(frames) if np.any(source == frame)]
