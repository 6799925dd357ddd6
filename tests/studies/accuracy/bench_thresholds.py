"""What a threshold of bench or estimator moves in a whole evaluation, for each of some values.

    python tests/studies/accuracy/bench_thresholds.py gauges.fit _ROUNDS 1 2 3 10
    python tests/studies/accuracy/bench_thresholds.py estimator.onset GUARD_RAD 0.001 0.004

A line a value: by how much any number of whisks.csv, estimates.csv, friction.csv and base_moments.csv of
fixtures/small-session (SESSION after --session) changes at most from that with the present value, over its stated
sigma, or over itself where it has none; and how many texts change.
"""

import argparse
import importlib
import sys
import tempfile
from ast import literal_eval
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import Settings
from bench.workflows.session_evaluation import evaluate
from tests.studies.net import compare_table

SMALL = Path(__file__).resolve().parents[3] / "fixtures" / "small-session"
TABLES = ("whisks.csv", "estimates.csv", "friction.csv", "base_moments.csv")


def main() -> None:
    """Read the command line and print the lines."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("module")
    parser.add_argument("constant")
    parser.add_argument("values", nargs="+")
    parser.add_argument("--session", type=Path, default=SMALL)
    options = parser.parse_args()
    package = "" if options.module.startswith("estimator.") else "bench."
    module = importlib.import_module(package + options.module)
    settings = Settings(figures=False)
    with tempfile.TemporaryDirectory() as folder:
        usual = Path(folder) / "usual"
        evaluate(options.session, usual, settings, workers=0, announce=len)
        for number, value in enumerate(options.values):
            setattr(module, options.constant, literal_eval(value))
            out = Path(folder) / str(number)
            evaluate(options.session, out, settings, workers=0, announce=len)
            found = [compare_table(usual / name, out / name) for name in TABLES]
            moved = ", ".join(
                f"{name} {largest:.2g}" + (f" ({texts} texts)" if texts else "")
                for name, (largest, texts) in zip(TABLES, found)
            )
            print(f"{value:>12}   {moved}", flush=True)


if __name__ == "__main__":
    main()
