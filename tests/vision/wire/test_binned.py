"""Pixels that lie equally far from the axis, averaged."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.speed.tracer import KNOTS, NOISE, rough_bands, wire_frames
from vision.pictures.pixel_noise import Noise
from vision.wire.bands import cut_pieces
from vision.wire.binned import binned, without
from vision.wire.common_shift import evidences_of
from vision.wire.cylinder import WAVES
from vision.wire.shaded_segments import ShadedSegments


@pytest.fixture(scope="module")
def pieces():
    """Of a wire over squares, its true line known, every eighth."""
    scene = wire_frames(np.random.default_rng(3))
    return cut_pieces(rough_bands(*scene, 0.0), 12, Noise(NOISE**2, 0.0)).select(
        slice(None, None, 8)
    )


def test_what_is_averaged_keeps_its_weight_and_its_mean(pieces):
    few, variance = binned(pieces, 0.25)
    assert few.offset_px.shape[1] < 0.5 * pieces.offset_px.shape[1]
    assert np.sum(few.weight**2, axis=1) == pytest.approx(
        np.sum(pieces.weight**2, axis=1), rel=1e-12
    )
    for name in ("grey", "background", "offset_px", "slope"):
        mean = [np.sum(getattr(p, name) * p.weight**2, axis=1) for p in (few, pieces)]
        assert mean[0] == pytest.approx(mean[1], rel=1e-9, abs=1e-6)
    assert 0.0 < variance <= 0.25**2 / 4  # offsets in a bin cannot vary more


def test_pixels_outside_the_picture_count_for_nothing(pieces):
    weight = pieces.weight.copy()
    weight[:, :40] = 0.0
    few, _ = binned(replace(pieces, weight=weight), 0.25)
    assert np.sum(few.weight**2, axis=1) == pytest.approx(np.sum(weight**2, axis=1), rel=1e-12)
    assert np.all(np.isfinite(few.grey)) and np.all(np.any(few.weight > 0, axis=0))


def test_averaged_pieces_are_explained_best_by_the_same_blur(pieces):
    """By a blur that is larger by what the bins add; `without` takes it off again."""
    few, variance = binned(pieces, 0.25)
    blurs, every = np.arange(0.6, 1.4, 0.05), np.ones(len(pieces))
    best = [
        blurs[np.argmin(evidences_of(ShadedSegments(p, WAVES, KNOTS, 0.8), every, [0.0], blurs))]
        for p in (pieces, few)
    ]
    assert without(best[1], variance) == pytest.approx(
        best[0], abs=0.06
    )  # one step of the blurs tried
    assert without(0.5, 1.0) == pytest.approx(0.25)  # never nothing
