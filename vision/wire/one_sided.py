"""Light from one side: how much of a rod's known width is seen, and on which side it ends.

Where a part of the rod is as dark as what is behind it, only the lit edge is seen. The fit of the shading knows the
diameter and takes the axis from that edge; what it cannot know is by how much, so the share that is seen is told.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.wire.bands import Pieces

# [px⁻¹] Bins across in which a camera's pieces are added: finer than any blur. Derived.
_BINS_PER_PX = 4
# [blurs] Beyond an edge, where a twentieth of its contrast is left. Derived.
_REACHES = 1.65
# [1, sigma] What is seen is more than this share of the strongest difference, the twentieth of
# the row above, and of its noise. Study: tests/vision/wire/test_one_sided.py.
_LEAST, _SIGMAS = 0.05, 4.0
# [noise] What the model of a wire's light leaves, RMS: of 63 path-traced scenes 60 leave 5 at
# most, three 7 to 10. Study: path_traced.py.
_MOST_MISFIT = 7.0
# [1] Share of the width below which a rod is one-sided: one seen whole comes out at 0.95 to 1.05.
# Study: tests/vision/wire/test_one_sided.py.
_ONE_SIDED = 0.8


@dataclass(frozen=True)
class SeenWidth:
    """Width seen and by the diameter, px, and by how far the middle of what is seen lies off the axis, along the
    normal."""

    seen_px: float
    expected_px: float
    off_px: float

    @property
    def one_sided(self) -> bool:
        """Whether an edge of the rod is not seen."""
        return self.seen_px < _ONE_SIDED * self.expected_px

    def line(self, camera: str) -> str:
        """For the report; empty where both edges are seen."""
        if not self.one_sided:
            return ""
        return (
            f"camera {camera} sees {self.seen_px:.1f} of the wire's {self.expected_px:.1f} px: light from one "
            f"side; the axis was taken {abs(self.off_px):.1f} px from the middle of what is seen, by the known "
            "diameter"
        )


def seen_width(pieces: Pieces, blur_px: float) -> SeenWidth:
    """How wide the rod is seen over pieces that lie where they were found, from their difference to the background."""
    width_px = 2.0 * float(np.median(pieces.radius_px))
    reach = 0.5 * width_px + 3.0 * blur_px
    use = (pieces.weight > 0) & (np.abs(pieces.offset_px) < reach)
    bins = np.floor((pieces.offset_px[use] + reach) * _BINS_PER_PX).astype(int)
    size = int(np.ceil(2 * reach * _BINS_PER_PX)) + 1
    count = np.maximum(np.bincount(bins, minlength=size), 1)
    squares = (pieces.grey - pieces.background)[use] ** 2 - pieces.weight[use] ** -2.0
    power = np.bincount(bins, squares, minlength=size) / count
    noise = (
        np.bincount(bins, pieces.weight[use] ** -2.0, minlength=size) / count * np.sqrt(2.0 / count)
    )
    strength = np.sqrt(np.maximum(power, 0.0))
    plain = np.flatnonzero((power > _SIGMAS * noise) & (strength > _LEAST * strength.max()))
    if len(plain) == 0:
        return SeenWidth(0.0, width_px, 0.0)
    low, high = plain[0] / _BINS_PER_PX - reach, (plain[-1] + 1) / _BINS_PER_PX - reach
    return SeenWidth(
        max(float(high - low) - 2 * _REACHES * blur_px, 0.0), width_px, 0.5 * float(low + high)
    )


@dataclass(frozen=True)
class WireAppearance:
    """How one camera sees the wire: lens blur in px, the width seen, and what the model of its light leaves in the
    median piece, over the noise, RMS."""

    blur_px: float
    width: SeenWidth
    misfit: float = 0.0

    def doubt(self, camera: str) -> str:
        """A sentence where the wire's light is not explained, '' where it is: its line may then be anywhere near."""
        if self.misfit < _MOST_MISFIT:
            return ""
        return (
            f"camera {camera}: the wire's light differs from that of any lit wire by {self.misfit:.0f} times the "
            f"noise, {_MOST_MISFIT:g} is allowed: look for a highlight along it, or something before it"
        )


def one_sided_lines(whisks: Sequence[Mapping[str, WireAppearance]]) -> tuple[str, ...]:
    """A line a camera that sees light from one side, from the whisk in which it saw least."""
    least: dict[str, WireAppearance] = {}
    for whisk in whisks:
        for camera, appearance in whisk.items():
            if camera not in least or appearance.width.seen_px < least[camera].width.seen_px:
                least[camera] = appearance
    return tuple(
        filter(None, (appearance.width.line(camera) for camera, appearance in least.items()))
    )
