"""How often stick–slip is felt in whisks with one coefficient of friction and in whisks with two, as motors start and stop.

    python tests/studies/accuracy/felt_phases.py [--whisks 10] [--seed 0]

Signals of the rig at 10 and 90°/s on four slopes of two surfaces: exact mechanics, ringing, hum, noise, the motor's ramps
and stops, its encoder's steps. Gauges and slopes are as they are. Printed: whisks, in how many of them jumps are felt, and
the friction angles at the ends of rests less the true ones, in degrees. With one coefficient fewer than 1 whisk in 200 may
show a jump.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import Settings
from bench.gauges.felt import strokes_of
from bench.records.phases import KINETIC, STATIC, Phases
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
from bench.trials.readout import RawMoments
from bench.trials.stick_slip_phases import felt_phases
from estimator.beam import Beam

SLOPES_DEG = (25.0, 40.0, 50.0, 65.0)
SPEEDS_DEG_S = (10.0, 90.0)
# Kinetic and static coefficients: steel and sandpaper as the paper fits them, and a sandpaper that sticks.
ONE = ((0.185, 0.185), (0.338, 0.338))
TWO = ((0.34, 0.43),)


@dataclass(frozen=True)
class FeltWhisk:
    """What is felt of one whisk, and what is true: tangents of its friction angles."""

    phases: Phases
    kinetic: float
    static: float


def felt_whisks(
    coefficients: tuple[float, float], speed_deg_s: float, whisks: int, seed: int
) -> Iterator[FeltWhisk]:
    """Yield the whisks of a recording a slope."""
    kinetic, static = coefficients
    table = TrialTable(
        beta_deg=list(SLOPES_DEG),
        speed_deg_s=speed_deg_s,
        friction=kinetic,
        static_friction=static,
        whisks=whisks,
    )
    protocol = Protocol(
        trials=[table],
        friction=FrictionTable(scatter=0.03 if kinetic == static else 0.0),
        gauges=GaugesTable(vibration=True, known=True),
        motor=MotorTable(
            before_deg=3.0 if speed_deg_s < 50 else 15.0,
            after_deg=6.0,
            ramp_s=0.02,
            pause_s=0.05,
            encoder_step_deg=0.01,
        ),
        pictures=PicturesTable(step_deg=3.0),
    )
    beam = Beam.from_modulus(
        protocol.whisker.youngs_modulus_GPa,
        protocol.whisker.diameter_mm,
        protocol.whisker.length_mm,
    )
    for number, run in enumerate(protocol.runs()):
        recording = Recording.make(run, np.random.default_rng([seed, number]))
        for phases in phases_of_recording(recording, beam):
            yield FeltWhisk(phases, kinetic, static)


def phases_of_recording(recording: Recording, beam: Beam) -> Iterator[Phases]:
    """Yield what is felt of each whisk, by the true gauges, slope and distance."""
    time, motor_deg, y, z = recording.signals.T
    signals = Signals(time, np.radians(motor_deg), y, z, "V")
    matrix = np.array(recording.run.protocol.gauges.matrix_Nmm_per_V)
    for stroke in strokes_of(signals, recording.run, Settings()):
        touch = stroke.touch
        moments = (stroke.channels - touch.offset) @ matrix.T
        theta = stroke.motor_rad - touch.motor_rad
        beta = np.radians(recording.run.beta_deg)
        raw = RawMoments(stroke.time_s, theta, moments)
        yield felt_phases(raw, beta, recording.run.d_x_mm, beam)


def errors_deg(whisks: list[FeltWhisk], kind: str) -> np.ndarray:
    """Return the friction angles of one kind less the true ones (n,), degrees."""
    found = []
    for whisk in whisks:
        true = np.arctan(whisk.kinetic if kind == KINETIC else whisk.static)
        angles = [angle.alpha_rad for angle in whisk.phases.angles if angle.kind == kind]
        found.extend(np.degrees(np.array(angles) - true))
    return np.array(found)


def main() -> None:
    """Print a line a pair of coefficients and speed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--whisks", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print(f"{'friction':>16}{'speed':>9}{'whisks':>8}{'felt in':>9}{'kinetic':>18}{'static':>18}")
    for coefficients in (*ONE, *TWO):
        for speed in SPEEDS_DEG_S:
            whisks = list(felt_whisks(coefficients, speed, options.whisks, options.seed))
            jumps = sum(whisk.phases.jumps > 0 for whisk in whisks)
            line = f"{coefficients[0]:>8.3f}{coefficients[1]:>8.3f}{speed:>5g}°/s{len(whisks):>8}{jumps:>9}"
            for kind in (KINETIC, STATIC):
                errors = errors_deg(whisks, kind)
                of = f"{errors.mean():+.2f} ± {errors.std():.2f}°" if len(errors) else "none"
                line += f"{of:>18}"
            print(line, flush=True)


if __name__ == "__main__":
    main()
