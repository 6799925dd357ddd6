"""A coarse estimate of the rig frame, where it is not measured: by the whisker's rotation with the
motor.

The lines of a free whisker (`moving_line.py`) all pass through the centre of rotation and rotate
about the motor's axis by the motor's own angle:

    direction = R · (cos m, sin m, 0),    point = centre + R · (cos m, sin m, 0) · arc

Coarse: the chord of a whisker with sag and set, to some degrees and millimetres. `place` takes over
from there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision.calibration.moving_line import MovingLines
from vision.geometry.centreline import rotation_z
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply, compose, invert_transform, nearest_rotation

# [share of the stroke] The first seventh is taken as free; from there on what goes on turning as it
# did. From a tenth or a quarter on rigs are found as well. Study:
# tests/vision/calibration/test_turning.py.
_FREE_SHARES = (1 / 7, 2 / 7, 4 / 7, 1.0)
# [share of the stroke] Taken as free at most, of few frames. By 0.15 too few of a short stroke are
# left, by 0.4 rigs are found as well. Study: tests/vision/calibration/test_turning.py.
_MOST_FREE_SHARE = 0.25
# [rad] Lines this far from the motor's angle are others', or a bent whisker's. By 0.005 or 0.02
# strays are left out as well. Study: tests/vision/calibration/test_turning.py.
_STRAY_RAD = 0.01
# [mm] Lines this far from the centre of rotation are others', or a bent whisker's. By 0.5 or 2
# strays are left out as well. Study: tests/vision/calibration/test_turning.py.
_STRAY_MM = 1.0
# [1] Or so many times as far as the median line. By 2 or 4.5 strays are left out as well. Study:
# tests/vision/calibration/test_turning.py.
_STRAY_TIMES = 3.0
# [lines] As `_MIN_FRAMES` of swing.py. Derived.
_FEWEST_LINES = 4
# [1] Rise of a line above the plane of rotation, sine; a steeper one is not the whisker. Stated.
_MOST_RISE = 0.25
# [mm] From the axis; a line that passes farther from it is not the whisker. Stated.
_FARTHEST_MM = 5.0
# [rounds] Of leaving strays out, at most. Stated. Study: tests/vision/calibration/test_turning.py.
_REJECTIONS = 5


@dataclass(frozen=True, eq=False)
class FirstRig:
    """A coarse rig frame: T_rig_world (3, 4), mm; the world is the frame that the cameras came in.

    width_rad: of the widest free stroke, as far as it is free; strokes: how many.
    """

    T_rig_world: np.ndarray
    width_rad: float
    strokes: int


def first_rig(strokes: Sequence[MovingLines]) -> FirstRig:
    """Estimate the rig frame by all strokes together. Raises Refused where nothing turns with the
    motor.
    """
    lines = _of_all(strokes)
    shares = np.concatenate([_share_of_stroke(stroke.motor_rad) for stroke in strokes])
    kept, R, centre_mm = _free_lines(lines, shares)
    widths = []
    ends = np.cumsum([len(stroke.motor_rad) for stroke in strokes])[:-1]
    for motor_rad, is_kept in zip(np.split(lines.motor_rad, ends), np.split(kept, ends)):
        if np.any(is_kept):
            widths.append(np.ptp(motor_rad[is_kept]))
    T_rig_world = invert_transform(np.column_stack([R, centre_mm]))
    return FirstRig(T_rig_world, float(max(widths)), len(widths))


def first_rig_about(T_world_axis: np.ndarray, strokes: Sequence[MovingLines]) -> FirstRig:
    """Estimate the rig frame where the axis is known: azimuth and height of the lines near it, as the
    strokes begin.

    T_world_axis (3, 4): its z is the axis. Short strokes serve, too. Raises Refused where no line
    turns about it.
    """
    lines = _of_all(strokes)
    points, directions = _outward_lines(lines, T_world_axis)
    shares = np.concatenate([_share_of_stroke(stroke.motor_rad) for stroke in strokes])
    begins = _is_near_axis(points, directions) & (shares <= _MOST_FREE_SHARE)
    if not begins.any():
        raise Refused(_NOTHING_TURNS.format(0))
    azimuth_rad = _median_azimuth(directions[begins], lines.motor_rad[begins])
    height_mm = np.median(_heights_mm(points, directions)[begins])
    T_axis_rig = np.column_stack([rotation_z(azimuth_rad), [0.0, 0.0, height_mm]])
    widths = [np.ptp(stroke.motor_rad) for stroke in strokes if len(stroke.motor_rad)]
    width_rad = _MOST_FREE_SHARE * float(max(widths))
    return FirstRig(invert_transform(compose(T_world_axis, T_axis_rig)), width_rad, len(widths))


def _heights_mm(points: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return the heights (n,) at the axis of lines through points, mm, by directions (n, 3)."""
    along_mm = np.hypot(points[:, 0], points[:, 1])
    return points[:, 2] - directions[:, 2] * along_mm


