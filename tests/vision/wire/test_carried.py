"""A wire's line in later frames, by the shading that the first ones have shown."""

import numpy as np
import pytest

from tests.studies.accuracy.lines import (
    FRAMES,
    KNOTS,
    NOISE,
    PIECE_PX,
    SCENES,
    SHAPE,
    band,
    drawn,
    errors,
    rough_curve,
)
from vision.pictures.pixel_noise import Noise
from vision.wire.bands import cut_pieces
from vision.wire.carried import carry_on
from vision.wire.trace import SegmentPositions, points_of, trace

FIRST = 4
# [px] Bias that a line may have by its model of light, as in test_line.
BIAS_PX = 0.02


def pieces_of(scene, background, rng, frames, off_px):
    """Segments of some frames about curves that are off by as much as off_px."""
    bands = []
    for frame in frames:
        picture = drawn(scene, frame) + NOISE * rng.standard_normal(SHAPE)
        bands.append(band(scene, picture, background, rough_curve(scene, frame, off_px)))
    pieces = cut_pieces(bands, PIECE_PX, Noise(NOISE**2, 0.0))
    numbers = np.array(list(frames))
    return type(pieces)(**{**vars(pieces), "source": numbers[pieces.source]})


@pytest.fixture(params=["even rod, flat background", "highlight over printed squares"])
def carried(request, rng):
    """A scene, its first frames traced, and the later ones carried on from curves a pixel off."""
    scene = SCENES[request.param]
    background = drawn(scene, None)
    traced = trace(pieces_of(scene, background, rng, range(FIRST), 0.3), KNOTS)
    later = pieces_of(scene, background, rng, range(FIRST, FRAMES), 1.0)
    return scene, traced, carry_on(later, traced, KNOTS)


def test_later_frames_are_as_near_as_is_said(carried):
    """Own errors scatter by their sigma, of some 200 points within a fifth; a common one is within three of its own."""
    scene, _, later = carried
    points, source = points_of(later)
    off = errors(scene, points, source)
    common_px = np.linalg.norm(np.mean(later.shared_px, axis=0))
    assert abs(np.mean(off)) < BIAS_PX + 3.0 * common_px
    own = (off - np.mean(off)) / np.hypot(points.sigma_px, BIAS_PX)
    assert 0.5 < np.sqrt(np.mean(own**2)) < 1.2
    assert len(points) > 0.9 * len(later.place)


def test_the_causes_that_frames_share_are_those_of_the_first(carried):
    """What moves the segments of the first frames together moves the later ones by as much."""
    _, traced, later = carried
    first = traced.positions
    assert later.shared_px.shape[1] == first.shared_px.shape[1]
    sizes = [np.sqrt(np.mean(np.sum(one.shared_px**2, axis=1))) for one in (first, later)]
    assert sizes[1] == pytest.approx(sizes[0], rel=0.3)
    together = SegmentPositions.join([first, later])
    points, source = points_of(together)
    assert set(source.tolist()) == set(range(FRAMES)) and len(points) > 0.9 * len(together.place)


def test_a_wire_far_from_its_curve_gives_no_point(rng):
    """Five pixels off, no segment converges on the rod: it is left out, not believed."""
    scene = SCENES["even rod, flat background"]
    background = drawn(scene, None)
    traced = trace(pieces_of(scene, background, rng, range(FIRST), 0.3), KNOTS)
    later = pieces_of(scene, background, rng, range(FIRST, FRAMES), 0.3)
    points, _ = points_of(
        SegmentPositions.join(
            [traced.positions, carry_on(later.moved(np.full(len(later), 6.0)), traced, KNOTS)]
        )
    )
    assert len(points) - len(traced.pieces) < 0.05 * len(later)
