"""Correlated noise: covariance of weighted sums of samples, from residuals and their
autocorrelation.

Hum, vibration and stick–slip correlate neighbouring samples, so a mean over n of them is not √n
better than one. Samples are rows, channels are columns; a sample that is left out of a sum has
weight 0 in it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len

# [lags per sample] How far the autocorrelation is used: beyond a sixth of the samples it is mostly
# noise. By a twelfth or a third a number of a whisk, or its sigma, changes by 0.7 or 0.2 of its
# sigma, or of itself, at most. Study: bench_thresholds.py estimator.noise LAGS_PER_SAMPLE ….
LAGS_PER_SAMPLE = 1 / 6
# [N·mm] Stands instead of a scatter of nothing, so that it may be squared and divided by. Derived.
TINY = 1e-150


@dataclass(frozen=True)
class Memory:
    """Autocovariance of samples, estimated from residuals.

    covariance (lags, k, k): covariance of the samples with those some lags later, tapered to zero.
    white (lags,): what the same residuals would show of white noise of unit variance. Fitted lines
    take part of the slow noise with them; the covariances of sums are raised by what is missing.
    """

    covariance: np.ndarray
    white: np.ndarray

    @classmethod
    def of(cls, x: np.ndarray, samples: np.ndarray, *segments: np.ndarray) -> "Memory":
        """Estimate the autocovariance of samples (n, k) about a line over x (n,) in each segment.

        Segments are masks (n,) that do not overlap.
        """
        used = np.logical_or.reduce(segments)
        inside = _hull(used)
        x = x[inside]
        samples = samples[inside]
        used = used[inside]
        lags = max(1, int(np.count_nonzero(used) * LAGS_PER_SAMPLE))
        segments = [segment[inside] for segment in segments]
        residuals = np.zeros_like(samples)
        for segment in segments:
            residuals[segment] = line_residuals(x, samples, segment)
        pairs = np.maximum(1.0, np.round(Spectrum.of(used, lags).lagged()))  # samples per lag
        taper = _parzen(np.arange(lags) / lags)
        covariance = _lagged_products(residuals, lags) * (taper / pairs)
        kept = -_lost_to_lines(x, segments, lags)
        kept[0] += pairs[0]
        return cls(np.moveaxis(covariance, -1, 0), kept * taper / pairs)

    def of_sum(self, weights: np.ndarray) -> np.ndarray:
        """Return the covariance (k, k) of Σ w_i x_i.

        Gaps in the samples can leave a direction of negative variance, which is set to zero.
        """
        weights = weights[_hull(weights)]
        overlap = _overlap(Spectrum.of(weights, len(self.white)))
        covariance = np.tensordot(overlap, self.covariance, axes=1)
        values, axes = np.linalg.eigh(covariance)
        return (axes * np.maximum(values, 0.0)) @ axes.T * self._loss_factor(weights, overlap)

    def between_sums(self, weights: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Return the covariance (k, k) of Σ w_i x_i with Σ v_i x_i."""
        inside = _hull((weights != 0) | (other != 0))
        weights = weights[inside]
        other = other[inside]
        first = Spectrum.of(weights, len(self.white))
        second = Spectrum.of(other, len(self.white))
        factor = self._loss_factor(weights, _overlap(first))
        other_factor = self._loss_factor(other, _overlap(second))
        covariance = np.tensordot(_overlap(first, second), self.covariance, axes=1)
        return covariance * np.sqrt(factor * other_factor)

    def _loss_factor(self, weights, overlap):
        """Return the factor by which fitted lines made a sum's variance too small."""
        shown = np.tensordot(overlap, self.white, axes=1)
        return (weights @ weights) / shown if shown > 0 else 1.0


@dataclass(frozen=True)
class Spectrum:
    """Fourier transform of a series (n,), from which its products with others at several lags are
    made.
    """

    values: np.ndarray
    size: int
    lags: int

    @classmethod
    def of(cls, series: np.ndarray, lags: int) -> "Spectrum":
        """Transform a series (n,), padded so that its end does not meet its beginning at any of the
        lags.
        """
        size = next_fast_len(len(series) + lags, real=True)
        return cls(np.fft.rfft(series, size), size, lags)

    def lagged(self, other: "Spectrum | None" = None) -> np.ndarray:
        """Return Σ_i a_i b_{i+h} for the lags h = 0 … lags − 1; without `other` b is the series
        itself.
        """
        second = self if other is None else other
        return np.fft.irfft(np.conj(self.values) * second.values, self.size)[: self.lags]


def _lost_to_lines(x, segments, lags):
    """Return the autocorrelation (lags,) of unit white noise that a line in each segment removes."""
    lost = np.zeros(lags)
    for segment in segments:
        for basis in _line_basis(x, segment):
            lost += Spectrum.of(basis, lags).lagged()
    return lost


def _lagged_products(residuals, lags):
    """Return the symmetric products (k, k, lags) of all pairs of columns of residuals (n, k)."""
    columns = [Spectrum.of(column, lags) for column in residuals.T]
    channels = len(columns)
    products = np.empty((channels, channels, lags))
    for row, first in enumerate(columns):
        for column, second in enumerate(columns):
            products[row, column] = first.lagged(second)
    return (products + products.swapaxes(0, 1)) / 2


def _overlap(one, other=None):
    """Return the weight of each lag (lags,) in the product of two sums, or of one with itself."""
    forward = one.lagged(other)
    backward = forward if other is None else other.lagged(one)
    overlap = forward + backward
    overlap[0] /= 2
    return overlap


def _hull(series: np.ndarray) -> slice:
    """Return the slice from the first to the last element that is not zero; the first element if
    none is.
    """
    there = np.flatnonzero(series)
    return slice(there[0], there[-1] + 1) if len(there) else slice(0, 1)


def _parzen(share):
    """Evaluate Parzen's taper from 1 to 0, which keeps sums over lags from going negative."""
    return np.where(share < 0.5, 1 - 6 * share**2 * (1 - share), 2 * (1 - share) ** 3)


def _line_basis(x, used):
    """Return the two orthonormal columns (n,) that a line fitted to the marked samples removes."""
    spread = np.where(used, x - x[used].mean(), 0.0)
    return [used / np.sqrt(np.count_nonzero(used)), spread / np.sqrt(max(spread @ spread, TINY))]


def wider(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the wider of two covariances (k, k), by their traces."""
    return one if np.trace(one) >= np.trace(other) else other


def weighted_sum(weights: np.ndarray, samples: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Compute Σ w_i x_i (k,) over the marked samples."""
    return weights[used] @ samples[used]


def mean_weights(used: np.ndarray) -> np.ndarray:
    """Return the weights (n,) that make the mean of the marked samples."""
    return used / np.count_nonzero(used)


def line_weights(x: np.ndarray, used: np.ndarray, at: float) -> np.ndarray:
    """Return the weights (n,) that make the least-squares line's value at x = `at` from the marked
    samples.
    """
    middle = x[used].mean()
    spread = np.where(used, x - middle, 0.0)
    return mean_weights(used) + spread * (at - middle) / max(spread @ spread, TINY)


def line_slope(x: np.ndarray, samples: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Compute the slope (k,) of the least-squares line through the marked samples."""
    spread = x[used] - x[used].mean()
    return spread @ samples[used] / max(spread @ spread, TINY)


def line_residuals(x: np.ndarray, samples: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Compute the residuals (m, k) of the marked samples from their least-squares line."""
    spread = x[used] - x[used].mean()
    values = samples[used]
    line = np.outer(spread, line_slope(x, samples, used))
    return values - values.mean(axis=0) - line
