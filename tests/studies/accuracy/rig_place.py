"""Whether the motor's axis by a marker on the hub is as sure as it says: z over painted sessions.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/rig_place.py [SESSIONS]

Each session has the cameras of a protocol moved at random by 40 mm and rolled by 5 degrees at most, and hubs alone, painted
at 13 motor angles of one stroke; their true place is the rig frame. The first frame is off by a degree and a millimetre, as a
first look's. A row a stroke and blur: RMS error and RMS z of w_x, w_y (degrees) and v_x, v_y (mm), RMS of z over all and the
mean of chi2 of four; then the corners' bias in px, RMS, and its drift in px a degree.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.scenes.hub_pictures import HubPictures
from vision.calibration import MarkerSighting, Placement, by_marker, move_rig_frame
from vision.geometry import Cameras
from vision.geometry.rotation import exp_rotation

# [deg] Strokes, and [px] blurs of lens and defocus, that are drawn.
STROKES_DEG = (3.0, 6.0, 20.0)
BLURS_PX = (0.6, 0.9, 1.5)
FRAMES = 13
# [components] Of a placement, which a marker constrains.
AXIS = [0, 1, 3, 4]
_ERROR_RAD, _ERROR_MM = np.radians(1.0), 1.0
_MOST_ROUNDS = 3


def first_frame(cameras: Cameras, rng: np.random.Generator) -> tuple[Cameras, np.ndarray]:
    """Return the cameras in a frame that is a little off, and the transform (3, 4) to it from the rig's."""
    w = _ERROR_RAD * rng.standard_normal(3) * [1.0, 1.0, 0.0]
    v = _ERROR_MM * rng.standard_normal(3) * [1.0, 1.0, 0.0]
    R = exp_rotation(w)
    to_off = Placement.of(np.column_stack([R.T, -R.T @ v]), np.zeros((6, 6)))
    exact = Placement(np.zeros(6), np.zeros((6, 6)))
    return move_rig_frame(cameras, exact, to_off), to_off.T_board_rig


def axis_error(
    sightings: Sequence[MarkerSighting], cameras: Cameras, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return the error (4,) of the axis by a marker, rad and mm, and its covariance (4, 4)."""
    here, to_rig = first_frame(cameras, rng)
    exact = Placement(np.zeros(6), np.zeros((6, 6)))
    for _ in range(_MOST_ROUNDS):
        found = by_marker(sightings, here)
        step = Placement(found.step, np.zeros((6, 6)))
        here = move_rig_frame(here, exact, step)
        to_rig = np.column_stack(
            [
                to_rig[:, :3] @ step.T_board_rig[:, :3],
                to_rig[:, :3] @ step.T_board_rig[:, 3] + to_rig[:, 3],
            ]
        )
    error = Placement.of(to_rig, np.zeros((6, 6))).step
    return error[AXIS], found.covariance[np.ix_(AXIS, AXIS)]


def corner_biases(
    pictures: HubPictures, sightings: Sequence[MarkerSighting]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean error (cameras, 4, 2) of corners, px, and its change with the angle, px/rad."""
    bias = []
    drift = []
    for camera in pictures.cameras:
        own = [one for one in sightings if one.camera == camera.name]
        off = np.array([one.px - pictures.corners_px(camera, one.motor_rad) for one in own])
        angle = np.array([one.motor_rad for one in own])
        angle -= angle.mean()
        bias.append(off.mean(axis=0))
        drift.append(np.tensordot(angle, off, axes=1) / (angle @ angle))
    return np.array(bias), np.array(drift)


def study(sessions: int) -> None:
    """Print a row a stroke and blur."""
    heads = ["stroke", "blur", "n", "w_x", "w_y", "v_x", "v_y", "z:w_x", "w_y", "v_x", "v_y"]
    print(*[f"{head:>8}" for head in [*heads, "z", "chi2", "bias", "drift"]])
    total = []
    for width_deg in STROKES_DEG:
        for blur_px in BLURS_PX:
            errors, zs, chi2, biases, drifts = [], [], [], [], []
            for seed in range(sessions):
                pictures = HubPictures.drawn(seed, blur_px=blur_px)
                rng = np.random.default_rng([seed, 2])
                first_deg = rng.uniform(-2.0, 4.0)
                angles = np.radians(first_deg + np.linspace(0.0, width_deg, FRAMES))
                sightings = pictures.sightings(angles)
                error, covariance = axis_error(sightings, Cameras(pictures.cameras), rng)
                errors.append(error * np.repeat([np.degrees(1.0), 1.0], 2))
                zs.append(error / np.sqrt(np.diag(covariance)))
                chi2.append(error @ np.linalg.solve(covariance, error))
                bias, drift = corner_biases(pictures, sightings)
                biases.append(bias)
                drifts.append(np.radians(drift))
            rms = [_rms(np.array(one), 0) for one in (errors, zs)]
            total += zs
            row = [*rms[0], *rms[1], _rms(np.array(zs)), np.mean(chi2), _rms(np.array(biases))]
            row.append(_rms(np.array(drifts)))
            print(
                f"{width_deg:8.1f} {blur_px:8.1f} {len(zs):8d}",
                *[f"{x:8.3f}" for x in row],
                flush=True,
            )
    every = np.abs(np.array(total))
    print(
        f"all: z {_rms(every):.2f} RMS, {np.mean(every < 1.96):.3f} within 1.96, largest {every.max():.1f}"
    )


def _rms(values: np.ndarray, axis: int | None = None) -> np.ndarray:
    """Return the root of the mean square."""
    return np.sqrt(np.mean(np.square(values), axis=axis))


if __name__ == "__main__":
    study(int(sys.argv[1]) if len(sys.argv) > 1 else 12)
