"""The precision of each camera's lines of wire and bar, measured in pictures of a known whisk."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.fit.line_noise import LineNoise, line_noise
from vision.fit.problem import Problem
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import solve
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.view import View
from vision.touched.edges import measure_edges
from vision.touched.line import BarLineEstimate, measure_bars
from vision.touched.object_view import ObjectView
from vision.touched.one_view import seen_from_one_side
from vision.truth.known_whisk import KnownWhisk
from vision.truth.predicted_lines import PredictedLines
from vision.truth.traced_lines import TracedLines
from vision.wire.points import LinePoints, Observed

_USUAL = VisionSettings()


@dataclass(frozen=True, eq=False)
class CameraPictures:
    """Grey pictures (h, w) of a known whisk by one camera.

    empty: two without wire and bar. with_bar: without the wire, free of noise. frames: by index.
    """

    camera: Camera
    empty: tuple[np.ndarray, np.ndarray]
    with_bar: np.ndarray
    frames: Mapping[int, np.ndarray]

    def view(self, frames: Mapping[int, np.ndarray]) -> View:
        """Return frames with the background and the noise of the empty pictures."""
        first, second = self.empty
        return View(self.camera, frames, first.astype(float), measure_noise(first, second))


def line_noise_in_pictures(
    known: KnownWhisk, pictures: Sequence[CameraPictures], cameras: Cameras
) -> dict[str, LineNoise]:
    """Return by camera the noise that is stated of lines in such pictures, their scatter about the
    fit included.

    pictures: of each of the cameras, in their order, with frames `known.frames_to_fit`.
    """
    views = [own.view(own.frames) for own in pictures]
    traced = TracedLines(known.pictured(views, cameras, _USUAL))
    on_wire = traced.wire_points(known.place, last=True)
    noise = {}
    for name, sigmas_px in _bar_sigmas_px(known, pictures).items():
        noise[name] = LineNoise(float("nan"), 0.0, sigmas_px)
    on_bar = PredictedLines(known, cameras, {}, noise).object_points(known.place, last=True)
    seen = []
    for name in cameras.names:
        seen += on_wire[name]
        seen += on_bar[name]
    return line_noise(_with_scatter(known, cameras, seen))


def _bar_sigmas_px(known: KnownWhisk, pictures: Sequence[CameraPictures]) -> dict[str, np.ndarray]:
    """Return by camera side and sigmas (k, 3) of its lines of the bar, as `LineNoise.bar_px`.

    The edges take the place of the middle where they locate the bar along the line of sight.
    """
    views = _bar_views(known, pictures)
    lines = _bar_middles(known, views)
    needs_edges = _needs_edges(known, views, lines)
    found = {}
    for view in views:
        points: Mapping[int, LinePoints] = {}  # by side of the bar
        line = lines.get(view.camera.name)
        if line is not None:
            edges = measure_edges(view, known.axis) if needs_edges else None
            points = edges or {0: line.points}
        found[view.camera.name] = _side_and_sigmas(points)
    return found


def _bar_views(known: KnownWhisk, pictures: Sequence[CameraPictures]) -> list[ObjectView]:
    """Return the views of the bar, crossed by the wire as it is in every frame."""
    place = known.place
    views = []
    for own in pictures:
        view = own.view(dict.fromkeys(place.curves, own.with_bar))
        views.append(ObjectView(view, known.rods.bar.radius_mm, _USUAL))
    return place.crossed(views)


def _side_and_sigmas(points: Mapping[int, LinePoints]) -> np.ndarray:
    """Return side and sigmas (k, 3), px, of two points each by side of the bar."""
    rows = [[side, *own.sigma_px] for side, own in points.items()]
    return np.array(rows, dtype=float).reshape(-1, 3)


def _needs_edges(
    known: KnownWhisk, views: Sequence[ObjectView], lines: Mapping[str, BarLineEstimate]
) -> bool:
    """Return whether the bar's middle, by camera, does not locate it along the line of sight."""
    cameras = Cameras(tuple(view.camera for view in views))
    return len(lines) == 1 or seen_from_one_side(cameras, known.axis)


def _bar_middles(known: KnownWhisk, views: Sequence[ObjectView]) -> dict[str, BarLineEstimate]:
    """Return by camera the middle of the bar, of cameras that show its edges."""
    try:
        lines = measure_bars(views, known.axis)
    except Refused:
        return {}
    return {name: line for name, line in lines.items() if line.has_edges}


def _with_scatter(known: KnownWhisk, cameras: Cameras, seen: Sequence[Observed]) -> Problem:
    """Return the fit's problem with sigmas as large as residuals show.

    They stay as stated where wire or bar is not seen, or the lines do not determine the fit.
    """
    problem = known.problem(cameras, seen)
    if len({one.on_wire for one in seen}) < 2:
        return problem
    try:
        state, _ = solve(problem, known.state(problem))
        return inflated_by_residuals(problem, state)
    except np.linalg.LinAlgError:
        return problem
