"""Covariances as files have them: symmetric, and no direction has a negative variance."""

import math

import numpy as np

# [1] Of a covariance's entries, over the product of their sigmas: what rounding leaves. Stated.
_ROUNDING = 1e-6


def is_covariance(written: np.ndarray) -> bool:
    """Return whether a matrix (n, n) is finite, symmetric and without negative variance, but for rounding."""
    if not np.all(np.isfinite(written)):
        return False
    sigma = np.sqrt(np.maximum(np.diag(written), 0.0))
    slack = _ROUNDING * np.outer(sigma, sigma) + np.finfo(float).tiny
    if np.any(np.diag(written) < 0) or np.any(np.abs(written - written.T) > slack):
        return False
    scale = np.where(sigma > math.sqrt(np.finfo(float).tiny), sigma, 1.0)
    return bool(np.linalg.eigvalsh(written / np.outer(scale, scale))[0] >= -_ROUNDING)
