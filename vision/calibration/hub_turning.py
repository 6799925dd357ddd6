"""Where the rig is, at a first look, when nothing else says so: by the whisker's turning with the motor.

Only what moves differs from one frame of a stroke to another, and on a free stroke that is the whisker: a straight
line in each camera, a plane through its centre of projection, and where two planes meet a line in space. Free lines
all pass through the centre of rotation and turn about the motor's axis by the motor's own angle:

    direction = R · (cos m, sin m, 0),    point = centre + R · (cos m, sin m, 0) · arc

Coarse: the chord of a whisker with sag and set, to some degrees and millimetres. `place` takes over from there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rotation import invert_transform, nearest_rotation
from vision.pictures.change import HALF, change_confidence
from vision.pictures.pixel_noise import measure_noise

# [share of the stroke, frames] A frame is compared with such as are farther away: there the
# whisker stands elsewhere. Set by eye. Study: tests/bench/trials/test_placing_pictures.py.
_ELSEWHERE, _MOST_OTHERS = 0.25, 4
# [1] Of `change.change_confidence`: 4.8 noise levels after smoothing. Derived.
_SURE = 0.3
# [pixels] Fewer are no line; more cost time alone. Set by eye. Study:
# tests/bench/trials/test_placing_pictures.py.
_FEWEST_PIXELS, _MOST_PIXELS = 20, 4000
# [1, px] A Hough transform's bins: half a degree, 3 px; refined afterwards. Study:
# tests/bench/trials/test_placing_pictures.py.
_TURNS, _BIN_PX = 360, 3.0
# [px] Beside a line: what a lens bends and a whisker sags; what noise scatters. Study:
# tests/bench/trials/test_placing_pictures.py.
_NEAR_PX, _SCATTER_PX = 8.0, 1.0
# [rounds] Of reweighting; settles in fewer. Not measured.
_ROUNDS = 12
# [px] Of a line's pixels; shorter tells no direction. Set by eye. Study:
# tests/bench/trials/test_placing_pictures.py.
_LEAST_LENGTH_PX = 40.0
# [rad] Planes that meet at less do not tell where: 1/sin 3° multiplies a line's error by 19.
# Derived.
_LEAST_ANGLE_RAD = np.radians(3.0)
# [share of the stroke] The first seventh is taken as free, of few frames a quarter; from there on
# what goes on turning as it did. Set by eye. Study: tests/bench/trials/test_placing_pictures.py.
_FREE_SHARES, _MOST_FREE_SHARE = (1 / 7, 2 / 7, 4 / 7, 1.0), 0.25
# [rad, mm, 1] Lines this far from where the motor has them are others', or a bent whisker's: or
# so many times the usual line's. Set by eye. Study: tests/vision/calibration/test_turning.py.
_STRAY_RAD, _STRAY_MM, _STRAY_TIMES = 0.01, 1.0, 3.0
# [lines] As `_MIN_FRAMES` of swing.py. Derived.
_FEWEST_LINES = 4
# [rounds] Of leaving strays out. Not measured. Study: tests/vision/calibration/test_turning.py.
_REJECTIONS = 5


@dataclass(frozen=True, eq=False)
class MovingLines:
    """What moves in one stroke, a row a frame where it is a line: motor_rad (n,), from the stroke's start on; point_mm
    (n, 3), middle of what is seen of the line; direction (n, 3), unit, either way along it. In the cameras' frame."""

    motor_rad: np.ndarray
    point_mm: np.ndarray
    direction: np.ndarray


@dataclass(frozen=True, eq=False)
class FirstRig:
    """T_rig_world (3, 4), mm; the world is the frame that the cameras came in. width_rad: of the widest free stroke,
    as far as it looks free; strokes: how many."""

    T_rig_world: np.ndarray
    width_rad: float
    strokes: int


