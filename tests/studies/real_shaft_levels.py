"""Where a polished shaft seems to end, by the grey level that is taken for its edge, and what direction that gives.

    OMP_NUM_THREADS=1 python tests/studies/real_shaft_levels.py FOLDER

FOLDER is the one of `real_shaft.py`. No model of light: on either side of the shaft, in six segments along it, the edge is
where the mean picture becomes so many grey levels brighter than the room beside it. Segments beside which something else
stands are left out, and poses with fewer than four left. Prints by level how much wider than 6 mm the shaft seems in each
camera, and by how much its direction by all three cameras is off the one that all poses have in common in the cube's
frame: the mean of all poses, which turn with the cube while lamps and cameras stand still, and their scatter.
"""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.studies.real_cube import CUBE, body_poses, fit_axis, read_views
from tests.studies.real_shaft import HIDDEN, POINT_MM, SHAFT, place_about, read_pictures
from vision.calibration.calibrate import calibrate_cameras
from vision.geometry.camera import Camera, Cameras
from vision.geometry.rotation import unit
from vision.geometry.silhouette import edges

LEVELS = (0.3, 0.6, 1.0, 2.0, 4.0)
# [mm] Places along the shaft, from its middle; between the cube and the border of the pictures.
ALONG_MM = np.arange(-15.0, 15.01, 0.1)
SEGMENTS = 6
# [px] From the edge of a shaft of 6 mm, outward positive.
OUTWARD_PX = np.arange(-25.0, 12.0, 0.25)
# [px] Beyond it is the room.
ROOM_PX = 7.0
# [grey levels] A brighter room is something else.
BRIGHTEST_ROOM = 3.2
# [columns] Fewer are no segment.
FEWEST_COLUMNS = 15
FEWEST_SEGMENTS = 4
PASSES = 3
# [mm, rad]
STEP = 1e-4


@dataclass(frozen=True)
class Line:
    """A shaft's axis in the cube's frame: point_mm, direction (3,)."""

    point_mm: np.ndarray
    direction: np.ndarray


@dataclass(frozen=True)
class SeenAxis:
    """What one pose says. shift_mm, tilt_rad (2,): of the axis, along and across the sight, off the one expected; frame
    (3, 3): columns along the sight, across it and along the shaft, in the world. wider: share by camera."""

    shift_mm: np.ndarray
    tilt_rad: np.ndarray
    frame: np.ndarray
    wider: Mapping[str, float]


def side_profiles(
    picture: np.ndarray, one: np.ndarray, other: np.ndarray
) -> list[tuple[float, np.ndarray]]:
    """Return the place and the mean profile over OUTWARD_PX of each segment at the edge `one` (n, 2), px."""
    outward = unit(one - other)
    px = one[:, None] + OUTWARD_PX[:, None] * outward[:, None]  # (n, o, 2)
    maps = px.astype(np.float32)
    grey = cv2.remap(
        picture.astype(np.float32), maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderValue=-1.0
    )
    is_inside = np.all(grey >= 0.0, axis=1)
    profiles = []
    for columns in np.array_split(np.arange(len(one)), SEGMENTS):
        used = columns[is_inside[columns]]
        if len(used) >= FEWEST_COLUMNS:
            profiles.append((float(ALONG_MM[used].mean()), grey[used].mean(axis=0)))
    return profiles


def outermost(profile: np.ndarray, level: float) -> float:
    """Return how far outward, px, a profile is last so much brighter than the room; NaN where it is never."""
    room = profile[OUTWARD_PX > ROOM_PX].mean()
    brighter = np.flatnonzero(profile > room + level)
    if room > BRIGHTEST_ROOM or len(brighter) == 0 or brighter[-1] + 1 >= len(profile):
        return np.nan
    last = brighter[-1]
    share = (profile[last] - room - level) / (profile[last] - profile[last + 1])
    return float(OUTWARD_PX[last] + share * (OUTWARD_PX[1] - OUTWARD_PX[0]))


def edge_line(profiles: list[tuple[float, np.ndarray]], level: float) -> np.ndarray | None:
    """Return slope and offset (2,), px per mm and px, of an edge along the shaft; None where too few segments show it."""
    points = [(place, outermost(profile, level)) for place, profile in profiles]
    seen = np.array([point for point in points if np.isfinite(point[1])])
    return np.polyfit(*seen.T, 1) if len(seen) >= FEWEST_SEGMENTS else None


