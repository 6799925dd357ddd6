"""Whether a design does what `whisker-bench design` expects of it: whisks at its region's corners, through signals.

    python tests/studies/accuracy/design.py [--whisks 25] [--seed 0]

Three regions, and the paper's whisker over the first. At each of the eight corners the rig makes whisks by exact
mechanics, with the noise of the means, on an upright bar; touch and moments are felt as in a session. Printed: mean
error beside the expected bias, and the scatter beside the expected sigma (as if nothing leaned), corner by corner; at
the end the largest difference of bias and the RMS ratio of scatter to sigma.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import Settings
from bench.gauges.drift import allow_drift
from bench.gauges.felt import strokes_of
from bench.gauges.matrix import GaugeMatrix
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import (
    GaugesTable,
    MotorTable,
    PicturesTable,
    TrialTable,
    WhiskerTable,
)
from bench.rig.recording import Recording
from bench.session.signals import Signals
from bench.theory.best_design import (
    Design,
    DesignJob,
    Equipment,
    Region,
    best_design,
    expected_error,
)
from bench.theory.design_map import rod_of
from bench.trials.readout import Readout, whisk_at
from estimator.builtin import with_friction
from estimator.whisk import EstimatorSettings

EQUIPMENT = Equipment(length_sigma_mm=0.0, diameter_sigma_mm=0.0)  # the rig's are as designed
REGIONS = (
    Region((20.0, 60.0), (5.0, 15.0), (30.0, 80.0), lean_sigma_deg=0.0),
    Region((0.0, 75.0), (5.0, 25.0), (20.0, 90.0), lean_sigma_deg=0.0),
    Region((-40.0, 40.0), (15.0, 25.0), (40.0, 60.0), lean_sigma_deg=0.0),
)
RANGES = {
    "theta_deg": (0.5, 8.0),
    "alpha_est_deg": (0.0, 45.0),
    "diameter_mm": (0.3, 1.5),
    "taper": (0.0, 0.95),
    "tilt_deg": (-60.0, 60.0),
}
_VOLT_NMM = 20.0  # N·mm/V of the gauges: whatever a corner asks for is within 10 V


def errors_percent(
    design: Design, region: Region, corner: np.ndarray, whisks: int, rng: np.random.Generator
) -> np.ndarray:
    """Error of (10), % (n,), of so many whisks at one corner: (slope, friction angle) in rad, and distance."""
    (beta, alpha, d_x), found = corner, []
    slope, exactly = (
        float(np.degrees(beta)) - design.tilt_deg,
        {"beta_scatter_deg": 0.0, "d_x_scatter_mm": 0.0},
    )
    table = TrialTable(
        beta_deg=slope,
        d_x_mm=float(d_x),
        friction=float(np.tan(alpha)),
        bar_diameter_mm=2 * region.bar_radius_mm,
        **exactly,
    )
    protocol = _protocol(design, table)
    for _ in range(whisks):
        recording = Recording.make(*protocol.runs(), rng)
        d_x_est = _felt(design, recording)
        found.append(100.0 * (d_x_est / recording.touch.d_x_mm - 1.0))
    return np.array(found)


def _protocol(design: Design, table: TrialTable) -> Protocol:
    rod = rod_of(design, EQUIPMENT)
    size = {
        name: getattr(rod, name)
        for name in ("shape", "length_mm", "diameter_mm", "tip_diameter_mm")
    }
    whisker = WhiskerTable(**size, youngs_modulus_GPa=EQUIPMENT.youngs_modulus_GPa)
    gauges = GaugesTable(
        matrix_Nmm_per_V=((_VOLT_NMM, 0.0), (0.0, _VOLT_NMM)),
        noise_V=EQUIPMENT.noise_Nmm / _VOLT_NMM,
        hum_V=0.0,
        known=True,
    )
    motor = MotorTable(after_deg=max(design.theta_deg + 1.0, 2.5))
    pictures = PicturesTable(step_deg=4.0, after_deg=2.0)
    return Protocol(trials=[table], whisker=whisker, gauges=gauges, motor=motor, pictures=pictures)


def _felt(design: Design, recording: Recording) -> float:
    """d_x by (10), mm; NaN where no touch is felt."""
    time, motor_deg, y, z = recording.signals.T
    (stroke,) = strokes_of(
        Signals(time, np.radians(motor_deg), y, z, "V"), recording.run, Settings()
    )
    touch = allow_drift(stroke.touch, np.zeros(2), stroke.speed_rad_s)
    beam = design.beam(EQUIPMENT)
    whisk = whisk_at(
        stroke, Readout(GaugeMatrix(_VOLT_NMM * np.eye(2))), touch, beam, design.theta_rad
    )
    told = EstimatorSettings(float(np.radians(design.alpha_est_deg)))
    return np.nan if isinstance(whisk, str) else with_friction(whisk, told).d_x_mm


def rows(design: Design, region: Region, whisks: int, rng: np.random.Generator) -> Iterator[tuple]:
    """(corner, expected bias, mean error, expected sigma, scatter), % of d_x."""
    corners = region.corners()
    told = expected_error(design, DesignJob(region, EQUIPMENT), corners)
    for corner, bias, sigma in zip(corners.T, told.bias_percent, told.sigma_percent):
        found = errors_percent(design, region, corner, whisks, rng)
        yield corner, bias, found.mean(), sigma, found.std(ddof=1)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--whisks", type=int, default=25)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng, apart, ratios = np.random.default_rng(options.seed), [], []
    designs = [
        (
            region,
            best_design(
                {**RANGES, "length_mm": (1.05 * region.d_x_mm[1], 150.0)},
                DesignJob(region, EQUIPMENT),
            ),
        )
        for region in REGIONS
    ]
    paper = replace(Design(), length_mm=100.0)
    for region, (design, worst) in [(REGIONS[0], (paper, np.nan)), *designs]:
        print(design, f"worst {worst:.2f} %")
        for (beta, alpha, d_x), bias, mean, sigma, scatter in rows(
            design, region, options.whisks, rng
        ):
            place = f"  β {np.degrees(beta):5.0f}° α {np.degrees(alpha):4.0f}° d_x {d_x:4.0f} mm"
            errors = (
                f"bias {bias:+7.2f}, mean {mean:+7.2f}; sigma {sigma:.3f}, scatter {scatter:.3f} %"
            )
            print(f"{place}: {errors}", flush=True)
            apart.append(abs(mean - bias))
            ratios.append(scatter / sigma)
    print(
        f"bias within {max(apart):.2f} %; scatter over sigma {np.sqrt(np.mean(np.square(ratios))):.2f} RMS"
    )


if __name__ == "__main__":
    main()
