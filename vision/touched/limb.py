"""The outline of a rounded object in one camera: where its edges are, stretch by stretch.

As the line of a bar is read (see `vision.touched.evidence`), but that each stretch of the outline has one edge and speaks
for itself: what lies within is lit in any way, what lies beyond is the picture without rods, and both are blurred by
the lens. Nothing is said here of which outlines are possible: the fit knows that.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from vision.geometry.rounded import Rounded
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import SATURATED, View
from vision.touched.edges import EDGE_PX, FORMAL_TO_TRUE
from vision.touched.evidence import LitRod, compute_evidence
from vision.touched.posterior import estimate_temperature
from vision.touched.profiles import FULL_SCALE, OUTSIDE_PX, compute_profiles
from vision.wire.bands import Pieces
from vision.wire.points import LinePoints

# [1] Of each side of an outline, some 60 px long each: as many as a bar has in 72 mm, and two.
# Set by eye. Study: rounded_seen.py.
STRETCHES = 8
# [px] Of the object that are read beside an edge: as of a thick bar (`_RIM_PX`), and one. Stated.
_INSIDE_PX = 9.0
# [px] Half a width: what is thinner has both edges in one. Stated.
_LEAST_HALF_PX = 5.0
# [px] Half a width; the light of what is wider changes no faster beside its edge, and profiles
# grow no longer. Stated.
_WIDEST_PX = 40.0
# [px, 1] Lens blurs of a first look, as of a bar; of a next one, over what the first had. Stated.
_BLURS_PX, _FINE_BLURS = (0.6, 0.85, 1.2, 1.7), np.exp(np.array([-0.2, -0.1, 0.0, 0.1, 0.2]))
# [px, steps] Of a quick look: as of a bar. Stated.
_ROUGH_BLURS_PX, _ROUGH_EVERY = (1.0,), 2
# [px] Beside an edge, where nothing else of the object may be: what is read of the background.
# Stated.
_CLEAR_PX = 5.0
# [1] Transfer curves, as of a bar's line. By the wrong one an outline is read half a pixel too
# far out. Study: rounded_seen.py.
_GAMMAS = (1.0, 2.2)
# [chance] Of a transfer curve that still counts. Study: chosen.
_LEAST_CHANCE = 0.001
# [pieces] Of a side, each of 12 px: fewer tell no texture. Stated.
_FEWEST_PIECES = 4
# [px] How far off a fitted outline may be. Stated.
_FINE_REACH_PX = 1.5
# [1] Sigma over reach of an edge: 0.58 where it may be anywhere, which is none. Such points would
# hold an outline where it was taken to be. Derived.
_MOST_UNSURE = 0.4
# [chi²] Tempered, for an edge in a stretch and against none: odds of 20 to one. Derived.
_LEAST_EVIDENCE = 6.0


@dataclass(frozen=True)
class Limb:
    """Points of an outline, their `place` how far away the sight grazes, mm; of how many
    stretches that were asked for an edge; the lens blur, px; and how much more probable edges are there than anywhere
    within reach: a logarithm."""

    points: LinePoints
    asked: int
    blur_px: float
    said: float = 0.0


@dataclass(frozen=True)
class _Side:
    """One side of a predicted outline: its stations in the picture, how far away each is, whether it is before
    nothing but the background, and half the object's width there."""

    px: np.ndarray
    normal: np.ndarray
    far_mm: np.ndarray
    clear: np.ndarray
    half_px: np.ndarray


def measure_limbs(
    views: Sequence[View],
    axis: Rounded,
    radius_mm: float,
    wires_px: Mapping[str, Sequence[np.ndarray]],
    settings: VisionSettings,
    reach_px: float,
    before: Mapping[str, Limb] | None = None,
    *,
    rough: bool = False,
) -> dict[str, Limb]:
    """By camera the edges beside a predicted outline that is at most reach_px off. before: of a look that told the
    blurs, by which they are measured finely. rough: by one quick look. wires_px: by camera lines (m, 2) where the wire
    lies in some frame."""
    before = before or {}
    seen = [
        _Seen.of(
            view,
            axis,
            radius_mm,
            wires_px.get(view.camera.name, []),
            settings,
            reach_px,
            before.get(view.camera.name),
            rough,
        )
        for view in views
    ]
    against = np.sum([one.of_curves for one in seen], axis=0)
    chances = np.exp(-0.5 * (against - against.min()))
    chances = np.where(chances < _LEAST_CHANCE * chances.max(), 0.0, chances)
    return {view.camera.name: one.limb(chances / chances.sum()) for view, one in zip(views, seen)}


