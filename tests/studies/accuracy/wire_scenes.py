"""How far a camera's line of the wire is off as a whole, in path-traced scenes, in the frames before touch.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/wire_scenes.py SCENES

SCENES holds sessions of one whisk each with exact cameras, as for path_traced.py. Before touch the wire is a straight
line from the axis at the motor's angle, so that its picture is known. A row a camera: lens blur found, misfit over
noise, mean error of the line's points in px, and in sigmas of what they share (that of a whole line in the fit's prior
included). Then median, nine in ten and RMS of all, and RMS of z.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.path_traced import see_scene
from vision.fit.blocks import WIRE_OFFSET_PX
from vision.geometry.silhouette import outline
from vision.truth import traced_lines as seeing

_LENGTH_MM, _NODES = 100.0, 401


def free_wire_px(camera, motor_rad: float, radius_mm: float) -> np.ndarray:
    """Middle (n, 2) of the picture of a straight wire at this angle, px."""
    direction = np.array([np.cos(motor_rad), np.sin(motor_rad), 0.0])
    points = np.linspace(1.0, _LENGTH_MM, _NODES)[:, None] * direction
    return outline(camera, points, np.broadcast_to(direction, points.shape), radius_mm)[0]


def off_px(points, line_px: np.ndarray) -> np.ndarray:
    """By how much points (n,) lie beside a straight line (m, 2) along their normals, px."""
    nearest = np.argmin(np.linalg.norm(points.px[:, None] - line_px[None], axis=2), axis=1)
    return np.einsum("ni,ni->n", points.px - line_px[nearest], points.normal)


class Recorder:
    """Takes what the last look of each camera's wire finds in the frames before touch."""

    def __init__(self, touch_rad: float):
        self.touch_rad, self.rows, self._trace = touch_rad, {}, seeing.trace_wire

    def __call__(self, whisk, view, place, **options):
        found = self._trace(whisk, view, place, **options)
        angles = [whisk.motor[frame] for frame in place.curves]
        free = [one.points for one in found if angles[one.frame] < self.touch_rad]
        if free:
            radius = float(whisk.rods.wire.radius_mm(0.5 * _LENGTH_MM))
            errors = [
                off_px(one.points, free_wire_px(view.camera, angles[one.frame], radius))
                for one in found
                if angles[one.frame] < self.touch_rad
            ]
            shared = np.median(
                np.linalg.norm(np.concatenate([one.shared_px for one in free]), axis=1)
            )
            error, sigma = (
                float(np.mean(np.concatenate(errors))),
                float(np.hypot(shared, WIRE_OFFSET_PX)),
            )
            looks = whisk.light[view.camera.name]
            self.rows[view.camera.name] = (looks.blur_px, looks.misfit, error, sigma)
        return found


def look_at(folder: Path) -> dict[str, tuple[float, float, float, float]]:
    """By camera: blur, misfit, error and its stated sigma."""
    frames = np.genfromtxt(folder / "trials" / "w" / "truth.csv", delimiter=",", names=True)
    recorder = Recorder(float(np.radians(frames["motor_deg"][frames["contact"] > 0].min())) - 1e-6)
    usual, seeing.trace_wire = seeing.trace_wire, recorder
    try:
        see_scene(folder)
    finally:
        seeing.trace_wire = usual
    return recorder.rows


def main() -> None:
    total = []
    for folder in sorted(path for path in Path(sys.argv[1]).iterdir() if path.is_dir()):
        for camera, (blur, misfit, error, sigma) in look_at(folder).items():
            total.append((error, error / sigma))
            print(
                f"{folder.name} {camera}: blur {blur:.2f} px, misfit {misfit:.1f}, off {error:+.3f} px, "
                f"{error / sigma:+.1f} sigma",
                flush=True,
            )
    error, z = np.abs(np.array(total)).T
    print(
        f"{len(error)} views: median {np.median(error):.3f}, nine in ten {np.quantile(error, 0.9):.3f}, "
        f"RMS {np.sqrt(np.mean(error**2)):.3f} px; z RMS {np.sqrt(np.mean(z**2)):.2f}"
    )


if __name__ == "__main__":
    main()
