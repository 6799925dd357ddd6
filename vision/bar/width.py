"""How thick the bar looks: a length known otherwise, against which a board at the wrong scale shows."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from vision.bar.edges import coarse_share, measure_edges
from vision.bar.search import SeenBar, see_bar
from vision.geometry.camera import Cameras
from vision.geometry.centreline import resting_lines
from vision.geometry.errors import Refused
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.settings import VisionSettings
from vision.geometry.silhouette import outline
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.view import View

# Of one trial, what light on the edges and the axis leave: 28 trials at the right scale erred by 0.009 RMS, 0.024 most.
SIGMA_SHARE = 0.015
_FEWEST_PICTURES = 3
_COARSE_ENOUGH = 0.05  # a coarse look errs by 0.02 and looks no farther than 0.2
# Scatter of what cameras say over its size. A bar of 4 mm for 6 leaves 0.09, edges that light drew 0.23 and more in 15
# of 74 path-traced scenes.
_AGREE = 0.15
_WORTH_A_LOOK = 0.09  # less is no contradiction, whatever draws the edges (bench/trials/consistency.py)


def bar_diameter_mm(
    pictures: Mapping[str, Sequence[np.ndarray]],
    background: Mapping[str, np.ndarray],
    motor_rad: tuple[float, float],
    cameras: Cameras,
    wire: Wire,
    bar: Bar,
) -> float:
    """Diameter of the bar as the cameras see it, mm; NaN where none shows both edges, or fewer than two cameras see it:
    one alone takes from this diameter how far away the bar is.

    pictures: grey (h, w) of one trial by camera, spread over it; background: the same without rods. motor_rad: lowest
    and highest motor angle. Raises Refused where nothing like the bar is seen.
    """
    names = [n for n in cameras.names if len(pictures.get(n, ())) >= _FEWEST_PICTURES and background.get(n) is not None]
    if len(names) < 2:
        return np.nan
    used, settings = cameras.subset(names), VisionSettings()
    views = [View(camera, dict(enumerate(pictures[camera.name])), np.asarray(background[camera.name], dtype=float),
                  measure_noise(*pictures[camera.name][:2])) for camera in used]
    axis = see_bar(views, used, Rods(wire, bar), np.array(motor_rad), settings).axis
    shares = [_share(view, axis, wire, bar, motor_rad, settings) for view in views]
    seen = [share for share in shares if share is not None]
    return bar.diameter_mm * float(np.median(seen)) if seen else np.nan


def _share(view: View, axis, wire: Wire, bar: Bar, motor_rad, settings: VisionSettings) -> float | None:
    """How wide the bar looks in one camera, over how wide it should."""
    wires = resting_lines(view.camera, wire, np.linspace(*motor_rad, 8))
    edges = measure_edges(view, axis, bar.radius_mm, wires, settings, coarse=True)
    if edges is None:
        return None
    across = 0.5 * (edges[1].normal[0] + edges[1].normal[1])
    seen_px = np.mean(np.abs(np.sum((edges[1].px - edges[-1].px) * across, axis=1)))
    points = axis.point_mm + edges[1].place[:, None] * axis.direction
    _, half_px = outline(view.camera, points, np.broadcast_to(axis.direction, points.shape), bar.radius_mm)
    return float(seen_px / (2.0 * np.mean(half_px)))


def seen_over_given(views: Sequence[View], cameras: Cameras, seen: SeenBar, rods: Rods, motor_rad: np.ndarray,
                    settings: VisionSettings) -> dict[str, float]:
    """How wide the bar looks over how wide it should, by camera, of those that show both its edges; none where light
    and shade draw the edges: a bar as wide as these say is then not seen more clearly than the one that was given.

    What several cameras agree on is believed. motor_rad (n,): at each frame. A coarse look is enough where it finds the
    width that it should; else the edges are measured.
    """
    span = float(np.min(motor_rad)), float(np.max(motor_rad))
    asked = [view for view in views if view.camera.name in seen.seen_by]
    found = _by_camera(asked, lambda view: coarse_share(
        view, seen.axis, rods.bar.radius_mm, resting_lines(view.camera, rods.wire, np.linspace(*span, 8)), settings))
    if found and abs(np.median(list(found.values())) - 1.0) > _COARSE_ENOUGH:
        found = _by_camera(asked, lambda view: _share(view, seen.axis, rods.wire, rods.bar, span, settings))
    share = float(np.median(list(found.values()))) if found else 1.0
    if abs(np.log(share)) < _WORTH_A_LOOK or _agree(list(found.values())):
        return found
    return found if _sees(views, cameras, rods, share, motor_rad, settings) > seen.clearness else {}


def _by_camera(views: Sequence[View], share: Callable[[View], float | None]) -> dict[str, float]:
    """What is told of each view, by camera, without those of which nothing is."""
    told = {view.camera.name: share(view) for view in views}
    return {name: one for name, one in told.items() if one is not None}


def _agree(shares: Sequence[float]) -> bool:
    """Whether two cameras or more see one factor: light draws edges differently in each."""
    logs = np.log(shares)
    return len(logs) > 1 and bool(np.std(logs, ddof=1) < _AGREE * abs(np.median(logs)))


def _sees(views, cameras: Cameras, rods: Rods, share: float, motor_rad, settings: VisionSettings) -> float:
    """How clearly a bar is seen that is so many times as wide."""
    wider = Rods(rods.wire, Bar(rods.bar.diameter_mm * share))
    try:
        return see_bar(views, cameras, wider, motor_rad, settings).clearness
    except Refused:
        return 0.0
