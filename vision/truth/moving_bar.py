"""The bar of a whisk through which it moves: its line read frame by frame, each in the one picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vision.geometry.contact import BarAxis
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View
from vision.truth.strategies import BarMiddles
from vision.wire.points import LinePoints

# [frames] Of a whisk, in which the line of a bar that moves is read: it is then known as well as
# the wire is. Study: chosen.
_MOST_FRAMES = 12


@dataclass
class BarInFrames:
    """The bar's middle in single frames of all views; each: what was measured in a frame before."""

    views: Sequence[View]
    radius_mm: float
    settings: VisionSettings
    each: dict[int, BarMiddles] = field(default_factory=dict)

    def observed(
        self,
        axis: BarAxis,
        came_mm: np.ndarray,
        frames: Sequence[int],
        wires_px: Mapping[str, Sequence[np.ndarray]],
        *,
        last: bool,
    ) -> dict[str, list[tuple[int, int, LinePoints]]]:
        """See `BarMiddles.observed`; in frame k the bar is came_mm[k] (f, 3) away from the axis."""
        found: dict[str, list] = {}
        for k in np.unique(
            np.linspace(0, len(frames) - 1, _MOST_FRAMES).round().astype(int)
        ).tolist():
            there = BarAxis(axis.point_mm + came_mm[k], axis.direction)
            wires = {name: [lines[k]] for name, lines in wires_px.items()}
            for name, sides in self._in(frames[k]).points(there, wires, last=last).items():
                found.setdefault(name, []).extend(
                    (k, side, points) for side, points in sides.items()
                )
        return found

    def _in(self, frame: int) -> BarMiddles:
        if frame not in self.each:
            self.each[frame] = BarMiddles(
                in_one_frame(self.views, frame), self.radius_mm, self.settings
            )
        return self.each[frame]


def in_one_frame(views: Sequence[View], frame: int) -> list[View]:
    """What the views show in one frame alone."""
    return [
        replace(view, frames={frame: view.frames[frame]}) for view in views if frame in view.frames
    ]
