"""What others make of the frames that tests/studies/speed/beside.py hands over; run by it, in an environment of their own.

    python others.py FRAMES.npy WORK LIBRARIES OUT.npz

FRAMES.npy: (f, h, w) grey pictures of 8 bits. WORK: a folder for whisk's files. LIBRARIES: folders of FFmpeg's
libraries, with colons between. OUT.npz: by method its line points (n, 3) as frame, x and y in pixels, its seconds of
processor a frame, and its version.
"""

import os
import resource
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import tifffile
from skimage.filters import sato

_HEADER_BYTES = 12
_STRIP_PX = 30  # columns
_SIGMA_PX = (
    2.0  # of the ridge filter: half of the wire's width over sqrt 2, as its scale space has it
)


def by_whisk(frames: np.ndarray, work: Path, libraries: str) -> tuple[np.ndarray, float]:
    """Every segment's points with the segment's number as a fourth column; seconds a frame. It traces the movie twice:
    the first run makes its tables, which it keeps beside the movie."""
    movie = 255 - frames
    movie[:, :, -_STRIP_PX:] = 0
    tifffile.imwrite(work / "movie.tif", movie, photometric="minisblack")
    known = os.environ | {"LD_LIBRARY_PATH": libraries}
    program = Path(
        sys.prefix,
        "lib",
        f"python3.{sys.version_info[1]}",
        "site-packages",
        "whisk",
        "bin",
        "trace",
    )
    program.chmod(0o755)
    command = [str(program), "movie.tif", "movie.whiskers"]
    for _ in range(2):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            command,
            cwd=work,
            env=known,
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return segments((work / "movie.whiskers").read_bytes()), spent / len(frames)


def segments(data: bytes) -> np.ndarray:
    """(n, 4) frame, x, y, number of the segment. whisk's binary format: per segment its id, frame and length, then x,
    y, thickness and score of each point, all of 4 bytes; at the end how many segments there are."""
    place, found = _HEADER_BYTES, []
    (count,) = np.frombuffer(data[-4:], "<i4")
    for number in range(count):
        _, frame, length = np.frombuffer(data, "<i4", 3, place)
        x, y = np.frombuffer(data, "<f4", 2 * length, place + 12).reshape(2, length)
        found.append(np.stack([np.full(length, frame), x, y, np.full(length, number)], axis=1))
        place += 12 + 16 * length
    return np.concatenate(found)


def by_ridges(frames: np.ndarray) -> tuple[np.ndarray, float]:
    """In each column the strongest response of Sato's filter, to a part of a pixel by a parabola."""
    found, spent = [], []
    for number, frame in enumerate(frames):
        begin = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        strength = sato(frame.astype(float), sigmas=[_SIGMA_PX], black_ridges=False)
        x, y = np.arange(frame.shape[1]), strength.argmax(axis=0).clip(1, len(frame) - 2)
        low, at, high = (strength[y + step, x] for step in (-1, 0, 1))
        bend = np.where(low + high < 2 * at, low + high - 2 * at, -np.inf)
        found.append(np.stack([np.full(len(x), number), x, y + 0.5 * (low - high) / bend], axis=1))
        spent.append(resource.getrusage(resource.RUSAGE_SELF).ru_utime - begin)
    return np.concatenate(found), min(spent)


def main() -> None:
    frames, work, libraries, out = np.load(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], sys.argv[4]
    whisked, whisk_s = by_whisk(frames, work, libraries)
    ridges, ridges_s = by_ridges(frames)
    np.savez(
        out,
        whisk=whisked,
        whisk_s=whisk_s,
        whisk_version=version("whisk-janelia"),
        ridges=ridges,
        ridges_s=ridges_s,
        ridges_version=version("scikit-image"),
    )


if __name__ == "__main__":
    main()
