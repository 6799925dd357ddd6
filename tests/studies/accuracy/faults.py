"""Faults of a lab made one by one, and what a run says of each: exit code, status, warnings, and errors in stated sigmas.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/faults.py OUT [PART OF A NAME ...]
        [--session SESSION] [--entered]

OUT keeps a sound run's cameras and gauges, by which a trial is evaluated alone (some 10 s a fault), and each fault's
session and results. --session: another with a trial b60_4 and that board. --entered: the faults that a lab enters or
overlooks (`ENTERED_WRONGLY`). Last comes a table: each fault is refused, told (with the codes of the run's warnings) or
priced (worst error in its stated sigmas); a silent wrong number is marked: exit 0, and an error above 3 sigma.
"""

import argparse
import contextlib
import csv
import io
import itertools
import json
import shutil
import time
import tomllib
from pathlib import Path

import numpy as np

from bench.commands import cli
from tests.scenes.faults import ENTERED_WRONGLY, FAULTS, TRIAL, WHOLE, WITH_BOARDS, alone, copy_of

SMALL_SESSION = Path(__file__).resolve().parents[3] / "fixtures" / "small-session"
SILENT_SIGMAS = 3.0
AT_TOUCH = ("d_x_mm", "touch_deg", "beta_deg")


def errors(out: Path, truth: dict[str, float]) -> dict[str, float]:
    """By quantity (estimate − truth)/sigma of the trial's whisk; empty where nothing was written."""
    path = out / "whisks.csv"
    if not path.is_file():
        return {}
    with path.open(newline="") as file:
        row = next((row for row in csv.DictReader(file) if row["trial"] == TRIAL), None)
    if row is None:
        return {}
    truth = truth | {"slip_mm": truth["slip_at_3deg_mm"], "touch_felt_deg": truth["touch_deg"]}
    known = {name: row[name] for name in (*AT_TOUCH, "slip_mm", "touch_felt_deg") if row[name]}
    return {
        name: (float(text) - truth[name]) / float(row[_sigma(name)]) for name, text in known.items()
    }


def _sigma(name: str) -> str:
    stem, _, unit = name.rpartition("_")
    return f"{stem}_sigma_{unit}"


def estimate(out: Path, true_mm: float) -> str:
    """Error of (10) in per cent of the true distance, and in sigmas."""
    path = out / "estimates.csv"
    if not path.is_file():
        return ""
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


def prepared(folder: Path, sound: Path) -> tuple[Path, Path]:
    """Folder of the cameras and file of the gauges that a sound run calibrates."""
    made, gauges = folder / "reference" / "calibration", folder / "gauges" / "gauges.toml"
    if not (made / "cameras.toml").is_file():
        run("evaluate", sound, "--out", folder / "reference")
    if not gauges.is_file():
        run("calibrate", "gauges", sound, "--out", gauges)
    return made, gauges


def warning_lines(printed: str) -> list[str]:
    """Warnings; all lines where there is no verdict."""
    lines = printed.splitlines()
    if "Warnings" not in lines:
        return [] if any(line.startswith("All of it: ") for line in lines) else lines
    after = lines[lines.index("Warnings") + 1 :]
    return after[: after.index("") if "" in after else None]


def outcome(code: int, z: dict[str, float], out: Path, printed: str) -> str:
    """What a run makes of a fault: refused, told or priced; SILENT where none of these."""
    if code == 2:
        return f"refused: {printed.strip().splitlines()[-1]}"
    worst = max(z, key=lambda name: abs(z[name]), default="")
    price = f"worst z {z[worst]:+.1f} ({worst})" if worst else "no truth"
    if code == 1:
        codes = json.loads((out / "run.json").read_text())["warning_codes"]
        named = ", ".join(dict.fromkeys(itertools.chain.from_iterable(codes)))
        return f"told: {named}; {price}"
    if worst and abs(z[worst]) > SILENT_SIGMAS:
        return f"SILENT: {price}"
    return f"priced: {price}"


def study(folder: Path, sound: Path, name: str) -> str:
    """Print what check and evaluate say of a session with a fault; return its outcome."""
    made, gauges = prepared(folder, sound)
    place = folder / name.replace(" ", "_").replace("%", "percent").replace("/", "")
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    session, out = place / "session", place / "out"
    cameras = [] if name in WITH_BOARDS else [made / "cameras.toml", made / "cameras.npz"]
    copy_of(sound, session) if name in WHOLE else alone(sound, session, [*cameras, gauges])
    FAULTS[name](session)
    code, said, check_s = run("check", session)
    told = " | ".join(line.strip() for line in said.splitlines())
    print(f"== {name}\n   check {code} in {check_s:.1f} s: {told}")
    code, printed, seconds = run("evaluate", session, "--out", out)
    truth = tomllib.loads((sound / "trials" / TRIAL / "truth.toml").read_text())
    z = {quantity: one for quantity, one in errors(out, truth).items() if np.isfinite(one)}
    numbers = "  ".join(f"{quantity} z {one:+.1f}" for quantity, one in z.items())
    print(f"   evaluate {code} in {seconds:.0f} s: {numbers}  {estimate(out, truth['d_x_mm'])}")
    for line in warning_lines(printed):
        print(f"     {line.strip()}")
    head = printed.splitlines()[:2]
    print(f"   verdict: {head[1] if len(head) > 1 and code < 2 else ''}", flush=True)
    return outcome(code, z, out, printed)


def without_figures() -> None:
    """A fault costs 10 s so, 25 with them."""
    import bench.report.trial_figures
    from bench.analyses.analysis import Analysis

    def nothing(*_, **__) -> list:
        return []

    bench.report.trial_figures.draw_trials = nothing
    Analysis.draw = nothing


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, metavar="OUT")
    parser.add_argument("parts", nargs="*", metavar="PART")
    parser.add_argument("--session", type=Path, default=SMALL_SESSION)
    parser.add_argument("--entered", action="store_true")
    options = parser.parse_args()
    without_figures()
    outcomes = {}
    for name in ENTERED_WRONGLY if options.entered else FAULTS:
        if not options.parts or any(part in name for part in options.parts):
            outcomes[name] = study(options.folder, options.session, name)
    print()
    for name, made in outcomes.items():
        print(f"{name:32s} {made}")


if __name__ == "__main__":
    main()
