"""A cube with six ChArUco faces, calibrated from with three cameras: lengths that are known.

    python tests/studies/real_cube.py FOLDER [--out OUT]

FOLDER holds a folder of pictures of each camera, pictures of one number being of one instant; nothing is fetched. The
cube of pyCamSet's `calibration_ccube`: 10 × 10 squares of 3.2 mm a face, DICT_6X6_1000, 50 markers a face, 40 mm, and
it turned about one axis. Prints the residuals of views held out, the distances between opposite faces, the angles
between the others, and the axis about which the body turned, with the scatter of its poses about it; then how sizes
and axis by half of the views differ from those by the other half. OUT gets cameras.toml and axis.toml, in one frame.
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.base.threads import in_threads
from bench.cameras.cameras_toml import write_cameras
from vision.boards.body import Body
from vision.boards.corners import find_corners
from vision.calibration.adjust import adjust_bundle
from vision.calibration.calibrate import Calibration, calibrate_cameras
from vision.calibration.held_out import camera_alone, check_held_out
from vision.calibration.layout import lay_out
from vision.calibration.priors import pose_priors
from vision.calibration.views import BoardViews
from vision.geometry.rotation import apply, exp_rotation, log_rotation
from vision.pictures.frames import Frames

CUBE = Body(
    (10, 10),
    3.2,
    marker_mm=2.4,
    dictionary="DICT_6X6_1000",
    first_ids=tuple(range(0, 300, 50)),
    square_sigma_mm=0.0032,
    stretch_sigma=0.001,
)
SIDE_MM = 40.0
HOLD_EVERY = 4


def read_views(folder: Path) -> BoardViews:
    """Return the body's corners in every picture, by camera."""
    boards = {}
    sizes_px = {}
    for source in sorted(path for path in folder.iterdir() if path.is_dir()):
        frames = Frames.open(source)
        boards[source.name] = list(
            in_threads(lambda frame: find_corners(frame[1], CUBE), frames.read())
        )
        sizes_px[source.name] = frames.size_px
    return BoardViews(boards, sizes_px)


class Measured(NamedTuple):
    """A measured value and its sigma."""

    value: float
    sigma: float


def by_faces(
    of_pair: Callable[[Body, np.ndarray, int, int], float], made: Calibration, a: int, b: int
) -> Measured:
    """Return what a function says of two faces of a body, by its terms (B,), with the sigma by the covariance of these."""

    def value(terms: np.ndarray) -> float:
        """Return the value at terms (B,) of the body."""
        return of_pair(made.placed_board, terms, a, b)

    steps = np.maximum(1e-3 * np.sqrt(np.diag(made.board_covariance)), 1e-12)
    gradient = np.empty(len(steps))
    for k, step in enumerate(np.diag(steps)):
        gradient[k] = (value(made.board + step) - value(made.board - step)) / (2.0 * steps[k])
    return Measured(value(made.board), float(np.sqrt(gradient @ made.board_covariance @ gradient)))


def distance_mm(body: Body, terms: np.ndarray, a: int, b: int) -> float:
    """Return the distance of two opposite faces between the means of their points, along their mean normal.

    A face that is bent lies beside its own plane, by as much as it is found to be bent.
    """
    faces = body.faces_at(terms)
    middles_mm = body.printed(terms)[0].reshape(len(faces), -1, 3).mean(axis=1)
    between = middles_mm[b] - middles_mm[a]
    normal = faces[a, :, 2] - faces[b, :, 2]
    return abs(float(between @ normal)) / float(np.linalg.norm(normal))


def angle_deg(body: Body, terms: np.ndarray, a: int, b: int) -> float:
    """Return the angle between the normals of two faces."""
    faces = body.faces_at(terms)
    return float(np.degrees(np.arccos(np.clip(faces[a, :, 2] @ faces[b, :, 2], -1.0, 1.0))))


def sizes_of(made: Calibration) -> dict[tuple[int, int], Measured]:
    """Return the distance of each opposite pair of faces, mm, and the angle of each other pair, degrees."""
    sizes = {}
    for a, b in combinations(range(len(CUBE.first_ids)), 2):
        of_pair = distance_mm if is_opposite(made, a, b) else angle_deg
        sizes[a, b] = by_faces(of_pair, made, a, b)
    return sizes


