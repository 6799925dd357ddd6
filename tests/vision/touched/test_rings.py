"""A ring that stands with its edge to both cameras, found in painted pictures without knowing where it is."""

import cv2
import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS, WIRE
from vision.geometry.refusals import Refused
from vision.geometry.ring import Ring
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.pictures.view import View
from vision.touched.places import touched_first
from vision.touched.rounded_search import find_by_coverage
from vision.touched.search_scene import SearchScene

RADIUS_MM = 3.0
RODS = Rods(WIRE, Ring(2.0 * RADIUS_MM, ring_diameter_mm=60.0))
MOTOR_RAD = np.radians(np.linspace(0.5, 4.5, 5))
STANDS = touched_first(
    RODS,
    np.array([[57.3, np.radians(2.2), np.radians(23.0), np.radians(3.0), np.radians(-7.0)]]),
)
SUBPIXELS, FINE = 4, 720


def cover(camera):
    """How far (h, w) a ring covers pixels, up to 1, its edges blurred by a pixel: all the balls along its circle."""
    whole = np.zeros((720, 1280), dtype=np.uint8)
    turn = np.linspace(0.0, 2.0 * np.pi, FINE)[:, None]
    normal, centre = STANDS.direction[0], STANDS.point_mm[0]
    out = np.cross(normal, [0.0, 0.0, 1.0])
    out /= np.linalg.norm(out)
    balls = centre + 30.0 * (np.cos(turn) * out + np.sin(turn) * np.cross(normal, out))
    far = np.linalg.norm(balls - camera.centre_mm, axis=1)
    for px, mm in zip(camera.project(balls), far):
        size = RADIUS_MM * camera.matrix[0, 0] / mm
        at = np.rint(2**SUBPIXELS * np.array([*px, size])).astype(int).tolist()
        cv2.circle(whole, at[:2], at[2], 255, -1, cv2.LINE_AA, SUBPIXELS)
    return cv2.GaussianBlur(whole.astype(float), (0, 0), 0.9) / 255.0


def picture(covered, rng):
    """A ring that is lit evenly before a wall."""
    grey = 60.0 + 70.0 * covered
    return np.clip(np.rint(grey + rng.normal(size=grey.shape)), 0, 255).astype(np.uint8)


def views_of(there):
    """Each camera's view, of which `there` says whether the ring is in it."""
    rng, views = np.random.default_rng(4), []
    for camera, seen in zip(CAMERAS, there):
        covered = cover(camera) if seen else np.zeros((720, 1280))
        frames = {frame: picture(covered, rng) for frame in range(3)}
        views.append(
            View(camera, frames, picture(0.0 * covered, rng).astype(float), Noise(1.0, 0.0))
        )
    return views


def find(views):
    """What is seen."""
    return find_by_coverage(SearchScene(views, CAMERAS, RODS, MOTOR_RAD, VisionSettings()))


def test_a_ring_is_found_where_it_is():
    """So near that the fit does the rest: another ring along its rims is 15 mm off."""
    found = find(views_of((True, True)))
    np.testing.assert_allclose(found.point_mm, STANDS.point_mm[0], atol=2.5)
    assert abs(found.direction @ STANDS.direction[0]) > np.cos(np.radians(3.0))


def test_a_ring_in_one_camera_alone_is_refused():
    with pytest.raises(Refused, match="no ring of 60 mm"):
        find(views_of((True, False)))
