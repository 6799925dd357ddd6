"""Saturated samples are found, and nothing else is taken for them."""

import numpy as np

from bench.session.rails import off_the_rails


def ramp(rng, noise=0.01):
    return np.concatenate([np.zeros(200), np.linspace(0.0, 5.0, 400)]) + noise * rng.normal(
        size=600
    )


def test_a_flat_top_is_masked(rng):
    channel = np.minimum(ramp(rng), 4.0)
    kept = off_the_rails(channel[:, None])[:, 0]
    assert np.isnan(kept[channel == 4.0]).sum() == np.isnan(kept).sum() > 50


def test_single_samples_at_the_top_stay(rng):
    assert not np.isnan(off_the_rails(ramp(rng)[:, None])).any()


def test_a_noiseless_free_stroke_is_no_rail():
    """A channel without noise stands still at its minimum, which is its zero."""
    assert not np.isnan(off_the_rails(np.maximum(0.0, np.arange(-50.0, 99.0))[:, None])).any()


def test_each_channel_by_itself(rng):
    both = np.stack([np.minimum(ramp(rng), 4.0), ramp(rng)], axis=1)
    assert np.isnan(off_the_rails(both)).any(axis=0).tolist() == [True, False]