@dataclass(frozen=True)
class _Seen:
    """What one camera shows beside a predicted outline: its sides, their pieces, and looks at these by transfer curve,
    under these blurs."""

    sides: Sequence["_Side"]
    pieces: Sequence[Pieces]
    looks: Sequence[Sequence["_Look"]]
    blurs_px: Sequence[float]
    reach_px: float

    @classmethod
    def of(
        cls,
        view: View,
        axis: Rounded,
        radius_mm: float,
        wires_px: Sequence[np.ndarray],
        settings: VisionSettings,
        reach_px: float,
        before: Limb | None,
        rough: bool,
    ) -> "_Seen":
        """Arguments as of `measure_limbs`."""
        reach_px = reach_px if before is None else _FINE_REACH_PX
        pairs = [
            (side, _pieces(view, side, wires_px, settings, reach_px))
            for side in _sides(view, axis, radius_mm, settings)
        ]
        pairs = [(side, some) for side, some in pairs if len(some) >= _FEWEST_PIECES]
        blurs, gammas, every = (
            _BLURS_PX if before is None else before.blur_px * _FINE_BLURS,
            _GAMMAS,
            1,
        )
        if rough:
            blurs, gammas, every = _ROUGH_BLURS_PX, _GAMMAS[:1], _ROUGH_EVERY
        looks = [
            [
                _look(some, reach_px, blurs, gamma, every, fine=before is not None)
                for _, some in pairs
            ]
            for gamma in gammas
        ]
        return cls([side for side, _ in pairs], [some for _, some in pairs], looks, blurs, reach_px)

    @property
    def of_curves(self) -> list[float]:
        """Minus twice the log probability of each transfer curve: all stretches of a side are lit nearly alike, so that
        what they say of it counts once."""
        return [sum(look.of_curve for look in curve) for curve in self.looks]

    def limb(self, chances: np.ndarray) -> Limb:
        """The edges by all transfer curves and blurs, each by its chance: these are of the whole camera."""
        shares = [
            chance * _chances(sum(look.against for look in curve))
            for chance, curve in zip(chances, self.looks)
            if curve
        ]
        if not shares:
            nothing = LinePoints(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0))
            return Limb(nothing, 0, _BLURS_PX[1])
        found = [self._of_side(number, chances, shares) for number in range(len(self.sides))]
        points, asked = zip(*found)
        joined = LinePoints(
            *(
                np.concatenate([getattr(one, name) for one in points])
                for name in LinePoints.__dataclass_fields__
            )
        )
        blur = float(np.exp(np.log(self.blurs_px) @ np.sum(shares, axis=0)))
        said = float(np.sum(np.log(2.0 * self.reach_px / (np.sqrt(2.0 * np.pi) * joined.sigma_px))))
        return Limb(joined, sum(asked), blur, said)

    def _of_side(self, number: int, chances, shares) -> tuple[LinePoints, int]:
        side, looks = self.sides[number], [curve[number] for curve in self.looks]
        mean = sum(share @ look.mean for share, look in zip(shares, looks))
        square = sum(share @ (look.variance + look.mean**2) for share, look in zip(shares, looks))
        for_edge = sum(chance * look.for_edge for chance, look in zip(chances, looks))
        formal = np.sqrt(np.maximum(square - mean**2, 0.0))
        sigma = np.hypot(FORMAL_TO_TRUE * formal, EDGE_PX)
        at = _stations(self.pieces[number], len(mean))
        points = LinePoints(
            side.px[at] + mean[:, None] * side.normal[at], side.normal[at], sigma, side.far_mm[at]
        )
        keep = (for_edge > _LEAST_EVIDENCE) & (formal < _MOST_UNSURE * self.reach_px)
        return points.select(keep), len(keep)


def _chances(against: np.ndarray) -> np.ndarray:
    """Of minus twice the logarithms of probabilities."""
    chance = np.exp(-0.5 * (against - against.min()))
    return chance / chance.sum()


