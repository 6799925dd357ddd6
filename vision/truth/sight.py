"""What a camera has in sight of a known whisk: which segments of the wire, and how much of the bar."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.pictures.view import View
from vision.touched.pieces import ARM_MM
from vision.truth.known_whisk import KnownWhisk
from vision.truth.traced_lines import BESIDE_BAR_PX
from vision.wire.bands import Pieces
from vision.wire.trace import NEAR_CLAMP_MM, clear_of_bar, wire_pieces

# Says which of points (n, 3) something else hides from a camera, (n,) bool.
Hides = Callable[[Camera, np.ndarray], np.ndarray]
# [1] Of a segment's pixels, that are in the picture. Stated.
_LEAST_IN_PICTURE = 0.5
# [points] Along the middle of the bar. Stated.
_BAR_POINTS = 41


@dataclass(frozen=True, eq=False)
class Sight:
    """What one camera has in sight of a whisk.

    pieces: the wire's segments that it can trace; their source is the frame. points_mm (s, 3):
    where they are on the wire's axis. outside, behind_bar, hidden: shares of the wire's segments
    that are outside its picture, at the bar's outline, or behind something else. is_bar_nearer:
    whether the bar stands before the whisker. angle_to_bar_rad: between line of sight and bar.
    is_along_bar: whether that hardly shows the bar's edges. bar_share: of the bar's middle, that is
    in the picture.
    """

    pieces: Pieces
    points_mm: np.ndarray
    outside: float
    behind_bar: float
    hidden: float
    is_bar_nearer: bool
    angle_to_bar_rad: float
    is_along_bar: bool
    bar_share: float


def blank_view(camera: Camera, frames: Sequence[int]) -> View:
    """Return a view of empty pictures, from which segments are cut as from any other."""
    blank = np.zeros(camera.size_px[::-1], dtype=np.uint8)
    return View(camera, dict.fromkeys(frames, blank), blank, Noise(1.0, 0.0))


def find_sight(
    known: KnownWhisk,
    camera: Camera,
    settings: VisionSettings,
    hides: Hides | None = None,
) -> Sight:
    """Find what a camera has in sight of a whisk in the frames that make its truth."""
    curves = known.place.curves
    pieces = _pieces_of(known, camera, settings)
    points_mm = _points_mm(pieces, curves)
    visible = _Visible(
        is_inside=np.mean(pieces.weight > 0, axis=1) > _LEAST_IN_PICTURE,
        is_clear=clear_of_bar(pieces, _bar_discs(known, camera), BESIDE_BAR_PX),
        is_hidden=_hidden(camera, points_mm, hides),
    )
    return Sight(
        pieces=pieces.select(visible.is_traced),
        points_mm=points_mm[visible.is_traced],
        outside=visible.outside(_pieces_in_large_picture(camera, curves, settings)),
        behind_bar=visible.behind_bar,
        hidden=visible.hidden,
        is_bar_nearer=known.is_bar_nearer(camera),
        angle_to_bar_rad=known.angle_to_bar_rad(camera),
        is_along_bar=known.is_seen_along_bar(camera),
        bar_share=_bar_share(known, camera),
    )


@dataclass(frozen=True, eq=False)
class _Visible:
    """Which of a wire's segments (s,) are in the picture, clear of the bar's outline, and behind
    something else.
    """

    is_inside: np.ndarray
    is_clear: np.ndarray
    is_hidden: np.ndarray

    @property
    def _count(self) -> int:
        """Return the number of segments, at least 1."""
        return max(len(self.is_inside), 1)

    @property
    def is_traced(self) -> np.ndarray:
        """Return which segments (s,) can be traced."""
        return self.is_inside & self.is_clear & ~self.is_hidden

    @property
    def behind_bar(self) -> float:
        """Return the share of segments at the bar's outline."""
        return float(np.sum(self.is_inside & ~self.is_clear)) / self._count

    @property
    def hidden(self) -> float:
        """Return the share of segments behind something else."""
        return float(np.sum(self.is_inside & self.is_clear & self.is_hidden)) / self._count

    def outside(self, in_large_picture: float) -> float:
        """Return the share of segments outside the picture.

        in_large_picture: how many there are in a picture that holds all of them. Bands end at the
        picture's edges, so that pieces beyond them are counted apart.
        """
        return 1.0 - self.is_inside.sum() / max(in_large_picture, self._count)


def _pieces_of(known: KnownWhisk, camera: Camera, settings: VisionSettings) -> Pieces:
    """Return the segments of the wire in a camera's picture, those at the clamp left out."""
    curves = known.place.curves
    pieces = wire_pieces(
        blank_view(camera, curves),
        curves,
        known.rods.wire,
        settings.wire_piece_px,
        settings.wire_margin_px,
    )
    return pieces.select(pieces.place > NEAR_CLAMP_MM)


def _bar_discs(known: KnownWhisk, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return the middles and radii, px, of discs that cover the bar in a camera's picture."""
    return known.axis.covering_discs(camera, known.rods.bar.radius_mm)


def _hidden(camera: Camera, points_mm: np.ndarray, hides: Hides | None) -> np.ndarray:
    """Return which of points (s, 3) something else hides from a camera; none by default."""
    return np.zeros(len(points_mm), dtype=bool) if hides is None else hides(camera, points_mm)


def _pieces_in_large_picture(
    camera: Camera, curves: Mapping[int, Curves], settings: VisionSettings
) -> float:
    """Return how many segments the wires would make in a picture that holds all of them."""
    count = 0.0
    for curve in curves.values():
        ends_mm, _ = curve.at(np.array([NEAR_CLAMP_MM, curve.arc_mm[-1]]))
        first_px, last_px = camera.project(ends_mm)
        length_px = np.max(np.abs(last_px - first_px))
        count += np.nan_to_num(length_px) // settings.wire_piece_px
    return float(count)


def _bar_share(known: KnownWhisk, camera: Camera) -> float:
    """Return the share of the bar's middle that is in a camera's picture."""
    place_mm = np.linspace(-ARM_MM, ARM_MM, _BAR_POINTS)
    px = camera.project(known.axis.points_at(place_mm))
    return float(np.mean(camera.has_in_picture(px)))


def _points_mm(pieces: Pieces, curves: Mapping[int, Curves]) -> np.ndarray:
    """Return where on the wire's axis segments are, (s, 3)."""
    points_mm = np.zeros((len(pieces), 3))
    for frame, curve in curves.items():
        own = pieces.source == frame
        points_mm[own], _ = curve.at(pieces.place[own])
    return points_mm