def moving_lines(
    frames: Mapping[str, Mapping[int, np.ndarray]], motor_rad: Mapping[int, float], cameras: Cameras
) -> MovingLines:
    """Lines of one stroke. frames: grey pictures by camera and frame index; motor_rad: by frame index, all of them."""
    planes = [
        _planes(camera, frames[camera.name], motor_rad)
        for camera in cameras
        if frames.get(camera.name)
    ]
    lines = [
        (motor_rad[f], *line)
        for f in motor_rad
        if (line := _meet([p[f] for p in planes if f in p])) is not None
    ]
    motor, points, directions = zip(*lines) if lines else ((), np.zeros((0, 3)), np.zeros((0, 3)))
    return MovingLines(np.array(motor), np.array(points), np.array(directions))


def _planes(
    camera: Camera, pictures: Mapping[int, np.ndarray], motor_rad: Mapping[int, float]
) -> dict:
    """By frame: centre of projection, normal of the plane of what moves, and the ray to its middle."""
    small = {
        f: picture[::HALF, ::HALF].astype(float)
        for f, picture in pictures.items()
        if f in motor_rad
    }
    if len(small) < _FEWEST_LINES:
        return {}
    noise = measure_noise(*list(small.values())[:2])
    far = _ELSEWHERE * np.ptp([motor_rad[f] for f in small])
    planes = {}
    for f, grey in small.items():
        others = [g for g in small if abs(motor_rad[g] - motor_rad[f]) >= far]
        chosen = (
            np.unique(np.linspace(0, len(others) - 1, _MOST_OTHERS).astype(int)) if others else ()
        )
        moves = [change_confidence(grey, small[others[k]], noise) for k in chosen]
        plane = _plane(camera, np.min(moves, axis=0)) if moves else None
        planes |= {} if plane is None else {f: plane}
    return planes


