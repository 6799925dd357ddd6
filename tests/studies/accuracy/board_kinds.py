"""Cameras by each kind of board: are the stated sigmas true, and what does a contact's place lose against ChArUco?

    python tests/studies/accuracy/board_kinds.py --count 10
    python tests/studies/accuracy/board_kinds.py --whisks FOLDER [--seeds 1]

Each board is painted through the lenses of two known cameras, held at the same random poses and standing on the rig;
its points are found in the pictures. One calibration is made of these, and `count` more of the true points with noise
of the sigmas that the pictures gave. Prints RMS of error over stated sigma of places where the whisker is, for the
calibration by pictures and for all others, and the sigma of x there, which is that of d_x by the cameras.

With --whisks sessions of each kind are simulated in FOLDER and evaluated, boards to verdict: prints errors of d_x (mm)
and slope (deg), RMS and largest z, how many 95 % intervals hold, and what is warned of. A session that has its row in
FOLDER/whisks.csv is not made again.
"""

import argparse
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench import api
from bench.rig.simulation import simulate
from bench.session.session import load_session
from tests.scenes.board_prints import KINDS, NAMES, picture_of, pose_before
from tests.studies.accuracy.board_scenes import SIZE_PX, T_RIG_BOARD, WORK_MM, two_cameras
from tests.studies.accuracy.rows import all_rows
from tests.studies.accuracy.sessions import errors
from tests.studies.accuracy.whisk_errors import as_columns, columns_of, of_columns, of_whisks
from vision.boards import Corners, find_corners
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.turned import with_turns_resolved
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.board import Board
from vision.geometry.camera import Camera, Cameras
from vision.geometry.rotation import apply, compose, exp_rotation, invert_transform
from vision.geometry.triangulate import triangulate

VIEWS = 10
EDGE_PX = 12
MOST_TILT_RAD = 0.55
POINT_SIGMA_PX = 0.05
# Kalibr's z comes out of the board.
_TO_VIEWER = np.diag([1.0, -1.0, -1.0])


