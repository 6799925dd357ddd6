"""One camera's pictures of a whisk, beside the picture without rods."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vision.geometry.camera import Camera
from vision.pictures.others import Others, RodLines, covered
from vision.pictures.pixel_noise import Noise

# [frames] Whose brightest pixel tells how many bits the sensor has: what is saturated is so in
# all of them. Stated.
_SCALE_OF = 3
# [1] Of full scale: above, the sensor cut off and what it saw is not known. Five levels of 255
# for a picture's compression; set by eye. Study: bar_scenes.py.
SATURATED = 250.0 / 255.0
# [frames] More would not make a still thing clearer: noise is down by 6.3. Derived.
MEAN_OF = 40
# [frames] That show a pixel of the bar clear of all wires: of a stroke that begins 3° before
# touch, in steps of 0.5°, two to three show all of it. The noise of all pixels is taken to be
# that of two. Study: arrays_seen.py.
_LEAST_CLEAR = 2


@dataclass(frozen=True)
class View:
    """One camera's pictures of a whisk: frames {index: grey}, the picture without rods, and the noise. others: rods in
    them that are not looked for; itself: the wire that is, where its place is known to a pixel or two."""

    camera: Camera
    frames: Mapping[int, np.ndarray]
    background: np.ndarray
    noise: Noise
    others: Others = field(default_factory=dict)
    itself: RodLines | None = None

    def some(self, most: int) -> list[np.ndarray]:
        """At most so many of the pictures, spread over all of them."""
        pictures = list(self.frames.values())
        return [
            pictures[int(k)] for k in np.unique(np.linspace(0, len(pictures) - 1, most).round())
        ]

    @cached_property
    def full_scale(self) -> float:
        """The brightest that the sensor can say, grey levels: of 8 bit, or of as many as the pictures show."""
        brightest = max(float(np.max(picture)) for picture in self.some(_SCALE_OF))
        return 2.0 ** max(8, int(np.ceil(np.log2(brightest + 1.0)))) - 1.0

    @property
    def mean_share(self) -> float:
        """What part of one picture's variance the mean has; where rods are known, the pixel with most has."""
        if self.itself is not None:
            return 1.0 / _LEAST_CLEAR
        return 1.0 / min(len(self.frames), MEAN_OF)

    @cached_property
    def mean(self) -> np.ndarray:
        """Mean (h, w) of the pictures, of MEAN_OF at most; where rods are known, of those in which none covers a pixel,
        NaN where one does in nearly all."""
        if self.itself is not None:
            return self._mean_of_clear({"": self.itself, **self.others})
        pictures = self.some(MEAN_OF)
        total = np.zeros(pictures[0].shape, dtype=np.float32)
        for picture in pictures:
            total += picture
        return total / len(pictures)

    def _mean_of_clear(self, rods: Others) -> np.ndarray:
        """Of pixels that a rod passes the median of clear frames, for where a rod is may be wrong in one of them."""
        frames = list(self.frames)
        chosen = [
            frames[k]
            for k in np.unique(np.linspace(0, len(frames) - 1, MEAN_OF).round().astype(int))
        ]
        hidden = np.stack([covered(rods, frame, self.frames[frame].shape) for frame in chosen])
        passed = np.any(hidden, axis=0)
        mean = np.mean([self.frames[frame] for frame in chosen], axis=0, dtype=np.float32)
        values = np.stack([self.frames[frame][passed] for frame in chosen]).astype(np.float32)
        values[hidden[:, passed]] = np.nan
        few = np.sum(~hidden[:, passed], axis=0) < _LEAST_CLEAR
        values[0, few] = 0.0  # of none at all there is no median
        mean[passed] = np.where(few, np.nan, np.nanmedian(values, axis=0))
        return mean


def median_of(pictures: Sequence[np.ndarray]) -> np.ndarray:
    """Median (h, w) of pictures (h, w) of any kind of number, of an even number the upper one: what moves vanishes.

    Each pass carries the largest of the rest to its end, whole pictures at a time: no sort of single pixels is as fast.
    """
    pictures = list(pictures)
    for last in range(len(pictures) - 1, len(pictures) // 2 - 1, -1):
        for k in range(last):
            lower = np.minimum(pictures[k], pictures[k + 1])
            pictures[k], pictures[k + 1] = lower, np.maximum(pictures[k], pictures[k + 1])
    return pictures[len(pictures) // 2]
