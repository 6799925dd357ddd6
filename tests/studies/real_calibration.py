"""Are calibrations right on real pictures: held out against OpenCV and mrcal, and sigmas by halves of a set?

    OMP_NUM_THREADS=1 python tests/studies/real_calibration.py FOLDER [FOLDER …] [--splits 6]

FOLDER holds board.toml (the keys of session.toml's [board]) and a video or a folder of pictures of each camera; nothing
is fetched. Every camera is calibrated by itself, from the same corners, by this project, by OpenCV (five terms of
distortion) and by mrcal (by each of three models; where its command is installed) without every fourth view; prints the root
mean square error of those, px an axis, each view with the pose that suits it best by plain least squares; ours with the
board's points and bend as learnt from the other views, too, and what is said of these.
Then from random halves of its views, so many times (0: not): the root mean square of each lens parameter's difference
between the halves over its stated sigma, which is 1 where sigmas are true. Then, of cameras that share views and are not
triggered together, what instants of their own make of held-out views.
"""

import argparse
import ast
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.base.threads import in_threads
from bench.session.stated_board import KINDS
from vision.boards.corners import Corners, find_corners
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews
from vision.geometry.board import Board
from vision.geometry.lens import LENS_TERMS
from vision.geometry.refusals import Refused
from vision.pictures.frames import Frames

SEED = 7
HELD_OUT_EVERY = 4
# [corners] Of a view: with fewer its pose takes up what the lens does wrong.
FEWEST_CORNERS = 8
MRCAL = "mrcal-calibrate-cameras"
MRCAL_MODELS = ("OPENCV4", "OPENCV5", "OPENCV8")


def read_set(folder: Path) -> tuple[Board, BoardViews]:
    """The board of a folder, and its views by camera."""
    table = tomllib.loads((folder / "board.toml").read_text())
    kind = KINDS[table.pop("kind", "charuco")]
    board = kind(**table | {"squares": tuple(table["squares"])})
    boards = {}
    sizes_px = {}
    for source in sorted(folder.iterdir()):
        if source.is_dir() or source.suffix == ".mp4":
            frames = Frames.open(source)
            found = in_threads(lambda frame: find_corners(frame[1], board), frames.read())
            boards[source.stem] = list(found)
            sizes_px[source.stem] = frames.size_px
    return board, BoardViews(boards, sizes_px)


def half_differences(views: BoardViews, name: str, board: Board, splits: int) -> np.ndarray:
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


def _lens_of(views: BoardViews, name: str, half: np.ndarray, board: Board):
    """The lens of some views of one camera, and its sigmas, (9,) each."""
    made = calibrate_cameras(_some_views(views, name, half), board, None)
    return made.cameras[name].lens, made.report[0].intrinsics_sigma


def _some_views(views: BoardViews, name: str, kept: np.ndarray) -> BoardViews:
    """Some views of one camera."""
    series = [view if k in kept else Corners.none() for k, view in enumerate(views.boards[name])]
    return BoardViews({name: series}, {name: views.sizes_px[name]})


def held_out_errors(views: BoardViews, name: str, board: Board) -> dict[str, float]:
    """RMS error of every fourth view, px an axis, by the program that calibrated from the others."""
    series = views.boards[name]
    used = [k for k, view in enumerate(series) if len(view) >= FEWEST_CORNERS]
    held = used[HELD_OUT_EVERY - 1 :: HELD_OUT_EVERY]
    kept = np.setdiff1d(used, held)
    learnt = [series[k] for k in kept]
    size_px = views.sizes_px[name]
    made = calibrate_cameras(_some_views(views, name, kept), board, None)
    print(*(f"{name}: {note}" for note in made.notes), sep="\n")
    ours = made.cameras[name].lens
    lenses = {"ours, the board as stated": ours, "OpenCV": _by_opencv(learnt, board, size_px)}
    for model in MRCAL_MODELS if shutil.which(MRCAL) else ():
        try:
            lenses[f"mrcal {model}"] = _by_mrcal(learnt, board, size_px, lenses["OpenCV"][0], model)
        except Refused as reason:
            print(f"{name}: mrcal {model} failed: {reason}")
    views_held = [series[k] for k in held]
    errors = {"ours": _error_of_views(views_held, made.board_mm, ours)}
    for who, lens in lenses.items():
        errors[who] = _error_of_views(views_held, board.corners_mm, lens)
    return errors


