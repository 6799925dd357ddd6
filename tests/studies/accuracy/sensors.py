"""Table I with numbers: what each sensor's distance is worth, by slope and friction, on the same simulated whisks.

    python tests/studies/accuracy/sensors.py [--count 600] [--seed 0] [--table] [--figure PICTURE.png]

Every whisk goes all the way: exact mechanics, signals with noise, felt touch, estimate. Drawn anew are d_x 30 to 80 mm,
θ 2 to 4°, the bar (to 6 mm, leaning by N(0, 5°)), its slope 0 to 80°, α as (10)'s α_est says of it, and the sensors'
noise, a half to twice as stated: gauges 6.4 mV (0.06 N·mm), load cell 3 mN, a sample. Printed: how often each 95 %
interval holds the true d_x, and the largest |z| of what has no status. What touch alone says holds by its making: of
bars anywhere along the whisker 95 % lie in the middle 95 % of it.

--table: instead, on a grid of slope and friction with the noise as stated, α_est = 10 ± 4°, θ = 3°: RMS error and
stated sigma (RMS) of each, in % of d_x, beside the share of whisks with a distance. --figure: the table drawn.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.drawing import label_of, save, style
from bench.base.settings import Settings
from bench.gauges.drift import allow_drift, drift_rate
from bench.gauges.felt import FeltStroke, strokes_of
from bench.gauges.matrix import GaugeMatrix
from bench.records.trial_result import EstimateRow
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import (
    GaugesTable,
    LoadCellTable,
    MotorTable,
    PicturesTable,
    TrialTable,
    WhiskerTable,
)
from bench.rig.recording import Recording
from bench.session.signals import Signals
from bench.trials.estimates import run_estimators
from bench.trials.readout import Readout, whisk_at
from bench.trials.sensor_readings import with_others
from estimator.beam import Beam
from estimator.builtin import no_slip, with_friction
from estimator.sensors import SENSORS
from estimator.whisk import Whisk
from tests.studies.accuracy.estimates_montecarlo import (
    ALPHA_EST_DEG,
    ALPHA_SIGMA_DEG,
    DRAWN_ALPHA_DEG,
)

NAMED = {
    "touch_alone": SENSORS["touch_alone"],
    "no_slip": no_slip,
    "moment_rate": SENSORS["moment_rate"],
    "with_friction": with_friction,
    "force_and_moment": SENSORS["force_and_moment"],
}
TITLES = {
    "touch_alone": "touch",
    "no_slip": "angle, m_z (2)",
    "moment_rate": "rate of m (1), (10)",
    "with_friction": "angle, m (10)",
    "force_and_moment": "force, moment",
}
SLOPES_DEG, ALPHAS_DEG, WHISKS = (0.0, 20.0, 40.0, 60.0, 75.0), (3.0, 10.0, 20.0), 12
LENGTH_MM, TILT_SIGMA_DEG = 100.0, 5.0
RADII_MM = (np.nan, 0.5)  # of the bar nothing is told
BEAM = Beam.from_modulus(60.0, 1.0, LENGTH_MM)
_ENDS = ("d_x_est_low_mm", "d_x_est_high_mm")


@dataclass(frozen=True)
class Drawn:
    """One whisk to be made: slope, friction, distance, lean, the bar's diameter, noise in parts of the stated, θ."""

    beta_deg: float
    alpha_deg: float
    d_x_mm: float
    psi_deg: float
    bar_mm: float
    noise: float = 1.0
    theta_deg: float = 3.0


def drawn(rng: np.random.Generator) -> Drawn:
    """One of the whisks over which intervals are to hold."""
    alpha = float(DRAWN_ALPHA_DEG.rvs(random_state=rng))
    psi, noise = TILT_SIGMA_DEG * rng.normal(), 2.0 ** rng.uniform(-1.0, 1.0)
    place = rng.uniform(0.0, 80.0), alpha, rng.uniform(30.0, 80.0), psi, rng.uniform(1.0, 6.0)
    return Drawn(*place, noise, rng.uniform(2.0, 4.0))


def on_grid(rng: np.random.Generator) -> Iterator[Drawn]:
    """Of the table."""
    for alpha in ALPHAS_DEG:
        for beta in SLOPES_DEG:
            for _ in range(WHISKS):
                yield Drawn(
                    beta, alpha, rng.uniform(30.0, 80.0), TILT_SIGMA_DEG * rng.normal(), 6.0
                )


def recorded(one: Drawn, rng: np.random.Generator) -> tuple[float, FeltStroke] | None:
    """(true d_x, the stroke as felt), None where the whisker finds no hold."""
    place = {
        "beta_deg": one.beta_deg,
        "psi_deg": one.psi_deg,
        "d_x_mm": one.d_x_mm,
        "bar_diameter_mm": one.bar_mm,
    }
    mu, exactly = (
        float(np.tan(np.radians(one.alpha_deg))),
        {"beta_scatter_deg": 0.0, "d_x_scatter_mm": 0.0},
    )
    table = TrialTable(**place, friction=mu, **exactly)
    plain = GaugesTable(
        matrix_Nmm_per_V=((10.0, 0.0), (0.0, 10.0)), noise_V=0.0064 * one.noise, known=True
    )
    protocol = Protocol(
        trials=[table],
        whisker=WhiskerTable(length_mm=LENGTH_MM),
        gauges=plain,
        load_cell=LoadCellTable(noise_N=0.003 * one.noise),
        motor=MotorTable(after_deg=5.0),
        pictures=PicturesTable(step_deg=3.0),
    )
    return recorded_stroke(protocol, rng)


