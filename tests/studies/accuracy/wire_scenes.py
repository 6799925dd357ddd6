"""How far a camera's line of the wire is off as a whole, in path-traced scenes, in the frames before touch.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/wire_scenes.py SCENES

SCENES holds sessions of one whisk each with exact cameras, as for path_traced.py. Before touch the wire is a straight
line from the axis at the motor's angle, so that its picture is known. A row a camera: lens blur found, misfit over
noise, mean error of the line's points in px, and in sigmas of what they share (that of a whole line in the fit's prior
included). Then median, nine in ten and RMS of all, and RMS of z; of views with a free stroke of 2.5 degrees or more by
how much the line's offset and tilt drift over the whisk (half of what they change by), as quantiles.
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
_LONG_DEG = 2.5  # free strokes that show a drift


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
        self.drift_px = {}

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
            own_rad = [angles[one.frame] for one in found if angles[one.frame] < self.touch_rad]
            if np.degrees(np.ptp(own_rad)) >= _LONG_DEG:
                self.drift_px[view.camera.name] = drift_px(free, own_rad, errors, angles)
            looks = whisk.light[view.camera.name]
            self.rows[view.camera.name] = (looks.blur_px, looks.misfit, error, sigma)
        return found


def drift_px(points, own_rad, errors, swing_rad) -> np.ndarray:
    """Offset and tilt (2,), px, by which lines drift linearly over a whisk, at its ends.

    points, own_rad, errors: of each line before touch, its points, motor angle, and errors (n,) px.
    swing_rad: motor angles of the whisk.
    """
    lever = [one.place / (0.5 * _LENGTH_MM) - 1.0 for one in points]
    middle, half = np.mean([min(swing_rad), max(swing_rad)]), 0.5 * np.ptp(swing_rad)
    turned = [np.full(len(one), (angle - middle) / half) for one, angle in zip(errors, own_rad)]
    place, turn = np.concatenate(lever), np.concatenate(turned)
    shapes = np.column_stack([np.ones(len(place)), place, turn, turn * place])
    return np.linalg.lstsq(shapes, np.concatenate(errors), rcond=None)[0][2:]


def look_at(folder: Path) -> Recorder:
    """What is found in a scene: by camera `rows`, blur, misfit, error and its stated sigma, and `drift_px`."""
    frames = np.genfromtxt(folder / "trials" / "w" / "truth.csv", delimiter=",", names=True)
    recorder = Recorder(float(np.radians(frames["motor_deg"][frames["contact"] > 0].min())) - 1e-6)
    usual, seeing.trace_wire = seeing.trace_wire, recorder
    try:
        see_scene(folder)
    finally:
        seeing.trace_wire = usual
    return recorder


def main() -> None:
    total, drifts = [], []
    for folder in sorted(path for path in Path(sys.argv[1]).iterdir() if path.is_dir()):
        recorder = look_at(folder)
        drifts += recorder.drift_px.values()
        for camera, (blur, misfit, error, sigma) in recorder.rows.items():
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
    shares = np.quantile(np.abs(np.array(drifts)), [0.68, 0.95], axis=0)
    print(
        f"{len(drifts)} long free strokes: 68 in 100 drift by less than {shares[0][0]:.3f} px in offset and "
        f"{shares[0][1]:.3f} px in tilt, 95 in 100 by less than {shares[1][0]:.3f} and {shares[1][1]:.3f} px"
    )


if __name__ == "__main__":
    main()