def _by_opencv(learnt: list[Corners], board: Board, size_px: tuple[int, int]) -> np.ndarray:
    """The lens that OpenCV finds: fx fy cx cy and its distortion."""
    points = [board.corners_mm[view.ids].astype(np.float32) for view in learnt]
    px = [view.px.astype(np.float32) for view in learnt]
    _, matrix, distortion, _, _ = cv2.calibrateCamera(points, px, size_px, None, None)
    return np.concatenate([matrix[[0, 1, 0, 1], [0, 1, 2, 2]], distortion.ravel()])


def _by_mrcal(
    learnt: list[Corners], board: Board, size_px: tuple[int, int], focal_px: float, model: str
) -> np.ndarray:
    """The lens that mrcal finds, as `_by_opencv` has it."""
    columns, rows = board.grid
    lines = ["# filename x y level"]
    for number, view in enumerate(learnt):
        seen = {k: f"{x} {y} 0" for k, (x, y) in zip(view.ids, view.px)}
        lines += [f"view{number:04d}.png {seen.get(k, '- - -')}" for k in range(columns * rows)]
    with tempfile.TemporaryDirectory() as folder:
        corners = Path(folder) / "corners.vnl"
        corners.write_text("\n".join(lines) + "\n")
        options = {
            "--lensmodel": f"LENSMODEL_{model}",
            "--focal": focal_px,
            "--object-spacing": board.square_mm / 1000.0,
            "--object-width-n": columns,
            "--object-height-n": rows,
            "--outdir": folder,
            "--corners-cache": corners,
        }
        words = [str(word) for option in options.items() for word in option]
        size = ["--imagersize", *map(str, size_px)]
        ran = subprocess.run([MRCAL, *words, *size, "view*.png"], capture_output=True, text=True)
        if ran.returncode:
            raise Refused(ran.stderr.strip().splitlines()[-1])
        written = (Path(folder) / "camera-0.cameramodel").read_text()
    return np.array(ast.literal_eval(written)["intrinsics"])


def _error_of_views(held: list[Corners], board_mm: np.ndarray, lens: np.ndarray) -> float:
    """RMS error of views of a board's corners (n, 3), px an axis, each with its own best pose."""
    fx, fy, cx, cy = lens[:4]
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    errors = []
    for view in held:
        points = board_mm[view.ids]
        _, turn, shift = cv2.solvePnP(points, view.px, matrix, lens[4:])
        turn, shift = cv2.solvePnPRefineLM(points, view.px, matrix, lens[4:], turn, shift)
        errors.append(cv2.projectPoints(points, turn, shift, matrix, lens[4:])[0][:, 0] - view.px)
    return rms(np.concatenate(errors))


def print_held_out(rows: dict[str, dict[str, float]]) -> None:
    """Print how much better than the best of the others each camera is, and all together."""
    ratios = []
    for camera, errors in rows.items():
        rival = min(error for who, error in errors.items() if not who.startswith("ours"))
        ratios.append(errors["ours"] / rival)
        told = ", ".join(f"{who} {error:.3f}" for who, error in errors.items())
        print(f"{camera}: held out {told} px; ours over the best other {ratios[-1]:.3f}")
    together = np.exp(np.mean(np.log(ratios)))
    print(f"{len(rows)} cameras: ours over the best other {together:.3f} (geometric mean)")


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def together(views: BoardViews, board: Board) -> str:
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
    held_out = {}
    for folder in options.folders:
        board, views = read_set(folder)
        for name in views.boards:
            try:
                held_out[f"{folder.name}, {name}"] = held_out_errors(views, name, board)
            except Refused as reason:
                print(f"{folder.name}, {name}: refused: {reason}")
                continue
            z = half_differences(views, name, board, options.splits)
            if not len(z):
                continue
            every.append(z)
            terms = ", ".join(f"{term} {rms(of):.2f}" for term, of in zip(LENS_TERMS, z.T))
            print(f"{folder.name}, {name}: z RMS {rms(z):.2f} ({terms})")
        if len(views.boards) > 1 and options.splits:
            print(f"{folder.name}, all together: {together(views, board)}")
    if held_out:
        print_held_out(held_out)
    if every:
        print(f"all cameras: z RMS {rms(np.concatenate(every)):.2f}")


if __name__ == "__main__":
    main()
