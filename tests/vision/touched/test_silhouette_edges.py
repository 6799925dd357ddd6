"""The outline of a rounded object, read from a painted picture and found without knowing where it is."""

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS, WIRE
from vision.geometry.grazing import sights_beside
from vision.geometry.rods import Rods
from vision.geometry.rounded import RoundedAxis
from vision.geometry.sphere import Sphere
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.pictures.view import View
from vision.touched.object_view import ObjectView
from vision.touched.rounded_search import find_by_silhouette
from vision.touched.search_scene import SearchScene
from vision.touched.silhouette_edges import measure_silhouette_edges

RADIUS_MM, CENTRE = 8.0, np.array([58.0, 11.0, -1.5])
SPOT = CENTRE - [0.0, RADIUS_MM, 0.0]
SPHERE = RoundedAxis(CENTRE, np.array([0.0, 0.0, 1.0]), Sphere(2.0 * RADIUS_MM), SPOT)


def picture(camera, rng, there=True):
    """A sphere lit from above before an even wall, its edge blurred by a pixel and a half."""
    grey = np.full((720, 1280), 70.0)
    if there:
        limb, _ = SPHERE.silhouette(camera.centre_mm, RADIUS_MM, 0.0, 300)
        limb = camera.project(limb.reshape(-1, 3))
        middle = limb.mean(axis=0)
        y, x = np.mgrid[:720, :1280]
        px = np.stack([x, y], axis=-1).reshape(-1, 2)
        near = np.linalg.norm(px - middle, axis=1) < 80.0
        turn = np.arctan2(*(limb - middle).T[::-1])
        order = np.argsort(turn)
        away = px[near] - middle
        radius = np.interp(
            np.arctan2(away[:, 1], away[:, 0]),
            turn[order],
            np.linalg.norm(limb - middle, axis=1)[order],
            period=2 * np.pi,
        )
        inside = 1.0 / (1.0 + np.exp((np.linalg.norm(away, axis=1) - radius) / 0.6))
        grey.reshape(-1)[near] += inside * (90.0 - 0.6 * away[:, 1])
    return np.clip(np.rint(grey + rng.normal(size=grey.shape)), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def views():
    rng = np.random.default_rng(2)
    return [
        View(
            camera,
            dict(enumerate(picture(camera, rng) for _ in range(3))),
            picture(camera, rng, there=False).astype(float),
            Noise(1.0, 0.0),
        )
        for camera in CAMERAS
    ]


def test_edges_are_where_they_are(views):
    """To a tenth of a pixel, from an outline that is a millimetre off; and each to three of its sigmas."""
    off = RoundedAxis(
        CENTRE + np.array([0.3, 0.2, -0.2]), SPHERE.direction, SPHERE.form, SPHERE.spot_mm
    )
    views = [ObjectView(view, RADIUS_MM, VisionSettings()) for view in views]
    rough = measure_silhouette_edges(views, off, 4.0)
    for view, limb in zip(views, measure_silhouette_edges(views, SPHERE, 2.0, rough).values()):
        near = sights_beside(view.camera, SPHERE, limb.points.px, limb.points.place)
        left_px = (near.outside_mm - RADIUS_MM) * near.px_per_mm(view.camera, limb.points.normal)
        assert len(limb.points) >= 8
        assert np.abs(np.median(left_px)) < 0.1
        assert np.all(np.abs(left_px) < 3.0 * limb.points.sigma_px)


def test_an_object_is_found_where_it_is(views):
    motor_rad = np.radians(np.linspace(1.0, 5.0, 5))
    rods = Rods(WIRE, SPHERE.form)
    found = find_by_silhouette(SearchScene(views, CAMERAS, rods, motor_rad, VisionSettings()))
    np.testing.assert_allclose(found.point_mm, CENTRE, atol=0.1)
