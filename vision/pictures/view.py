"""One camera's pictures of a whisk, with the picture without rods."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.sampling import spread
from vision.pictures.change import HALF
from vision.pictures.others import Others, RodLines, mask_rods
from vision.pictures.pixel_noise import Noise

# [frames] Whose brightest pixel shows how many bits the sensor has: what is saturated is so in
# all of them. Stated.
_SCALE_OF = 3
# [1] Of full scale: above, the sensor cut off and what it saw is not known. Five levels of 255
# for a picture's compression. By 0.96 a slope moves by 0.3 sigma, by 0.996 by 0.03. Study:
# thresholds.py pictures.view SATURATED ….
SATURATED = 250.0 / 255.0
# [frames] More would not make a still thing clearer: noise is down by 6.3. Derived.
MEAN_OF = 40
# [frames] In whose median what moves vanishes. More would not make it less noisy: it has 0.38 of a
# frame's noise. Derived.
MEDIAN_OF = 11
# [frames] That show a pixel of the bar clear of all wires: of a stroke that begins 3° before
# touch, in steps of 0.5°, two to three show all of it. The noise of all pixels is taken to be
# that of two. Study: arrays_seen.py.
_LEAST_CLEAR = 2


@dataclass(frozen=True)
class View:
    """One camera's pictures of a whisk.

    frames: grey (h, w) by index. background: the picture without rods. noise: of a pixel. others:
    rods besides the one that is measured. itself: that one, where its place is known to a pixel or
    two.
    """

    camera: Camera
    frames: Mapping[int, np.ndarray]
    background: np.ndarray
    noise: Noise
    others: Others = field(default_factory=dict)
    itself: RodLines | None = None

    def in_frame(self, frame: int) -> Self:
        """Return the view with one of its frames alone."""
        return replace(self, frames={frame: self.frames[frame]})

    def sample_frames(self, most: int) -> list[int]:
        """Return the indices of at most so many frames, spread over all of them."""
        return spread(list(self.frames), most)

    def some(self, most: int) -> list[np.ndarray]:
        """Return at most so many of the pictures, spread over all of them."""
        return [self.frames[frame] for frame in self.sample_frames(most)]

    @cached_property
    def full_scale(self) -> float:
        """Return the sensor's brightest grey level, of 8 bit or of as many as the pictures show."""
        brightest = max(float(np.max(picture)) for picture in self.some(_SCALE_OF))
        bits = max(8, int(np.ceil(np.log2(brightest + 1.0))))
        return 2.0**bits - 1.0

    @cached_property
    def still(self) -> np.ndarray:
        """Return the picture (h, w) of what stands still, at every HALF-th pixel.

        It is the median of some frames. A wire that moves vanishes. Where rods are known it is the
        mean without these, so that a wire that rests on the bar vanishes, too.
        """
        frames = [np.ascontiguousarray(one[::HALF, ::HALF]) for one in self.some(MEDIAN_OF)]
        median = median_of(frames)
        if self.itself is None:
            return median
        mean = self.mean[::HALF, ::HALF]
        return np.where(np.isnan(mean), median, mean)

    @property
    def half_background(self) -> np.ndarray:
        """Return the background (h, w) at every HALF-th pixel."""
        return self.background[::HALF, ::HALF]

    @property
    def mean_share(self) -> float:
        """Return the variance of the mean over one picture's.

        Where rods are known, it is that of the pixel with most.
        """
        if self.itself is not None:
            return 1.0 / _LEAST_CLEAR
        return 1.0 / min(len(self.frames), MEAN_OF)

    @cached_property
    def mean(self) -> np.ndarray:
        """Return the mean (h, w) of MEAN_OF pictures at most.

        Where rods are known, it is that of the pictures in which none covers a pixel, NaN where one
        does in nearly all.
        """
        if self.itself is not None:
            return self._mean_of_clear({"": self.itself, **self.others})
        pictures = self.some(MEAN_OF)
        total = np.zeros(pictures[0].shape, dtype=np.float32)
        for picture in pictures:
            total += picture
        return total / len(pictures)

    def _mean_of_clear(self, rods: Others) -> np.ndarray:
        """Average the frames; pixels that a rod passes have the median of their clear frames.

        The median, because the place of a rod may be wrong in one of them.
        """
        frames = self.sample_frames(MEAN_OF)
        pictures = np.stack([self.frames[frame] for frame in frames])  # (frames, h, w)
        hidden = np.stack([mask_rods(rods, frame, pictures[0].shape) for frame in frames])
        passed = np.any(hidden, axis=0)
        clear = ~hidden[:, passed]  # (frames, pixels)
        mean = np.mean(pictures, axis=0, dtype=np.float32)
        values = np.where(clear, pictures[:, passed].astype(np.float32), np.float32(np.nan))
        is_seen = np.sum(clear, axis=0) >= _LEAST_CLEAR
        medians = np.full(len(is_seen), np.nan, dtype=np.float32)
        medians[is_seen] = np.nanmedian(values[:, is_seen], axis=0)
        mean[passed] = medians
        return mean


def median_of(pictures: Sequence[np.ndarray]) -> np.ndarray:
    """Return the median (h, w) of pictures, of an even number the upper one: what moves vanishes.

    Each pass carries the largest of the rest to its end, whole pictures at a time: no sort of
    single pixels is as fast.
    """
    pictures = list(pictures)
    middle = len(pictures) // 2
    for last in range(len(pictures) - 1, middle - 1, -1):
        for k in range(last):
            lower = np.minimum(pictures[k], pictures[k + 1])
            pictures[k + 1] = np.maximum(pictures[k], pictures[k + 1])
            pictures[k] = lower
    return pictures[middle]
