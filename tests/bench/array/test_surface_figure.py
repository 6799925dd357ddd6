"""The figure of the contacts before the object: all of it can be seen, and told apart."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb

from bench.array.figure import draw
from tests.bench.array.test_size import SURFACES, drawn


@pytest.mark.parametrize("name", SURFACES)
def test_the_whole_object_is_within_the_axes(name):
    surface = SURFACES[name]
    figure = draw("t", drawn(surface, np.random.default_rng(1)), surface)
    for axes in figure.axes:
        discs = [patch for patch in axes.patches if to_rgb(patch.get_facecolor()) == to_rgb("0.85")]
        assert discs
        for ends, number, size in ((axes.get_xlim(), 0, "width"), (axes.get_ylim(), 1, "height")):
            middles = np.array([disc.center[number] for disc in discs])
            radii = np.array([getattr(disc, size) for disc in discs]) / 2.0
            assert ends[0] <= (middles - radii).min() + 1e-9
            assert ends[1] >= (middles + radii).max() - 1e-9


@pytest.mark.parametrize("count", [6, 24, 36])
def test_the_legend_fits_and_its_entries_differ(count):
    ball = SURFACES["sphere"]
    contacts = drawn(ball, np.random.default_rng(1))
    cloud = [replace(contacts[k % len(contacts)], whisker=f"w{k}") for k in range(count)]
    figure = draw("t", cloud, ball)
    FigureCanvasAgg(figure).draw()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    whole = figure.bbox
    assert whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1
    entries = {(*to_rgb(line.get_color()), line.get_marker()) for line in legend.get_lines()}
    assert len(entries) == count == len(legend.get_texts())
    right = max(axes.get_window_extent().x1 for axes in figure.axes)
    assert right <= box.x0  # beside the axes
