"""Positions, shading and blur solved together: what they are said to be uncertain by, against draws from the prior."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from vision.wire.bands import Pieces
from vision.wire.cylinder import round_the_rod, shading_basis
from vision.wire.joint import solve_jointly
from vision.wire.light_prior import USUAL_LIGHT
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import Knots, contrast_of, fit_shading
from vision.wire.trace import WIRE_WAVES

FRAMES, PLACES, TERMS, BLUR_PX, NOISE = 6, np.arange(5.0, 100.0, 10.0), 5, 0.9, 2.0
KNOTS = Knots(np.array([0.0, 50.0, 100.0]))


def drawn(rng, jump_px=0.0, tip_px=2.8, waves=None) -> Pieces:
    """Pieces of a rod on the line where they are looked for, before an even floor; in the last frame it is seen for half
    of the time to either side, jump_px apart. tip_px: half-width at its end. waves (knots, terms): its shading, drawn
    from the prior where None."""
    place = np.tile(PLACES, FRAMES)
    count, rows = len(place), np.arange(-9.0, 10.0)
    offset = (
        np.tile(rows, (count, 6))
        + rng.uniform(-0.5, 0.5, (count, 1))
        + np.repeat(np.arange(6) / 6.0, len(rows))
    )
    flat, radius = np.full(offset.shape, 60.0), np.interp(place, [0.0, 100.0], [2.8, tip_px])
    none = np.zeros(offset.shape)
    pieces = Pieces(
        offset,
        flat + 60.0 * (np.abs(offset) < radius[:, None]),
        flat,
        none,
        none,
        np.full(offset.shape, 1.0 / NOISE),
        place,
        radius,
        np.zeros((count, 2)),
        np.tile([0.0, 1.0], (count, 1)),
        np.repeat(range(FRAMES), len(PLACES)),
    )
    if waves is None:
        covariance = contrast_of(pieces) ** 2 * np.linalg.inv(USUAL_LIGHT.precision(KNOTS, TERMS))
        waves = rng.multivariate_normal(np.zeros(len(covariance)), covariance).reshape(
            len(KNOTS), TERMS
        )
        # bright enough that its contrast, by which the prior is scaled, is what was drawn with
        waves[:, 0] += 160.0
    aside = 0.5 * jump_px * (pieces.source == FRAMES - 1)[:, None]
    terms = waves.shape[1]
    basis = 0.5 * sum(
        shading_basis(offset + move, radius[:, None], BLUR_PX, terms) for move in (-aside, aside)
    )
    light = np.einsum("spt,st->sp", basis[..., :terms], KNOTS.weights(pieces) @ waves)
    grey = light + (1.0 - basis[..., 0]) * flat + NOISE * rng.standard_normal(offset.shape)
    return Pieces(**{**vars(pieces), "grey": grey})


@pytest.mark.parametrize("tip_px", [2.8, 0.7])
def test_what_all_pieces_share_is_off_by_as_much_as_it_is_said_to(rng, tip_px):
    """40 draws: their RMS over the stated sigma is 1 to 11 %; three of that, and as much for a prior that is scaled by
    the contrast seen, which is that of the draw to a third. Evidence counts a quarter, and other lights are as probable as
    the one drawn, so that the sigma may be twice as wide again."""
    z = []
    for _ in range(40):
        found = solve_jointly(ShadedSegments(drawn(rng, tip_px=tip_px), TERMS, KNOTS, 0.8))
        sigma = np.hypot(
            np.linalg.norm(found.shared_px.mean(axis=0)),
            np.linalg.norm(found.own_sigma_px) / len(found.shift_px),
        )
        z.append(found.shift_px.mean() / sigma)
        assert abs(found.blur_px / BLUR_PX - 1.0) < 0.15
    assert 0.67 / 1.33 / 2.0 < np.sqrt(np.mean(np.square(z))) < 1.33 * 1.33


def test_light_from_one_side_moves_a_tapered_rod_by_no_more_than_is_said(rng):
    """One side as dark as the floor: what is seen may lie a share of the half-width aside, all along the rod, so that
    the uncertainty is as thick as the rod is, to a fifth for what each place has of its own."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 301)
    lit = 60.0 + 100.0 * np.maximum(np.sin(t), 0.0)
    waves = np.linalg.lstsq(round_the_rod(t, WIRE_WAVES), lit, rcond=None)[0]
    pieces = drawn(rng, tip_px=0.7, waves=np.tile(waves, (len(KNOTS), 1)))
    found = solve_jointly(ShadedSegments(pieces, WIRE_WAVES, KNOTS, 0.8))
    sigma = np.linalg.norm(found.shared_px, axis=1)
    ends = [0, len(PLACES) - 1]
    assert sigma[ends[0]] / sigma[ends[1]] == pytest.approx(
        pieces.radius_px[ends[0]] / pieces.radius_px[ends[1]], rel=0.2
    )
    assert np.all(np.abs(found.shift_px[pieces.place < 50.0]) < 2.0 * sigma[pieces.place < 50.0])


def test_a_frame_that_shows_two_places_is_said_to_be_wider_by_their_variance(rng):
    """Places J apart, half of the time each, have a variance of J² / 4; to J⁴ their mean is no blur."""
    pieces = drawn(rng, 0.6)
    widened, sigma = solve_jointly(ShadedSegments(pieces, TERMS, KNOTS, 0.8)).widened_px2.T
    jumped = pieces.source == FRAMES - 1
    mean = [np.average(widened[which], weights=sigma[which] ** -2.0) for which in (jumped, ~jumped)]
    noise = np.sum(sigma[jumped] ** -2.0) ** -0.5
    assert noise < 0.02 and mean[0] - mean[1] == pytest.approx(
        0.6**2 / 4, abs=3 * noise + 0.1 * 0.6**2 / 4
    )


def test_a_rod_that_no_pixel_shows_has_no_shading_and_no_warning(rng):
    """All of it is hidden; a search takes no place where it is."""
    pieces = drawn(rng)
    hidden = replace(pieces, weight=np.zeros_like(pieces.weight))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        shading, chi2 = fit_shading(hidden, BLUR_PX, TERMS, KNOTS)
    assert not shading.coefficients.any() and chi2 == np.inf