def held_poses(board: Board, camera: Camera, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """T_camera_board of views in which the whole board is seen."""
    upright = _TO_VIEWER if board.kind == "aprilgrid" else np.eye(3)
    count = 0
    while count < VIEWS:
        lean = exp_rotation(np.array([*rng.uniform(-MOST_TILT_RAD, MOST_TILT_RAD, 2), 0.0]))
        turn = exp_rotation(np.array([0.0, 0.0, rng.uniform(-0.4, 0.4)])) @ lean @ upright
        middle = [*rng.uniform(-70, 70, 1), *rng.uniform(-40, 40, 1), 400 * rng.uniform(0.85, 1.3)]
        T = pose_before(board, camera, middle, turn)
        if _is_whole(camera, compose(invert_transform(camera.T_camera_rig), T), board):
            count += 1
            yield T


def _is_whole(camera: Camera, T_rig_board: np.ndarray, board: Board) -> bool:
    px = camera.project(apply(T_rig_board, board.corners_mm))
    margin = EDGE_PX + 0.06 * np.ptp(px, axis=0).max()
    return bool(np.all((px > margin) & (px < np.array(camera.size_px) - margin)))


def rig_pose(board: Board) -> np.ndarray:
    """T_rig_board with the board's middle where that of the ChArUco board is."""
    middle = apply(T_RIG_BOARD, KINDS[0].corners_mm.mean(axis=0)[None])[0]
    turn = T_RIG_BOARD[:, :3] @ (_TO_VIEWER if board.kind == "aprilgrid" else np.eye(3))
    return np.column_stack([turn, middle - turn @ board.corners_mm.mean(axis=0)])


def seen(board: Board, camera: Camera, T: np.ndarray, rng: np.random.Generator) -> tuple:
    """What is found in a picture, under the true names; and the true places of these points."""
    found = find_corners(picture_of(board, camera, T, rng, fine=2), board)
    T_rig_board = compose(invert_transform(camera.T_camera_rig), T)
    true_px = camera.project(apply(T_rig_board, board.corners_mm))
    names = (np.arange(len(true_px)), *board.hidden_turns)
    right = min(names, key=lambda turn: np.abs(found.px - true_px[turn][found.ids]).sum())
    ids = right[found.ids]
    return Corners(ids, found.px, found.sigma_px), true_px[ids]


def renoised(view: tuple, rng: np.random.Generator) -> Corners:
    found, true_px = view
    noise = found.sigma_px[:, None] * rng.standard_normal(true_px.shape)
    return Corners(found.ids, true_px + noise, found.sigma_px)


def outcome(boards: dict, rig: dict, board: Board, cameras: Cameras, rng: np.random.Generator):
    """Errors and sigmas (points, 3) mm of places where the whisker is."""
    views = BoardViews(boards, dict.fromkeys(boards, SIZE_PX), rig)
    made = calibrate_cameras(
        with_turns_resolved(views, board), board, MeasuredPose(rig_pose(board))
    ).cameras
    noise = {c.name: rng.standard_normal((len(WORK_MM), 2)) for c in cameras}
    px = {c.name: c.project(WORK_MM) + POINT_SIGMA_PX * noise[c.name] for c in cameras}
    sigma_px = np.full(len(WORK_MM), POINT_SIGMA_PX)
    points = triangulate(made, px, {c.name: sigma_px for c in cameras})
    return points.mm - WORK_MM, np.sqrt(np.einsum("nii->ni", points.covariance(made)))


def study(board: Board, count: int) -> str:
    rng = np.random.default_rng(11)
    cameras = two_cameras()
    held = {}
    rig = {}
    for camera in cameras:
        poses = held_poses(board, camera, rng)
        held[camera.name] = [seen(board, camera, T, rng) for T in poses]
        rig[camera.name] = seen(board, camera, compose(camera.T_camera_rig, rig_pose(board)), rng)
    found = {name: [view[0] for view in views] for name, views in held.items()}
    on_rig = {name: view[0] for name, view in rig.items()}
    z = np.divide(*outcome(found, on_rig, board, cameras, rng))
    drawn = []
    for _ in range(count):
        boards = {name: [renoised(v, rng) for v in views] for name, views in held.items()}
        again = {name: renoised(view, rng) for name, view in rig.items()}
        drawn.append(outcome(boards, again, board, cameras, rng))
    errors, sigmas = (np.array(part) for part in zip(*drawn))
    points = np.concatenate([view.sigma_px for views in found.values() for view in views])
    return (
        f"points {np.median(points):.4f} px; by pictures z {np.sqrt(np.mean(z**2)):.2f}; "
        f"drawn z {np.sqrt(np.mean((errors / sigmas) ** 2)):.2f}, "
        f"x off by {np.sqrt(np.mean(errors[..., 0] ** 2)):.4f}, sigma {np.sqrt(np.mean(sigmas[..., 0] ** 2)):.4f} mm"
    )


# The boards of --whisks: each is seen whole on the rig, too.
ON_RIG = {
    "charuco": "",
    "checkerboard": 'kind = "checkerboard"\nsquares = [8, 7]\nsquare_mm = 13.0',
    "circles": 'kind = "circles"\nsquares = [8, 6]\nsquare_mm = 14.0\nmarker_mm = 8.0',
    "asymmetric": 'kind = "asymmetric_circles"\nsquares = [4, 9]\nsquare_mm = 9.0\nmarker_mm = 7.0',
    "aprilgrid": 'kind = "aprilgrid"\nsquares = [5, 4]\nsquare_mm = 22.0\nmarker_mm = 17.0',
}
PROTOCOL = """
name = "{name}"
[[cameras]]
name = "high"
position_mm = [38.0, -175.0, 335.0]
focal_px = 2010.0
distortion = [-0.11, 0.14, 0.0006, -0.0004, 0.0]
[[cameras]]
name = "low"
position_mm = [98.0, -325.0, 120.0]
target_mm = [53.0, 7.0, 0.0]
focal_px = 1932.0
[gauges]
known = true
[board]
{board}
views = 12
[[trials]]
beta_deg = [0, 25, 50]
d_x_mm = 58.0
"""
QUANTITIES = {"d_x": "d_x_mm", "beta": "beta_deg"}
MOST_Z = tuple(f"{name}_most_z" for name in QUANTITIES)
WHISK_COLUMNS = ("look", *columns_of(QUANTITIES), *MOST_Z, "status")
FIRST_SEED = 5


def row_of(folder: Path, name: str, seed: int, workers: int = 2) -> dict:
    """The row of a session by one kind of board, made where it is not there."""
    table = folder / "whisks.csv"
    look = f"{name} {seed}"
    rows = all_rows(table, WHISK_COLUMNS, [look], lambda _: whisks_of(folder, name, seed, workers))
    (row,) = (row for row in rows if row["look"] == look)
    return row


def whisks_of(folder: Path, name: str, seed: int, workers: int) -> dict:
    """A session by one kind of board, evaluated and reduced; the pictures go."""
    path = folder / f"{name}{seed}"
    out = folder / f"{name}{seed}_out"
    protocol = folder / f"{name}.toml"
    folder.mkdir(parents=True, exist_ok=True)
    protocol.write_text(PROTOCOL.format(name=name, board=ON_RIG[name]))
    simulate(path, protocol=protocol, seed=seed, workers=workers)
    run = api.evaluate(path, out, figures=False, workers=workers)
    status = " ".join(filter(None, run.whisks["status"]))
    row: dict = {"look": f"{name} {seed}", "status": status}
    for quantity, column in QUANTITIES.items():
        found = errors(load_session(path), out, run.whisks, column)[:, :2]
        row |= as_columns(quantity, of_whisks(found))
        row[f"{quantity}_most_z"] = float(np.abs(np.divide(*found.T)).max())
    shutil.rmtree(path)
    return row


def print_whisks(folder: Path, only: str, seeds: int) -> None:
    for name in ON_RIG:
        if not name.startswith(only):
            continue
        for seed in range(FIRST_SEED, FIRST_SEED + seeds):
            row = row_of(folder, name, seed)
            print(f"{row['look']}: {row['d_x_n']:.0f} whisks {row['status']}")
            for quantity in QUANTITIES:
                found = of_columns(row, quantity)
                print(
                    f"  {quantity} off by {found['rms']:.4f} RMS, z {found['rms_z']:.2f} RMS, "
                    f"{row[f'{quantity}_most_z']:.1f} at most, {found['held']:.0%} hold",
                    flush=True,
                )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--whisks", type=Path, metavar="FOLDER", help="whole whisks, into FOLDER")
    parser.add_argument("--count", type=int, default=10)
    parser.add_argument("--seeds", type=int, default=1, help="sessions of each kind, of --whisks")
    parser.add_argument("--only", default="", help="names that begin so")
    options = parser.parse_args()
    if options.whisks:
        print_whisks(options.whisks, options.only, options.seeds)
        return
    for board, name in zip(KINDS, NAMES):
        if name.startswith(options.only):
            print(f"{name}: {study(board, options.count)}", flush=True)


if __name__ == "__main__":
    main()
