"""Are the stated sigmas of a calibration true? Many synthetic calibrations, predicted against sampled.

    python tests/studies/accuracy/cameras_montecarlo.py --count 1000
    python tests/studies/accuracy/cameras_montecarlo.py --films 40

Every calibration runs the whole of `calibrate_cameras` on corners with fresh noise. For points where the whisker is it
compares: the pixels that the calibrated cameras project them to, and the places that the calibrated cameras bring them
to from freshly noisy pixels. Prints, for both, sampled over predicted standard deviation (least, median and largest
over the points) and how often 95 % intervals hold the truth.

With --films, of so many films by two cameras that are not triggered together, of a board that is shaken at 4 Hz (the
second camera late by up to half a frame, at random): the root mean square error of all lens terms over stated sigmas,
the largest, and of how many films the cameras' views were taken as each camera's own.
"""

import argparse
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.board_scenes import (
    BOARD,
    SIZE_PX,
    T_RIG_BOARD,
    WORK_MM,
    Film,
    Recording,
    a_recording,
    measured_pose,
)
from tests.studies.accuracy.rows import HALF_WIDTH_95
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews, MeasuredPose
from vision.geometry.camera import Cameras
from vision.geometry.triangulate import triangulate

SIGMA_PX = 0.05
FILMS = (
    Film(3.0),
    Film(10.0),
    Film(20.0),
    Film(10.0, period_s=1 / 60),
    Film(3.0, period_s=1 / 100),
)


@dataclass(frozen=True, eq=False)
class Sample:
    """Errors and stated sigmas of many calibrations, (count, values)."""

    error: np.ndarray
    sigma: np.ndarray

    @property
    def ratio(self) -> np.ndarray:
        """Sampled over predicted standard deviation of each value; the prediction is the root mean square one."""
        return np.sqrt(np.mean(self.error**2, axis=0) / np.mean(self.sigma**2, axis=0))

    @property
    def coverage(self) -> float:
        """Share of the 95 % intervals that hold the truth."""
        return float(np.mean(np.abs(self.error) < HALF_WIDTH_95 * self.sigma))


def sample_calibrations(
    count: int, seed: int = 0, *, views: int = 10, rig_sigma_mm=0.0, rig_sigma_rad=0.0
):
    """(projected, triangulated): Samples in px and in mm of `count` calibrations of one recording."""
    recording, rng = a_recording(views), np.random.default_rng(seed)
    drawn = [_one(recording, rng, rig_sigma_mm, rig_sigma_rad) for _ in range(count)]
    projected, triangulated = zip(*drawn)
    return (
        Sample(*(np.array(column) for column in zip(*rows))) for rows in (projected, triangulated)
    )


def _one(recording: Recording, rng: np.random.Generator, rig_sigma_mm: float, rig_sigma_rad: float):
    boards, rig = recording.seen(SIGMA_PX, rng)
    sizes = dict.fromkeys(boards, SIZE_PX)
    T_measured = measured_pose(T_RIG_BOARD, rig_sigma_mm, rig_sigma_rad, rng)
    on_rig = MeasuredPose(T_measured, rig_sigma_mm, rig_sigma_rad)
    made = calibrate_cameras(BoardViews(boards, sizes, rig), BOARD, on_rig)
    return _projected(made.cameras, recording.cameras), _triangulated(
        made.cameras, recording.cameras, rng
    )


def _projected(made: Cameras, true: Cameras) -> tuple[np.ndarray, np.ndarray]:
    errors, sigmas = [], []
    for camera in made:
        px, _, J = camera.project_with_jacobians(WORK_MM)
        own = made.parameters_of(camera.name)
        variance = np.einsum("nij,jk,nik->ni", J, made.covariance[own, own], J)
        errors.append((px - true[camera.name].project(WORK_MM)).ravel())
        sigmas.append(np.sqrt(variance).ravel())
    return np.concatenate(errors), np.concatenate(sigmas)


def _triangulated(
    made: Cameras, true: Cameras, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    seen = {
        c.name: c.project(WORK_MM) + SIGMA_PX * rng.standard_normal((len(WORK_MM), 2)) for c in true
    }
    points = triangulate(made, seen, {c.name: np.full(len(WORK_MM), SIGMA_PX) for c in true})
    sigma = np.sqrt(np.einsum("nii->ni", points.covariance(made)))
    return (points.mm - WORK_MM).ravel(), sigma.ravel()


def sample_films(film: Film, count: int, seed: int = 0) -> tuple[np.ndarray, int]:
    """Errors of lens terms over their sigmas, (count, 2, 9), and of how many films each camera's views are its own."""
    recording = a_recording(2)
    z = []
    own = 0
    for number in range(count):
        rng = np.random.default_rng(seed + number)
        late = replace(film, late=rng.uniform(-0.5, 0.5))
        boards = late.views(recording.cameras, SIGMA_PX, rng)
        rig = recording.seen(SIGMA_PX, rng)[1]
        views = BoardViews(boards, dict.fromkeys(boards, SIZE_PX), rig)
        made = calibrate_cameras(views, BOARD, MeasuredPose(T_RIG_BOARD))
        own += not made.together
        for camera, report in zip(made.cameras, made.report):
            z.append((camera.lens - recording.cameras[camera.name].lens) / report.intrinsics_sigma)
    return np.array(z), own


def lines(name: str, sample: Sample):
    """What the ladder asks for: ratios within 0.9 to 1.1, coverage within 93 to 97 %."""
    ratio = sample.ratio
    yield (
        f"{name}: sampled / predicted sigma {ratio.min():.3f} to {ratio.max():.3f}, median {np.median(ratio):.3f}; "
        f"95 % intervals hold in {100 * sample.coverage:.1f} %"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--films", type=int)
    options = parser.parse_args()
    for film in FILMS if options.films else ():
        z, own = sample_films(film, options.films, options.seed)
        print(
            f"{film.shake_mm:g} mm, 1/{1 / film.period_s:.0f} s: z of lens terms {np.sqrt(np.mean(z**2)):.2f} RMS, "
            f"{np.abs(z).max():.1f} at most; {own} of {options.films} each camera's own",
            flush=True,
        )
    if options.films:
        return
    uncertain = {"rig_sigma_mm": 0.1, "rig_sigma_rad": np.radians(0.1)}
    for what, rig in (
        ("board on the rig exact", {}),
        ("known to 0.1 mm and 0.1 degrees", uncertain),
    ):
        begin = time.perf_counter()
        projected, triangulated = sample_calibrations(options.count, options.seed, **rig)
        seconds = time.perf_counter() - begin
        print(f"{options.count} calibrations, {what} ({1e3 * seconds / options.count:.0f} ms each)")
        print(
            *lines("  projected points", projected),
            *lines("  triangulated points", triangulated),
            sep="\n",
        )


if __name__ == "__main__":
    main()
