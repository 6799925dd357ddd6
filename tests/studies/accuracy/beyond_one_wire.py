"""What once went wrong with whiskers that are not the paper's, and with numbers of many whisks: as it comes out today.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/beyond_one_wire.py FOLDER [ROW ...]

A row each: what it was, what it should be, what is found. None takes pictures (those are `accuracy/species.py`); all but
`paper`, a quarter of an hour of 640 whisks, take seconds. FOLDER keeps the sessions. More of `combined`:
`accuracy/combined_numbers.py`.
"""

import argparse
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import tomli_w

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench import api
from bench.gauges.clamped_rod import load_at_clamp
from bench.rig import protocol
from bench.rig.simulation import simulate
from bench.session.session import load_session
from bench.theory.best_design import Design, DesignJob, Equipment, Region, expected_error
from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.whisk import EstimatorSettings, Whisk
from tests.studies.accuracy.combined_numbers import DrawnSession, Table, judge
from tests.studies.accuracy.felt import felt_rows, scores, session_in
from tests.studies.accuracy.felt_phases import ONE, felt_whisks

PROFILED = """
name = "profiled"
[whisker]
length_mm = 45.0
diameter_mm = 0.2
widths = [1.0, -0.35, -0.9, 0.4, 0.05]
youngs_modulus_GPa = 3.0
set_y_mm = -3.0
states_rest = true
[[trials]]
d_x_mm = 20.0
"""
ARRAY = """
name = "array"
[[columns]]
name = "a"
heights_mm = [0, 12]
[[trials]]
purpose = "gauge"
d_x_mm = 50
follicle_roll_deg = 90
[[trials]]
beta_deg = 20
d_x_mm = 55
"""
SESSIONS = 10  # of `combined`
WHISKS = 25  # a slope, of `slip`
QUIET_V = 0.0006  # noise of a sample, a tenth of the usual


def made(folder: Path, name: str, text: str) -> Path:
    """Return the session of a protocol without pictures, simulated where it is not there."""
    file = folder / f"{name}.toml"
    file.write_text(text, encoding="utf-8")
    return simulate(folder / name, protocol=file, signals_only=True)


def clamp(_folder: Path) -> Iterator[str]:
    """The moment at the clamp over that of small angles, of any stiffness."""
    yield "was 0.997, 122, 4650, 41700 at EI = 100, 50, 10, 0.26 N·mm²; should be one number near 1"
    theta = np.radians(8.0)
    at = 60.0 * np.array([np.cos(theta), np.sin(theta)])
    for rigidity in (100.0, 50.0, 10.0, 0.26):
        load = load_at_clamp(*at, lambda arc, EI=rigidity: EI + 0.0 * arc)
        yield f"EI {rigidity:g}: {load.moment_Nmm[0] * 60.0 / (3 * rigidity * theta):.9f}"


def entered(folder: Path) -> Iterator[str]:
    """A base of 0.2 mm, a measured profile and unloaded shape in session.toml."""
    yield "was refused; should be read"
    whisker = load_session(made(folder, "profiled", PROFILED)).whisker
    turn_deg = np.degrees(whisker.turn_rad)
    yield f"base {whisker.diameter_mm:g} mm, {len(whisker.widths)} terms of a profile, turns by {turn_deg:.1f}°"


def slip(_folder: Path) -> Iterator[str]:
    """Stick–slip where there is one coefficient of friction."""
    yield "was felt in 64 of 80 whisks of 90°/s; should be in fewer than 1 of 200"
    for coefficients in ONE:
        whisks = list(felt_whisks(coefficients, 90.0, WHISKS, 1))
        jumps = sum(whisk.phases.jumps > 0 for whisk in whisks)
        yield f"μ = {coefficients[0]:g}: in {jumps} of {len(whisks)}"