class Pose:
    """The pictures of one pose about an expected axis, in the world."""

    def __init__(self, pictures, cameras: Cameras, T_world_body: np.ndarray, line: Line):
        R = T_world_body[:, :3]
        eye_mm = cameras.cameras[0].centre_mm
        self.cameras = cameras
        self.place = place_about(R @ line.direction, R @ line.point_mm + T_world_body[:, 3], eye_mm)
        self.profiles = {}
        for camera in cameras:
            one, other = self.edges_px(camera, np.zeros(4))
            picture = pictures[camera.name]
            sides = (side_profiles(picture, one, other), side_profiles(picture, other, one))
            self.profiles[camera.name] = sides

    def edges_px(self, camera: Camera, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the edges (n, 2) of the shaft at ALONG_MM, its axis shifted and tilted by a change (4,)."""
        R = self.place.R
        direction = unit(R[:, 2] + R[:, :2] @ change[2:])
        point_mm = self.place.origin_mm + R[:, :2] @ change[:2]
        on_axis = point_mm + ALONG_MM[:, None] * direction
        return edges(camera, on_axis, direction, SHAFT.radius_mm)

    def axis_at(self, level: float) -> SeenAxis | None:
        """Return the axis by edges at a level; None where not all cameras see both of them."""
        ends = [0, -1]
        rows, offsets, wider = [], [], {}
        for camera in self.cameras:
            lines = [edge_line(side, level) for side in self.profiles[camera.name]]
            if lines[0] is None or lines[1] is None:
                return None
            one, other = self.edges_px(camera, np.zeros(4))
            across = unit(one - other)[ends]
            middle = 0.5 * (one + other)[ends]
            offsets.append(0.5 * np.polyval(lines[0] - lines[1], ALONG_MM[ends]))
            columns = []
            for step in STEP * np.eye(4):
                moved = 0.5 * np.sum(self.edges_px(camera, step), axis=0)[ends]
                columns.append(np.sum((moved - middle) * across, axis=1) / STEP)
            rows.append(np.array(columns).T)
            width_px = np.median(np.linalg.norm(one - other, axis=1))
            wider[camera.name] = (lines[0][1] + lines[1][1]) / width_px
        change = np.linalg.lstsq(np.concatenate(rows), np.concatenate(offsets), rcond=None)[0]
        return SeenAxis(change[:2], change[2:], self.place.R, wider)


def in_common(seen: Mapping[int, SeenAxis], poses: np.ndarray, line: Line) -> Line:
    """Return the axis in the cube's frame that is the median of what poses say about an expected one."""
    shifts, tilts = [], []
    for index, axis in seen.items():
        to_body = poses[index, :, :3].T @ axis.frame[:, :2]
        shifts.append(to_body @ axis.shift_mm)
        tilts.append(to_body @ axis.tilt_rad)
    direction = unit(line.direction + np.median(tilts, axis=0))
    return replace(line, point_mm=line.point_mm + np.median(shifts, axis=0), direction=direction)


def print_level(level: float, seen: Mapping[int, SeenAxis], cameras: Cameras) -> None:
    """Print a line of one level."""
    tilts_deg = np.degrees([axis.tilt_rad for axis in seen.values()])
    names = [camera.name for camera in cameras]
    wider = [np.median([axis.wider[name] for axis in seen.values()]) for name in names]
    parts = []
    for name, tilt in zip(("along", "across"), tilts_deg.T):
        parts.append(f"{name} {tilt.mean():+.2f}, scatter {tilt.std():.2f}")
    off_deg = np.linalg.norm(tilts_deg, axis=1)
    widths = ", ".join(f"{share:+.1%}" for share in wider)
    print(
        f"{level:g} levels, {len(seen)} poses: wider by {widths}; direction off by {np.median(off_deg):.2f} degrees in "
        f"the median, {np.sort(off_deg)[-3:].round(2)} at most; mean {'; '.join(parts)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    options = parser.parse_args()
    corners = read_views(options.folder)
    made = calibrate_cameras(corners, CUBE, None, triggered=True)
    poses = body_poses(made, corners)
    turning = fit_axis(made, corners).in_body
    pictures = read_pictures(options.folder, made.cameras)
    for level in LEVELS:
        line = Line(POINT_MM, turning)
        for _ in range(PASSES):
            seen = {}
            for index, greys in pictures.items():
                if index not in HIDDEN:
                    axis = Pose(greys, made.cameras, poses[index], line).axis_at(level)
                    if axis is not None:
                        seen[index] = axis
            expected = line
            line = in_common(seen, poses, line)
        leans_deg = np.degrees(np.arccos(min(1.0, abs(float(expected.direction @ turning)))))
        print(f"the shaft leans by {leans_deg:.2f} degrees against the turning axis")
        print_level(level, seen, made.cameras)


if __name__ == "__main__":
    main()
