"""Small linear systems, by LAPACK without the checks that take numpy longer than the work."""

import numpy as np
from scipy.linalg.lapack import dgesv


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """x of matrix · x = right, (n, n) and (n,) or (n, k). Raises ArithmeticError where the matrix is singular or not
    finite.
    """
    _, _, x, info = dgesv(matrix, right)
    if info or not np.isfinite(x).all():
        raise ArithmeticError("a singular system")
    return x
