"""Fig. 8 on the paper's protocol, signals only: the α that the fits return, beside the α that was simulated.

    python tests/studies/accuracy/figure_8.py FOLDER [--only one|stick-slip] [--slopes N] [--whisks N] [--seed N] [--workers N]
        [--picture FILE]

The last columns say where the difference (less the kinetic α) comes from: "model", fitted to exact moments, slopes and
distances; "slope" and "d_x", their nominal values in the place of the true ones; "rest", gauges, touch and noise.

FOLDER keeps sessions and results, and is taken up again where it stopped. Once with one friction coefficient and once
with a static one a quarter above the kinetic one (stick–slip). Prints a table, with times and sizes; the command's
own simulate, evaluate and `figures 8` make everything. --slopes and --whisks leave out part of the protocol; --picture
writes the last figure, small enough for a repository.
"""

import argparse
import sys
import time
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomli_w
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.analyses.surfaces import FittedSurface
from bench.base.exit_codes import DONE, WITH_WARNINGS
from bench.commands import cli
from bench.records.trial_result import TrialResult
from bench.report.pooled import pooled
from bench.report.run_folder import read_results
from bench.rig.protocol import FOLDER as PROTOCOLS
from estimator.friction import Pushes, fit_alpha

STATIC_BY_KINETIC = {"one": 1.0, "stick-slip": 1.25}
WIDTH_PX = 1400


@dataclass(frozen=True)
class Whisk:
    """What was felt of a whisk at the pushing angle, what was nominal, and what the truth files say of it."""

    beta_deg: float
    d_x_mm: float
    felt_Nmm: np.ndarray
    true_beta_deg: float
    true_d_x_mm: float
    exact_Nmm: np.ndarray
    kinetic_deg: float
    static_deg: float


@dataclass(frozen=True)
class Panel:
    """One panel of the figure and its whisks."""

    surface: FittedSurface
    whisks: tuple[Whisk, ...]

    def line(self) -> str:
        alpha, sigma = np.degrees([self.surface.fit.alpha_rad, self.surface.fit.sigma_rad])
        kinetic, static = (
            np.mean([getattr(w, name) for w in self.whisks])
            for name in ("kinetic_deg", "static_deg")
        )
        by_slope = alpha - self.fitted_deg(beta_deg="true_beta_deg")
        by_distance = alpha - self.fitted_deg(d_x_mm="true_d_x_mm")
        by_model = self.fitted_deg("true_beta_deg", "true_d_x_mm", "exact_Nmm") - kinetic
        shares = (
            by_model,
            by_slope,
            by_distance,
            alpha - kinetic - by_model - by_slope - by_distance,
        )
        return (
            f"{self.surface.title:<18}{len(self.whisks):5d}{kinetic:8.2f}{static:8.2f}{alpha:8.2f} ± {sigma:.2f}"
            f"{alpha - kinetic:+8.2f}" + "".join(f"{share:+8.2f}" for share in shares)
        )

    def fitted_deg(self, beta_deg="beta_deg", d_x_mm="d_x_mm", moments="felt_Nmm") -> float:
        """α that fits with these fields of the whisks."""
        beta, d_x, m = (
            np.array([getattr(w, name) for w in self.whisks])
            for name in (beta_deg, d_x_mm, moments)
        )
        theta, beam = self.surface.theta_rad, self.surface.beam
        pushes = Pushes(np.radians(beta), *m.T, beam.as_cylinder_mm(d_x), theta, beam.C_Nmm2)
        return float(np.degrees(fit_alpha(pushes).alpha_rad))


HEAD = f"{'':<18}{'n':>5}{'kinetic':>8}{'static':>8}{'fitted':>15}" + "".join(
    f"{name:>8}" for name in ("less", "model", "slope", "d_x", "rest")
)


