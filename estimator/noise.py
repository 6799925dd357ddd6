"""Noise that remembers: covariance of weighted sums of samples, from residuals and their autocorrelation.

Hum, vibration and stick–slip tie neighbouring samples together, so a mean over n of them is not √n better
than one. Samples are rows, channels are columns; a sample that is to be left out has weight 0 and a
residual of NaN.
"""

import numpy as np

LAGS_PER_SAMPLE = 1 / 6


def autocovariance(residuals):
    """(lags, k, k) covariance of residuals (n, k) with themselves, lag samples later, tapered to zero at n/6.

    The Parzen taper keeps the sum over lags from going negative. NaN rows are left out.
    """
    known = np.isfinite(residuals).all(axis=1)
    filled = np.where(known[:, None], residuals, 0.0)
    lags = max(1, int(known.sum() * LAGS_PER_SAMPLE))
    return np.stack([_parzen(h / lags) * _lagged(filled, known, h) for h in range(lags)])


def _lagged(residuals, known, lag):
    n = len(residuals) - lag
    pairs = max(1, np.count_nonzero(known[:n] & known[lag:]))
    product = residuals[:n].T @ residuals[lag:] / pairs
    return (product + product.T) / 2


def _parzen(share):
    return 1 - 6 * share**2 * (1 - share) if share < 0.5 else 2 * (1 - share) ** 3


def covariance_of_sums(weights, other_weights, autocovariance):
    """(k, k) covariance between the sums Σ w_i x_i and Σ v_i x_i of the channels' samples."""
    total = np.zeros(autocovariance.shape[1:])
    for lag, covariance in enumerate(autocovariance):
        n = len(weights) - lag
        overlap = weights[:n] @ other_weights[lag:]
        if lag:
            overlap += weights[lag:] @ other_weights[:n]
        total += overlap * covariance
    return total


def mean_weights(used):
    """Weights (n,) that make the mean of the samples marked in `used`."""
    return used / np.count_nonzero(used)


def line_weights(x, used, at):
    """Weights (n,) that make the least-squares line's value at x = `at` from the samples marked in `used`."""
    middle = x[used].mean()
    spread = np.where(used, x - middle, 0.0)
    return mean_weights(used) + spread * (at - middle) / (spread @ spread)


def line_residuals(x, samples, used):
    """Residuals (n, k) of the least-squares line through the marked samples, NaN elsewhere, of unbiased
    scatter.
    """
    middle = x[used].mean()
    spread = x - middle
    mean = samples[used].mean(axis=0)
    slope = spread[used] @ (samples[used] - mean) / (spread[used] @ spread[used])
    residuals = np.where(used[:, None], samples - mean - np.outer(spread, slope), np.nan)
    n = np.count_nonzero(used)
    return residuals * np.sqrt(n / max(n - 2, 1))
