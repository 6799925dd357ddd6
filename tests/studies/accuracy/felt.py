"""How honest touch felt and (10) are over the pushing angle: signals only, the simulated friction given to (10).

    python tests/studies/accuracy/felt.py FOLDER [--count 3] [--seed 0] [--theta-deg 0.3 0.5 1 3] [--drift-V-per-s 0]
        [--shape cylinder|cone|tapered] [--noise-V 0.0064]

FOLDER keeps the simulated session (β 0, 30, 60, at 10 and 90°/s, `--count` trials of each, gauges known, vibration on)
and is taken up again. Printed for each speed: error of touch felt, and for each θ that of d_x by (10): bias and RMS,
how often the 95 % intervals hold, the largest |z|.
"""

import argparse
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import Settings
from bench.gauges.drift import drift_rate, free_slope
from bench.gauges.felt import gauge_delay, strokes_of
from bench.gauges.gauges_file import given_gauges
from bench.report.score import Score
from bench.rig.simulation import simulate
from bench.session.session import load_session
from bench.session.signals import read_signals
from bench.trials.estimates import as_felt, run_estimator
from bench.trials.readout import Readout, felt_whisk
from estimator.builtin import with_friction

PROTOCOL = """
name = "felt"
[whisker]
shape = "{shape}"
{tip}
[gauges]
known = true
vibration = true
drift_V_per_s = {drift}
noise_V = {noise}
[[trials]]
beta_deg = [0, 30, 60]
speed_deg_s = [10, 90]
d_x_mm = 60.0
repeats = {count}
psi_scatter_deg = 2.0
"""


def session_in(
    folder: Path,
    count: int,
    seed: int,
    drift: float = 0.0,
    shape: str = "cylinder",
    noise: float = 0.0064,
) -> Path:
    """The simulated session, made where it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    protocol, tip = folder / "protocol.toml", "tip_diameter_mm = 0.4" if shape == "tapered" else ""
    protocol.write_text(
        PROTOCOL.format(count=count, drift=drift, shape=shape, tip=tip, noise=noise),
        encoding="utf-8",
    )
    return simulate(folder / "session", protocol=str(protocol), signals_only=True, seed=seed)


def felt_rows(session_path: Path, thetas_deg: Sequence[float]) -> Iterator[dict]:
    """A row a whisk and θ: speed, errors and sigmas of touch felt (deg) and of d_x by (10) (mm)."""
    session = load_session(session_path)
    gauges, settings = given_gauges(session).all, Settings()
    strokes = {t.name: strokes_of(read_signals(t), t, settings) for t in session.trials}
    rate = drift_rate(
        [s for many in strokes.values() for one in many if (s := free_slope(one)) is not None]
    )
    for trial in session.trials:
        truth = tomllib.loads((trial.folder / "truth.toml").read_text(encoding="utf-8"))
        alpha, readout = float(np.arctan(truth["mu_kinetic"])), Readout.of(trial, gauges)
        for stroke in strokes[trial.name]:
            for theta_deg in thetas_deg:
                row = {"speed": trial.speed_deg_s, "theta_deg": theta_deg}
                touch, whisk = felt_whisk(
                    stroke, readout, rate, session.whisker.beam, np.radians(theta_deg)
                )
                delay = gauge_delay(trial.gauge_filter_Hz)
                felt = as_felt(0, touch, whisk, stroke.speed_rad_s, delay).touch_felt_rad
                row["touch"] = np.degrees(felt.value) - truth["touch_deg"]
                row["touch_sigma"] = np.degrees(felt.sigma)
                said = run_estimator("with_friction", with_friction, whisk, alpha, 0.0).d_x_est_mm
                yield row | {"d_x": said.value - truth["d_x_mm"], "d_x_sigma": said.sigma}


def scores(rows: Sequence[dict]) -> Iterator[Score]:
    """Touch felt by speed, d_x by speed and θ."""
    for speed in sorted({row["speed"] for row in rows}):
        mine = [row for row in rows if row["speed"] == speed]
        thetas = sorted({row["theta_deg"] for row in mine})
        yield _score(
            f"touch felt, {speed:g}°/s",
            "deg",
            "touch",
            [r for r in mine if r["theta_deg"] == thetas[0]],
        )
        for theta in thetas:
            of_theta = [r for r in mine if r["theta_deg"] == theta]
            yield _score(f"d_x at θ = {theta:g}°, {speed:g}°/s", "mm", "d_x", of_theta)


def _score(name: str, unit: str, key: str, rows: Sequence[dict]) -> Score:
    return Score(name, unit, *(np.array([row[k] for row in rows]) for k in (key, f"{key}_sigma")))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=3)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--theta-deg", type=float, nargs="+", default=[0.3, 0.5, 1.0, 3.0])
    parser.add_argument("--drift-V-per-s", type=float, default=0.0)
    parser.add_argument("--shape", choices=("cylinder", "cone", "tapered"), default="cylinder")
    parser.add_argument("--noise-V", type=float, default=0.0064)
    options = parser.parse_args()
    session = session_in(
        options.folder,
        options.count,
        options.seed,
        options.drift_V_per_s,
        options.shape,
        options.noise_V,
    )
    rows = list(felt_rows(session, options.theta_deg))
    print(f"{'':<28}{'n':>5}  {'bias':>9}  {'RMS':>8}     in 95 %  most |z|")
    print(*(s.line() for s in scores(rows)), sep="\n")


if __name__ == "__main__":
    main()
