"""Moments of a push whose cameras see the bar from nearly one side: are they right, and are their sigmas?

    python tests/studies/accuracy/moments_from_one_side.py --count 150

Two cameras stand 0.4 m away, one 20 degrees up along the bar and one 20 degrees down, so that they see the wire from two
sides; their planes through the bar are apart by an angle that is drawn, from a twentieth of a degree on, so that its
slope is known to anything from a degree to nothing at all. A scene is fitted from line points with every error that the
fit allows for (scenes.py); its moments are those of which gauges are calibrated (`reference_from_pictures`), and the
truth those of the rig's mechanics. Printed by how well the slope is known: RMS of the error of the moments, of their
size and across it in shares of the size, the stated sigma, z, and how many of these whisks have a truth.
"""

import argparse
import itertools
import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import Settings
from bench.gauges.gauge_readings import reference_from_pictures
from bench.records.trial_result import SeenWhisk
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import CameraTable, PicturesTable, TrialTable
from bench.rig.rod_contact import moments_Nmm
from bench.session.whisker import Whisker
from bench.trials.seen import whisk_record
from tests.studies.accuracy.coverage import SCALES
from tests.studies.accuracy.rows import HALF_WIDTH_95
from tests.studies.accuracy.scenes import (
    Scene,
    Sigmas,
    as_problem,
    begin,
    calibrated,
    given,
    line_points,
    make_scene,
)
from vision.fit.scatter import inflated_by_residuals
from vision.fit.solve import solve
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.truth.truth_rows import to_whisk
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures

AWAY_MM = 400.0
UP_DEG = (20.0, -20.0)
MIDDLE_MM = np.array([52.0, 3.0, 0.0])
LEAST_ANGLE_DEG = 0.05
MOST_ANGLE_DEG = 8.0
SLOPES_DEG = (0.0, 25.0, 45.0)
MOST_BAR_PX = 0.6  # sigma of the points of the bar's line
# Of the slope's sigma, deg: bounds of the rows that are printed.
BOUNDS_DEG = (0.0, 3.0, 10.0, 20.0, 40.0, 90.0, 1000.0)


@dataclass(frozen=True)
class Row:
    """One whisk: sigma of its slope, whether it has a truth, and the shares (2,) by which its
    moments are off, with their sigmas.
    """

    slope_sigma_deg: float
    has_truth: bool
    error: np.ndarray | None
    sigma: np.ndarray | None


def scene_of(seed: int, angle_deg: float, slope_deg: float, bar_px: float) -> Scene:
    """Return a scene whose two cameras' planes through the bar are so far apart.

    bar_px: sigma of the points of the bar's line.
    """
    slope = math.radians(slope_deg)
    along_bar = np.array([0.0, -math.sin(slope), math.cos(slope)])
    normal = np.array([0.0, -math.cos(slope), -math.sin(slope)])
    cameras = []
    for number, up_deg in enumerate(UP_DEG):
        turn = math.radians(angle_deg * (number - 0.5))
        up = math.radians(up_deg)
        flat = math.cos(turn) * normal + math.sin(turn) * np.array([1.0, 0.0, 0.0])
        away = math.cos(up) * flat + math.sin(up) * along_bar
        position = tuple((MIDDLE_MM + AWAY_MM * away).tolist())
        target = tuple(MIDDLE_MM.tolist())
        size_px = (960, 600)
        table = CameraTable(
            name=f"c{number}",
            position_mm=position,
            target_mm=target,
            size_px=size_px,
            focal_px=1500.0,
        )
        cameras.append(table)
    trial = TrialTable(beta_deg=slope_deg, d_x_mm=50.0, purpose="gauge")
    protocol = Protocol(cameras=cameras, trials=[trial], pictures=PicturesTable(step_deg=0.7))
    return make_scene(protocol, Sigmas(bar_px=bar_px), seed)


