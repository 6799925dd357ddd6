"""The first look for a rod: votes of all its pieces, before noise, print and shadow."""

import numpy as np
import pytest

from vision.pictures.pixel_noise import Noise
from vision.wire.bands import Band, cut_pieces
from vision.wire.coarse import likely_curve, votes

REACH_PX, PIECES, PIECE_PX, NOISE = 40, 24, 16, 3.0
ROWS, ACROSS = PIECES * PIECE_PX, np.arange(-REACH_PX, REACH_PX + 1.0)
ALONG = np.linspace(0.0, 1.0, ROWS)[:, None]
SHAPES = np.stack([np.ones(PIECES), np.linspace(0.0, 1.0, PIECES)], axis=1)
GRIDS = [np.arange(-10.0, 11.0, 2.0), np.arange(-30.0, 31.0, 2.0)]


def noisy(rng, grey):
    """A picture (rows, across) of this grey level."""
    return grey + NOISE * rng.standard_normal((ROWS, len(ACROSS)))


def found(frame, background, still):
    """Places (s,) of the likeliest of straight lines at each piece, px, and whether it is sure."""
    band = Band(
        np.tile(ACROSS, (ROWS, 1)),
        frame,
        background,
        np.zeros((ROWS, 2)),
        np.tile([0.0, 1.0], (ROWS, 1)),
        ALONG[:, 0],
        np.full(ROWS, 2.0),
        still,
    )
    pieces = cut_pieces([band], PIECE_PX, Noise(NOISE**2, 0.0))
    best, sure = likely_curve([votes(pieces, 0.15, REACH_PX)], SHAPES, GRIDS)
    return SHAPES @ best, sure


def line(off_px, wide_px=2.0):
    """Where (rows, across) a line is that goes off by so much from end to end."""
    return np.abs(ACROSS - off_px * ALONG) <= wide_px


def test_a_wire_as_bright_as_the_noise_is_found_by_all_its_pieces(rng):
    """Five columns of 16 pixels, one noise level bright: 18 sigma, and 6 to 9 at half of that."""
    frame = noisy(rng, 50.0 + NOISE * line(20.0))
    place, sure = found(frame, noisy(rng, 50.0), 50.0 + 0.3 * (noisy(rng, 50.0) - 50.0))
    assert sure and np.allclose(place, SHAPES @ [0.0, 20.0], atol=2.0)  # a step of the grid


@pytest.mark.parametrize("wire", [0.0, 30.0])
def test_a_wire_over_print_is_told_from_a_shadow_that_stands_still(rng, wire):
    """A dark wire is no darker than every other square; the shadow's edge is, as the frames see it, plainer than it."""
    print_ = np.where((np.arange(ROWS)[:, None] // 40 + (ACROSS + 300) // 40) % 2, 150.0, 30.0)
    shaded = np.where(25.0 - 30.0 * ALONG[:] < ACROSS, 0.5, 1.0) * print_
    frame = np.where(line(12.0), wire, shaded)
    place, sure = found(noisy(rng, frame), noisy(rng, print_), shaded)
    assert sure and np.allclose(place, SHAPES @ [0.0, 12.0], atol=2.0)


def test_noise_is_no_wire(rng):
    """Thirty pictures of nothing: 8 sigma are passed by one in 10 000 or so (300 had one above 6)."""
    still = np.full((ROWS, len(ACROSS)), 50.0)
    assert not any(found(noisy(rng, 50.0), noisy(rng, 50.0), still)[1] for _ in range(30))
