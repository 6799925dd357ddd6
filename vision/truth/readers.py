"""How the edges of the touched object are read, pass by pass, in the pictures of one whisk.

A reader keeps what it measured in the pass before: from that a fine measurement begins. A straight
bar is read by its middle; by its two edges as well, where its distance is that at which it appears
as wide as it is. Any other object is read by its silhouette. Which reader an object has is chosen
in `vision.truth.strategies`.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field

from vision.geometry.refusals import Refused
from vision.touched.edges import measure_edges
from vision.touched.line import BarLineEstimate, measure_bars
from vision.touched.object_view import ObjectView
from vision.touched.silhouette_edges import SilhouetteEdges, measure_silhouette_edges
from vision.truth.whisk_place import WhiskPlace
from vision.wire.points import LinePoints

# [px] How far off a silhouette may be that was fitted to coarse edges. Stated.
_OFF_PX = 3.0
# [nats] How much more probable a silhouette's edges are than edges anywhere, in all cameras: a
# wrong place said 2, true ones 3.8 to 7.9. Study: rounded_seen.py.
_LEAST_EVIDENCE = 3.0
# [segments] Of a silhouette: a camera in which so many were tried and none shows an edge
# contradicts the others, as one did that had a cone upside down. Study: rounded_seen.py.
_MANY_SEGMENTS = 4


@dataclass(frozen=True)
class ReadLine:
    """Line points of the object in one camera.

    side: see `vision.wire.points.Observed`. frame: of the fit, in which an object that moves was
    read; else 0.
    """

    points: LinePoints
    side: int
    frame: int = 0


class ObjectReader(ABC):
    """What reads the touched object's edges in all views of a whisk."""

    def begin_as(self, earlier: "ObjectReader") -> None:  # noqa: B027
        """Begin from what a reader of the same form has read in an earlier whisk of the same trial."""

    @abstractmethod
    def read(self, place: WhiskPlace, *, last: bool) -> dict[str, list[ReadLine]]:
        """Return by camera the lines of the object.

        last: no pass follows, so that even a first measurement is refined. Raises Refused where the
        object is not seen clearly.
        """


@dataclass
class BarMiddles(ObjectReader):
    """A straight bar, read by its middle in each view.

    lines: by camera, as measured in the pass before. are_fine: whether they were measured finely;
    then they stay, as another measurement of the same pixels adds nothing.
    """

    views: Sequence[ObjectView]
    lines: dict[str, BarLineEstimate] = field(default_factory=dict)
    are_fine: bool = False

    def begin_as(self, earlier: "BarMiddles") -> None:
        """Begin with the lines of an earlier whisk, where that had the same cameras: they are of the
        trial's mean pictures.
        """
        names = [view.camera.name for view in self.views]
        if names == [view.camera.name for view in earlier.views]:
            self.lines = earlier.lines
            self.are_fine = earlier.are_fine

    def read(self, place: WhiskPlace, *, last: bool) -> dict[str, list[ReadLine]]:
        """Return by camera the middle of the bar, where there is one."""
        is_only = last and not self.lines
        for _ in range(2 if is_only else 1):
            if not self.are_fine:
                self._measure(place)
        return {
            name: [ReadLine(line.points, 0)] for name, line in self.lines.items() if line.is_bar
        }

    def _measure(self, place: WhiskPlace) -> None:
        """Measure the middles, finely where they were measured before."""
        self.are_fine = bool(self.lines)
        self.lines = measure_bars(place.crossed(self.views), place.axis, self.lines)


class BarEdges(BarMiddles):
    """A straight bar, read by its two edges; by its middle where they are not seen."""

    def read(self, place: WhiskPlace, *, last: bool) -> dict[str, list[ReadLine]]:
        """Return by camera the two edges of the bar, sides -1 and 1, or its middle."""
        found = super().read(place, last=last)
        for view in place.crossed(self.views):
            edges = measure_edges(view, place.axis)
            if edges:
                found[view.camera.name] = [ReadLine(points, side) for side, points in edges.items()]
        return found


@dataclass
class SilhouetteReader(ObjectReader):
    """An object that is no straight bar, read by the edges of its silhouette in each view.

    silhouettes: by camera, as measured in the pass before.
    """

    views: Sequence[ObjectView]
    silhouettes: dict[str, SilhouetteEdges] = field(default_factory=dict)

    def read(self, place: WhiskPlace, *, last: bool) -> dict[str, list[ReadLine]]:
        """Return by camera the edges of the silhouette, all on side 1.

        Raises Refused where no silhouette is clear, or a camera contradicts the others.
        """
        is_only = last and not self.silhouettes
        for _ in range(2 if is_only else 1):
            self.silhouettes = measure_silhouette_edges(
                place.crossed(self.views), place.axis, _OFF_PX, self.silhouettes
            )
        self._require_clear()
        found = {}
        for name, silhouette in self.silhouettes.items():
            if len(silhouette.points):
                found[name] = [ReadLine(silhouette.points, 1)]
        return found

    def _require_clear(self) -> None:
        """Raise Refused where no silhouette is clear, or a camera contradicts the others."""
        for name, silhouette in self.silhouettes.items():
            if silhouette.segments >= _MANY_SEGMENTS and not len(silhouette.points):
                raise Refused(
                    f"camera {name} shows no edge of the object where the other cameras have it",
                    code="no_object_edge",
                )
        if sum(one.log_evidence for one in self.silhouettes.values()) < _LEAST_EVIDENCE:
            raise Refused(
                "no clear outline of the object is seen: too little of its edges stands out",
                code="no_object_outline",
            )
