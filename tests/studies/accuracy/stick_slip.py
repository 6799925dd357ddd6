"""Scatter of φ over ten whisks where a whisker sticks and slips, at both speeds of section V: what makes Fig. 8's.

    python tests/studies/accuracy/stick_slip.py [--seed 0] [--whisks 10]

The paper sees a larger scatter at 10°/s than at 90°/s and names stick–slip's dependence on speed. Simulated on
sandpaper, β = 45 and 60°, signals only, gauges known, are: teeth all alike; each rest reaching its own coefficient; and
this with an excess at rest that shrinks with speed (rests are shorter, so that contacts age less), as the paper's own α
at 10 and 90°/s asks for. Each is read as the estimators read it, and through section V's low-pass. Printed: SD of φ in
degrees.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import Settings
from bench.gauges.felt import strokes_of
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import (
    FrictionTable,
    GaugesTable,
    MotorTable,
    PicturesTable,
    TrialTable,
)
from bench.rig.recording import Recording
from bench.session.signals import Signals
from estimator.signal import moment_at

KINETIC, EXCESS, AGED_EXCESS = (
    0.338,
    0.09,
    0.02,
)  # tan 18.7°; a tooth at 10°/s, and what is left of it at 90°/s
IRREGULAR, SPEEDS, SLOPES_DEG, THETA_RAD = 0.6, (10.0, 90.0), (45.0, 60.0), np.radians(3.0)
CASES = {
    "teeth alike": (0.0, EXCESS),
    "each rest its own": (IRREGULAR, EXCESS),
    "and less at 90°/s": (IRREGULAR, AGED_EXCESS),
}


def recordings(irregular: float, excess_fast: float, speed: float, whisks: int, seed: int):
    """A recording a slope."""
    excess = EXCESS if speed == SPEEDS[0] else excess_fast
    table = TrialTable(
        beta_deg=list(SLOPES_DEG),
        speed_deg_s=speed,
        friction=KINETIC,
        static_friction=KINETIC + excess,
        whisks=whisks,
    )
    protocol = Protocol(
        trials=[table],
        friction=FrictionTable(irregular=irregular),
        gauges=GaugesTable(vibration=True, known=True),
        motor=MotorTable(
            before_deg=3.0 if speed < 50 else 15.0, after_deg=4.6, ramp_s=0.02, pause_s=0.05
        ),
        pictures=PicturesTable(step_deg=3.0),
    )
    for number, run in enumerate(protocol.runs()):
        yield Recording.make(run, np.random.default_rng([seed, number]))


def slip_angles(recording: Recording) -> np.ndarray:
    """φ (whisks, 2), degrees: as recorded, and low-passed."""
    time, motor_deg, y, z = recording.signals.T
    signals = Signals(time, np.radians(motor_deg), y, z, "V")
    matrix, found = np.array(recording.run.protocol.gauges.matrix_Nmm_per_V), []
    for stroke in strokes_of(signals, recording.run, Settings()):
        touch = stroke.touch
        both = (
            stroke.at(THETA_RAD, touch),
            moment_at(THETA_RAD, stroke.motor_rad, stroke.filtered, touch, time_s=stroke.time_s),
        )
        found.append([np.degrees(np.arctan2(*(matrix @ at.values))) for at in both])
    return np.array(found)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--whisks", type=int, default=10)
    options = parser.parse_args()
    print(f"{'':<22}{'speed':>8}{'β':>6}{'mean φ':>9}{'SD':>8}{'SD low-passed':>15}")
    for name, (irregular, excess_fast) in CASES.items():
        for speed in SPEEDS:
            for recording in recordings(
                irregular, excess_fast, speed, options.whisks, options.seed
            ):
                phi = slip_angles(recording)
                mean, sd = phi.mean(axis=0), phi.std(axis=0, ddof=1)
                beta = recording.run.beta_deg
                print(
                    f"{name:<22}{speed:>6g}°/s{beta:>5g}°{mean[0]:>8.2f}°{sd[0]:>7.3f}°{sd[1]:>14.3f}°",
                    flush=True,
                )


if __name__ == "__main__":
    main()
