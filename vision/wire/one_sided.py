"""Light from one side: how much of a rod's known width is seen, and on which side it ends.

Where a part of the rod is as dark as what is behind it, only the lit edge is seen. The fit of the
shading knows the diameter and takes the axis from that edge; how much of the width was seen is
reported, for the fit cannot know by how much it may be wrong then.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.wire.bands import Pieces

# [px⁻¹] Bins across in which a camera's segments are added: finer than any blur. Derived.
_BINS_PER_PX = 4
# [blurs] Beyond an edge, where a twentieth of its contrast is left. Derived.
_REACH_BLURS = 1.65
# [1] What is seen exceeds this share of the strongest difference, the twentieth of the row above.
# Study: tests/vision/wire/test_one_sided.py.
_LEAST_SHARE = 0.05
# [sigma] And exceeds its noise by so much. Study: tests/vision/wire/test_one_sided.py.
_LEAST_SIGMAS = 4.0
# [noise] RMS that the model of a wire's light leaves at most: of 63 path-traced scenes 60 leave 5 at
# most, three 7 to 10. Study: path_traced.py.
_MOST_MISFIT = 7.0
# [1] Share of the width below which a rod is one-sided: one seen whole comes out at 0.95 to 1.05.
# Study: tests/vision/wire/test_one_sided.py.
_ONE_SIDED = 0.8


@dataclass(frozen=True)
class SeenWidth:
    """The width that is seen, the width by the diameter, and the offset of what is seen, px.

    off_px: of the middle of what is seen from the axis, along the normal.
    """

    seen_px: float
    expected_px: float
    off_px: float

    @property
    def is_one_sided(self) -> bool:
        """Return whether an edge of the rod is not seen."""
        return self.seen_px < _ONE_SIDED * self.expected_px

    def line(self, camera: str) -> str:
        """Return a line for the report on a camera that sees one edge alone."""
        return (
            f"camera {camera} sees {self.seen_px:.1f} of the wire's {self.expected_px:.1f} px: light from one "
            f"side; the axis was taken {abs(self.off_px):.1f} px from the middle of what is seen, by the known "
            "diameter"
        )


def seen_width(pieces: Pieces, blur_px: float) -> SeenWidth:
    """Measure how wide the rod is seen, from the difference of segments to their background.

    The segments lie where the rod was found; blur_px: of the lens.
    """
    width_px = 2.0 * float(np.median(pieces.radius_px))
    reach_px = 0.5 * width_px + 3.0 * blur_px
    seen = np.flatnonzero(_seen_bins(pieces, reach_px))
    if len(seen) == 0:
        return SeenWidth(0.0, width_px, 0.0)
    low = seen[0] / _BINS_PER_PX - reach_px
    high = (seen[-1] + 1) / _BINS_PER_PX - reach_px
    seen_px = max(float(high - low) - 2 * _REACH_BLURS * blur_px, 0.0)
    return SeenWidth(seen_px, width_px, 0.5 * float(low + high))


def _seen_bins(pieces: Pieces, reach_px: float) -> np.ndarray:
    """Return in which bins across, from -reach_px on, the segments differ from their background."""
    is_used = (pieces.weight > 0) & (np.abs(pieces.offset_px) < reach_px)
    from_edge_px = pieces.offset_px[is_used] + reach_px
    bins = np.floor(from_edge_px * _BINS_PER_PX).astype(int)
    size = int(np.ceil(2 * reach_px * _BINS_PER_PX)) + 1
    count = np.maximum(np.bincount(bins, minlength=size), 1)
    variance = pieces.weight[is_used] ** -2.0
    difference = (pieces.grey - pieces.background)[is_used]
    power = _means(bins, difference**2 - variance, count)
    power_sigma = _means(bins, variance, count) * np.sqrt(2.0 / count)
    strength = np.sqrt(np.maximum(power, 0.0))
    exceeds_noise = power > _LEAST_SIGMAS * power_sigma
    is_strong = strength > _LEAST_SHARE * strength.max()
    return exceeds_noise & is_strong


def _means(bins: np.ndarray, values: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return the mean (b,) of values (n,) in each bin, of which count (b,) values are."""
    return np.bincount(bins, values, minlength=len(count)) / count


@dataclass(frozen=True)
class WireAppearance:
    """How one camera sees the wire: lens blur in px, and the width that is seen.

    misfit: RMS that the model of its light leaves in the median segment, over the noise.
    """

    blur_px: float
    width: SeenWidth
    misfit: float = 0.0

    def warning(self, camera: str) -> str:
        """Return a sentence where the wire's light is not explained, else an empty text.

        Its line may then be anywhere near.
        """
        if self.misfit < _MOST_MISFIT:
            return ""
        return (
            f"camera {camera}: the wire's light differs from that of any lit wire by {self.misfit:.0f} times the "
            f"noise, {_MOST_MISFIT:g} is allowed: look for a highlight along it, or something before it"
        )


def one_sided_widths(whisks: Sequence[Mapping[str, WireAppearance]]) -> dict[str, SeenWidth]:
    """Return the least width by camera that sees light from one side.

    whisks: how each camera sees the wire in each whisk.
    """
    least: dict[str, SeenWidth] = {}
    for whisk in whisks:
        for camera, appearance in whisk.items():
            if camera not in least or appearance.width.seen_px < least[camera].seen_px:
                least[camera] = appearance.width
    return {camera: width for camera, width in least.items() if width.is_one_sided}
