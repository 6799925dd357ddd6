"""For what the processor works while a session is evaluated: shares by purpose.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/speed/purposes.py SESSION OUT

Evaluates the session into OUT, which should be empty, in this process. Every few milliseconds of processor time the
stack is looked at: of the purposes below, the first one of which a function is on the stack has the time. Prints a row
a purpose: seconds, and share of all, per cent; "else" is what none of them has.
"""

import collections
import signal
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import FrameType

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))

OURS = (f"{ROOT}/bench/", f"{ROOT}/vision/")
INTERVAL_S = 0.004
ELSE = "else"
# By purpose, the functions that serve it alone. Those above have what both would have.
PURPOSES: Mapping[str, tuple[str, ...]] = {
    "imports": ("<module>",),
    "figures": ("draw_trials", "figure", "svg_of"),
    "page, record, summary": ("write_report", "record_of", "write_record", "summary_of"),
    "tables": ("write_tables", "write", "found"),
    "bars' diameters against the board": ("check_scale",),
    "cameras that moved, exposure": ("still_scene",),
    "decoding": ("read_picture", "read_frames"),
    "cameras by the boards": ("calibrate_session",),
    "bar: search": ("find_object",),
    "bar: its lines": ("object_points",),
    "bar and wire: width, end": ("measure_relative_widths", "wire_widths", "wire_ends"),
    "wire: first pass": ("coarse_shapes",),
    "wire: traced": ("wire_points",),
    "fits": ("fit_lines",),
    "last question": ("best_explanation", "_weigh_rivals"),
    "checks, rows of the truth": ("fitted_truth",),
    "estimators, gauges": ("feel_trial", "with_gauges"),
}


def main() -> None:
    session, out = map(Path, sys.argv[1:])
    from bench.base.settings import Settings  # counted, as all that it imports
    from bench.workflows.session_evaluation import evaluate

    counts = sampled(lambda: evaluate(session, out, Settings(), workers=0, verdict_alone=True))
    total = sum(counts.values())
    print("| for | seconds | share |\n|---|---|---|")
    for purpose in (*PURPOSES, ELSE):
        share = counts[purpose] / total
        print(f"| {purpose} | {INTERVAL_S * counts[purpose]:.2f} | {100.0 * share:.0f} % |")


def sampled(call: Callable[[], object]) -> collections.Counter[str]:
    """Return how often each purpose was met while a function ran."""
    counts = collections.Counter()

    def look(number: int, frame: FrameType | None) -> None:
        """Count the purpose of what runs."""
        counts[purpose_of(frame)] += 1

    signal.signal(signal.SIGPROF, look)
    signal.setitimer(signal.ITIMER_PROF, INTERVAL_S, INTERVAL_S)
    call()
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    return counts


def purpose_of(frame: FrameType | None) -> str:
    """Return the first purpose of which a function of the project is on the stack of a frame."""
    running = set()
    while frame is not None:
        if frame.f_code.co_filename.startswith(OURS):
            running.add(frame.f_code.co_name)
        frame = frame.f_back
    for purpose, functions in PURPOSES.items():
        if not running.isdisjoint(functions):
            return purpose
    return ELSE


if __name__ == "__main__":
    main()
