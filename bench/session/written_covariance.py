"""Covariances as files have them: symmetric, and no direction has a negative variance."""

import math

import numpy as np

# [1] Of a covariance's entries, over the product of their sigmas: what rounding leaves. Stated.
_ROUNDING = 1e-6


def is_covariance(written: np.ndarray) -> bool:
    """Return whether a matrix (n, n) is finite, symmetric and without negative variance, but for rounding."""
    if not np.all(np.isfinite(written)):
        return False
    variances = np.diag(written)
    if np.any(variances < 0):
        return False
    sigmas = np.sqrt(variances)
    smallest = np.finfo(float).tiny
    slack = _ROUNDING * np.outer(sigmas, sigmas) + smallest
    if np.any(np.abs(written - written.T) > slack):
        return False
    scale = np.where(sigmas > math.sqrt(smallest), sigmas, 1.0)
    correlation = written / np.outer(scale, scale)
    return bool(np.linalg.eigvalsh(correlation)[0] >= -_ROUNDING)
