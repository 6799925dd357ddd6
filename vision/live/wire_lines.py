"""The wire's lines in a whisk that is being recorded: traced together in its first frames, then carried on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from vision.truth.traced_lines import TracedLines, clear_pieces, trace_camera, wire_knots
from vision.truth.whisk_pictures import WhiskPictures
from vision.truth.whisk_place import WhiskPlace
from vision.wire.carried import carry_on
from vision.wire.one_sided import WireAppearance
from vision.wire.points import Observed
from vision.wire.shading import LIT_ALIKE_RAD, Knots
from vision.wire.trace import SegmentPositions, WireTrace, observed, points_of

# [rad] A wire that is lit otherwise than where it was traced (`LIT_ALIKE_RAD`) is traced anew, in the frames
# of so much of the stroke before: then it is lit alike for two more degrees. Stated.
_TRACED_RAD = np.radians(6.0)


@dataclass(eq=False)
class WireLines:
    """The wire in each camera: how it is lit, by the frames that were traced, and its segments in all.

    frames: in which it is known. first_rad: motor angle of the first of them. light: how each camera
    sees it.
    """

    traced: dict[str, WireTrace]
    knots: Knots
    first_rad: float
    light: dict[str, WireAppearance]
    frames: list[int]
    segments: dict[str, list[SegmentPositions]] = field(default_factory=dict)

    @classmethod
    def trace(cls, whisk: WhiskPictures, place: WhiskPlace, blur_px: Mapping[str, float]) -> Self:
        """Trace the wire in all frames of a whisk; blur_px: of each lens, by a pass before."""
        traced = {}
        segments = {}
        for view in whisk.views:
            name = view.camera.name
            found = trace_camera(whisk, view, place, blur_px=blur_px.get(name), last=True)
            if found is not None:
                traced[name] = found
                segments[name] = [found.positions]
        first_rad = float(np.min(whisk.angles_rad))
        frames = list(whisk.frames)
        return cls(traced, wire_knots(whisk), first_rad, whisk.light, frames, segments)

    def is_lit_alike(self, motor_rad: float) -> bool:
        """Return whether the wire is lit at a motor angle as in the frames that were traced."""
        return abs(motor_rad - self.first_rad) <= LIT_ALIKE_RAD

    def carry_on(self, whisk: WhiskPictures, place: WhiskPlace) -> None:
        """Find the wire in the frames of a whisk, which come later."""
        for view in whisk.views:
            traced = self.traced.get(view.camera.name)
            pieces = clear_pieces(whisk, view, place)
            if traced is not None and len(pieces):
                found = carry_on(pieces, traced, self.knots)
                self.segments[view.camera.name].append(found)
        self.frames += whisk.frames


def frames_lit_alike(frames: Sequence[int], motor_rad: Mapping[int, float]) -> list[int]:
    """Return the frames to trace together: those in which the wire is lit as in the last one."""
    last_rad = motor_rad[frames[-1]]
    return [frame for frame in frames if abs(motor_rad[frame] - last_rad) <= _TRACED_RAD]


@dataclass
class CarriedLines(TracedLines):
    """The lines of a whisk whose wire is traced already; the object's are traced as by `TracedLines`."""

    wire: WireLines | None = None

    def wire_points(self, place: WhiskPlace, *, last: bool) -> dict[str, list[Observed]]:
        """Return by camera the wire's points in the frames that have a curve."""
        found = {}
        for number, name in enumerate(self.whisk.cameras.names):
            found[name] = []
            if name in self.wire.segments:
                points, source = points_of(SegmentPositions.join(self.wire.segments[name]))
                found[name] = observed(points, source, number, list(place.curves))
        return found
