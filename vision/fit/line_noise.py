"""The precision of each camera's lines of wire and bar in a few numbers: of a fit, or of a planned
one.
"""

from dataclasses import dataclass

import numpy as np

from vision.fit.object_rows import object_rows
from vision.fit.problem import Problem


@dataclass(frozen=True, eq=False)
class LineNoise:
    """Precision of one camera's lines in one whisk.

    wire_px: sigma of a point of the wire (one for each piece), scatter about the fit and what
    neighbours share included; NaN where it has none. alike: the correlation of a point's error with
    the next one's. bar_px (k, 3): of each line of the bar its side (0 the middle, ±1 an edge), and
    sigma at the two places where it is handed on; none of an outline that is no bar's.
    """

    wire_px: float
    alike: float
    bar_px: np.ndarray


def line_noise(problem: Problem) -> dict[str, LineNoise]:
    """Return by camera the noise of a fit's line points; of many sigmas that with the same
    precision.
    """
    correlation = problem.neighbour_correlation or [0.0] * len(problem.cameras)
    found = {}
    for camera, name in enumerate(problem.cameras.names):
        wire_px = _wire_sigma_px(problem, camera)
        found[name] = LineNoise(wire_px, correlation[camera], _bar_sigmas_px(problem, camera))
    return found


def _wire_sigma_px(problem: Problem, camera: int) -> float:
    """Return the sigma of one camera's points of the wire, px; NaN where it has none."""
    own = problem.seen_of_wire(camera)
    if not own:
        return float("nan")
    sigma_px = np.concatenate([one.points.sigma_px for one in own])
    return float(np.mean(sigma_px**-2.0) ** -0.5)


def _bar_sigmas_px(problem: Problem, camera: int) -> np.ndarray:
    """Return side and two sigmas (k, 3) of one camera's lines of the bar."""
    rows = object_rows(problem)
    lines = []
    for one in problem.seen:
        if one.camera == camera and not one.on_wire:
            lines += rows.sigmas_px(one)
    return np.array(lines, dtype=float).reshape(-1, 3)