def _outward_lines(lines: MovingLines, T_world_axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return points, mm, and directions (n, 3) of lines in the axis's frame, directions away from the axis."""
    T_axis_world = invert_transform(T_world_axis)
    R = T_axis_world[:, :3]
    points = apply(T_axis_world, lines.point_mm)
    directions = lines.direction @ R.T
    across_axis = directions[:, :2]
    outward_mm = np.sum(points[:, :2] * across_axis, axis=1)
    is_outward = outward_mm[:, None] >= 0
    return points, np.where(is_outward, directions, -directions)


def _is_near_axis(points_mm: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return the mask (n,) of lines that pass near the z axis and rise little along it."""
    x, y, _ = points_mm.T
    lateral_mm = np.abs(x * directions[:, 1] - y * directions[:, 0])
    return (lateral_mm < _FARTHEST_MM) & (np.abs(directions[:, 2]) < _MOST_RISE)


def _median_azimuth(directions: np.ndarray, motor_rad: np.ndarray) -> float:
    """Return the median azimuth, rad, of directions (n, 3) turned back to motor angle 0."""
    azimuths = np.arctan2(directions[:, 1], directions[:, 0]) - motor_rad
    from_first = np.angle(np.exp(1j * (azimuths - azimuths[0])))  # within ±π
    return azimuths[0] + np.median(from_first)


def _of_all(strokes: Sequence[MovingLines]) -> MovingLines:
    """Return the lines of all strokes as one. Raise Refused where there is no stroke."""
    if not strokes:
        raise Refused(_NOTHING_TURNS.format(0))
    return MovingLines.join(strokes)


def _free_lines(
    lines: MovingLines, shares: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mask (n,) of lines of a free whisker, and R (3, 3), rig to world, and the centre
    (3,) by them.

    shares (n,): of the stroke. The beginnings of the strokes are taken as free. Lines that follow
    the motor as they do are added, a larger share of the strokes at a time. Raises Refused where
    too few do.
    """
    earliest = np.sort(shares)[:_FEWEST_LINES].max(initial=0.0)
    first = max(_FREE_SHARES[0], min(earliest, _MOST_FREE_SHARE))
    kept = shares <= first
    for share in (first, *_FREE_SHARES[1:]):
        for _ in range(_REJECTIONS):
            if kept.sum() < _FEWEST_LINES:
                raise Refused(_NOTHING_TURNS.format(kept.sum()))
            R, centre_mm = _fit(lines.select(kept))
            last = kept
            kept = _follows_motor(R, centre_mm, lines, kept) & (shares <= share)
            if np.array_equal(last, kept):
                break
    return kept, R, centre_mm


_NOTHING_TURNS = (
    "T_rig_board is missing and nothing is seen to turn with the motor ({} frames of free stroke in which two cameras "
    "see a line move, 4 are needed): record free strokes of some 10 degrees in view of two cameras, or measure "
    "T_rig_board"
)


def _share_of_stroke(motor_rad: np.ndarray) -> np.ndarray:
    """Return how far into the stroke each frame is, 0 to 1."""
    if not len(motor_rad):
        return motor_rad
    return (motor_rad - motor_rad[0]) / max(np.ptp(motor_rad), 1e-9)


def _fan(motor_rad: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Return the directions (n, 3) of a whisker at these motor angles, in the frame to which R
    rotates the rig.
    """
    return rotation_z(motor_rad)[:, :, 0] @ R.T


def _fit(lines: MovingLines) -> tuple[np.ndarray, np.ndarray]:
    """Return R (3, 3), rig to world, and the centre (3,), by lines taken as lying in the plane of
    rotation.
    """
    directions = lines.direction
    usual = np.linalg.eigh(directions.T @ directions)[1][:, 2]
    outward = directions * np.where(directions @ usual < 0, -1.0, 1.0)[:, None]
    R = nearest_rotation(outward.T @ _fan(lines.motor_rad, np.eye(3)))
    along = _fan(lines.motor_rad, R)
    across = np.eye(3) - along[:, :, None] * along[:, None, :]  # (n, 3, 3)
    offsets = across @ lines.point_mm[:, :, None]
    centre = np.linalg.lstsq(across.reshape(-1, 3), offsets.ravel(), rcond=None)[0]
    if np.sum((lines.point_mm - centre) * along) < 0:  # the other way along the lines is outward
        R = R @ np.diag([-1.0, -1.0, 1.0])
    return R, centre


def _follows_motor(R, centre_mm, lines: MovingLines, kept: np.ndarray) -> np.ndarray:
    """Return the mask (n,) of lines that are where the motor has them, as nearly as those of `kept`
    mostly are.
    """
    along = _fan(lines.motor_rad, R)
    angle_rad = np.linalg.norm(np.cross(along, lines.direction), axis=1)
    distance_mm = np.linalg.norm(np.cross(along, lines.point_mm - centre_mm), axis=1)
    most_rad = max(_STRAY_RAD, _STRAY_TIMES * np.median(angle_rad[kept]))
    most_mm = max(_STRAY_MM, _STRAY_TIMES * np.median(distance_mm[kept]))
    return (angle_rad < most_rad) & (distance_mm < most_mm)
