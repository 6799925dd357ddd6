"""Cameras from the same board pictures by ours and by aniposelib: the error of points in space, and seconds."""

import subprocess
import time
from collections.abc import Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.rig import boards, build
from bench.rig.protocol import Protocol, load
from bench.rig.studio import Studio
from tests.studies.accuracy.board_scenes import WORK_MM
from vision.boards.charuco import CharucoBoard
from vision.boards.corners import find_corners
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.camera import Camera

VIEWS = 16  # of the board in the air, as seen by all cameras at once


def board_pictures(protocol: Protocol, rng: np.random.Generator) -> np.ndarray:
    """Pictures (c, v, h, w) of 8 bits: the board held before one camera after the other, and on the rig (the last)."""
    scene, sensor, board = build.scene(protocol), build.sensor(protocol), build.board(protocol)
    cameras = build.cameras(protocol)
    held = [boards.draw_poses(board, camera, VIEWS // len(cameras), rng) for camera in cameras]
    poses = [pose for of_camera in held for pose in of_camera]
    studios = [Studio(camera, scene, sensor) for camera in cameras]
    return np.array(
        [
            [
                *(studio.sensor.expose(studio.board_brightness(pose), rng) for pose in poses),
                studio.sensor.expose(studio.rig_brightness(), rng),
            ]
            for studio in studios
        ]
    )


def in_space_mm(cameras: Sequence[Camera], exact: Sequence[Camera]) -> tuple[float, float]:
    """RMS and largest error, mm, of points round the whisker that two cameras triangulate from exact pictures of them,
    after the shift and turn that fits best."""
    found = _triangulated(cameras, [camera.project(WORK_MM) for camera in exact])
    left, right = found - found.mean(axis=0), WORK_MM - WORK_MM.mean(axis=0)
    u, _, vt = np.linalg.svd(left.T @ right)
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    off = np.linalg.norm(left @ turn - right, axis=1)
    return float(np.sqrt(np.mean(off**2))), float(off.max())


def _triangulated(cameras: Sequence[Camera], px: Sequence[np.ndarray]) -> np.ndarray:
    """Points (n, 3) nearest to the sights of all cameras."""
    matrix, target = np.zeros((len(WORK_MM), 3, 3)), np.zeros((len(WORK_MM), 3))
    for camera, seen in zip(cameras, px):
        ways = camera.rays(seen)
        across = np.eye(3) - ways[:, :, None] * ways[:, None, :]
        matrix, target = matrix + across, target + across @ camera.centre_mm
    return np.linalg.solve(matrix, target[..., None])[..., 0]


def ours(
    pictures: np.ndarray, board: CharucoBoard, T_rig_board: np.ndarray
) -> tuple[list[Camera], float, float]:
    """Cameras; seconds of processor a picture, and of the adjustment."""
    begin = time.process_time()
    views = [[find_corners(picture, board) for picture in of_camera] for of_camera in pictures]
    found_s, names = time.process_time() - begin, [f"c{k}" for k in range(len(pictures))]
    begin, sizes = time.process_time(), dict.fromkeys(names, pictures.shape[:1:-1])
    all_views = BoardViews(
        {n: v[:-1] for n, v in zip(names, views)}, sizes, {n: v[-1] for n, v in zip(names, views)}
    )
    made = calibrate_cameras(all_views, board, MeasuredPose(T_rig_board))
    return list(made.cameras), found_s / pictures[..., 0, 0].size, time.process_time() - begin


def theirs(others: Path, pictures: np.ndarray, board: CharucoBoard) -> dict:
    """What others_boards.py writes."""
    _, kind, size = board.dictionary.split("_")
    numbers = [*board.squares, board.square_mm, board.marker_mm, kind[0], size]
    with TemporaryDirectory() as name:
        work = Path(name)
        np.save(work / "pictures.npy", pictures)
        script = Path(__file__).with_name("others_boards.py")
        command = [
            others / "bin" / "python",
            script,
            work / "pictures.npy",
            *numbers,
            work / "out.npz",
        ]
        subprocess.run([str(part) for part in command], check=True, stderr=subprocess.DEVNULL)
        with np.load(work / "out.npz") as out:
            return dict(out)


def table(others: Path) -> Iterator[str]:
    """Lines of the comparison. others: the environment that has aniposelib."""
    protocol = load("paper")
    pictures = board_pictures(protocol, np.random.default_rng(0))
    exact = [
        Camera(
            c.name,
            c.size_px,
            c.matrix,
            c.distortion,
            np.column_stack([c.rotation, c.translation_mm]),
        )
        for c in build.cameras(protocol)
    ]
    given = protocol.board
    board = CharucoBoard(given.squares, given.square_mm, given.marker_mm, given.dictionary)
    title = f"{len(exact)} cameras from {pictures.shape[1]} views"
    yield f"{title:<34}{'RMS mm':>8}{'worst mm':>10}{'find, ms/picture':>18}{'adjust, s':>11}"
    cameras, found_s, adjusted_s = ours(pictures, board, build.T_rig_board(protocol))
    yield _line(
        f"whisker-bench {version('whisker-bench')}",
        in_space_mm(cameras, exact),
        found_s,
        adjusted_s,
    )
    other = theirs(others, pictures, board)
    parts = zip(other["matrix"], other["distortion"], other["pose"])
    cameras = [Camera(f"c{k}", exact[k].size_px, *part) for k, part in enumerate(parts)]
    yield _line(
        f"aniposelib {other['version']}",
        in_space_mm(cameras, exact),
        other["found_s"],
        other["adjusted_s"],
    )


def _line(name: str, error_mm: tuple[float, float], found_s: float, adjusted_s: float) -> str:
    return (
        f"{name:<34}{error_mm[0]:8.4f}{error_mm[1]:10.4f}{1000 * found_s:18.1f}{adjusted_s:11.2f}"
    )
