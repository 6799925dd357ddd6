"""How well the bar's line is found in pictures whose truth is known: bias, scatter, and what it says of itself.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/bar_lines.py [REPEATS]

A bar of 6 mm at 376 mm before a pinhole camera is 32 px wide; its two edges are the tangents from the camera's
centre, so that the picture is exact. It is drawn as in lines.py at random places and slopes, noise of 2 grey levels in
the mean of 13 frames and in the background, and looked for from up to half a pixel off. The line is given at 20 mm to
either side; columns: mean and RMS error there in px, median stated sigma, and z, the RMS error over it.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.lines import FINE, NOISE, coverage, squares
from vision.geometry.camera import Camera
from vision.geometry.contact import BarAxis
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.pictures.view import View
from vision.touched.line import BarLineEstimate, measure_bars
from vision.touched.object_view import ObjectView

SIZE, FOCAL_PX, AWAY_MM, RADIUS_MM, BLUR_PX, FRAMES = (420, 300), 2010.0, 376.0, 3.0, 0.9, 13
WHITE = 255.0  # grey levels: brighter light saturates
CENTRE = np.array([209.5, 149.5])


def painted(t):
    """A matt bar in soft light from one side."""
    return 150.0 + 40.0 * t


def metal(t):
    """A polished one: a highlight off the middle, rims that mirror the dark."""
    return (60.0 + 110.0 * np.exp(-0.5 * ((t + 0.3) / 0.2) ** 2)) * (1 - t**2) ** 0.15 + 40.0 * (
        1 - t**2
    ) ** 0.5


def glossy(t):
    """A dark mirror with the picture of a lamp near one edge, brighter than any pixel can say."""
    rims = 18.0 - 14.0 * np.abs(t) ** 6
    return np.where((t > 0.4) & (t < 0.78), 550.0, rims)


SCENES: dict[str, tuple[Callable, Callable]] = {
    "painted, flat background": (painted, lambda x, y: 60.0 + 0.0 * x),
    "painted, step of a fifth": (painted, lambda x, y: np.where(x > 210.0, 60.0, 40.0)),
    "painted, printed squares": (painted, squares),
    "grey as the mean of printed squares": (lambda t: 105.0 + 0.0 * t, squares),
    "polished, flat background": (metal, lambda x, y: 110.0 + 0.0 * x),
    "polished, printed squares": (metal, squares),
    "glossy, as dark a background": (glossy, lambda x, y: 18.0 + 0.0 * x),
}


def edges_px(across_mm: float) -> tuple[float, float]:
    """Where the two edges lie across the bar, px from the picture's centre, for an axis that passes it by this."""
    middle, half = (
        np.arctan2(across_mm, AWAY_MM),
        np.arcsin(RADIUS_MM / np.hypot(across_mm, AWAY_MM)),
    )
    return FOCAL_PX * np.tan(middle - half), FOCAL_PX * np.tan(middle + half)


def drawn(shade, behind, angle_rad: float, across_mm: float):
    """Noiseless picture with the bar, and without."""
    x, y = np.meshgrid(*((np.arange(n * FINE) + 0.5) / FINE - 0.5 for n in SIZE))
    background = behind(x, y)
    low, high = edges_px(across_mm)
    across = -np.sin(angle_rad) * (x - CENTRE[0]) + np.cos(angle_rad) * (y - CENTRE[1])
    cover = np.minimum(coverage(across - low), coverage(high - across))
    t = np.clip((2 * across - low - high) / (high - low), -1.0, 1.0)
    return [_seen(p) for p in (background + cover * (shade(t) - background), background)]


def _seen(fine):
    blurred = cv2.GaussianBlur(fine, (0, 0), BLUR_PX * FINE, borderType=cv2.BORDER_REPLICATE)
    return blurred.reshape(SIZE[1], FINE, SIZE[0], FINE).mean(axis=(1, 3))


def noisy_view(shade, behind, angle: float, across_mm: float, rng) -> View:
    """A bar in some frames of a camera, and the picture without it, each with its noise."""
    picture, background = drawn(shade, behind, angle, across_mm)
    frames = {}
    for k in range(FRAMES):
        frames[k] = np.minimum(picture + NOISE * rng.standard_normal(picture.shape), WHITE)
    background = background + NOISE * rng.standard_normal(picture.shape)
    matrix = [[FOCAL_PX, 0, CENTRE[0]], [0, FOCAL_PX, CENTRE[1]], [0, 0, 1]]
    camera = Camera("c", SIZE, matrix, np.zeros(5), np.column_stack([np.eye(3), [0, 0, AWAY_MM]]))
    return View(camera, frames, background, Noise(NOISE**2, 0.0))


def measured(view: View, axis: BarAxis) -> BarLineEstimate:
    """The bar's line, from a coarse one."""
    views = [ObjectView(view, RADIUS_MM, VisionSettings())]
    return measure_bars(views, axis, measure_bars(views, axis))[view.camera.name]


def errors_and_sigmas(shade, behind, rng) -> tuple[np.ndarray, np.ndarray]:
    """Error across the bar of the line's two points, and what is stated of them, in common too, px."""
    angle, across_mm = rng.uniform(0.9, 2.2), rng.uniform(-2.0, 2.0)
    view = noisy_view(shade, behind, angle, across_mm, rng)
    normal = np.array([-np.sin(angle), np.cos(angle), 0.0])
    off_mm, off_rad = rng.uniform(-0.5, 0.5) * AWAY_MM / FOCAL_PX, rng.uniform(-0.004, 0.004)
    direction = np.array([np.cos(angle + off_rad), np.sin(angle + off_rad), 0.0])
    axis = BarAxis((across_mm + off_mm) * normal, direction)
    points = measured(view, axis).points
    error = (points.px - CENTRE) @ normal[:2] - np.mean(edges_px(across_mm))
    return error, np.sqrt(points.sigma_px**2 + np.sum(points.shared_px**2, axis=1))


def main() -> None:
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    rng = np.random.default_rng(0)
    print(f"{'bar':<28} {'mean':>8} {'RMS':>8} {'sigma':>8} {'z':>6}")
    for name, (shade, behind) in SCENES.items():
        error, sigma = np.array(
            [errors_and_sigmas(shade, behind, rng) for _ in range(repeats)]
        ).transpose(1, 0, 2)
        print(
            f"{name:<28} {error.mean():>+8.4f} {np.sqrt(np.mean(error**2)):>8.4f} {np.median(sigma):>8.4f} "
            f"{np.sqrt(np.mean((error / sigma) ** 2)):>6.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
