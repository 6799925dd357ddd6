"""How thick the bar looks: a length known otherwise, against which a board at the wrong scale shows.

By the evidence that its line is found by, for bars of other widths about the same axis: light on the bar is free, so
that neither a highlight nor a dark rim passes for an edge, and where a rim is as dark as the bench the sigma says so.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from vision.geometry.camera import Cameras
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.view import View
from vision.touched.posterior import estimate_log_width, move_to_line
from vision.touched.search import SeenBar, see_bar

# [1] Of one trial, what light on the edges and the axis leave: with it z is 0.75 RMS over 37
# path-traced scenes, 2.4 at most. Study: bar_scenes.py.
SIGMA_SHARE = 0.02
# [pictures] Fewer give no median that an odd one leaves alone. Derived.
_FEWEST_PICTURES = 3


def bar_diameter_mm(
    pictures: Mapping[str, Sequence[np.ndarray]],
    background: Mapping[str, np.ndarray],
    motor_rad: tuple[float, float],
    cameras: Cameras,
    wire: Wire,
    bar: Bar,
) -> float:
    """Diameter of the bar as the cameras see it, mm; NaN where fewer than two cameras see it: one alone takes from this
    diameter how far away the bar is.

    pictures: grey (h, w) of one trial by camera, spread over it; background: the same without rods. motor_rad: lowest
    and highest motor angle. Raises Refused where nothing like the bar is seen.
    """
    names = [
        n
        for n in cameras.names
        if len(pictures.get(n, ())) >= _FEWEST_PICTURES and background.get(n) is not None
    ]
    if len(names) < 2:
        return np.nan
    used, settings, rods = cameras.subset(names), VisionSettings(), Rods(wire, bar)
    views = [
        View(
            camera,
            dict(enumerate(pictures[camera.name])),
            np.asarray(background[camera.name], dtype=float),
            measure_noise(*pictures[camera.name][:2]),
        )
        for camera in used
    ]
    found = seen_over_given(see_bar(views, used, rods, np.array(motor_rad), settings))
    return bar.diameter_mm * in_all(found)[0] if found else np.nan


def seen_over_given(seen: SeenBar) -> dict[str, tuple[float, float]]:
    """How wide the bar looks over how wide it should, and sigma, by camera, of those that show it: in what was looked
    at for it."""
    lines = {name: seen.lines[name] for name in seen.seen_by}
    return {
        name: _share(*estimate_log_width(move_to_line(one.pieces, one.line)))
        for name, one in lines.items()
    }


def _share(log: float, sigma: float) -> tuple[float, float]:
    return float(np.exp(log)), float(np.exp(log) * np.hypot(sigma, SIGMA_SHARE))


def in_all(found: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    """What cameras say together: the weighted mean of their logarithms; as light is alike in all, no surer than each is
    by itself, and by their scatter less sure."""
    share, sigma = np.array(list(found.values())).T
    logs, weight = np.log(share), (share / sigma) ** 2
    mean = float(np.average(logs, weights=weight))
    scatter = np.average((logs - mean) ** 2, weights=weight) / max(len(logs) - 1, 1)
    return float(np.exp(mean)), float(np.exp(mean) * np.sqrt(1.0 / np.mean(weight) + scatter))
