"""A line followed through one picture: drawn ones against their truth, real whiskers against themselves."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from tests.studies.real.whiskers import MIDDLE, PIECE_PX, STILL_LINES, follow_both_ways, left_out
from vision.geometry.refusals import Refused
from vision.pictures.files import read_picture
from vision.pictures.frames import Frames
from vision.wire.follow import follow, noise_of

FINE = 6
ENDS = (33, 43), (205, 118)  # 3 px off the drawn line


def bent_line(x):
    """Height and slope of the drawn line: a third-order bend, radius of curvature down to 100 px."""
    t = (x - 30) / 180
    return 40 + 30 * t + 60 * t**3, (30 + 180 * t**2) / 180


def draw_bent(rng, *, radii=(2.0, 0.3), blur=0.9, step=0.0, line=40.0, noise=3.0, shape=(160, 240)):
    """A tapered line on a slanting background, drawn sharp on a fine grid, blurred, summed into pixels."""
    y, x = np.meshgrid(
        *[np.arange(n * FINE) / FINE + 0.5 / FINE - 0.5 for n in shape], indexing="ij"
    )
    height, slope = bent_line(x)
    off = (y - height) / np.sqrt(1 + slope**2)
    inside = (np.abs(off) < np.interp(x, [30, 210], radii)) & (x > 25) & (x < 215)
    sharp = np.where(inside, line, 120 + 0.15 * x - 0.1 * y + step * (off > 0))
    seen = gaussian_filter(sharp, blur * FINE).reshape(shape[0], FINE, -1, FINE).mean(axis=(1, 3))
    return seen + noise * rng.standard_normal(shape)


def errors_px(points):
    """Distance of each point from the drawn line along its normal."""
    x = np.linspace(20, 220, 20001)
    height, slope = bent_line(x)
    curve = np.stack([x, height], axis=1)
    normal = np.stack([-slope, np.ones_like(slope)], axis=1) / np.hypot(1, slope)[:, None]
    nearest = [np.argmin(np.sum((curve - px) ** 2, axis=1)) for px in points.px]
    return np.sum((points.px - curve[nearest]) * normal[nearest], axis=1)


@pytest.mark.parametrize(
    "kind", [{}, {"radii": (0.6, 0.2)}, {"radii": (3.5, 2.5), "step": 16.0}, {"line": 220.0}]
)
def test_a_bent_tapered_line_is_followed_within_its_sigmas(rng, kind):
    lines = [
        follow(draw_bent(rng, **kind), *ENDS, dark=kind.get("line", 0) < 100) for _ in range(3)
    ]
    error = np.concatenate([errors_px(line.points) for line in lines])
    z = error / np.concatenate([line.points.sigma_px for line in lines])
    # some 60 points: the median's own sigma is 15 %, the mean's 0.13 sigma; three of each
    assert 0.55 < np.median(np.abs(z)) / 0.6745 < 1.45
    assert abs(np.mean(np.clip(z, -3, 3))) < 0.4
    assert np.median(np.abs(error)) < 0.04  # under a tenth of the thinnest line's width


def test_an_even_picture_has_no_line_and_an_end_outside_is_refused(rng):
    even = 120 + 3.0 * rng.standard_normal((160, 240))
    with pytest.raises(Refused, match=r"no line stands out|pieces of a line"):
        follow(even, *ENDS)
    with pytest.raises(Refused, match="outside the picture of 240 x 160"):
        follow(even, (33, 43), (240, 118))


def test_noise_of_one_picture_is_what_was_added(rng):
    noise = noise_of(draw_bent(rng, noise=4.0))
    assert noise.sigma(120.0) == pytest.approx(
        4.0, rel=0.05
    )  # 38 000 pixels that share neighbours: 1 %


def test_real_whiskers_are_followed_within_their_sigmas(real):
    """Points left out against their neighbours' parabola; three frames of the video and two lines of a still."""
    pictures = dict(
        Frames.open(real / "whiskers" / "whiskiwrap" / "test_video2.mp4").read(397, 411)
    )
    still = read_picture(real / "whiskers" / "pwhisk" / "testFRONT1.png")
    seen = [follow_both_ways(pictures[frame], MIDDLE[frame]) for frame in (397, 404, 410)]
    seen += [follow_both_ways(still, ends) for ends in STILL_LINES["testFRONT1.png"][:2]]
    assert not [s.reason for s in seen if s.reason]
    for s in seen:
        length = np.linalg.norm(s.line.points.px[-1] - s.line.points.px[0])
        assert len(s.line.points) > 0.7 * length / PIECE_PX / np.sqrt(
            2
        )  # a piece is up to √2 of its steps long
    z = np.concatenate([np.divide(*left_out(s.line.points)) for s in seen])
    assert 0.7 < np.median(np.abs(z)) / 0.6745 < 1.3  # 120 points: 10 %, three times
    assert (
        np.mean(np.abs(z) > 4) < 0.05
    )  # 5 of 136: another whisker crosses, or a bend is no parabola
