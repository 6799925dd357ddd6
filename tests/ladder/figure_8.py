"""Fig. 8 on the paper's protocol, signals only: the α that the fits return, beside the α that was simulated.

    python tests/ladder/figure_8.py FOLDER [--only one|stick-slip] [--slopes N] [--whisks N] [--seed N] [--workers N]
        [--picture FILE]

FOLDER keeps sessions and results, and is taken up again where it stopped. Once with one friction coefficient and once
with a static one a quarter above the kinetic one (stick–slip). Prints a table, with times and sizes; the command's
own simulate, evaluate and `figures 8` make everything. --slopes and --whisks leave out part of the protocol; --picture
writes the last figure, small enough for a repository.
"""

import argparse
import sys
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tomli_w
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench import cli
from bench.rig.protocol import FOLDER as PROTOCOLS
from bench.runs import pooled

STATIC_BY_KINETIC = {"one": 1.0, "stick-slip": 1.25}
WIDTH_PX = 1400


@dataclass(frozen=True)
class Panel:
    """One panel: the friction angles that were simulated and the one that was fitted, with its sigma, in degrees."""

    title: str
    kinetic_deg: float
    static_deg: float
    alpha_deg: float
    sigma_deg: float
    whisks: int

    def line(self) -> str:
        return (
            f"{self.title:<20}{self.kinetic_deg:8.2f}{self.static_deg:8.2f}{self.alpha_deg:9.2f} ± {self.sigma_deg:.2f}"
            f"{self.alpha_deg - self.kinetic_deg:+11.2f}{self.whisks:8d}"
        )


def protocol(static_by_kinetic: float, slopes: int = 16, whisks: int = 10) -> dict:
    """The paper's protocol with a static coefficient above the kinetic one, or part of it."""
    tables = tomllib.loads((PROTOCOLS / "paper.toml").read_text(encoding="utf-8"))
    for table in tables["trials"]:
        if table.get("purpose") != "gauge":
            table["static_friction"] = table["friction"] * static_by_kinetic
            every = np.unique(np.linspace(0, len(table["beta_deg"]) - 1, slopes).round().astype(int))
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
    if code not in (cli.DONE, cli.DOUBTFUL):
        raise SystemExit(code)


def panels(folder: Path) -> list[Panel]:
    """What the fits of an evaluated session return, a panel each."""
    return [
        Panel(
            surface.title,
            *_angles_deg(folder / "session" / "trials", surface.name, surface.speed_deg_s),
            *np.degrees([surface.fit.alpha_rad, surface.fit.sigma_rad]),
            len(surface.felt),
        )
        for surface in pooled([folder / "out"])
    ]


def _angles_deg(trials: Path, surface: str, speed_deg_s: float) -> np.ndarray:
    """Friction angles, kinetic and static, of the whisks as they were simulated: mean over their truth files."""
    coefficients = []
    for trial in sorted(trials.iterdir()):
        stated = tomllib.loads((trial / "trial.toml").read_text(encoding="utf-8"))
        truth = tomllib.loads((trial / "truth.toml").read_text(encoding="utf-8"))
        if (stated["purpose"], stated["surface"], stated["speed_deg_s"]) == ("measure", surface, speed_deg_s):
            coefficients.append(np.array([truth["mu_kinetic"], truth["mu_static"]]).reshape(2, -1))
    return np.degrees(np.arctan(np.concatenate(coefficients, axis=1))).mean(axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
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
        tables, folder = protocol(STATIC_BY_KINETIC[name], options.slopes, options.whisks), options.folder / name
        took = record(folder, tables, options.seed, options.workers)
        lines += ["", f"{name}: simulate {took[0]:.0f} s, evaluate {took[1]:.0f} s, {took[2]:.0f} MB"]
        lines += [f"{'':<20}{'kinetic':>8}{'static':>8}{'fitted α':>16}{'less kin.':>11}{'whisks':>8}"]
        lines += [panel.line() for panel in panels(folder)]
    print("\n".join(lines))
    if options.picture:
        _require(cli.main(["figures", "8", str(folder / "out"), "--out", str(folder / "figures")]))
        picture = Image.open(folder / "figures" / "figure_8.png").convert("RGB")
        picture.thumbnail((WIDTH_PX, WIDTH_PX))
        picture.quantize(64).save(options.picture, optimize=True)


if __name__ == "__main__":
    main()
