"""How thick the bar looks: a length known otherwise, against which a board at the wrong scale shows.

Coarse by design: the share of changed pixels is averaged along the bar, and its outermost half-level points are the
rims. Light, shade beside the bar and what the first look leaves of tilt make it err by some 8 %.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import map_coordinates

from vision.bar import HALF, changed, find_bar
from vision.contact import BarAxis
from vision.line import measure_noise
from vision.scene import Bar, Camera, Cameras, Wire

SIGMA_SHARE = 0.08
_ALONG_MM = np.arange(-24.0, 24.1, 2.0)
_REACH, _STEPS = 3.0, 241  # across the axis, in radii as given, to either side
_FEWEST_PLACES = 5
_FEWEST_PICTURES = 3


def bar_diameter_mm(
    pictures: Mapping[str, Sequence[np.ndarray]],
    background: Mapping[str, np.ndarray],
    motor_rad: tuple[float, float],
    cameras: Cameras,
    wire: Wire,
    bar: Bar,
) -> float:
    """Diameter of the bar as the cameras see it, mm; NaN where none shows both rims, or fewer than two cameras see it:
    one alone takes from this diameter how far away the bar is.

    pictures: grey (h, w) of one trial by camera, spread over it; background: the same without rods. motor_rad: lowest
    and highest motor angle. Raises Refused where nothing like the bar is seen.
    """
    names = [n for n in cameras.names if len(pictures.get(n, ())) >= _FEWEST_PICTURES and background.get(n) is not None]
    if len(names) < 2:
        return np.nan
    used = cameras.subset(names)
    changes = {name: _change(pictures[name], background[name]) for name in names}
    reach_mm = bar.radius_mm + 0.5 * wire.diameter_mm
    axis = find_bar(changes, used, bar.radius_mm, reach_mm, motor_rad, wire.length_mm)
    widths = np.array([_width_mm(changes[camera.name], camera, axis, bar.radius_mm) for camera in used])
    return float(np.median(widths[np.isfinite(widths)])) if np.isfinite(widths).any() else np.nan


def _change(pictures: Sequence[np.ndarray], background: np.ndarray) -> np.ndarray:
    median = np.median([picture[::HALF, ::HALF] for picture in pictures], axis=0)
    return changed(median, np.asarray(background, dtype=float)[::HALF, ::HALF], measure_noise(*pictures[:2]))


def _width_mm(change: np.ndarray, camera: Camera, axis: BarAxis, radius_mm: float) -> float:
    """Distance of the two rims at the axis's depth."""
    sideways = np.cross(axis.direction, axis.point_mm - camera.centre_mm)
    across = radius_mm * np.linspace(-_REACH, _REACH, _STEPS)
    along = axis.point_mm + _ALONG_MM[:, None] * axis.direction
    points = along[:, None] + across[:, None] * sideways / np.linalg.norm(sideways)
    column, row = camera.project(points.reshape(-1, 3)).T / HALF
    profiles = map_coordinates(change, [row, column], order=1, cval=np.nan).reshape(len(_ALONG_MM), -1)
    profiles = profiles[np.all(np.isfinite(profiles), axis=1)]
    if len(profiles) < _FEWEST_PLACES:
        return np.nan
    mean = profiles.mean(axis=0)
    inside = np.flatnonzero(mean > 0.5 * (np.percentile(mean, 97) + np.percentile(mean, 5)))
    return float(across[inside[-1]] - across[inside[0]]) if len(inside) else np.nan
