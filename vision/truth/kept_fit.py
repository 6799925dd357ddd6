"""What is kept of a whisk's fit so that it can be fitted again where the cameras stand a little elsewhere.

The free strokes that place the rig move all cameras together, after the lines of wire and bar were measured. The
lines are the pictures' own, wherever the rig is: they are fitted once more (`vision.truth.explanations.fit_again`),
and no picture is searched or traced again.
"""

from dataclasses import dataclass, replace

import numpy as np

from vision.fit.bend_onset import Onset
from vision.geometry.reasons import Reason
from vision.wire.one_sided import WireAppearance
from vision.wire.points import Observed


@dataclass(frozen=True, eq=False)
class KeptFit:
    """The fit of a whisk to a straight bar that stands.

    number: of the whisk. cameras: names of those in the fit. indices: frames of the stroke; frames (f,): those fitted.
    point_mm, direction (3,): of the axis from which the bar is counted. vector (size,), arcs_mm (f,): the fit's state.
    touching, bent, seen, onset, neighbour_correlation: as of `vision.fit.problem.Problem`. light: how each camera sees
    the wire. left_out, warning: on cameras that are not used, and on another place of the bar.
    """

    number: int
    cameras: tuple[str, ...]
    indices: tuple[int, ...]
    frames: tuple[int, ...]
    point_mm: np.ndarray
    direction: np.ndarray
    vector: np.ndarray
    arcs_mm: np.ndarray
    touching: np.ndarray
    bent: np.ndarray
    seen: tuple[Observed, ...]
    onset: Onset | None
    neighbour_correlation: tuple[float, ...]
    light: dict[str, WireAppearance]
    left_out: Reason
    warning: Reason

    def observed(self) -> list[Observed]:
        """Return the lines. A blur that is not known has an infinite sigma, which files write as NaN."""
        lines = []
        for one in self.seen:
            widened_px2 = np.nan_to_num(one.points.widened_px2, nan=np.inf, posinf=np.inf)
            lines.append(replace(one, points=replace(one.points, widened_px2=widened_px2)))
        return lines