def _sides(view: View, axis: Rounded, radius_mm: float, settings: VisionSettings) -> list[_Side]:
    """Both sides of the outline, a station every pixel or so."""
    camera = view.camera
    points, normals = axis.limb(camera.centre_mm, radius_mm, settings.bar_reach_mm, 400)
    px = camera.project(points.reshape(-1, 3)).reshape(2, -1, 2)
    if not np.all(np.isfinite(px)):
        return []
    half = 0.5 * np.linalg.norm(px[0] - px[1], axis=1)
    sides = []
    for some, out, there in zip(points, normals, px):
        normal = np.einsum("nij,nj->ni", camera.project_with_jacobians(some)[1], out)
        scale = np.linalg.norm(normal, axis=1)
        beside = some + (_CLEAR_PX / scale)[:, None] * out
        clear = (half > _LEAST_HALF_PX) & ~axis.hides_itself(camera.centre_mm, beside, radius_mm)
        far = np.linalg.norm(some - camera.centre_mm, axis=1)
        sides.append(_Side(there, normal / scale[:, None], far, clear, half))
    return sides


def _pieces(
    view: View,
    side: _Side,
    wires_px: Sequence[np.ndarray],
    settings: VisionSettings,
    reach_px: float,
) -> Pieces:
    """The pixels beside one side, as pieces along it: each a row."""
    inside, outside = reach_px + _INSIDE_PX, reach_px + OUTSIDE_PX + 1.0
    pixels = _pixels_near(view.mean.shape, side, inside, outside)
    if not len(pixels):
        return _no_pieces()
    _, nearest = cKDTree(side.px).query(pixels)
    away = pixels - side.px[nearest]
    offset = np.sum(away * side.normal[nearest], axis=1)
    tangent = np.stack([-side.normal[:, 1], side.normal[:, 0]], axis=1)
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(side.px, axis=0), axis=1))])
    tangent *= np.sign(np.sum(np.gradient(side.px, axis=0) * tangent, axis=1))[:, None]
    along = run[nearest] + np.sum(away * tangent[nearest], axis=1)
    keep = (
        side.clear[nearest]
        & (offset > -np.minimum(inside, side.half_px[nearest]))
        & (offset < outside)
    )
    keep &= (along >= 0.0) & (along <= run[-1])
    if len(wires_px) and view.itself is None:
        wire = np.concatenate([_dense(line) for line in wires_px])
        keep &= ~np.isfinite(
            cKDTree(wire).query(pixels, distance_upper_bound=settings.bar_piece_px / 2 + 5.0)[0]
        )
    return _as_rows(view, side, pixels[keep], offset[keep], along[keep], run, settings.bar_piece_px)


def _dense(line: np.ndarray) -> np.ndarray:
    """A line (m, 2) by a point every pixel or two, without what is not finite."""
    line = line[np.all(np.isfinite(line), axis=1)]
    if len(line) < 2:
        return line
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.arange(0.0, run[-1], 2.0)
    return np.stack([np.interp(at, run, line[:, k]) for k in range(2)], axis=1)


