"""Noise that remembers: covariance of weighted sums of samples, from residuals and their autocorrelation.

Hum, vibration and stick–slip tie neighbouring samples together, so a mean over n of them is not √n better than one.
Samples are rows, channels are columns; a sample that is left out of a sum has weight 0 in it.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len

LAGS_PER_SAMPLE = 1 / 6
TINY = 1e-150  # instead of a scatter of nothing, so that it may be squared and divided by


@dataclass(frozen=True)
class Memory:
    """Covariance of the samples with those some lags later, as residuals show it.

    covariance (lags, k, k) is tapered to zero. seen (lags,) is what white noise of unit variance would show: lines that
    were fitted take part of the slow noise with them, and the sums are raised by what is missing.
    """

    covariance: np.ndarray
    seen: np.ndarray

    @classmethod
    def of(cls, x: np.ndarray, samples: np.ndarray, *stretches: np.ndarray) -> "Memory":
        """Memory of samples (n, k) about a line over x (n,) in each stretch, a mask (n,); stretches do not overlap."""
        used = np.logical_or.reduce(stretches)
        held = _hull(used)  # what lies outside counts for nothing
        x, samples, used, stretches = (
            x[held],
            samples[held],
            used[held],
            [stretch[held] for stretch in stretches],
        )
        residuals, bases = np.zeros_like(samples), []
        for stretch in stretches:
            bases += _line_basis(x, stretch)
            residuals[stretch] = line_residuals(x, samples, stretch)
        lags = max(1, int(np.count_nonzero(used) * LAGS_PER_SAMPLE))
        pairs = np.maximum(1.0, np.round(Spectrum.of(used, lags).lagged()))
        taper = _parzen(np.arange(lags) / lags)
        columns = [Spectrum.of(column, lags) for column in residuals.T]
        products = np.array([[a.lagged(b) for b in columns] for a in columns])
        products = (products + products.swapaxes(0, 1)) / 2
        lost = sum(Spectrum.of(basis, lags).lagged() for basis in bases)
        kept = np.where(np.arange(lags) == 0, pairs, 0.0) - lost
        return cls(np.moveaxis(products * (taper / pairs), -1, 0), kept * taper / pairs)

    def of_sum(self, weights: np.ndarray) -> np.ndarray:
        """Covariance (k, k) of Σ w_i x_i; gaps can leave a negative direction, which is taken as no scatter."""
        weights = weights[_hull(weights)]
        own = self._overlap(Spectrum.of(weights, len(self.seen)))
        values, axes = np.linalg.eigh(np.tensordot(own, self.covariance, axes=1))
        return (axes * np.maximum(values, 0.0)) @ axes.T * self._missing(weights, own)

    def between_sums(self, weights: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Covariance (k, k) of Σ w_i x_i with Σ v_i x_i."""
        held = _hull((weights != 0) | (other != 0))
        weights, other = weights[held], other[held]
        first, second = (Spectrum.of(w, len(self.seen)) for w in (weights, other))
        missing = (
            self._missing(w, self._overlap(s)) for w, s in ((weights, first), (other, second))
        )
        both = np.tensordot(self._overlap(first, second), self.covariance, axes=1)
        return both * np.sqrt(math.prod(missing))

    def _missing(self, weights, own):
        seen = np.tensordot(own, self.seen, axes=1)
        return (weights @ weights) / seen if seen > 0 else 1.0

    @staticmethod
    def _overlap(one, other=None):
        """What each lag (lags,) counts for in the product of two sums, or of one with itself."""
        forward = one.lagged(other)
        overlap = forward + (forward if other is None else other.lagged(one))
        overlap[0] /= 2
        return overlap


@dataclass(frozen=True)
class Spectrum:
    """Fourier transform of a series (n,), from which its products with others at several lags are made."""

    values: np.ndarray
    size: int
    lags: int

    @classmethod
    def of(cls, series: np.ndarray, lags: int) -> "Spectrum":
        """Padded, so that its end does not meet its beginning at any of the lags."""
        size = next_fast_len(len(series) + lags, real=True)
        return cls(np.fft.rfft(series, size), size, lags)

    def lagged(self, other: "Spectrum | None" = None) -> np.ndarray:
        """Σ_i a_i b_{i+h} for the lags h = 0 … lags − 1; of the series with itself where no other is given."""
        second = self if other is None else other
        return np.fft.irfft(np.conj(self.values) * second.values, self.size)[: self.lags]


def _hull(series: np.ndarray) -> slice:
    """From the first to the last that is not zero; of one that is nothing but zeros its first."""
    there = np.flatnonzero(series)
    return slice(there[0], there[-1] + 1) if len(there) else slice(0, 1)


def _parzen(share):
    """Taper from 1 to 0 that keeps sums over lags from going negative."""
    return np.where(share < 0.5, 1 - 6 * share**2 * (1 - share), 2 * (1 - share) ** 3)


def _line_basis(x, used):
    """The two orthonormal columns (n,) that a line fitted to the marked samples removes."""
    spread = np.where(used, x - x[used].mean(), 0.0)
    return [used / np.sqrt(np.count_nonzero(used)), spread / np.sqrt(max(spread @ spread, TINY))]


def wider(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The wider of two covariances (k, k)."""
    return one if np.trace(one) >= np.trace(other) else other


def weighted_sum(weights: np.ndarray, samples: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Σ w_i x_i (k,) over the marked samples."""
    return weights[used] @ samples[used]


def mean_weights(used: np.ndarray) -> np.ndarray:
    """Weights (n,) that make the mean of the marked samples."""
    return used / np.count_nonzero(used)


def line_weights(x: np.ndarray, used: np.ndarray, at: float) -> np.ndarray:
    """Weights (n,) that make the least-squares line's value at x = `at` from the marked samples."""
    middle = x[used].mean()
    spread = np.where(used, x - middle, 0.0)
    return mean_weights(used) + spread * (at - middle) / max(spread @ spread, TINY)


def line_slope(x: np.ndarray, samples: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Slope (k,) of the least-squares line through the marked samples."""
    spread = x[used] - x[used].mean()
    return spread @ samples[used] / max(spread @ spread, TINY)


def line_residuals(x: np.ndarray, samples: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Residuals (m, k) of the marked samples from their least-squares line."""
    spread = x[used] - x[used].mean()
    return (
        samples[used] - samples[used].mean(axis=0) - np.outer(spread, line_slope(x, samples, used))
    )
