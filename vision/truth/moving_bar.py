"""The bar of a whisk through which it moves: its line, read in one picture after the other."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from vision.geometry.sampling import spread
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.view import View
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

    views: Sequence[View]
    radius_mm: float
    settings: VisionSettings
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
            views = in_one_frame(self.views, frame)
            self.readers[frame] = BarMiddles(views, self.radius_mm, self.settings)
        return self.readers[frame]


def in_one_frame(views: Sequence[View], frame: int) -> list[View]:
    """Return the views that show a frame, with that frame alone."""
    showing = []
    for view in views:
        if frame in view.frames:
            showing.append(replace(view, frames={frame: view.frames[frame]}))
    return showing
