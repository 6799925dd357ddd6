"""The bar's edges, and the bar by them: in the light of another lamp, with a highlight, and where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.accuracy.bar_lines import (
    AWAY_MM,
    CENTRE,
    RADIUS_MM,
    edges_px,
    metal,
    noisy_view,
    squares,
)
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.pictures.view import View
from vision.touched.edge_map import EdgeMap, compute_edge_map, edge_strength_tensor
from vision.touched.find import EdgeScore, axis_from_angles
from vision.touched.grid_search import climb
from vision.touched.one_view import find_bars_alone
from vision.touched.search import find_object
from vision.touched.search_scene import SearchScene


def test_squares_of_the_board_in_a_soft_shadow_are_no_edges(rng):
    """At their borders they count for less than a fifth of a rod's edge; noise alone has 0.07 of the clearest."""
    x, y = np.meshgrid(np.arange(200.0), np.arange(150.0))
    board = np.where((x // 25 + y // 25) % 2 > 0, 160.0, 40.0)
    shadow = 1.0 - 0.5 / (1.0 + np.exp((x - 60.0) / 12.0))
    seen = np.where(np.abs(x - 140.0) < 8.0, 100.0, board * shadow)
    noisy = [picture + rng.standard_normal(board.shape) for picture in (seen, board)]
    edges = edge_strength_tensor(*noisy, 1.0)
    across = edges[20:-20, :, 0]
    assert np.mean(np.max(across[:, 131:135], axis=1)) > 0.5
    assert np.mean(across[:, [24, 25, 49, 50, 74, 75, 99, 100]]) < 0.1


def test_a_polished_bar_over_squares_is_found_by_one_camera(rng):
    """Within a quarter of its half-width, 16 px; the highlight's edges lie 4 to 8 px from its middle."""
    angle, across_mm = 1.3, 0.7
    view = noisy_view(metal, squares, angle, across_mm, rng)
    camera = Camera(
        "c",
        view.camera.size_px,
        view.camera.matrix,
        np.zeros(5),
        np.column_stack([np.eye(3), [-50.0, 0.0, AWAY_MM]]),
    )
    rods = Rods(Wire("cylinder", 100.0, 0.5), Bar(2.0 * RADIUS_MM))
    view = replace(view, camera=camera)
    scene = SearchScene([view], Cameras((camera,)), rods, np.zeros(1), VisionSettings())
    found = find_bars_alone(compute_edge_map(view, rods, 0.0), scene)[0]
    px = camera.project(found.point_mm + np.array([-8.0, 8.0])[:, None] * found.direction)
    off = (px - CENTRE) @ [-np.sin(angle), np.cos(angle)] - np.mean(edges_px(across_mm))
    assert np.max(np.abs(off)) < 4.0


@pytest.mark.filterwarnings("error")
def test_bars_end_on_and_about_a_camera_are_scored_without_a_warning(rng):
    """A camera between the bars: some are behind it, some end on, of some the picture is beyond all numbers."""
    lens = [[2000, 0, 640], [0, 2000, 360], [0, 0, 1]]
    T = np.column_stack([[[0, -1, 0], [0, 0, -1], [1, 0, 0]], [5.0, 0.0, -50.0]])
    camera = Camera("c", (1280, 720), lens, [-0.1, 0.1, 0, 0, 0], T)
    beta_rad = rng.uniform(-1.4, 1.4, 2000)
    x_mm = rng.uniform(10, 100, 2000)
    touch_rad = rng.uniform(0, 0.5, 2000)
    axes = axis_from_angles(x_mm, touch_rad, beta_rad, 0.1, 3.5)
    edges = EdgeMap(camera, np.full((360, 640, 3), 0.3, dtype=np.float32), 10.0)
    score = EdgeScore(lambda one: one, [edges], 3.0, np.ones(5), np.arange(-30.0, 31.0, 5.0))
    scores = score.of_objects(axes)
    assert not np.any(scores < 0.0) and np.any(np.isnan(scores))


def test_where_nothing_changed_no_bar_is_seen(rng):
    views = []
    for name, shift in (("one", 0.0), ("two", 60.0)):
        camera = Camera(
            name,
            (320, 240),
            [[600, 0, 160], [0, 600, 120], [0, 0, 1]],
            np.zeros(5),
            np.column_stack([np.eye(3), [-50.0 - shift, 0.0, 300.0]]),
        )
        frames = {k: 90.0 + 2.0 * rng.standard_normal((240, 320)) for k in range(3)}
        views.append(
            View(camera, frames, 90.0 + 2.0 * rng.standard_normal((240, 320)), Noise(4.0, 0.0))
        )
    rods = Rods(Wire("cylinder", 100.0, 0.5), Bar(6.0))
    cameras = Cameras(tuple(view.camera for view in views))
    with pytest.raises(Refused, match="bar"):
        find_object(SearchScene(views, cameras, rods, np.array([-0.1, 0.1]), VisionSettings()))


def test_climbing_ends_on_the_top():
    top = np.array([0.3, -1.7])
    found, score = climb(
        np.zeros((2, 2)), np.ones(2), lambda each: -np.sum((each - top) ** 2, axis=1)
    )
    assert np.all(np.abs(found - top) < 0.5)
    assert np.all(score > -0.2)
