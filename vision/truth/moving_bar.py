"""The bar of a whisk through which it moves: its line, read in one picture after the other."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from vision.geometry.sampling import spread
from vision.touched.object_view import ObjectView
from vision.truth.readers import BarMiddles, ObjectReader, ReadLine
from vision.truth.whisk_place import WhiskPlace

# [frames] Of a whisk, in which the line of a bar that moves is read: it is then known as well as
# the wire is. Study: chosen.
_MOST_FRAMES = 12


@dataclass
class BarInFrames(ObjectReader):
    """A straight bar that moves, read by its middle in single frames of all views.

    readers: by frame, with what they measured in the pass before.
    """

    views: Sequence[ObjectView]
    readers: dict[int, BarMiddles] = field(default_factory=dict)

    def read(self, place: WhiskPlace, *, last: bool) -> dict[str, list[ReadLine]]:
        """Return by camera the middle of the bar in some frames."""
        found: dict[str, list[ReadLine]] = {}
        for k, frame in spread(list(enumerate(place.curves)), _MOST_FRAMES):
            seen = self._reader(frame).read(place.in_frame(k), last=last)
            for name, lines in seen.items():
                own = found.setdefault(name, [])
                own += [replace(line, frame=k) for line in lines]
        return found

    def _reader(self, frame: int) -> BarMiddles:
        """Return the reader of one frame, as it was left in the pass before."""
        if frame not in self.readers:
            showing = [view for view in self.views if frame in view.pictures.frames]
            views = [replace(view, pictures=view.pictures.in_frame(frame)) for view in showing]
            self.readers[frame] = BarMiddles(views)
        return self.readers[frame]
