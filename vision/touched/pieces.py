"""What the bar's line and its edges are read from: pieces of its band, clear of wire and clamps, and their rims."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.silhouette import outline
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.pictures.view import View
from vision.wire.bands import Band, Pieces, cut_pieces, read_band
from vision.wire.cylinder import WAVES
from vision.wire.shading import Knots, fit_shading, locate

# [mm] The line is handed on as two points, this far to either side: a layout.
ARM_MM = 20.0
# [radii] What lies nearer to the axis is no rim, where edges are looked for. Origin not known.
# Study: thresholds.py bar.pieces _INNER_SHARE ….
_INNER_SHARE = 0.72
# [1] Of a piece's pixels. Set by eye. Study: bar_scenes.py.
_LEAST_IN_PICTURE = 0.5
# [pieces] Four: two for a line, two left over. Derived.
FEWEST_PIECES = 4
# [1] Of the median piece's, or of what noise alone gives, if that is more: then it shows
# something else than the bar. Set by eye. Study: coverage.py alone.
_WORST_MISFIT = 3.0
# [px] To either side of a wire's middle its pixels, and those that the lens spreads it to: half a
# wire of 4 px and four blurs of a pixel. Derived.
# to either side of a wire's middle its pixels, and those that the lens spreads it to
_WIRE_PX = 6.0
# [1] Of a piece's pixels: where a wire hides more, the piece tells little. Set by eye. Study:
# bar_scenes.py.
_LEAST_BESIDE = 0.3
# [mm] Between knots of the rims' shading, where edges are looked for. Origin not known. Study:
# thresholds.py bar.pieces _KNOT_MM ….
_KNOT_MM = 14.0
# [1] Chi² per pixel of the edges' model: a bar before its background leaves 0.1 to 2. Study:
# coverage.py alone.
NO_BAR = 3.5


def bar_pieces(
    view: View,
    noise: Noise,
    axis: BarAxis,
    radius_mm: float,
    wires_px: Sequence[np.ndarray],
    settings: VisionSettings,
) -> Pieces:
    """Pieces of the bar's band in the mean picture, to either side of the axis's point, that show no wire. noise: what
    the difference of mean and background is taken to have.

    Raises Refused where no part of the bar lies before the camera."""
    place = np.linspace(-settings.bar_reach_mm, settings.bar_reach_mm, 200)
    points = axis.point_mm + place[:, None] * axis.direction
    middle, radius = outline(
        view.camera, points, np.broadcast_to(axis.direction, points.shape), radius_mm
    )
    if not np.any(np.isfinite(radius)):
        raise Refused(
            f"camera {view.camera.name} would have the bar behind it: check T_camera_rig",
            code="bar_behind_camera",
        )
    half = int(np.ceil(np.nanmax(radius))) + settings.bar_margin_px
    band = _from_whole(
        read_band(view.mean, view.background, middle, place, radius, half), settings.bar_piece_px
    )
    pieces = cut_pieces([band], settings.bar_piece_px, noise)
    in_picture = np.mean(pieces.weight > 0, axis=1) > _LEAST_IN_PICTURE
    wires_px = (
        wires_px if view.itself is None else ()
    )  # where they are known they are not in the mean
    return pieces.select(
        in_picture & clear_of_wire(pieces, wires_px, settings.bar_piece_px / 2 + 5.0)
    )


def _from_whole(band: Band, length_px: int) -> Band:
    """The band from a pixel on whose number is a multiple of a piece's length: pieces do not move with the axis."""
    steps = band.foot_px[
        :, int(np.argmin(np.abs(np.ptp(band.foot_px, axis=0) - len(band.place) + 1)))
    ]
    first = int(-steps[0] % length_px)
    return Band(*(getattr(band, name)[first:] for name in band.__dataclass_fields__))


def bar_knots(settings: VisionSettings) -> Knots:
    """Places between which the bar's shading changes linearly."""
    return Knots(np.arange(-settings.bar_reach_mm, settings.bar_reach_mm + 1e-9, _KNOT_MM))


def clear_of_wire(pieces: Pieces, wires_px: Sequence[np.ndarray], margin_px: float) -> np.ndarray:
    """Which pieces (s,) of the bar show no wire: each reads a rectangle along and across the bar."""
    tangent = np.stack([pieces.normal[:, 1], -pieces.normal[:, 0]], axis=1)
    clear = np.ones(len(pieces), dtype=bool)
    for line in wires_px:
        away = line[None] - pieces.foot_px[:, None]
        along = np.abs(np.einsum("smi,si->sm", away, tangent))
        across = np.abs(np.einsum("smi,si->sm", away, pieces.normal))
        clear &= ~np.any(
            (along < margin_px) & (across < pieces.radius_px[:, None] + margin_px), axis=1
        )
    return clear


def beside_wires(pieces: Pieces, wires_px: Sequence[np.ndarray]) -> Pieces:
    """Pieces whose pixels near a wire weigh nothing, of those that have enough others: of a bar that a wire sweeps
    along, where hardly a piece is clear of it."""
    px = pieces.foot_px[:, None] + pieces.offset_px[..., None] * pieces.normal[:, None]
    hidden = np.zeros(pieces.weight.shape, dtype=bool)
    for line in wires_px:
        for row, there in zip(hidden, px):
            row |= (
                np.min(np.linalg.norm(there[:, None] - line, axis=-1), axis=1, initial=np.inf)
                < _WIRE_PX
            )
    pieces = replace(pieces, weight=np.where(hidden, 0.0, pieces.weight))
    return pieces.select(np.mean(pieces.weight > 0, axis=1) > _LEAST_BESIDE)


def of_bar_alone(pieces: Pieces, placed: Callable[[Pieces], Pieces], knots: Knots) -> Pieces:
    """Without the pieces that a bar before its background cannot explain: clamps, the hub, a shadow's border.

    placed: brings pieces to where the bar is taken to be.
    """
    for _ in range(3):
        there = placed(pieces)
        misfit = locate(there, fit_shading(there, 1.0, WAVES, knots)[0], rounds=1).chi2
        good = misfit < _WORST_MISFIT * max(float(np.median(misfit)), 1.0)
        if np.all(good) or np.sum(good) < FEWEST_PIECES:
            break
        pieces = pieces.select(good)
    return pieces


def rims_of(pieces: Pieces, placed: Pieces) -> Pieces:
    """Pieces without their middle: highlights there say nothing about the edges. placed: the same, where the bar is."""
    inner = np.abs(placed.offset_px) < _INNER_SHARE * placed.radius_px[:, None]
    rims = replace(pieces, weight=np.where(inner, 0.0, pieces.weight))
    return rims.columns(np.any(rims.weight > 0, axis=0))


def at_arms(pieces: Pieces) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Places (2,) at ± ARM_MM, and there the band's foot and normal (2, 2) and half-width (2,), by parabolas."""
    order, place = np.argsort(pieces.place), np.array([-ARM_MM, ARM_MM])
    columns = np.column_stack([pieces.foot_px, pieces.normal, pieces.radius_px])[order].T
    there = np.stack(
        [np.polyval(np.polyfit(pieces.place[order], column, 2), place) for column in columns],
        axis=1,
    )
    return place, there[:, :2], there[:, 2:4], there[:, 4]
