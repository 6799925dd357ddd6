"""Files of trackers as their programs left them: whether SLEAP's two kinds agree, and whether cameras see points in space there.

    python tests/studies/real_tracks.py SESSION CALIBRATION ...

SESSION: tests/data/minimal_session of talmolab/sleap-anipose (GPL-3; at a9274a6, whose cameras made its points), with a
folder a camera. Prints by camera how many points both files have, how far they are apart, and the median distance of the
points in space from these, px. CALIBRATION: other files of aniposelib, of which it prints the cameras, or `.measurements`
of whisk (ExampleFiles of vncntprvst/whisker_pipeline, at 14a0c72), of which it prints segments, frames and identities.
Needs h5py.
"""

import sys
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.session.trace_readers import DrawnLines, read_lines, read_measurements
from vision.calibration import foreign_cameras
from vision.geometry import Camera


def distances_px(camera: Camera, points: np.ndarray, lines: DrawnLines) -> np.ndarray:
    """Return how far tracked points (n,) are from the nearest point in space (frames, joints, 3) of their frame."""
    found = []
    for frame, px in zip(lines.frame.tolist(), lines.px):
        known = points[frame][np.isfinite(points[frame]).all(axis=1)]
        found.append(np.min(np.linalg.norm(camera.project(known) - px, axis=1)))
    return np.array(found)


def main() -> None:
    session = Path(sys.argv[1])
    with h5py.File(session / "points3d.h5") as file:
        points = file["tracks"][:, 0]  # (frames, joints, 3)
    for camera in foreign_cameras(session / "calibration.toml"):
        (analysis,) = (session / camera.name).glob("*.analysis.h5")
        (project,) = (session / camera.name).glob("*.slp")
        one = read_lines(analysis, analysis.name)
        other = read_lines(project, project.name)
        apart_px = np.abs(np.sort(one.px, axis=0) - np.sort(other.px, axis=0)).max()
        median_px = np.median(distances_px(camera, points, one))
        print(f"{camera.name}: {len(one.px)} and {len(other.px)} points, {apart_px:.1g} px apart;")
        print(f"  {median_px:.1f} px from the points in space")
    for path in map(Path, sys.argv[2:]):
        if path.suffix == ".measurements":
            identities = read_measurements(path, path.name)
            frames = len({frame for frame, _ in identities})
            print(
                f"{path}: {len(identities)} segments, {frames} frames, identities {set(identities.values())}"
            )
        else:
            print(f"{path}: cameras {', '.join(foreign_cameras(path).names)}")


if __name__ == "__main__":
    main()