def protocol(static_by_kinetic: float, slopes: int = 16, whisks: int = 10) -> dict:
    """The paper's protocol with a static coefficient above the kinetic one, or part of it."""
    tables = tomllib.loads((PROTOCOLS / "paper.toml").read_text(encoding="utf-8"))
    for table in tables["trials"]:
        if table.get("purpose") != "gauge":
            table["static_friction"] = table["friction"] * static_by_kinetic
            every = np.unique(
                np.linspace(0, len(table["beta_deg"]) - 1, slopes).round().astype(int)
            )
            table["beta_deg"], table["whisks"] = [table["beta_deg"][k] for k in every], whisks
    return tables


def record(folder: Path, tables: dict, seed: int, workers: int) -> tuple[float, float, float]:
    """Simulate into folder/session and evaluate into folder/out. Seconds of each, and the session's megabytes."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "protocol.toml").write_text(tomli_w.dumps(tables), encoding="utf-8")
    session, out, many = str(folder / "session"), str(folder / "out"), ["--workers", str(workers)]
    begin = time.perf_counter()
    given = ["--protocol", str(folder / "protocol.toml"), "--signals-only", "--seed", str(seed)]
    _require(cli.main(["simulate", session, *given, *many]))
    simulated = time.perf_counter()
    _require(cli.main(["evaluate", session, "--out", out, *many]))
    megabytes = sum(f.stat().st_size for f in (folder / "session").rglob("*") if f.is_file()) / 1e6
    return simulated - begin, time.perf_counter() - simulated, megabytes


def _require(code: int) -> None:
    if code not in (DONE, WITH_WARNINGS):
        raise SystemExit(code)


def panels(folder: Path) -> list[Panel]:
    """An evaluated session's panels, each with its whisks."""
    found: dict[tuple, list[Whisk]] = {}
    for result in read_results(folder / "out"):
        trial = result.trial
        if trial.purpose == "measure":
            found.setdefault(trial.panel, []).extend(
                _whisks(result, folder / "session" / "trials" / trial.name)
            )
    return [Panel(s, tuple(found[s.panel])) for s in pooled([folder / "out"])]


def _whisks(result: TrialResult, folder: Path) -> Iterator[Whisk]:
    """The whisks of a trial beside its truth files."""
    truth = {
        k: np.atleast_1d(v)
        for k, v in tomllib.loads((folder / "truth.toml").read_text(encoding="utf-8")).items()
    }
    track = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    felt, trial = result.felt.whisks, result.trial
    for k, (whisk, frames) in enumerate(zip(felt, np.split(track, len(felt)))):
        theta_deg = frames["motor_deg"] - truth["touch_deg"][k]
        yield Whisk(
            trial.beta_nominal_deg,
            trial.d_x_nominal_mm,
            np.array([whisk.m_y_Nmm.value, whisk.m_z_Nmm.value]),
            truth["beta_deg"][k],
            truth["d_x_mm"][k],
            np.array(
                [np.interp(result.theta_deg, theta_deg, frames[m]) for m in ("m_y_Nmm", "m_z_Nmm")]
            ),
            *np.degrees(np.arctan([truth["mu_kinetic"][k], truth["mu_static"][k]])),
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", choices=tuple(STATIC_BY_KINETIC))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--slopes", type=int, default=16)
    parser.add_argument("--whisks", type=int, default=10)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    lines = []
    for name in [options.only] if options.only else STATIC_BY_KINETIC:
        tables, folder = (
            protocol(STATIC_BY_KINETIC[name], options.slopes, options.whisks),
            options.folder / name,
        )
        took = record(folder, tables, options.seed, options.workers)
        lines += [
            "",
            f"{name}: simulate {took[0]:.0f} s, evaluate {took[1]:.0f} s, {took[2]:.0f} MB",
        ]
        lines += [HEAD, *(panel.line() for panel in panels(folder))]
    print("\n".join(lines))
    if options.picture:
        _require(cli.main(["figures", "8", str(folder / "out"), "--out", str(folder / "figures")]))
        picture = Image.open(folder / "figures" / "figure_8.png").convert("RGB")
        picture.thumbnail((WIDTH_PX, WIDTH_PX))
        picture.quantize(64).save(options.picture, optimize=True)


if __name__ == "__main__":
    main()
