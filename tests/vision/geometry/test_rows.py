"""A table of arrays keeps its columns together."""

from dataclasses import dataclass

import numpy as np

from vision.geometry.rows import Rows


@dataclass(frozen=True)
class Points(Rows):
    px: np.ndarray
    sigma_px: np.ndarray


def test_rows_are_selected_and_joined_in_all_columns():
    points = Points(np.arange(6.0).reshape(3, 2), np.arange(3.0))
    parts = [points.select(points.sigma_px > 1.5), points.select(slice(0, 2))]
    joined = Points.join(parts)
    assert joined.sigma_px.tolist() == [2.0, 0.0, 1.0]
    assert joined.px.tolist() == points.px[[2, 0, 1]].tolist()
