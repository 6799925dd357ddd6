"""Profiles across a bar: how sure each place is, by what pieces of a stretch differ by."""

import numpy as np

from vision.touched.posterior import SEGMENTS
from vision.touched.profiles import compute_profiles
from vision.wire.bands import Pieces

PIECES, NOISE, NEAR_PX = 36, 1.5, 9.0


def drawn(rng, three_go_farther: bool) -> Pieces:
    """A bar 10 px wide before printed squares in shadow. Beyond NEAR_PX three pieces in a row have a pixel at every
    second px, or none has any."""
    across = np.arange(-13.0, 13.05, 0.1)
    offset = np.tile(across, (PIECES, 1))
    behind = 60.0 + 40.0 * rng.uniform(size=offset.shape)
    grey = np.where(np.abs(offset) < 5.0, 150.0, 0.7 * behind) + NOISE * rng.standard_normal(
        offset.shape
    )
    far, some = (
        across > NEAR_PX,
        np.isin(np.arange(PIECES), (8, 9, 10))[:, None] & (np.arange(len(across)) % 20 == 0),
    )
    weight = np.where(far & ~(some & three_go_farther), 0.0, 1.0) / NOISE
    flat, two = np.zeros_like(offset), np.tile([0.0, 1.0], (PIECES, 1))
    return Pieces(
        offset,
        grey,
        behind,
        flat,
        flat,
        weight,
        np.arange(float(PIECES)),
        np.full(PIECES, 5.0),
        two,
        two,
        np.zeros(PIECES, dtype=int),
    )


def test_a_place_that_one_piece_tells_makes_no_stretch_rough():
    """Between two others only the middle one of three pieces tells what they differ by. The share of the background
    that is fitted to it leaves rounding, beside which rounding was 1e60 times as rough: whether a stretch was seen at
    all changed with the cameras' last digit. Four such places of some 100 that its texture is told by."""
    without, beside = (
        compute_profiles(drawn(np.random.default_rng(3), more), SEGMENTS, 3.0, 1.0)
        for more in (False, True)
    )
    near = np.abs(without.offset_px) < NEAR_PX - 2.0
    assert np.allclose(beside.sigma[:, near], without.sigma[:, near], rtol=0.04)
