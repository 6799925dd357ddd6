"""What each camera's lines of wire and bar are worth, in a few numbers: as a fit found them, or as one is planned."""

from dataclasses import dataclass

import numpy as np

from vision.fit.problem import Problem


@dataclass(frozen=True, eq=False)
class LineNoise:
    """Of one camera's lines in one whisk.

    wire_px: sigma of a point of the wire (one for each piece), scatter about the fit and what neighbours share
    included; NaN where it has none. alike: how much of its error a point shares with the next one. bar_px (k, 3): of
    each line of the bar its side (0 the middle, ±1 an edge), and sigma at the two places where it is handed on; none of
    an outline that is no bar's.
    """

    wire_px: float
    alike: float
    bar_px: np.ndarray


def line_noise(problem: Problem) -> dict[str, LineNoise]:
    """By camera, from the line points of a fit; of many sigmas that which has the same information."""
    alike = [
        *problem.neighbour_correlation,
        *[0.0] * (len(problem.cameras) - len(problem.neighbour_correlation)),
    ]
    return {
        name: LineNoise(_of_wire(problem, camera), alike[camera], _of_bar(problem, camera))
        for camera, name in enumerate(problem.cameras.names)
    }


def _of_wire(problem: Problem, camera: int) -> float:
    sigmas = [
        seen.points.sigma_px for seen in problem.seen if seen.camera == camera and seen.frame >= 0
    ]
    return float(np.mean(np.concatenate(sigmas) ** -2.0) ** -0.5) if sigmas else float("nan")


def _of_bar(problem: Problem, camera: int) -> np.ndarray:
    bars = (
        ()
        if problem.is_rounded
        else [one for one in problem.seen if one.camera == camera and one.frame < 0]
    )
    lines = [[seen.side, *seen.points.sigma_px] for seen in bars]
    return np.array(lines, dtype=float).reshape(-1, 3)