def recorded_stroke(
    protocol: Protocol, rng: np.random.Generator
) -> tuple[float, FeltStroke] | None:
    """(true d_x, the stroke as felt) of a protocol's one push; None where the whisker finds no hold."""
    (run,) = protocol.runs()
    try:
        recording = Recording.make(run, rng)
    except ArithmeticError:
        return None
    time, motor_deg, y, z, *forces = recording.signals.T
    signals = Signals(time, np.radians(motor_deg), y, z, "V", forces_N=np.stack(forces, axis=1))
    (stroke,) = strokes_of(signals, run, Settings())
    return recording.touch.d_x_mm, stroke


def felt_whisk(stroke: FeltStroke, theta_rad: float) -> Whisk | None:
    """The whisk of a stroke at a pushing angle; None where no touch is felt. Nothing drifts, and the bench is told so."""
    readout = Readout(GaugeMatrix(10.0 * np.eye(2)))
    touch = allow_drift(stroke.touch, drift_rate([]), stroke.speed_rad_s)
    whisk = touch.status or whisk_at(stroke, readout, touch, BEAM, theta_rad)
    if isinstance(whisk, str):
        return None
    return with_others(whisk, stroke, readout, touch, force_drift_rate=np.zeros(3), scale_sigma=0.0)


def answered(one: Drawn, stroke: FeltStroke, settings: Settings) -> dict[str, EstimateRow]:
    """What each sensor says; nothing where no touch is felt."""
    whisk = felt_whisk(stroke, np.radians(one.theta_deg))
    if whisk is None:
        return {}
    return {row.estimator: row for row in run_estimators(whisk, NAMED, settings, RADII_MM)}


def sample(wanted: Iterator[Drawn], settings: Settings, rng: np.random.Generator) -> list[tuple]:
    """(drawn, true d_x, answers by name) of the whisks that found hold and were felt."""
    found = []
    for one in wanted:
        made = recorded(one, rng)
        said = {} if made is None else answered(one, made[1], settings)
        if said:
            found.append((one, made[0], said))
    return found


def coverage_lines(found: list[tuple]) -> Iterator[str]:
    """How often intervals hold."""
    truths = np.array([truth for _, truth, _ in found])
    for name in NAMED:
        rows = [said[name] for *_, said in found]
        low, high = (np.array([getattr(row, end) for row in rows]) for end in _ENDS)
        z = np.array([row.d_x_est_mm.value for row in rows]) - truths
        z = z / [row.d_x_est_mm.sigma for row in rows]
        plain = np.array([not row.status for row in rows])
        yield (
            f"{TITLES[name]:<22}{len(rows)} whisks, 95 % intervals hold in "
            f"{100 * np.mean((low <= truths) & (truths <= high)):.1f} %; largest |z| without a status "
            f"{np.nanmax(np.abs(z[plain])):.2f}; {np.count_nonzero(~plain)} with a status"
        )


def of_cells(found: list[tuple]) -> dict[tuple[float, float], dict[str, np.ndarray]]:
    """By (α, β) and sensor: (RMS error, RMS sigma, share with a distance), %."""
    cells: dict[tuple, list] = {}
    for one, truth, said in found:
        cells.setdefault((one.alpha_deg, one.beta_deg), []).append((truth, said))
    return {key: {name: _worth(name, whisks) for name in NAMED} for key, whisks in cells.items()}


def _worth(name: str, whisks: list[tuple]) -> np.ndarray:
    table = np.array(
        [
            [said[name].d_x_est_mm.value / truth - 1, said[name].d_x_est_mm.sigma / truth]
            for truth, said in whisks
        ]
    )
    known = table[np.isfinite(table).all(axis=1)]
    rms = np.sqrt(np.mean(known**2, axis=0)) if len(known) else np.full(2, np.nan)
    return 100.0 * np.append(rms, len(known) / len(table))


def table_lines(cells: dict) -> Iterator[str]:
    """A row of the document a cell."""
    yield "| α | β | " + " | ".join(TITLES.values()) + " |"
    yield "|---" * (2 + len(TITLES)) + "|"
    for (alpha, beta), worth in cells.items():
        said = (
            f"{error:.1f} (± {sigma:.1f})" + (f", {share:.0f} %" if share < 100 else "")
            for error, sigma, share in worth.values()
        )
        yield f"| {alpha:g}° | {beta:g}° | " + " | ".join(said) + " |"


def draw(cells: dict, path: Path) -> None:
    """RMS error over the slope, a panel an α."""
    from matplotlib.figure import Figure

    with style():
        figure = Figure(figsize=(9.0, 3.2), layout="constrained")
        panels = figure.subplots(1, len(ALPHAS_DEG), sharey=True)
        for panel, alpha in zip(panels, ALPHAS_DEG):
            for number, name in enumerate(NAMED):
                mine = [worth[name][0] for (one, _), worth in cells.items() if one == alpha]
                panel.plot(SLOPES_DEG, mine, "o-", ms=3, color=f"C{number}", label=label_of(name))
            panel.set(yscale="log", xlabel="slope β, °", title=f"α = {alpha:g}°", ylim=(0.1, 300.0))
        panels[0].set_ylabel("error of d$_x$, RMS, %")
        figure.legend(
            *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(NAMED)
        )
        save(figure, path, "tests/studies/accuracy/sensors.py")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--table", action="store_true")
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    if not (options.table or options.figure):
        settings = Settings(alpha_est_deg=ALPHA_EST_DEG, alpha_est_sigma_deg=ALPHA_SIGMA_DEG)
        found = sample((drawn(rng) for _ in range(options.count)), settings, rng)
        print(*coverage_lines(found), sep="\n")
        return
    cells = of_cells(
        sample(on_grid(rng), Settings(alpha_est_deg=10.0, alpha_est_sigma_deg=4.0), rng)
    )
    print(*table_lines(cells), sep="\n")
    if options.figure:
        draw(cells, options.figure)


if __name__ == "__main__":
    main()
