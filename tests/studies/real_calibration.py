"""Are the stated sigmas of a calibration true on real pictures? Halves of a set, compared.

    OMP_NUM_THREADS=1 python tests/studies/real_calibration.py FOLDER [FOLDER …] [--splits 6]

FOLDER holds board.toml (the keys of session.toml's [board]) and a video or a folder of pictures of each camera; nothing
is fetched. Every camera is calibrated by itself from random halves of its views, so many times; prints the root mean
square of each lens parameter's difference between the halves over its stated sigma, which is 1 where sigmas are true.
Then, of cameras that share views and are not triggered together, what instants of their own make of held-out views.
"""

import argparse
import sys
import tomllib
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.base.threads import in_threads
from vision.boards.charuco import CharucoBoard
from vision.boards.corners import Corners, find_corners
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews
from vision.geometry.lens import LENS_TERMS
from vision.geometry.refusals import Refused
from vision.pictures.frames import Frames

SEED = 7


def read_set(folder: Path) -> tuple[CharucoBoard, BoardViews]:
    """The board of a folder, and its views by camera."""
    table = tomllib.loads((folder / "board.toml").read_text())
    board = CharucoBoard(**table | {"squares": tuple(table["squares"])})
    boards = {}
    sizes_px = {}
    for source in sorted(folder.iterdir()):
        if source.is_dir() or source.suffix == ".mp4":
            frames = Frames.open(source)
            found = in_threads(lambda frame: find_corners(frame[1], board), frames.read())
            boards[source.stem] = list(found)
            sizes_px[source.stem] = frames.size_px
    return board, BoardViews(boards, sizes_px)


def half_differences(views: BoardViews, name: str, board: CharucoBoard, splits: int) -> np.ndarray:
    """Differences of the lens between halves of a camera's views, in stated sigmas, (splits, 9)."""
    rng = np.random.default_rng(SEED)
    series = views.boards[name]
    seen = [k for k, view in enumerate(series) if len(view)]
    z = []
    for _ in range(splits):
        order = rng.permutation(seen)
        halves = order[: len(order) // 2], order[len(order) // 2 :]
        try:
            lenses, sigmas = zip(*(_lens_of(views, name, half, board) for half in halves))
        except Refused as reason:
            print(f"  {name}: half refused: {reason}")
            continue
        z.append((lenses[0] - lenses[1]) / np.hypot(*sigmas))
    return np.array(z).reshape(-1, len(LENS_TERMS))


def _lens_of(views: BoardViews, name: str, half: np.ndarray, board: CharucoBoard):
    """The lens of some views of one camera, and its sigmas, (9,) each."""
    kept = [view if k in half else Corners.none() for k, view in enumerate(views.boards[name])]
    made = calibrate_cameras(BoardViews({name: kept}, {name: views.sizes_px[name]}), board, None)
    return made.cameras[name].lens, made.report[0].intrinsics_sigma


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def together(views: BoardViews, board: CharucoBoard) -> str:
    """What the joint calibration says of instants and views."""
    try:
        made = calibrate_cameras(views, board, None)
    except Refused as reason:
        return f"refused: {reason}"
    return "; ".join([*made.notes, *made.warnings]) or "of one instant, without a question"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--splits", type=int, default=6)
    options = parser.parse_args()
    every = []
    for folder in options.folders:
        board, views = read_set(folder)
        for name in views.boards:
            z = half_differences(views, name, board, options.splits)
            if not len(z):
                continue
            every.append(z)
            terms = ", ".join(f"{term} {rms(of):.2f}" for term, of in zip(LENS_TERMS, z.T))
            print(f"{folder.name}, {name}: z RMS {rms(z):.2f} ({terms})")
        if len(views.boards) > 1:
            print(f"{folder.name}, all together: {together(views, board)}")
    print(f"all cameras: z RMS {rms(np.concatenate(every)):.2f}")


if __name__ == "__main__":
    main()
