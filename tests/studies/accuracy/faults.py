"""Faults of a lab made one by one, and what a run says of each: exit code, status, warnings, and errors in stated sigmas.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/faults.py OUT [PART OF A NAME ...]

OUT keeps a sound run's cameras and gauges, by which a trial is evaluated alone (some 10 s a fault), and each fault's
session and results. A silent wrong number is marked: a status of nothing, exit 0, and an error above 3 sigma.
"""

import contextlib
import csv
import io
import shutil
import sys
import time
import tomllib
from pathlib import Path

import numpy as np

from bench.commands import cli
from tests.scenes.faults import FAULTS, TRIAL, WHOLE, WITH_BOARDS, alone, copy_of

SESSION = Path(__file__).resolve().parents[3] / "fixtures" / "small-session"
SILENT_SIGMAS = 3.0
AT_TOUCH = ("d_x_mm", "touch_deg", "beta_deg")


def errors(out: Path) -> dict[str, float]:
    """By quantity (estimate − truth)/sigma of the trial's whisk; empty where nothing was written."""
    path = out / "whisks.csv"
    if not path.is_file():
        return {}
    with path.open(newline="") as file:
        row = next((row for row in csv.DictReader(file) if row["trial"] == TRIAL), None)
    if row is None:
        return {}
    truth = tomllib.loads((SESSION / "trials" / TRIAL / "truth.toml").read_text())
    truth |= {"slip_mm": truth["slip_at_3deg_mm"], "touch_felt_deg": truth["touch_deg"]}
    known = {name: row[name] for name in (*AT_TOUCH, "slip_mm", "touch_felt_deg") if row[name]}
    return {
        name: (float(text) - truth[name]) / float(row[_sigma(name)]) for name, text in known.items()
    }


def _sigma(name: str) -> str:
    stem, _, unit = name.rpartition("_")
    return f"{stem}_sigma_{unit}"


def estimate(out: Path) -> str:
    """Error of (10) in per cent of the true distance, and in sigmas."""
    path = out / "estimates.csv"
    if not path.is_file():
        return ""
    true_mm = tomllib.loads((SESSION / "trials" / TRIAL / "truth.toml").read_text())["d_x_mm"]
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            if row["trial"] == TRIAL and row["estimator"] == "with_friction" and row["d_x_est_mm"]:
                error = float(row["d_x_est_mm"]) - true_mm
                return f"(10) {100 * error / true_mm:+.1f} % z {error / float(row['d_x_est_sigma_mm']):+.1f}"
    return "(10) none"


def run(*arguments) -> tuple[int, str, float]:
    """Exit code, what was printed, seconds."""
    text, start = io.StringIO(), time.perf_counter()
    with contextlib.redirect_stdout(text), contextlib.redirect_stderr(text):
        code = cli.main(list(map(str, arguments)))
    return code, text.getvalue(), time.perf_counter() - start


def prepared(folder: Path) -> tuple[Path, Path]:
    """Folder of the cameras and file of the gauges that a sound run calibrates."""
    made, gauges = folder / "reference" / "calibration", folder / "gauges" / "gauges.toml"
    if not (made / "cameras.toml").is_file():
        run("evaluate", SESSION, "--out", folder / "reference")
    if not gauges.is_file():
        run("calibrate", "gauges", SESSION, "--out", gauges)
    return made, gauges


def warning_lines(printed: str) -> list[str]:
    """Warnings; all lines where there is no verdict."""
    lines = printed.splitlines()
    if "Doubtful" not in lines:
        return [] if any(line.startswith("All of it: ") for line in lines) else lines
    after = lines[lines.index("Doubtful") + 1 :]
    return after[: after.index("") if "" in after else None]


def study(folder: Path, name: str) -> None:
    made, gauges = prepared(folder)
    place = folder / name.replace(" ", "_").replace("%", "percent").replace("/", "")
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    session, out = place / "session", place / "out"
    cameras = [] if name in WITH_BOARDS else [made / "cameras.toml", made / "cameras.npz"]
    copy_of(SESSION, session) if name in WHOLE else alone(SESSION, session, [*cameras, gauges])
    FAULTS[name](session)
    code, said, check_s = run("check", session)
    told = " | ".join(line.strip() for line in said.splitlines())
    print(f"== {name}\n   check {code} in {check_s:.1f} s: {told}")
    code, printed, seconds = run("evaluate", session, "--out", out)
    z = errors(out)
    warnings = warning_lines(printed)
    worst = max((abs(one) for one in z.values() if np.isfinite(one)), default=0.0)
    silent = "  SILENT" if code == 0 and worst > SILENT_SIGMAS else ""
    numbers = "  ".join(f"{quantity} z {one:+.1f}" for quantity, one in z.items())
    print(f"   evaluate {code} in {seconds:.0f} s: {numbers}  {estimate(out)}{silent}")
    for line in warnings:
        print(f"     {line.strip()}")
    head = printed.splitlines()[:2]
    print(f"   verdict: {head[1] if len(head) > 1 and code < 2 else ''}", flush=True)


def without_figures() -> None:
    """A fault costs 10 s so, 25 with them."""
    import bench.report.trial_figures
    from bench.analyses.analysis import Analysis

    def nothing(*_, **__) -> list:
        return []

    bench.report.trial_figures.draw_trials = nothing
    Analysis.draw = nothing


def main() -> None:
    without_figures()
    folder, *parts = sys.argv[1:]
    for name in FAULTS:
        if not parts or any(part in name for part in parts):
            study(Path(folder), name)


if __name__ == "__main__":
    main()