def seen_whisk(scene: Scene) -> tuple[SeenWhisk, float]:
    """Return the record of the scene's whisk, fitted from its noisy line points, and the sigma of
    the bar's slope, rad.
    """
    rng = np.random.default_rng([scene.seed, 22])
    cameras = calibrated(scene, rng)
    wire, bar = given(scene, rng)
    problem = as_problem(scene, cameras, wire, bar, line_points(scene, rng))
    state, _ = solve(problem, begin(problem), scales=SCALES)
    problem = inflated_by_residuals(problem, state)
    state, _ = solve(problem, state, scales=(4.0, 4.0, 4.0))
    frames = list(range(len(scene.motor_rad)))
    fitted = FittedWhisk(problem, state, frames)
    time_s = scene.recording.frames.time_s
    whisk = WhiskPictures(
        0,
        frames,
        time_s,
        scene.motor_rad,
        (),
        cameras,
        Rods(wire, bar),
        None,
        VisionSettings(),
    )
    return whisk_record(to_whisk(whisk, fitted), Settings()), fitted.of_whisk("beta").sigma


def moment_errors(scene: Scene, seen: SeenWhisk) -> tuple[np.ndarray, np.ndarray] | None:
    """Return by how much all moments together are off, of their size and across it (2,), as shares
    of the size, with their sigmas (2,); None of a whisk that shows no moments.
    """
    whisker = Whisker(
        shape="cylinder",
        length_mm=scene.wire.length_mm,
        diameter_mm=scene.protocol.whisker.diameter_mm,
        youngs_modulus_GPa=60.0,
    )
    if seen.deflection is None:
        return None
    reference = reference_from_pictures(seen, whisker)
    state_at = scene.recording.whisks[0].forward.state_at
    true = np.array([moments_Nmm(state_at(motor)) for motor in reference.motor_rad])
    aside = np.stack([-true[:, 1], true[:, 0]], axis=1)
    shares = np.stack([true.ravel(), aside.ravel()]) / np.sum(true**2)
    error = shares @ (reference.moments - true).ravel()
    common = (reference.scale_sigma * true).ravel()
    covariance = reference.covariance + np.outer(common, common)
    return error, np.sqrt(np.einsum("ij,jk,ik->i", shares, covariance, shares))


def drawn(seed: int) -> Scene:
    """Return a scene with the angle between its planes and the noise of its bar's line drawn."""
    rng = np.random.default_rng([seed, 31])
    span = math.log(MOST_ANGLE_DEG / LEAST_ANGLE_DEG)
    angle_deg = LEAST_ANGLE_DEG * math.exp(span * rng.random())
    bar_px = rng.uniform(0.04, MOST_BAR_PX)
    return scene_of(seed, angle_deg, SLOPES_DEG[seed % len(SLOPES_DEG)], bar_px)


def line(label: str, rows: list[Row]) -> str:
    """Return a line of the table."""
    known = [row for row in rows if row.error is not None]
    counts = f"{label} {len(rows):4d} whisks, {sum(row.has_truth for row in rows):4d} with a truth"
    if not known:
        return f"{counts}, none shows moments"
    errors = np.array([row.error for row in known])
    sigmas = np.array([row.sigma for row in known])
    rms = 100.0 * np.sqrt(np.mean(errors**2, axis=0))
    stated = 100.0 * np.sqrt(np.mean(sigmas**2, axis=0))
    z = errors / sigmas
    z_rms = np.sqrt(np.mean(z**2, axis=0))
    held = 100.0 * np.mean(np.abs(z) < HALF_WIDTH_95)
    return (
        f"{counts}, {len(known):4d} show moments: size {rms[0]:.2f} % (stated {stated[0]:.2f}, z {z_rms[0]:.2f}), "
        f"across {rms[1]:.2f} % (stated {stated[1]:.2f}, z {z_rms[1]:.2f}); largest z {np.max(np.abs(z)):.1f}, "
        f"95 % intervals hold in {held:.0f} %"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--first", type=int, default=0, help="seed of the first scene")
    options = parser.parse_args()
    rows = []
    for seed in range(options.first, options.first + options.count):
        scene = drawn(seed)
        try:
            seen, slope_sigma_rad = seen_whisk(scene)
        except np.linalg.LinAlgError:
            print(f"seed {seed}: the fit does not converge")
            continue
        error, sigma = moment_errors(scene, seen) or (None, None)
        rows.append(Row(math.degrees(slope_sigma_rad), seen.has_truth, error, sigma))
    for low, high in itertools.pairwise(BOUNDS_DEG):
        own = [row for row in rows if low <= row.slope_sigma_deg < high]
        print(line(f"slope known to {low:2.0f}–{high:2.0f}°:", own))


if __name__ == "__main__":
    main()
