"""Seconds that the evaluation of pictures and the drawing of figures take."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.base.settings import Settings
from bench.records.trial_result import SeenTrial, TrialResult
from bench.report.trial_figures import TrialToDraw, draw_trial
from bench.session.signals import read_signals
from bench.trials.seen import see_trial
from bench.trials.unit import Unit


@dataclass(frozen=True)
class Timing:
    """Least seconds of processor and of wall time that some work took."""

    cpu_s: float
    wall_s: float


def time_work(work: Callable[[], list | None], repeats: int) -> tuple[list | None, Timing]:
    """Return what the work gives, and the least seconds that it took."""
    cpu_s = []
    wall_s = []
    for _ in range(repeats):
        cpu_start = time.process_time()
        wall_start = time.perf_counter()
        made = work()
        cpu_s.append(time.process_time() - cpu_start)
        wall_s.append(time.perf_counter() - wall_start)
    return made, Timing(min(cpu_s), min(wall_s))


def see_all(units: Sequence[Unit], settings: Settings) -> list[SeenTrial]:
    """Evaluate the pictures of all trials."""
    seen = []
    for unit in units:
        signals = read_signals(unit.trial)
        seen.append(see_trial(unit.session, unit.trial, signals, unit.calibration, settings))
    return seen


def draw_all(results: Sequence[tuple[Unit, TrialResult]]) -> None:
    """Draw sensing planes and overlays into a folder that is removed."""
    with TemporaryDirectory() as folder:
        for unit, result in results:
            alpha = (unit.settings.alpha_est_rad, "assumed")
            whisker = unit.session.whisker
            draw_trial(TrialToDraw(unit.trial, result, whisker, alpha, Path(folder)))