def paper(folder: Path) -> Iterator[str]:
    """The 640 whisks of the paper, signals alone, the truth by a stage."""
    yield "was: radius less the bar's +6.5 ± 1.2 mm (true 0), 18 straight bars curved to the side, 118 whisks stick and slip"
    tables = tomllib.loads((protocol.FOLDER / "paper.toml").read_text(encoding="utf-8"))
    tables.pop("cameras")
    session = made(folder, "paper", tomli_w.dumps(tables | {"stage": True}))
    out = folder / "paper-out"
    is_there = (out / "run.json").is_file()
    run = api.read(out) if is_there else api.evaluate(session, out, figures=False)
    said = (out / "summary.txt").read_text(encoding="utf-8").splitlines()
    yield from (line.strip() for line in said if "radius of the object" in line)
    yield f"{sum('curved to the side' in line for line in said)} trials curved to the side"
    friction = run.table("friction")
    yield f"stick–slip in {np.sum(friction['jumps_felt'] > 0)} of {len(friction)} whisks"


def combined(_folder: Path) -> Iterator[str]:
    """Friction angles of a cone's session."""
    yield "was 4.918 ± 0.0055° for 5°, 15 sigma; should lie within 1.96 of its sigma in 95 %"
    table = Table()
    for seed in range(SESSIONS):
        judge(DrawnSession("cone", np.random.default_rng([seed, 1])), table, "cone")
    yield from (line for line in table.lines() if not line.startswith("straight bars said"))


def touch(folder: Path) -> Iterator[str]:
    """First touch as felt, where noise is low."""
    yield "was within its interval in 58 %, z 3.7; should be in 95 %"
    session = session_in(folder / "quiet", 4, 2, noise=QUIET_V)
    yield from (one.line() for one in scores(list(felt_rows(session, [3.0]))))


def array(folder: Path) -> Iterator[str]:
    """The follicle's turn and the gauges of a simulated array."""
    yield "was without its turn, and with exact gauges; should state the turn and leave gauges to its gauge trials"
    session = made(folder, "array", ARRAY)
    for trial in sorted((session / "trials").iterdir()):
        keys = tomllib.loads((trial / "trial.toml").read_text(encoding="utf-8"))
        if keys["purpose"] == "gauge":
            yield f"{trial.name}: follicle_roll_deg = {keys.get('follicle_roll_deg')}"
    keys = tomllib.loads((session / "session.toml").read_text(encoding="utf-8"))
    yield f"whiskers with gauges stated: {sum('gauges' in whisker for whisker in keys['whiskers'])}"


def tip(_folder: Path) -> Iterator[str]:
    """A contact at the tip."""
    yield "was [100, 100] beside a sigma of 0.39 mm; should reach from below up to the length"
    beam = Beam.from_modulus(60.0, 1.0, 100.0)
    theta = np.radians(3.0)
    moment = beam.C_Nmm2 * theta / 100.2
    whisk = Whisk.without_samples(theta, (0.0, moment), (0.004 * moment) ** 2 * np.eye(2), beam)
    found = with_friction(whisk, EstimatorSettings(np.radians(10.0)))
    interval = f"[{found.low_mm:.2f}, {found.high_mm:.2f}]"
    yield f"{found.d_x_mm:.2f} ± {found.sigma_mm:.2f} mm in {interval}; {found.status}"


def design(_folder: Path) -> Iterator[str]:
    """How well the whisker's own sizes are known, in the error that a design expects."""
    yield "was left out; a length wrong by 1 mm moves this cone's d_x by 0.84 mm"
    region = Region((20.0, 60.0), (5.0, 15.0), (30.0, 80.0))
    place = np.array([[np.radians(40.0)], [np.radians(10.0)], [80.0]])
    cone = Design(1.97, 6.5, 2.0, 85.0, 0.98, 40.0)
    for sigmas_mm in ((0.0, 0.0), (1.0, 0.0), (0.5, 0.02)):
        equipment = Equipment(length_sigma_mm=sigmas_mm[0], diameter_sigma_mm=sigmas_mm[1])
        sigma = expected_error(cone, DesignJob(region, equipment), place).sigma_percent[0]
        told = "length ± {:g} mm, diameters ± {:g} mm".format(*sigmas_mm)
        yield f"{told}: d_x of 80 mm ± {0.8 * sigma:.2f} mm"


ROWS = {
    row.__name__: row for row in (clamp, entered, slip, paper, combined, touch, array, tip, design)
}


def main() -> None:
    """Print the rows."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("row", nargs="*", choices=[*ROWS, []], default=[])
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    for name in options.row or ROWS:
        print(f"{name}: {ROWS[name].__doc__}")
        for line in ROWS[name](options.folder):
            print(f"    {line}", flush=True)


if __name__ == "__main__":
    main()
