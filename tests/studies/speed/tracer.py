"""What seeing costs: the tracer alone on 640 × 480 frames, and a whisk of 13 frames × 2 cameras at 1280 × 720 whole.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/speed/tracer.py [SESSION [TRIAL]] [--profile]

Prints CPU milliseconds a frame, least of three, with pictures in memory (decoding apart). The tracer: the centreline
of one wire 5.6 px wide and 570 px long from a start up to 2 px off, 13 frames together as in a whisk, which share the
shading; "first" knows nothing, "again" the lens blur, and begins nearer. Janelia's whisk takes 132 to
147 ms a frame of this size on one core; the bar is a tenth of that. SESSION is a synthetic one (its truth holds the
cameras), fixtures/small-session by default. --profile prints the whisk's time by function.
"""

import cProfile
import pstats
import sys
import time
from pathlib import Path

import numpy as np
from scipy.special import ndtr

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.scenes.recorded import Recorded
from vision.pictures.pixel_noise import Noise
from vision.truth.trial_pictures import TrialPictures
from vision.wire.bands import cut_pieces, read_band
from vision.wire.shading import Knots
from vision.wire.trace import to_points, trace

ROOT = Path(__file__).resolve().parents[3]
FRAMES, SHAPE = 13, (480, 640)
RADIUS_PX, BLUR_PX, NOISE = 2.8, 0.95, 2.0
KNOTS = Knots(np.arange(40.0, 600.0, 70.0))  # as many as a whisker of 100 mm gets
BAR_MS = 13.2  # a tenth of the faster of Janelia's two times


def wire_frames(rng, step: float = 40.0) -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]:
    """Background (a chessboard, its squares so many grey levels apart), frames of a wire that bends more and more, and
    the true height of its axis at each column."""
    column = np.arange(SHAPE[1])
    background = 60.0 + step * ((np.arange(SHAPE[0]) // 45)[:, None] + column[None] // 45 & 1)
    heights = [
        200.0 + 6.0 * k + (0.05 + 0.01 * k) * column + 2e-4 * k * column**1.6 for k in range(FRAMES)
    ]
    frames = []
    for height in heights:
        off = (np.arange(SHAPE[0])[:, None] - height) / np.hypot(1.0, np.gradient(height))
        cover = ndtr((off + RADIUS_PX) / BLUR_PX) - ndtr((off - RADIUS_PX) / BLUR_PX)
        frames.append(
            background + cover * (150.0 - background) + NOISE * rng.standard_normal(SHAPE)
        )
    return background, frames, heights


def rough_bands(background, frames, heights, off_px: float):
    """Bands beside the wire as a predicted curve gives them, up to off_px away from it."""
    x = np.linspace(30.0, 600.0, 200)
    curves = [
        np.stack([x, np.interp(x, np.arange(SHAPE[1]), h) + off_px * np.sin(x / 90.0)], axis=1)
        for h in heights
    ]
    return [
        read_band(frame, background, curve, x, np.full(len(x), RADIUS_PX), 10)
        for frame, curve in zip(frames, curves)
    ]


def trace_first(scene) -> float:
    """Everything for frames that were never looked at; returns the lens blur found."""
    pieces = cut_pieces(rough_bands(*scene, 1.0), 12, Noise(NOISE**2, 0.0))
    traced = trace(pieces, KNOTS)
    to_points(traced)
    return traced.blur_px


def trace_again(scene, blur_px: float) -> None:
    """The same as a whisk's second look: from a nearer start, with the blur seen."""
    pieces = cut_pieces(rough_bands(*scene, 0.2), 12, Noise(NOISE**2, 0.0))
    to_points(trace(pieces, KNOTS, seen_blur_px=blur_px))


def cpu_ms(call) -> float:
    """CPU milliseconds a frame of a call for all frames: least of three, after one that fills the tables."""
    call()
    return min(_timed(call) for _ in range(3)) / FRAMES


def _timed(call) -> float:
    begin = time.process_time()
    call()
    return 1000.0 * (time.process_time() - begin)


def whisk_call(session: Path, trial: str):
    """A function that sees a whisk of 13 frames, spread over a trial, with two cameras."""
    recorded = Recorded(session, trial)
    chosen = np.unique(np.linspace(0, len(recorded.rows["time_s"]) - 1, FRAMES).round().astype(int))
    frames = {
        name: {k: pictures[f] for k, f in enumerate(chosen)}
        for name, pictures in recorded.frames.items()
    }
    motor, clock = np.radians(recorded.rows["motor_deg"][chosen]), recorded.rows["time_s"][chosen]
    pictures = TrialPictures(frames, clock, motor, recorded.background)
    return lambda: recorded.see_frames(pictures)


def main() -> None:
    names = [a for a in sys.argv[1:] if not a.startswith("--")]
    session = Path(names[0]) if names else ROOT / "fixtures" / "small-session"
    trial = names[1] if len(names) > 1 else "b30_3"
    scene = wire_frames(np.random.default_rng(0))
    blur = trace_first(scene)
    first, again = cpu_ms(lambda: trace_first(scene)), cpu_ms(lambda: trace_again(scene, blur))
    print(
        f"tracer, {SHAPE[1]} x {SHAPE[0]}: first {first:.1f} ms, again {again:.1f} ms a frame (bar: {BAR_MS:.1f})"
    )
    see = whisk_call(session, trial)
    seen = see()
    whole = min(_timed(see) for _ in range(3))
    print(
        f"whisk of {FRAMES} frames x {seen.cameras} cameras ({trial}): {whole / 1000:.2f} s "
        f"(bar: 1 s), d_x {seen.d_x_mm.value:.3f} ± {seen.d_x_mm.sigma:.3f} mm"
    )
    if "--profile" in sys.argv:
        profile = cProfile.Profile()
        profile.runcall(see)
        pstats.Stats(profile).sort_stats("tottime").print_stats(18)
        pstats.Stats(profile).sort_stats("cumulative").print_stats(45)


if __name__ == "__main__":
    main()