def is_opposite(made: Calibration, a: int, b: int) -> bool:
    """Return whether two faces are opposite ones."""
    return angle_deg(made.placed_board, made.board, a, b) > 135.0


def body_poses(made: Calibration, views: BoardViews) -> np.ndarray:
    """Return the poses of the body T_world_body (views, 3, 4) by all cameras."""
    alone = {}
    for camera in made.cameras:
        alone[camera.name] = camera_alone(camera, views.boards[camera.name], made.placed_board)
    T_camera_world = np.array([camera.T_camera_rig for camera in made.cameras])
    layout = lay_out(alone, T_camera_world, together=True)
    priors = pose_priors(len(alone), len(layout.index), made.placed_board)
    state = made.with_board(layout.first)
    return adjust_bundle(state, layout.seen, made.placed_board, priors).state.T_world_board


class Axis(NamedTuple):
    """An axis in the world, through the point on it that is nearest to the cube's middle.

    in_body: its direction in the body's frame. sigma_rad: of a direction, per axis; sigma_mm: of the point across it;
    both by the scatter of the poses, without what cameras have in common. scatter_mm: by how much the cube's corners
    miss their circles about it, an axis of three.
    """

    direction: np.ndarray
    point_mm: np.ndarray
    in_body: np.ndarray
    sigma_rad: float
    sigma_mm: float
    scatter_mm: float
    turns_deg: np.ndarray


def fit_axis(made: Calibration, views: BoardViews) -> Axis:
    """Fit one axis about which the body turned from view to view, by the corners of a cube in each pose."""
    poses = body_poses(made, views)  # (V, 3, 4)
    corners_mm = SIDE_MM * (np.array(list(np.ndindex(2, 2, 2))) - 0.5)
    corners_mm = corners_mm + made.board_mm.mean(axis=0)
    seen = np.array([apply(T, corners_mm) for T in poses])  # (V, 8, 3)
    turns = log_rotation(poses[:, :, :3] @ poses[0, :, :3].T)
    first = np.linalg.svd(turns)[2][0]
    across = np.linalg.svd(first[None])[2][1:]  # (2, 3)
    middle = seen.mean(axis=(0, 1))

    def misses(parameters: np.ndarray) -> np.ndarray:
        """Return by how much corners miss their places, by turns and shifts of the axis, the first pose, the angles."""
        direction = exp_rotation(parameters[:2] @ across) @ first
        point = middle + parameters[2:4] @ across
        body = seen[0] @ exp_rotation(parameters[4:7]).T + parameters[7:10]
        angles = np.concatenate([[0.0], parameters[10:]])
        about = exp_rotation(angles[:, None] * direction)
        return (np.einsum("vij,pj->vpi", about, body - point) + point - seen).ravel()

    fitted = least_squares(misses, np.concatenate([np.zeros(10), turns[1:] @ first]))
    # the eight corners of a pose are six numbers
    variance = 2.0 * fitted.cost / (6 * len(poses) - len(fitted.x))
    sigma = np.sqrt(variance * np.diag(np.linalg.pinv(fitted.jac.T @ fitted.jac)))
    direction = exp_rotation(fitted.x[:2] @ across) @ first
    return Axis(
        direction=direction,
        point_mm=middle + fitted.x[2:4] @ across,
        in_body=poses[0, :, :3].T @ direction,
        sigma_rad=float(np.sqrt(np.mean(sigma[:2] ** 2))),
        sigma_mm=float(np.sqrt(np.mean(sigma[2:4] ** 2))),
        scatter_mm=float(np.sqrt(np.mean(fitted.fun**2))),
        turns_deg=np.degrees(np.concatenate([[0.0], fitted.x[10:]])),
    )


