"""Pixels gathered by their distance from the axis tell of the light what all pixels one by one do."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.speed.tracer import BLUR_PX, KNOTS, NOISE, rough_bands, wire_frames
from vision.pictures.pixel_noise import Noise
from vision.wire import shading
from vision.wire.bands import cut_pieces
from vision.wire.binned import binned
from vision.wire.common_shift import evidences_of
from vision.wire.gathered import GatheredEquations
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import SegmentEquations
from vision.wire.trace import BIN_PX, WIRE_WAVES

SHIFT_PX, WIDER = 0.4, 1.1


@pytest.fixture(scope="module")
def pieces():
    scene = wire_frames(np.random.default_rng(0))
    cut = cut_pieces(rough_bands(*scene, 0.0), 12, Noise(NOISE**2, 0.0)).select(
        slice(None, None, 6)
    )
    some, _ = binned(cut, BIN_PX)
    thinner = np.where(np.arange(len(some)) % 3 == 0, 0.7, 1.0)  # of two half-widths
    return replace(some, radius_px=thinner * some.radius_px)


def both(pieces, **how):
    """Normal matrix, right side and squares as gathered, and pixel by pixel."""
    hats, robust = KNOTS.weights(pieces), 1.0 / (1.0 + np.arange(len(pieces)) % 4)
    told = [
        part[0]
        for part in GatheredEquations(pieces, hats, robust, **how).normal(
            [SHIFT_PX], [(WIDER, BLUR_PX)], 11
        )
    ]
    moved = pieces.moved(SHIFT_PX * pieces.relative_radius)
    thicker = replace(moved, radius_px=WIDER * pieces.radius_px)
    one_by_one = SegmentEquations(thicker, BLUR_PX, WIRE_WAVES)
    return told, (*one_by_one.shared(hats, robust), robust @ one_by_one.power)


def test_gathered_pixels_have_the_normal_equations_of_all_of_them(pieces):
    for gathered, pixels in zip(*both(pieces)):
        assert np.allclose(gathered, pixels, rtol=0.0, atol=2e-3 * np.max(np.abs(pixels)))


def test_pieces_that_show_no_background_are_asked_pixel_by_pixel(pieces):
    """A background cut off by the sensor: cubics leave its gain and offset a square below nothing."""
    inside = np.abs(pieces.offset_px) < pieces.radius_px[:, None]
    for gathered, pixels in zip(*both(replace(pieces, weight=pieces.weight * inside))):
        assert np.allclose(gathered, pixels, rtol=1e-9)


def test_shifts_are_as_probable_by_gathered_pixels(pieces, monkeypatch):
    shifts, blurs, robust = np.linspace(-0.3, 0.3, 7), np.array([BLUR_PX]), np.ones(len(pieces))
    task = ShadedSegments(pieces, WIRE_WAVES, KNOTS, BLUR_PX)
    gathered = evidences_of(task, robust, shifts, blurs)
    monkeypatch.setattr("vision.wire.gathered._LEAST_BACKGROUND_SHARE", 1.0)
    pixels = evidences_of(task, robust, shifts, blurs)
    assert np.ptp(pixels) > 100.0
    assert np.allclose(
        gathered - gathered.min(), pixels - pixels.min(), atol=3.0 + 0.02 * np.ptp(pixels)
    )
    assert np.argmin(gathered) == np.argmin(pixels)


def test_pixels_that_no_light_reaches_are_summed_beforehand(pieces, monkeypatch):
    """Parting them from the others leaves the equations and their derivatives as they are."""
    waves = np.random.default_rng(1).standard_normal((len(pieces), WIRE_WAVES))
    parted = SegmentEquations(pieces, BLUR_PX, WIRE_WAVES)
    monkeypatch.setattr(shading, "_REACH_BLURS", 100.0)
    whole = SegmentEquations(pieces, BLUR_PX, WIRE_WAVES)
    assert parted._columns.shape[1] < 0.8 * whole._columns.shape[1]
    for name in ("gram", "moment", "power"):
        one, other = getattr(parted, name), getattr(whole, name)
        assert np.allclose(one, other, rtol=0.0, atol=1e-4 * np.max(np.abs(other))), name
    for name in ("rod", "gram", "contrast"):
        one, other = (getattr(equations.linearised(waves), name) for equations in (parted, whole))
        assert np.allclose(one, other, rtol=0.0, atol=1e-4 * np.max(np.abs(other))), name
