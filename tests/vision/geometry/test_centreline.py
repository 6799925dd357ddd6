"""Integration along a centreline, beside SciPy's."""

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from vision.geometry import centreline
from vision.geometry.centreline import simpson


@pytest.mark.parametrize("nodes", [10, 41])
def test_the_matrix_integrates_as_scipy_does(nodes, monkeypatch):
    """The last step is another one where nodes are even; sums of 41 terms are rounded."""
    monkeypatch.setattr(centreline, "_NODES", nodes)
    expected = cumulative_simpson(np.eye(nodes), dx=1.0, axis=0, initial=0.0)
    np.testing.assert_allclose(simpson.__wrapped__(), expected, rtol=0, atol=1e-14)
