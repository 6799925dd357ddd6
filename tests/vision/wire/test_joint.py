"""Positions, shading and blur solved together: what they are said to be uncertain by, against draws from the prior."""

import numpy as np
import pytest

from vision.wire.bands import Pieces
from vision.wire.cylinder import shading_basis
from vision.wire.joint import solve_jointly
from vision.wire.shaded_segments import ShadedSegments
from vision.wire.shading import Knots, stiffness, wave_prior

FRAMES, PLACES, TERMS, BLUR_PX, NOISE = 6, np.arange(5.0, 100.0, 10.0), 5, 0.9, 2.0
KNOTS = Knots(np.array([0.0, 50.0, 100.0]))


def drawn(rng, jump_px=0.0) -> Pieces:
    """Pieces of a rod on the line where they are looked for, its shading drawn from the prior, before an even floor; in
    the last frame it is seen for half of the time to either side, jump_px apart."""
    place = np.tile(PLACES, FRAMES)
    count, rows = len(place), np.arange(-9.0, 10.0)
    offset = (
        np.tile(rows, (count, 6))
        + rng.uniform(-0.5, 0.5, (count, 1))
        + np.repeat(np.arange(6) / 6.0, len(rows))
    )
    flat, radius = np.full(offset.shape, 60.0), np.full(count, 2.8)
    none = np.zeros(offset.shape)
    pieces = Pieces(
        offset,
        flat + 60.0 * (np.abs(offset) < 2.8),
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
    covariance = np.linalg.inv(stiffness(wave_prior(pieces, TERMS), KNOTS))
    waves = rng.multivariate_normal(np.zeros(len(covariance)), covariance).reshape(
        len(KNOTS), TERMS
    )
    waves[:, 0] += (
        160.0  # bright enough that its contrast, by which the prior is scaled, is what was drawn with
    )
    aside = 0.5 * jump_px * (pieces.source == FRAMES - 1)[:, None]
    basis = 0.5 * sum(
        shading_basis(offset + move, radius[:, None], BLUR_PX, TERMS) for move in (-aside, aside)
    )
    light = np.einsum("spt,st->sp", basis[..., :TERMS], KNOTS.weights(pieces) @ waves)
    grey = light + (1.0 - basis[..., 0]) * flat + NOISE * rng.standard_normal(offset.shape)
    return Pieces(**{**vars(pieces), "grey": grey})


def test_what_all_pieces_share_is_off_by_as_much_as_it_is_said_to(rng):
    """40 draws: their RMS over the stated sigma is 1 to 11 %; three of that, and as much for a prior that is scaled by
    the contrast seen, which is that of the draw to a third."""
    z = []
    for _ in range(40):
        found = solve_jointly(ShadedSegments(drawn(rng), TERMS, KNOTS, 0.8))
        sigma = np.hypot(
            np.linalg.norm(found.shared_px.mean(axis=0)),
            np.linalg.norm(found.own_sigma_px) / len(found.shift_px),
        )
        z.append(found.shift_px.mean() / sigma)
        assert abs(found.blur_px / BLUR_PX - 1.0) < 0.15
    assert 0.67 / 1.33 < np.sqrt(np.mean(np.square(z))) < 1.33 * 1.33


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
