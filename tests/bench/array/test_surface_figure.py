"""The figure of the contacts before the object: all of it can be seen, and told apart."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb

from bench.array.cloud import ContactPoint
from bench.array.figure import draw
from bench.array.surface import ObjectSurface
from vision.geometry.rods import Wire

UP = np.array([0.0, 0.0, 1.0])
SURFACES = {
    "bar": ObjectSurface("bar", np.array([55.0, 22.0, 0.0]), UP, 3.0),
    "sphere": ObjectSurface("sphere", np.array([55.0, 32.0, 2.0]), UP, 30.0),
    "cone": ObjectSurface(
        "cone", np.array([55.0, 22.0, 60.0]), UP, 0.0, half_angle_rad=np.radians(20.0)
    ),
    "ring": ObjectSurface(
        "ring", np.array([55.0, 45.0, 2.0]), np.array([1.0, 0.0, 0.0]), 3.0, 40.0
    ),
}


def contacts(count: int) -> list[ContactPoint]:
    """Return contacts of so many whiskers, one above the other, each ± 0.5 mm."""
    found = []
    for number in range(count):
        found.append(
            ContactPoint(
                whisker=f"w{number}",
                trial="t",
                whisk=0,
                estimator="with_friction",
                point_mm=np.array([55.0, 2.0, number - 0.5 * count]),
                covariance_mm2=0.25 * np.eye(3),
                normal=np.full(3, np.nan),
                normal_sigma_rad=np.nan,
                status="",
                base_mm=np.zeros(3),
                wire=Wire("cylinder", 100.0, 1.0),
            )
        )
    return found


@pytest.mark.parametrize("name", SURFACES)
def test_the_whole_object_is_within_the_axes(name):
    surface = SURFACES[name]
    figure = draw("t", contacts(6), surface)
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
    figure = draw("t", contacts(count), ball)
    FigureCanvasAgg(figure).draw()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    whole = figure.bbox
    assert whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1
    entries = {(*to_rgb(line.get_color()), line.get_marker()) for line in legend.get_lines()}
    assert len(entries) == count == len(legend.get_texts())
    right = max(axes.get_window_extent().x1 for axes in figure.axes)
    assert right <= box.x0  # beside the axes
