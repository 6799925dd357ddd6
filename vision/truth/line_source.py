"""Where the line points of a whisk come from, which its fit does not know.

A pass of the fit needs points near the curves of the pass before. They are traced in pictures
(`vision.truth.traced_lines`), or predicted for a whisk that is known exactly
(`vision.truth.predicted_lines`), or another program has traced them (`vision.truth.given_traces`).
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.fit.first_bends import next_bend
from vision.geometry.refusals import Refused
from vision.geometry.touched import Axis
from vision.truth.readers import ObjectReader
from vision.truth.whisk_place import WhiskPlace
from vision.wire.points import Observed

# [px] A camera whose points scatter by more sees another thing: where a wire is seen at all its
# points lie on one line to a tenth of a pixel. Study: thresholds.py
# truth.line_source _MOST_SCATTER_PX ….
_MOST_SCATTER_PX = 0.7
_HIDDEN = "no camera shows enough of the {}"


@dataclass(frozen=True, eq=False)
class StrokeBends:
    """The wire's bends in the frames of a stroke.

    frames: numbers of f frames. motor_rad (f,), bend_rad (f, 2): motor angle and bend in each.
    """

    frames: Sequence[int]
    motor_rad: np.ndarray
    bend_rad: np.ndarray

    def at(self, frames: Sequence[int], motor_rad: np.ndarray) -> np.ndarray | None:
        """Return the bends (n, 2), rad, of another stroke in its frames at motor angles (n,).

        They are right to a pixel where the whisker is pushed in the same way. None where it is not: on
        the way back friction turns round, and no bend is known more than a frame's step beyond the
        largest angle.
        """
        goes_on = frames[-1] > frames[0]
        went_on = self.frames[-1] > self.frames[0]
        order = np.argsort(self.motor_rad)
        known_rad = self.motor_rad[order]
        next_rad = 2.0 * known_rad[-1] - known_rad[-2]
        if goes_on != went_on or np.max(motor_rad) > next_rad:
            return None
        bend_rad = self.bend_rad[order]
        known_rad = np.append(known_rad, next_rad)
        bend_rad = np.vstack([bend_rad, next_bend(bend_rad)])
        return np.stack([np.interp(motor_rad, known_rad, one) for one in bend_rad.T], axis=1)


@dataclass(frozen=True, eq=False)
class EarlierWhisk:
    """What a whisk has shown, from which the search and the fit of the next one begin.

    axis: of the object. rest_mm (2, 4): rest shape of the wire. blur_px: of each camera's lens. reader: of
    the object's lines, and bends: of the wire; None of a whisk of another trial, which has other mean
    pictures and another object.
    """

    axis: Axis
    rest_mm: np.ndarray
    blur_px: Mapping[str, float]
    reader: ObjectReader | None = None
    bends: StrokeBends | None = None


class LineSource(ABC):
    """What gives the line points of a whisk in all its cameras.

    Points of the wire are numbered by their frame's position among the curves.
    """

    @property
    def most_scatter_px(self) -> float:
        """Return by how much a camera's points may scatter about a wire, px."""
        return _MOST_SCATTER_PX

    @abstractmethod
    def wire_points(self, place: WhiskPlace, *, last: bool) -> dict[str, list[Observed]]:
        """Return by camera the wire's points near its curves; every camera is there, with points or without.

        last: no pass follows.
        """

    @abstractmethod
    def object_points(self, place: WhiskPlace, *, last: bool) -> dict[str, list[Observed]]:
        """Return by camera the points of the object's outline; cameras without any may be absent.

        last: no pass follows. Raises Refused where the object is not seen clearly.
        """

    def all_points(self, place: WhiskPlace, *, last: bool) -> list[Observed]:
        """Return the points of wire and object, camera by camera.

        Raises Refused where one of them is seen in no camera.
        """
        on_object = self.object_points(place, last=last)
        seen = []
        for name, on_wire in self.wire_points(place, last=last).items():
            seen += on_wire
            seen += on_object.get(name, [])
        self.require_rods(seen)
        return seen

    def require_rods(self, seen: Sequence[Observed]) -> None:
        """Raise Refused where wire or bar is seen in no camera."""
        require_wire(seen)
        if all(one.on_wire for one in seen):
            raise Refused(_HIDDEN.format("bar clear of the wire"), code="rod_hidden")


def require_wire(seen: Sequence[Observed]) -> None:
    """Raise Refused where no camera has a point of the wire."""
    if not any(one.on_wire for one in seen):
        raise Refused(_HIDDEN.format("wire clear of the bar"), code="rod_hidden")
