"""What bringing whisks together costs against their number, step by step, and the exponents that fit.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/speed/whisks.py [OUT]

OUT: an evaluated run whose trials lie on few surfaces; by default fixtures/bring/stage is evaluated first. Its results
are taken again and again under other names, so that a panel has 80 to 640 whisks. Seconds of processor of each step after
the trials are evaluated: (10) with the session's friction and fits without each whisk, each analysis with its rows, and
the tables. A step above 0.1 s that grows faster than n^1.15 is marked.
"""

import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.analyses.catalogue import ANALYSES
from bench.base.settings import Settings
from bench.records.trial_result import TrialResult
from bench.report.evaluation import evaluated_run
from bench.report.run_folder import read_results
from bench.report.whisk_rows import write_tables
from bench.session.session import Session, load_session
from bench.workflows.session_evaluation import evaluate

STAGE = Path(__file__).resolve().parents[3] / "fixtures" / "bring" / "stage"
WHISKS = (80, 160, 320, 640)
LEAST_S = 0.1
MOST_EXPONENT = 1.15  # what chance of a clock makes of 1, over a factor of eight


def copies(results: Sequence[TrialResult], whisks: int) -> list[TrialResult]:
    """Return the trials again and again, until they have about so many whisks."""
    own = sum(len(result.seen.whisks) for result in results)
    made = []
    for number in range(round(whisks / own)):
        for result in results:
            name = f"{result.trial.name}_{number}"
            made.append(replace(result, trial=replace(result.trial, name=name)))
    return made


def steps(results: list[TrialResult], session: Session) -> Iterator[tuple[str, float]]:
    """Yield each step and its seconds."""
    settings = Settings(figures=False)
    begin = time.process_time()
    run = evaluated_run(results, session.whisker, settings)
    yield "fits, (10) again", time.process_time() - begin
    for analysis in ANALYSES:
        if not analysis.needs_session:
            name = type(analysis).__name__
            yield name, seconds(lambda one=analysis: list(one.rows(run.found(one)).values()))
    with tempfile.TemporaryDirectory() as folder:
        yield "tables", seconds(lambda: write_tables(Path(folder), run.results))


def seconds(call: Callable) -> float:
    """Return the processor time of a call."""
    begin = time.process_time()
    call()
    return time.process_time() - begin


def line(name: str, counts: Sequence[float], spent_s: Sequence[float], unit: str = "s") -> str:
    """Return the line of a step: seconds, or another unit, against a number, and the exponent."""
    exponent = np.polyfit(np.log(counts), np.log(np.maximum(spent_s, 1e-4)), 1)[0]
    costs = ", ".join(f"{count:g}: {cost:.2f} {unit}" for count, cost in zip(counts, spent_s))
    mark = "  FASTER" if exponent > MOST_EXPONENT and spent_s[-1] > LEAST_S else ""
    return f"{name:<26}{costs}  (cost ∝ n^{exponent:.2f}){mark}"


def results_of_fixture() -> list[TrialResult]:
    """Return the results of STAGE."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        evaluate(STAGE, out, Settings(figures=False), announce=lambda _: None)
        return read_results(out)


def measured(results: Sequence[TrialResult]) -> tuple[list[int], dict[str, list[float]]]:
    """Return numbers of whisks, and of each step its seconds at each."""
    session = load_session(STAGE)
    counts = []
    spent: dict[str, list[float]] = {}
    for wanted in WHISKS:
        made = copies(results, wanted)
        counts.append(sum(len(result.seen.whisks) for result in made))
        for name, cost_s in steps(made, session):
            spent.setdefault(name, []).append(cost_s)
    return counts, spent


def main() -> None:
    """Print a line a step."""
    results = read_results(Path(sys.argv[1])) if sys.argv[1:] else results_of_fixture()
    counts, spent = measured(results)
    for name, of_step in spent.items():
        print(line(name, counts, of_step))
    print(line("all", counts, np.sum(list(spent.values()), axis=0)))


if __name__ == "__main__":
    main()
