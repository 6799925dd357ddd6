"""Whether the wire's lines forget where they were looked for: starts off by an offset, alike in all frames or not.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/starts.py [REPEATS]

The wire of tests/studies/speed/tracer.py (5.6 px wide, contrast 50 to 90, noise 2, 13 frames) before four backgrounds, whose
borders are sharp. A start is off by an offset along the wire of sin(x / 90 px) times so many pixels. As in a whisk the
wire is looked for from there, and again beside a smooth curve through what was found. Columns:

- first: RMS error in px of the first look; RMS: of the second
- own, sigma: median of what a piece is stated to be uncertain by on its own, and with what all share (light and lens)
- z: error over the latter, RMS
- moved: from where the same noise leaves the line that was looked for where it is, in stated sigmas, RMS; and at most
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.polynomial import Polynomial
from scipy.special import ndtr

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from vision.pictures.pixel_noise import Noise
from vision.wire.bands import cut_pieces, read_band
from vision.wire.shading import Knots
from vision.wire.trace import WireTrace, trace

FRAMES, SHAPE = 13, (480, 640)
RADIUS_PX, BLUR_PX, NOISE = 2.8, 0.95, 2.0
X, HALF_PX, PIECE_PX = np.linspace(30.0, 600.0, 200), 10, 12
KNOTS = Knots(np.arange(40.0, 600.0, 70.0))  # as many as a whisker of 100 mm gets


@dataclass(frozen=True)
class Scene:
    """A wire of one grey level before a background (h, w)."""

    behind: Callable[[np.ndarray, np.ndarray], np.ndarray]
    wire: float


SCENES = {
    "flat, bright wire": Scene(lambda x, y: 80.0 + 0.0 * x, 150.0),
    "flat, dark wire": Scene(lambda x, y: 150.0 + 0.0 * x, 80.0),
    "ramp": Scene(lambda x, y: 60.0 + 40.0 * x / SHAPE[1], 150.0),
    "squares": Scene(lambda x, y: 60.0 + 40.0 * (y // 45 + x // 45 & 1), 150.0),
}
# How far off a start is (px), and by how much the phase of the offset moves on from frame to frame (rad).
STARTS = {
    "0": (0.0, 0.0),
    "0.2 px": (0.2, 0.0),
    "1 px": (1.0, 0.0),
    "1.5 px": (1.5, 0.0),
    "1 px, another phase in each frame": (1.0, 1.0),
    "1.5 px, another phase in each frame": (1.5, 1.0),
}


def axis_heights() -> list[np.ndarray]:
    """Height of the wire's axis at each column, frame by frame: it bends more and more."""
    column = np.arange(SHAPE[1])
    return [
        200.0 + 6.0 * k + (0.05 + 0.01 * k) * column + 2e-4 * k * column**1.6 for k in range(FRAMES)
    ]


def drawn(scene: Scene, rng) -> tuple[np.ndarray, list[np.ndarray]]:
    """Background and noisy frames."""
    y, x = np.indices(SHAPE)
    background, frames = scene.behind(x, y), []
    for height in axis_heights():
        off = (y - height) / np.hypot(1.0, np.gradient(height))
        cover = ndtr((off + RADIUS_PX) / BLUR_PX) - ndtr((off - RADIUS_PX) / BLUR_PX)
        frames.append(
            background + cover * (scene.wire - background) + NOISE * rng.standard_normal(SHAPE)
        )
    return background, frames


def rough_bands(background, frames, off_px: float, phase_rad: float = 0.0):
    """Bands beside the wire as a predicted curve gives them, up to off_px away from it."""
    heights = [np.interp(X, np.arange(SHAPE[1]), height) for height in axis_heights()]
    curves = [
        np.stack([X, height + off_px * np.sin(X / 90.0 + k * phase_rad)], axis=1)
        for k, height in enumerate(heights)
    ]
    return [
        read_band(frame, background, curve, X, np.full(len(X), RADIUS_PX), HALF_PX)
        for frame, curve in zip(frames, curves)
    ]


def looked_once(background, frames, off_px: float, phase_rad: float) -> WireTrace:
    """The wire in all frames, found from a start that is off."""
    return trace(
        cut_pieces(
            rough_bands(background, frames, off_px, phase_rad), PIECE_PX, Noise(NOISE**2, 0.0)
        ),
        KNOTS,
    )


def looked_twice(background, frames, off_px: float, phase_rad: float) -> WireTrace:
    """The same, and then found again beside a smooth curve through what was found, as in a whisk."""
    seen, bands = looked_once(background, frames, off_px, phase_rad), []
    for number, frame in enumerate(frames):
        points = seen.pieces.foot_px[seen.pieces.source == number]
        curve = Polynomial.fit(*points.T, 7)(X)
        bands.append(
            read_band(
                frame,
                background,
                np.stack([X, curve], axis=1),
                X,
                np.full(len(X), RADIUS_PX),
                HALF_PX,
            )
        )
    return trace(
        cut_pieces(bands, PIECE_PX, Noise(NOISE**2, 0.0)), KNOTS, seen_blur_px=seen.blur_px
    )


def whole_sigma_px(traced: WireTrace) -> np.ndarray:
    """Sigma (s,) of each piece alone, what it shares with others included."""
    return np.hypot(traced.solved.own_sigma_px, np.linalg.norm(traced.solved.shared_px, axis=1))


def errors(traced: WireTrace) -> np.ndarray:
    """Distance (s,) of each piece from the axis, px."""
    column, heights = np.arange(SHAPE[1]), np.array(axis_heights())
    slopes = np.gradient(heights, axis=1)
    x, y = traced.pieces.foot_px.T
    height, slope = (
        np.array([np.interp(at, column, table[k]) for at, k in zip(x, traced.pieces.source)])
        for table in (heights, slopes)
    )
    return (y - height) / np.hypot(1.0, slope)


def main() -> None:
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    print(
        f"{'background':<20}{'start off by':<38}{'n':>6}{'first px':>10}{'RMS px':>8}{'own px':>8}{'sigma px':>10}"
        f"{'z':>6}{'moved':>7}{'at most':>9}"
    )
    for name, scene in SCENES.items():
        rng = np.random.default_rng(0)
        pictures, begin = [drawn(scene, rng) for _ in range(repeats)], None
        for start, off in STARTS.items():
            first = np.concatenate([errors(looked_once(*one, *off)) for one in pictures])
            located = [looked_twice(*one, *off) for one in pictures]
            error = np.concatenate([errors(one) for one in located])
            own = np.concatenate([one.solved.own_sigma_px for one in located])
            sigma = np.concatenate([whole_sigma_px(one) for one in located])
            begin = error if begin is None else begin
            moved = np.abs(error - begin) / sigma
            print(
                f"{name:<20}{start:<38}{len(error):>6}{_rms(first):>10.3f}{_rms(error):>8.3f}{np.median(own):>8.3f}"
                f"{np.median(sigma):>10.3f}{_rms(error / sigma):>6.2f}{_rms(moved):>7.2f}{moved.max():>9.2f}",
                flush=True,
            )


def _rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    main()