def halves_lines(views: BoardViews) -> Iterator[str]:
    """Yield how sizes and axis by every other view differ from those by the views between, the print's size as stated."""
    is_odd = np.arange(most_views(views)) % 2 == 1
    body = replace(CUBE, square_sigma_mm=0.0)
    halves = []
    for left_out in (is_odd, ~is_odd):
        own = views.without(left_out)
        made = calibrate_cameras(own, body, None, triggered=True)
        halves.append((sizes_of(made), fit_axis(made, own)))
    (sizes, axis), (other_sizes, other_axis) = halves
    for unit, is_length in (("mm", True), ("degrees", False)):
        z = []
        apart = []
        for pair, one in sizes.items():
            if (one.value < 60.0) == is_length:
                apart.append(one.value - other_sizes[pair].value)
                z.append(apart[-1] / np.hypot(one.sigma, other_sizes[pair].sigma))
        yield f"halves: {len(z)} sizes differ by {rms(apart):.4f} {unit} RMS, z RMS {rms(z):.2f}"
    turn_deg = np.degrees(np.linalg.norm(np.cross(axis.in_body, other_axis.in_body)))
    sigma_deg = np.degrees(np.hypot(axis.sigma_rad, other_axis.sigma_rad))
    yield f"halves: axes on the body differ by {turn_deg:.4f} degrees, stated ± {sigma_deg:.4f} each way"


def rms(values: Sequence[float]) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def most_views(views: BoardViews) -> int:
    """Return the number of views of the longest series."""
    return max(len(series) for series in views.boards.values())


def held_out_line(views: BoardViews) -> str:
    """Return the residuals of views held out, index % 4 == 3, by cameras and body of the others."""
    is_held = np.arange(most_views(views)) % HOLD_EVERY == HOLD_EVERY - 1
    made = calibrate_cameras(views.without(is_held), CUBE, None, triggered=True)
    measured = check_held_out(made, views.boards, is_held)
    alone = ", ".join(f"{name} {px:.3f}" for name, px in measured.alone_px.items())
    joint = measured.joint
    return (
        f"held out, {measured.views} views: {joint.joint_px:.3f} px joint; alone {alone} px; neighbouring corners in "
        f"space {joint.pitch_rms_mm:.4f} mm RMS off, mean {joint.pitch_mean_mm:+.4f} mm"
    )


def write_out(out: Path, made: Calibration, axis: Axis) -> None:
    """Write cameras.toml (and .npz) and axis.toml into a folder."""
    out.mkdir(parents=True, exist_ok=True)
    write_cameras(out / "cameras.toml", made.cameras)
    lines = [
        "# axis about which the cube turned, in the frame of cameras.toml",
        f"direction = {axis.direction.round(9).tolist()}",
        f"point_mm = {axis.point_mm.round(6).tolist()}",
        f"sigma_rad = {axis.sigma_rad:.3g}",
        f"sigma_mm = {axis.sigma_mm:.3g}",
        f"turns_deg = {axis.turns_deg.round(4).tolist()}",
    ]
    (out / "axis.toml").write_text("\n".join(lines) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    views = read_views(options.folder)
    made = calibrate_cameras(views, CUBE, None, triggered=True)
    for camera, report in zip(made.cameras, made.report):
        print(
            f"{camera.name}: {report.views} views, {report.corners} corners, RMS {camera.rms_px:.3f} px"
        )
    print(*made.notes, *made.warnings, sep="\n")
    print(held_out_line(views))
    errors_deg = []
    for (a, b), size in sizes_of(made).items():
        if is_opposite(made, a, b):
            print(
                f"faces {a} and {b}: {size.value:.3f} ± {size.sigma:.3f} mm, {size.value - SIDE_MM:+.3f} mm"
            )
        else:
            errors_deg.append(size.value - 90.0)
            print(f"faces {a} and {b}: {size.value:.3f} ± {size.sigma:.3f} degrees")
    print(f"right angles: {rms(errors_deg):.3f} degrees RMS")
    axis = fit_axis(made, views)
    print(
        f"axis: direction {axis.direction.round(5)} ± {np.degrees(axis.sigma_rad):.4f} degrees, through "
        f"{axis.point_mm.round(3)} ± {axis.sigma_mm:.4f} mm; poses scatter by {axis.scatter_mm:.4f} mm about it, over "
        f"{np.ptp(axis.turns_deg):.0f} degrees"
    )
    print(*halves_lines(views), sep="\n")
    if options.out:
        write_out(options.out, made, axis)


if __name__ == "__main__":
    main()
