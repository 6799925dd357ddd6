"""Which frames touch, from coarse bends."""

import numpy as np

from vision.fit.touch import begins_free, bends_tell_more, frames_that_touch

MOTOR = np.radians(np.arange(0.8, 6.5, 0.7))


def bends(touch_deg: float, noise_deg: float, rng) -> np.ndarray:
    """Bends (f, 2) that grow by 1.3 degrees a degree from touch on, with noise."""
    size = 1.3 * np.maximum(MOTOR - np.radians(touch_deg), 0.0)
    return size[:, None] * [-0.8, 0.6] + np.radians(noise_deg) * rng.standard_normal(
        (len(MOTOR), 2)
    )


def test_noise_in_the_first_frames_is_no_touch():
    """Bends of 0.3 degrees that are none: beyond the least that counts as seen, and two in a row. A frame to either
    side of touch may be undecided, so that a hinge half a frame off puts none on the wrong side."""
    for seed in range(50):
        touching, free = frames_that_touch(MOTOR, bends(2.4, 0.3, np.random.default_rng(seed)))
        assert not np.any(touching[np.radians(2.4) > MOTOR])
        assert not np.any(free[np.radians(2.4) < MOTOR])
        assert np.all(touching[np.radians(4.6) < MOTOR]) and np.all(free[:2])


def test_without_a_bend_none_touches():
    touching, free = frames_that_touch(MOTOR, bends(9.0, 0.05, np.random.default_rng(0)))
    assert not np.any(touching) and np.all(free)


def test_bends_tell_more_than_a_touch_known_to_no_frame():
    """Frames 0.7 degrees apart: three sigma are a frame at 0.23 degrees. However near each other frames are, a bend is
    sure but a quarter of a degree after touch."""
    assert bends_tell_more(MOTOR, np.radians(0.24)) and not bends_tell_more(MOTOR, np.radians(0.23))
    assert not bends_tell_more(MOTOR / 100.0, np.radians(0.08)) and bends_tell_more(
        MOTOR / 100.0, np.radians(0.09)
    )


def test_a_stroke_begins_free_where_its_second_frame_comes_before_touch():
    """The second frame is at 1.5 degrees, and a bend is sure a quarter of a degree after touch. Without noise the hinge
    is where its starts are: a tenth of a frame."""
    none = np.random.default_rng(0)
    assert begins_free(MOTOR, bends(1.5 + 0.25 + 0.1, 0.0, none))
    assert not begins_free(MOTOR, bends(1.5 + 0.25 - 0.1, 0.0, none))
    assert not begins_free(MOTOR, bends(1.0, 0.0, none))
    assert begins_free(MOTOR, bends(9.0, 0.0, none))  # never touches
