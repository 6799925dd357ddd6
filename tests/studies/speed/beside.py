"""Beside what a user would take instead, on the same frames in one run: error and seconds of each, with its version.

    for each in lines boards rods; do python -m venv OTHERS/$each; done
    OTHERS/lines/bin/pip install whisk-janelia==1.2.5 av==12.3.0 scikit-image
    OTHERS/boards/bin/pip install aniposelib
    OTHERS/rods/bin/pip install pyelastica
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/speed/beside.py OTHERS

An environment that is not there is said so and left out. Cameras are compared in beside_boards.py, rods in
beside_rods.py.

Lines: the frames are those of tests/studies/speed/tracer.py, in grey levels of 8 bits: a wire 5.6 px wide, before an even
background and before a chessboard. Our tracer is told where the wire is to 1 px, as a whisk's fit tells it, and learns
shading and blur from all 13 frames. whisk and the ridge filter are told nothing, but of whisk's segments the one that
is nearest to the truth is taken in each frame, and of both what lies within 5 px of it. whisk traces what is dark, in
pictures that have something dark beside: it is given the frames' negative with a black strip beyond the columns judged.
Its programs ask for FFmpeg's libraries by their plain names: PyAV brings them, and links to them are made for the run.
"""

import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.speed import beside_boards, beside_rods
from tests.studies.speed.tracer import KNOTS, NOISE, cpu_ms, rough_bands, wire_frames
from vision.pictures.pixel_noise import Noise
from vision.wire.bands import cut_pieces
from vision.wire.trace import to_points, trace

FROM_PX, TO_PX = 30.0, 600.0  # columns that the wire is judged in, as it is traced
SHORTEST_PX = 50  # of a segment that may be the wire
NEAR_PX = 5.0
_OFF_PX = 1.0  # by which our tracer begins


def ours(background: np.ndarray, frames: list, heights: list) -> np.ndarray:
    """Line points (n, 3): frame, x, y."""
    pieces = cut_pieces(rough_bands(background, frames, heights, _OFF_PX), 12, Noise(NOISE**2, 0.0))
    points, source = to_points(trace(pieces, KNOTS))
    return np.column_stack([source, points.px])


def off_px(points: np.ndarray, heights: list) -> np.ndarray:
    """How far points (n, 3) lie off the true axis, across it; NaN beyond the columns judged."""
    off = np.full(len(points), np.nan)
    for number, height in enumerate(heights):
        mine = points[:, 0] == number
        x, y = points[mine, 1], points[mine, 2]
        column = np.arange(len(height))
        away = (y - np.interp(x, column, height)) / np.hypot(
            1.0, np.interp(x, column, np.gradient(height))
        )
        off[mine] = np.where((x >= FROM_PX) & (x <= TO_PX), away, np.nan)
    return off


def nearest_segments(points: np.ndarray, heights: list) -> np.ndarray:
    """Of segments (n, 4) the one in each frame that lies nearest to the wire."""
    off = np.abs(off_px(points, heights))
    chosen = []
    for number in range(len(heights)):
        there = [points[:, 3] == k for k in np.unique(points[points[:, 0] == number, 3])]
        there = [one for one in there if np.sum(np.isfinite(off[one])) >= SHORTEST_PX]
        chosen += [points[min(there, key=lambda one: np.nanmedian(off[one]))]] if there else []
    return np.concatenate(chosen)


def line(name: str, points: np.ndarray, heights: list, ms: float) -> str:
    """RMS error, worst, the share of the wire that has points, milliseconds of processor a frame."""
    off = off_px(points, heights)
    judged = np.isfinite(off)
    columns = {(frame, round(x)) for frame, x in points[judged, :2]}
    near = np.abs(off[judged]) <= NEAR_PX
    kept = off[judged][near]
    every = np.median(np.diff(np.sort(points[points[:, 0] == 0, 1])).clip(1))
    share = min(1.0, len(columns) * every / ((TO_PX - FROM_PX) * len(heights)))
    return (
        f"{name:<34}{np.sqrt(np.mean(kept**2)):8.3f}{np.abs(kept).max():10.3f}{np.mean(~near):12.0%}{share:8.0%}"
        f"{ms:10.1f}"
    )


def libraries(others: Path, folder: Path) -> str:
    """Where FFmpeg's libraries are that PyAV's wheel brings, and links to them in the folder under plain names:
    libavcodec.so.60 for libavcodec-1a1332f2.so.60.31."""
    found = list(others.glob("lib/python*/site-packages/av.libs/*.so*"))
    for file in found:
        plain = re.sub(r"-[0-9a-f]{8}\.", ".", file.name)
        (folder / re.sub(r"(\.so\.\d+).*", r"\1", plain)).symlink_to(file.resolve())
    return f"{folder}:{found[0].parent}"


def theirs(others: Path, frames: list) -> dict:
    """What tests/studies/speed/others.py writes."""
    with TemporaryDirectory() as name:
        work = Path(name)
        (work / "libraries").mkdir()
        np.save(work / "frames.npy", np.array(frames, dtype=np.uint8))
        found = libraries(others, work / "libraries")
        script = Path(__file__).with_name("others.py")
        command = [
            others / "bin" / "python",
            script,
            work / "frames.npy",
            work,
            found,
            work / "out.npz",
        ]
        subprocess.run([str(part) for part in command], check=True)
        with np.load(work / "out.npz") as out:
            return dict(out)


def table(others: Path, step: float) -> Iterator[str]:
    background, frames, heights = wire_frames(np.random.default_rng(0), step)
    frames = [np.clip(np.rint(frame), 0, 255) for frame in frames]
    found = theirs(others, frames)
    scene = background, frames, heights
    title = (
        "before an even background" if step == 0 else f"before squares {step:g} grey levels apart"
    )
    yield f"{title:<34}{'RMS px':>8}{'worst px':>10}{'beyond 5 px':>12}{'found':>8}{'ms/frame':>10}"
    yield line(
        f"whisker-bench {version('whisker-bench')}",
        ours(*scene),
        heights,
        cpu_ms(lambda: ours(*scene)),
    )
    whisked = nearest_segments(found["whisk"], heights)
    yield line(
        f"whisk-janelia {found['whisk_version']}", whisked, heights, 1000 * float(found["whisk_s"])
    )
    name = f"scikit-image {found['ridges_version']}, Sato"
    yield line(name, found["ridges"], heights, 1000 * float(found["ridges_s"]))


def main() -> None:
    others = Path(sys.argv[1])
    tables = {
        "lines": lambda place: (line for step in (0.0, 40.0) for line in table(place, step)),
        "boards": beside_boards.table,
        "rods": beside_rods.table,
    }
    for name, lines in tables.items():
        place = others / name
        if (place / "bin" / "python").exists():
            print(*lines(place), "", sep="\n", flush=True)
        else:
            print(f"{name}: there is no environment {place}\n")


if __name__ == "__main__":
    main()
