"""Two pictures of one scene are known for that, with their shift; others are not."""

import cv2
import numpy as np
import pytest

from vision.pictures.scene_match import exposures, is_blank, likeness, texture


def bench(rng, shape=(240, 320)) -> np.ndarray:
    """A textured scene in 8 bit."""
    grey = cv2.GaussianBlur(rng.normal(size=shape), (0, 0), 2.0)
    return np.clip(110 + 250 * grey, 0, 255).astype(np.uint8)


def noisy(grey, rng, sigma=3.0) -> np.ndarray:
    return np.clip(np.rint(grey + rng.normal(scale=sigma, size=grey.shape)), 0, 255).astype(
        np.uint8
    )


@pytest.mark.parametrize("shift", [(0, 0), (6, 4), (-30, 12), (100, -80)])
def test_a_shift_of_any_size_is_told(rng, shift):
    wide = bench(rng, (480, 640))
    x, y = shift
    rig, frame = wide[120:360, 160:480], wide[120 - y : 360 - y, 160 - x : 480 - x]
    found = likeness(texture(noisy(frame, rng)), texture(noisy(rig, rng)))
    assert found.is_same_scene
    np.testing.assert_allclose(found.shift_px, shift, atol=1.0)


def test_other_light_and_a_moving_rod_are_the_same_scene(rng):
    rig = bench(rng)
    frame = np.clip(0.6 * rig + np.linspace(0, 60, 320), 0, 255).astype(np.uint8)
    frame[:, 100:112] = 20
    found = likeness(texture(noisy(frame, rng)), texture(rig))
    assert found.is_same_scene
    assert found.shift_length_px == 0.0


@pytest.mark.parametrize(
    "change", [lambda g: g[:, ::-1], lambda g: g[::-1], lambda g: g[::-1, ::-1]]
)
def test_a_mirrored_scene_is_another(rng, change):
    rig = bench(rng)
    assert not likeness(texture(noisy(change(rig), rng)), texture(rig)).is_same_scene


def test_scenes_that_have_only_noise_are_not_told(rng):
    flat = np.full((240, 320), 90, dtype=np.uint8)
    assert not likeness(texture(noisy(flat, rng)), texture(noisy(flat, rng))).is_same_scene
    assert not likeness(texture(flat), texture(flat)).is_same_scene


def test_blank(rng):
    assert is_blank(np.zeros((40, 40), dtype=np.uint8))
    assert is_blank(np.full((40, 40), 65535, dtype=np.uint16))
    assert not is_blank(bench(rng))


def test_exposures_are_those_made(rng):
    scene, made = bench(rng), np.array([1.0, 1.0, 1.0, 1.1, 0.8])
    pictures = [noisy(gain * scene, rng) for gain in made]
    for k, picture in enumerate(pictures):
        picture[:, 40 * k : 40 * k + 20] = 200  # a rod that moves
    np.testing.assert_allclose(exposures(pictures, 255.0), made, atol=0.004)


def test_a_black_series_has_no_exposure():
    np.testing.assert_array_equal(
        exposures([np.zeros((40, 40), dtype=np.uint8)] * 3, 255.0), np.ones(3)
    )
