"""The apparent width of the bar: a known length, against which a board at the wrong scale shows.

The evidence that locates the bar's line is evaluated for bars of other widths about the same axis;
its logarithm has the posterior mean and sigma of `estimate_log_width`. Light on the bar is free, so
that neither a highlight nor a dark rim passes for an edge, and where a rim is as dark as the bench
the sigma is wide.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from vision.geometry.camera import Cameras
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.view import View
from vision.touched.posterior import estimate_log_width, move_to_line
from vision.touched.search import SeenBar, find_object
from vision.touched.search_scene import SearchScene

# [1] Sigma of the width of one trial by the light on the edges and by the axis: with it z is 0.75
# RMS over 37 path-traced scenes, 2.4 at most. Study: bar_scenes.py.
SIGMA_SHARE = 0.02
# [pictures] With fewer the median does not exclude an odd one. Derived.
_FEWEST_PICTURES = 3


def bar_diameter_mm(
    pictures: Mapping[str, Sequence[np.ndarray]],
    background: Mapping[str, np.ndarray],
    motor_rad: tuple[float, float],
    cameras: Cameras,
    wire: Wire,
    bar: Bar,
) -> float:
    """Return the diameter of the bar as the cameras show it, mm; NaN where fewer than two cameras
    have pictures.

    One camera alone takes the distance of the bar from its diameter. pictures: grey (h, w) of one
    trial by camera, spread over it; background: the same without rods. motor_rad: lowest and
    highest motor angle. Raises Refused where nothing like the bar is found.
    """
    views = []
    for camera in cameras:
        frames = pictures.get(camera.name, ())
        empty = background.get(camera.name)
        if len(frames) >= _FEWEST_PICTURES and empty is not None:
            noise = measure_noise(*frames[:2])
            views.append(View(camera, dict(enumerate(frames)), np.asarray(empty, float), noise))
    if len(views) < 2:
        return np.nan
    used = cameras.subset([view.camera.name for view in views])
    scene = SearchScene(views, used, Rods(wire, bar), np.array(motor_rad), VisionSettings())
    widths = measure_relative_widths(find_object(scene))
    return bar.diameter_mm * combine_widths(widths)[0] if widths else np.nan


def measure_relative_widths(seen: SeenBar) -> dict[str, tuple[float, float]]:
    """Return apparent over stated width and its sigma by camera, of cameras that show the bar.

    They are measured in the pixels by which the bar was found.
    """
    widths = {}
    for name in seen.seen_by:
        line = seen.lines[name]
        log_width, sigma = estimate_log_width(move_to_line(line.pieces, line.line))
        width = float(np.exp(log_width))
        widths[name] = (width, width * float(np.hypot(sigma, SIGMA_SHARE)))
    return widths


def combine_widths(widths: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
    """Return the weighted geometric mean of widths by camera, and its sigma.

    The light is alike in all cameras, so the mean is no more certain than each by itself; scatter
    makes it less so.
    """
    width, sigma = np.array(list(widths.values())).T
    log_width = np.log(width)
    weight = (width / sigma) ** 2
    log_mean = np.average(log_width, weights=weight)
    spread = np.average((log_width - log_mean) ** 2, weights=weight)
    variance = 1.0 / np.mean(weight) + spread / max(len(log_width) - 1, 1)
    mean = float(np.exp(log_mean))
    return mean, mean * float(np.sqrt(variance))