def _pixels_near(shape: tuple[int, int], side: _Side, inside: float, outside: float) -> np.ndarray:
    """Whole pixels (n, 2) within so much of the stations, x and y."""
    steps = np.arange(-inside, outside + 0.5, 0.5)
    near = (
        np.round(side.px[:, None] + steps[:, None] * side.normal[:, None])
        .astype(int)
        .reshape(-1, 2)
    )
    within = np.all((near >= 0) & (near < np.array(shape[::-1])), axis=1)
    code = np.unique(near[within, 1] * shape[1] + near[within, 0])
    return np.stack([code % shape[1], code // shape[1]], axis=1).astype(float)


def _no_pieces() -> Pieces:
    return Pieces(
        *[np.zeros((0, 1))] * 6,
        np.zeros(0),
        np.zeros(0),
        np.zeros((0, 2)),
        np.zeros((0, 2)),
        np.zeros(0, dtype=int),
    )


def _as_rows(view: View, side: _Side, pixels, offset, along, run, length_px: int) -> Pieces:
    """Pieces of this length along the side, their pixels in rows that are filled up with some of no weight. place:
    along it, px."""
    column, row = pixels.astype(int).T
    scale = FULL_SCALE / view.full_scale
    grey, behind = view.mean[row, column], view.background[row, column]
    gradient = _gradient(view.background, row, column)
    piece = (along // length_px).astype(int)
    slope = np.sum(
        gradient * side.normal[np.clip(np.searchsorted(run, along), 0, len(run) - 1)], axis=1
    )
    noise = view.noise.times(view.mean_share)
    seen = (
        np.isfinite(grey)
        & np.isfinite(behind)
        & (np.nan_to_num(grey) < SATURATED * view.full_scale)
    )
    weight = np.where(seen, 1.0 / noise.sigma(np.where(seen, grey, 0.0)), 0.0) / scale
    order = np.argsort(piece, kind="stable")
    names, first, count = np.unique(piece[order], return_index=True, return_counts=True)
    if not len(names):
        return _no_pieces()
    place = np.arange(len(order)) - np.repeat(first, count)
    rows = np.repeat(np.arange(len(names)), count)
    half = min(float(np.median(side.half_px[side.clear])), _WIDEST_PX)
    filled = []
    for values, empty in (
        (offset + half, 0.0),
        (grey * scale, 1.0),
        (behind * scale, 1.0),
        (slope * scale, 0.0),
        (weight, 0.0),
    ):
        table = np.full((len(names), int(count.max())), empty)
        table[rows, place] = np.nan_to_num(values[order], nan=empty)
        filled.append(table)
    middle = (names + 0.5) * length_px
    station = np.clip(np.searchsorted(run, middle), 0, len(run) - 1)
    offset, grey, behind, slope, weight = filled
    return Pieces(
        offset,
        grey,
        behind,
        slope,
        np.zeros_like(slope),
        weight,
        middle,
        np.full(len(names), half),
        side.px[station],
        side.normal[station],
        station,
    )


def _gradient(picture, row, column) -> np.ndarray:
    """Change (n, 2) of a picture by x and y at whole pixels, by their neighbours."""
    height, width = picture.shape
    by_x = picture[row, np.minimum(column + 1, width - 1)] - picture[row, np.maximum(column - 1, 0)]
    by_y = (
        picture[np.minimum(row + 1, height - 1), column] - picture[np.maximum(row - 1, 0), column]
    )
    return 0.5 * np.stack([by_x, by_y], axis=1)


@dataclass(frozen=True)
class _Look:
    """Of one side under one transfer curve: by blur (b,) minus twice the log probability; by blur and stretch (b, k)
    mean and variance of the shift, px; evidence (k,) for an edge; and what a stretch says of the curve."""

    against: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
    for_edge: np.ndarray
    of_curve: float


def _look(
    pieces: Pieces,
    reach_px: float,
    blurs_px: Sequence[float],
    gamma: float,
    every: int,
    *,
    fine: bool,
) -> _Look:
    seen = compute_profiles(pieces, STRETCHES, reach_px, gamma)
    rod = LitRod(seen)
    under = [
        compute_evidence(
            rod,
            reach_px,
            float(blur),
            positions=2 if fine else 1,
            with_smooth_priors=fine,
            every=every,
        )
        for blur in blurs_px
    ]
    best = min(under, key=lambda one: one.least_deviance.sum())
    temper = estimate_temperature(best, seen)
    against, mean, variance = [], [], []
    for one in under:
        own = -0.5 * one.bar_deviance / temper[:, None, None]
        total = logsumexp(own, axis=(1, 2))
        chance = np.sum(np.exp(own - total[:, None, None]), axis=2)
        mean.append(chance @ one.shift_px)
        variance.append(chance @ one.shift_px**2 - mean[-1] ** 2)
        against.append(-2.0 * total.sum())
    return _Look(
        np.array(against),
        np.array(mean),
        np.array(variance),
        (best.no_bar_deviance - best.least_deviance) / temper,
        float(np.mean(best.least_deviance / temper)),
    )


def _stations(pieces: Pieces, count: int) -> np.ndarray:
    """The station in the middle of each stretch, as `profiles` parts them."""
    order = np.argsort(pieces.place)
    return np.array([int(np.median(pieces.source[some])) for some in np.array_split(order, count)])
