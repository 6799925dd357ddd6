"""What the paper's rivals that give no distance are worth: profiles of sweeps, contours by touch alone, a microphone.

    python tests/studies/accuracy/rival_shapes.py [--count 4] [--seed 0]

The built-in protocols `sweep`, `ring` and `tap`, simulated with fresh seeds and evaluated from their files: errors
against the rig's truth, and how many 95 % intervals hold. Of a sweep by object, from 3° on; of a ring by the number of
whiskers that serve; of taps by speed.
"""

import argparse
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.analyses.continuous_profile import PROFILE, interpolated_mm
from bench.analyses.microphone import MICROPHONE
from bench.array.contour import CONTOUR
from bench.base.settings import Settings
from bench.rig.simulation import simulate
from bench.workflows.session_evaluation import evaluate
from estimator.uncertainty import Z_95

LEAST_THETA_DEG = 3.0


def evaluated(protocol: str, seed: int, folder: Path) -> tuple[Path, Path]:
    """Return the session of a protocol and the folder of its evaluation."""
    session = simulate(folder / f"{protocol}{seed}", protocol=protocol, seed=seed)
    out = folder / f"{protocol}{seed}-out"
    evaluate(session, out, Settings(figures=False), workers=0, announce=lambda text: None)
    return session, out


def profile_errors(session: Path, out: Path) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield the object, error and sigma (3,) of each contact from 3° on."""
    for row in PROFILE.read(out):
        trial = str(row["trial"])
        truth = np.genfromtxt(session / "trials" / trial / "truth.csv", delimiter=",", names=True)
        touching = truth[truth["contact"] == 1]
        points_mm = np.stack([touching[name] for name in ("x_mm", "y_mm", "z_mm")], axis=-1)
        true_mm = interpolated_mm(row["motor_deg"], touching["motor_deg"], points_mm)
        if row["theta_deg"] >= LEAST_THETA_DEG:
            found_mm = [row[f"{name}_est_mm"] for name in "xyz"]
            sigma_mm = [row[f"{name}_est_sigma_mm"] for name in "xyz"]
            yield trial.split("_")[0], np.array(found_mm) - true_mm, np.array(sigma_mm)


def contour_lines(out: Path) -> Iterator[str]:
    """Yield a line a trial of a ring."""
    table = CONTOUR.read(out)
    for trial in dict.fromkeys(table["trial"].tolist()):
        mine = table[table["trial"] == trial]
        held = np.abs(mine["outside_mm"]) < Z_95 * mine["across_sigma_mm"]
        yield (
            f"{trial}: {len(mine)} touches, resolution {mine['resolution_mm'].mean():.2f} mm, middles off by "
            f"{rms(mine['outside_mm']):.4f} (± {rms(mine['across_sigma_mm']):.4f}) mm, {held.sum()} hold, corners by "
            f"{rms(mine['corner_outside_mm']):.3f} mm"
        )


def touch_errors(session: Path, out: Path) -> Iterator[tuple[float, float, float]]:
    """Yield speed, °/s, error and sigma of the heard touch, ms; NaN where nothing is heard."""
    for row in MICROPHONE.read(out):
        truth = tomllib.loads((session / "trials" / str(row["trial"]) / "truth.toml").read_text())
        ms = 1e3 / row["speed_deg_s"]
        late = (row["touch_heard_deg"] - truth["touch_deg"]) * ms
        yield row["speed_deg_s"], late, row["touch_heard_sigma_deg"] * ms


def rms(values: np.ndarray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def print_profiles(runs: Sequence[tuple[Path, Path]]) -> None:
    """Print a line an object."""
    found = [one for session, out in runs for one in profile_errors(session, out)]
    for name in dict.fromkeys(one[0] for one in found):
        errors = np.array([error for own, error, _ in found if own == name])
        sigmas = np.array([sigma for own, _, sigma in found if own == name])
        z = errors / sigmas
        off = ", ".join(f"{rms(e):.3f} (± {rms(s):.3f})" for e, s in zip(errors.T, sigmas.T))
        held = 100 * np.mean(np.abs(z) < Z_95)
        print(f"{name}: {len(errors)} contacts, x, y, z off by {off} mm, {held:.0f} % hold")


def print_touches(runs: Sequence[tuple[Path, Path]]) -> None:
    """Print a line a speed."""
    found = np.array([one for session, out in runs for one in touch_errors(session, out)])
    for speed in np.unique(found[:, 0]):
        _, late, sigma = found[found[:, 0] == speed].T
        heard = np.isfinite(late)
        held = np.sum(np.abs(late[heard]) < Z_95 * sigma[heard])
        print(
            f"{speed:g}°/s: {np.sum(~heard)} of {len(late)} missed, late by {np.mean(late[heard]):+.2f} ms, scatter "
            f"{np.std(late[heard]):.2f} (± {rms(sigma[heard]):.2f}) ms, {held} of {heard.sum()} hold"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.count)
    with TemporaryDirectory() as name:
        folder = Path(name)
        print_profiles([evaluated("sweep", seed, folder) for seed in seeds])
        for seed in seeds:
            print(*contour_lines(evaluated("ring", seed, folder)[1]), sep="\n")
        print_touches([evaluated("tap", seed, folder) for seed in seeds])


if __name__ == "__main__":
    main()
