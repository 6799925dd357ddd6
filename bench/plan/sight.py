"""What each camera has in sight of a whisk: of the wire piece by piece, and of the bar; and what stands in the way."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.plan.staged import Staged
from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves, one_curve
from vision.geometry.contact import BarAxis
from vision.geometry.rods import Rods
from vision.geometry.silhouette import normals, outline
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.pictures.view import View
from vision.touched.pieces import ARM_MM
from vision.truth.whisk_truth import BESIDE_BAR_PX
from vision.wire.bands import Pieces
from vision.wire.points import LinePoints, Observed
from vision.wire.trace import NEAR_CLAMP_MM, clear_of_bar, wire_pieces

# Which of points (n, 3) something else stands before, as a camera sees them.
Hides = Callable[[Camera, np.ndarray], np.ndarray]
# A camera that looks at the bar at less than this to its axis has it a third as long.
ALONG_RAD = np.radians(20.0)
_LEAST_IN_PICTURE = 0.5  # of a piece's pixels


@dataclass(frozen=True, eq=False)
class Sight:
    """Of one camera: pieces of the wire that it can trace, by frame; what share of the others is lost to the picture's
    edge, to the bar (before the wire: bar_nearer), to what `Hides` says; angle between the sight at the contact and
    the bar; and the share of the bar's middle stretch that is in the picture."""

    camera: Camera
    pieces: Pieces
    outside: float
    by_bar: float
    bar_nearer: bool
    hidden: float
    to_bar_rad: float
    bar_share: float


def blank_view(camera: Camera, frames: Sequence[int]) -> View:
    """A view with nothing in it, to cut pieces from as those of pictures are cut."""
    blank = np.zeros(camera.size_px[::-1], dtype=np.uint8)
    return View(camera, dict.fromkeys(frames, blank), blank, Noise(1.0, 0.0))


def curves_of(staged: Staged, frames: Sequence[int]) -> dict[int, Curves]:
    """The whisker by frame, as vision models it."""
    return {
        f: one_curve(
            staged.rest_mm,
            staged.bend_rad[f],
            staged.arc_mm[f],
            staged.motor_rad[f],
            staged.rods.wire,
        )
        for f in frames
    }


def nothing_hides(_: Camera, points_mm: np.ndarray) -> np.ndarray:
    """An open bench."""
    return np.zeros(len(points_mm), dtype=bool)


def sight_of(
    camera: Camera,
    staged: Staged,
    curves: Mapping[int, Curves],
    settings: VisionSettings,
    hides: Hides = nothing_hides,
) -> Sight:
    """What a camera has in sight in these frames."""
    axis, rods = staged.axis, staged.rods
    every = wire_pieces(
        blank_view(camera, curves),
        curves,
        rods.wire,
        settings.wire_piece_px,
        settings.wire_margin_px,
    )
    every = every.select(every.place > NEAR_CLAMP_MM)
    inside = np.mean(every.weight > 0, axis=1) > _LEAST_IN_PICTURE
    clear = clear_of_bar(every, *axis.covering_discs(camera, rods.bar.radius_mm), BESIDE_BAR_PX)
    points = _in_space(every, curves)
    hidden = hides(camera, points)
    count = max(len(every), 1)
    wanted = _pieces_in_a_full_picture(camera, curves, settings)
    return Sight(
        camera,
        every.select(inside & clear & ~hidden),
        1.0 - inside.sum() / max(wanted, count),
        float(np.sum(inside & ~clear)) / count,
        _bar_is_nearer(camera, staged),
        float(np.sum(inside & clear & hidden)) / count,
        *_of_bar(camera, axis),
    )


def _pieces_in_a_full_picture(
    camera: Camera, curves: Mapping[int, Curves], settings: VisionSettings
) -> float:
    """How many pieces the wires would make were the picture large enough: bands end at its edges."""
    ends = [
        camera.project(curve.at(np.array([NEAR_CLAMP_MM, curve.arc_mm[-1]]))[0])
        for curve in curves.values()
    ]
    long = [np.max(np.abs(last - first)) for first, last in ends]
    return float(np.sum(np.nan_to_num(long) // settings.wire_piece_px))


def _bar_is_nearer(camera: Camera, staged: Staged) -> bool:
    """Whether the bar stands before the whisker at first touch."""
    away = [
        np.linalg.norm(point - camera.centre_mm)
        for point in (staged.foot_mm, staged.touch.point_mm)
    ]
    return bool(away[0] < away[1])


def to_bar_rad(camera: Camera, axis: BarAxis) -> float:
    """Angle between a camera's sight and the bar, where it is touched."""
    sight = axis.point_mm - camera.centre_mm
    return float(np.arccos(np.clip(abs(sight @ axis.direction) / np.linalg.norm(sight), 0.0, 1.0)))


def _of_bar(camera: Camera, axis: BarAxis) -> tuple[float, float]:
    """Angle between sight and bar, and how much of it is in the picture within the arm to either side."""
    along = axis.point_mm + np.linspace(-ARM_MM, ARM_MM, 41)[:, None] * axis.direction
    px = camera.project(along)
    inside = np.all((px > 0) & (px < np.array(camera.size_px) - 1), axis=1)
    return to_bar_rad(camera, axis), float(np.mean(inside))


def _in_space(pieces: Pieces, curves: Mapping[int, Curves]) -> np.ndarray:
    """Where on the wire's axis pieces are (s, 3)."""
    points = np.zeros((len(pieces), 3))
    for frame, curve in curves.items():
        mine = pieces.source == frame
        points[mine] = curve.at(pieces.place[mine])[0]
    return points


def wire_points(
    sight: Sight, number: int, curves: Mapping[int, Curves], sigma_px: float
) -> list[Observed]:
    """Line points of the wire where it is exactly, one Observed a frame; frames by their place among the curves'."""
    px = sight.camera.project(_in_space(sight.pieces, curves))
    points = LinePoints(px, sight.pieces.normal, np.full(len(px), sigma_px), sight.pieces.place)
    return [
        Observed(place, number, points.select(sight.pieces.source == frame))
        for place, frame in enumerate(curves)
        if np.any(sight.pieces.source == frame)
    ]


def bar_points(
    camera: Camera, number: int, axis: BarAxis, rods: Rods, bar_px: np.ndarray
) -> list[Observed]:
    """Lines of the bar where it is exactly; bar_px (k, 3): see `vision.fit.line_noise.LineNoise`."""
    place = np.array([-ARM_MM, 0.0, ARM_MM])
    along = axis.point_mm + place[:, None] * axis.direction
    middle, half = outline(
        camera, along, np.broadcast_to(axis.direction, along.shape), rods.bar.radius_mm
    )
    ends = LinePoints(middle, normals(middle), np.ones(3), place).select(
        np.array([True, False, True])
    )
    return [
        Observed(
            -1,
            number,
            replace(ends, px=ends.px + side * half[[0, 2], None] * ends.normal, sigma_px=sigmas),
            int(side),
        )
        for side, sigmas in ((row[0], row[1:]) for row in bar_px)
    ]