def _plane(camera: Camera, moves: np.ndarray):
    """(centre, normal, ray to the middle) of the strongest line in a picture of what moves; None where none is."""
    row, column = np.nonzero(moves > _SURE)
    if len(row) < _FEWEST_PIXELS:
        return None
    px = HALF * np.column_stack([column, row]).astype(float)
    angle, offset = _strongest(px[:: -(-len(px) // _MOST_PIXELS)])
    across, along = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    middle = _middles(px, px @ along, np.abs(px @ across - offset) < _NEAR_PX)
    rays = camera.rays(middle)
    middle, rays = middle[np.isfinite(rays[:, 0])], rays[np.isfinite(rays[:, 0])]
    weight = np.ones(len(rays))
    for _ in range(_ROUNDS):
        if weight.sum() * HALF < _LEAST_LENGTH_PX:
            return None
        normal = np.linalg.svd(rays * np.sqrt(weight)[:, None], full_matrices=False)[2][2]
        weight = 1.0 / (1.0 + (rays @ normal * camera.lens[0] / _SCATTER_PX) ** 2)
    return camera.centre_mm, normal, rays[np.searchsorted(np.cumsum(weight), 0.5 * weight.sum())]


def _middles(px: np.ndarray, along: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Mean of the points (n, 2) near a line at each step along it: a hub is many points and few steps."""
    step = np.round(along[near] / HALF).astype(int)
    step -= step.min(initial=0)
    count = np.bincount(step)
    sums = np.column_stack([np.bincount(step, column) for column in px[near].T])
    return sums[count > 0] / count[count > 0, None]


def _strongest(px: np.ndarray) -> tuple[float, float]:
    """Angle of the normal and offset of the line with most points (n, 2) in three neighbouring bins."""
    angles = np.arange(_TURNS) * np.pi / _TURNS
    bins = np.round((px @ np.stack([np.cos(angles), np.sin(angles)])) / _BIN_PX).astype(int)
    lowest = bins.min()
    votes = np.stack(
        [np.bincount(column - lowest, minlength=bins.max() - lowest + 1) for column in bins.T]
    )
    votes = votes + np.pad(votes[:, 1:], ((0, 0), (0, 1))) + np.pad(votes[:, :-1], ((0, 0), (1, 0)))
    turn, place = np.unravel_index(np.argmax(votes), votes.shape)
    return float(angles[turn]), float((place + lowest) * _BIN_PX)


def _meet(planes: Sequence[tuple]):
    """Point and direction of the line in which planes meet; None where they do not tell."""
    if len(planes) < 2:
        return None
    centres, normals, rays = map(np.array, zip(*planes))
    strength, axes = np.linalg.svd(normals)[1:]
    direction = axes[2]
    if strength[1] < np.sqrt(2) * np.sin(0.5 * _LEAST_ANGLE_RAD):
        return None
    point = np.linalg.lstsq(normals, np.sum(normals * centres, axis=1), rcond=None)[0]
    # Along the line, to where the cameras have the middle of it.
    across = rays - (rays @ direction)[:, None] * direction
    depth = np.sum((point - centres) * across, axis=1) / np.sum(across**2, axis=1)
    return point + np.median(
        (centres + depth[:, None] * rays - point) @ direction
    ) * direction, direction


def first_rig(strokes: Sequence[MovingLines]) -> FirstRig:
    """The rig frame by all strokes together. Raises Refused where nothing is seen to turn with the motor."""
    motor = np.concatenate([s.motor_rad for s in strokes])
    points, directions = (
        np.concatenate([getattr(s, name) for s in strokes]) for name in ("point_mm", "direction")
    )
    shares = np.concatenate([_share(s.motor_rad) for s in strokes])
    first = max(
        _FREE_SHARES[0], min(np.sort(shares)[:_FEWEST_LINES].max(initial=0.0), _MOST_FREE_SHARE)
    )
    kept = shares <= first
    for share in (first, *_FREE_SHARES[1:]):
        for _ in range(_REJECTIONS):
            if kept.sum() < _FEWEST_LINES:
                raise Refused(_NOTHING_TURNS.format(kept.sum()))
            R, centre = _fit(motor[kept], points[kept], directions[kept])
            last, kept = (
                kept,
                _follows(R, centre, motor, points, directions, kept) & (shares <= share),
            )
            if np.array_equal(last, kept):
                break
    number = np.repeat(np.arange(len(strokes)), [len(s.motor_rad) for s in strokes])
    widths = [
        np.ptp(motor[kept & (number == k)])
        for k in range(len(strokes))
        if np.any(kept & (number == k))
    ]
    return FirstRig(invert_transform(np.column_stack([R, centre])), float(max(widths)), len(widths))


_NOTHING_TURNS = (
    "T_rig_board is missing and nothing is seen to turn with the motor ({} frames of free stroke in which two cameras "
    "see a line move, 4 are needed): record free strokes of some 10 degrees in view of two cameras, or measure "
    "T_rig_board"
)


def _share(motor_rad: np.ndarray) -> np.ndarray:
    """How far into the stroke each frame is, 0 to 1."""
    return (
        (motor_rad - motor_rad[0]) / max(np.ptp(motor_rad), 1e-9) if len(motor_rad) else motor_rad
    )


def _fan(motor_rad: np.ndarray) -> np.ndarray:
    return np.column_stack([np.cos(motor_rad), np.sin(motor_rad), np.zeros(len(motor_rad))])


def _fit(
    motor_rad: np.ndarray, points: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """R (3, 3), rig to world, and the centre (3,), by lines taken as lying in the plane of rotation."""
    fan = _fan(motor_rad)
    usual = np.linalg.eigh(directions.T @ directions)[1][:, 2]
    outward = directions * np.where(directions @ usual < 0, -1.0, 1.0)[:, None]
    R = nearest_rotation(outward.T @ fan)
    across = np.eye(3) - np.einsum("ni,nj->nij", fan @ R.T, fan @ R.T)
    centre = np.linalg.lstsq(
        across.reshape(-1, 3), (across @ points[:, :, None]).ravel(), rcond=None
    )[0]
    if np.sum((points - centre) * (fan @ R.T)) < 0:  # the other way along the lines is outward
        R = R @ np.diag([-1.0, -1.0, 1.0])
    return R, centre


def _follows(R, centre, motor_rad, points, directions, kept) -> np.ndarray:
    """Which lines are where the motor has them, as nearly as those of `kept` mostly are."""
    along = _fan(motor_rad) @ R.T
    turned = np.linalg.norm(np.cross(along, directions), axis=1)
    away = np.linalg.norm(np.cross(along, points - centre), axis=1)
    return (turned < max(_STRAY_RAD, _STRAY_TIMES * np.median(turned[kept]))) & (
        away < max(_STRAY_MM, _STRAY_TIMES * np.median(away[kept]))
    )
