"""Seconds that the evaluation of pictures takes, after a push or while it is recorded, and drawing."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.base.errors import BadInput
from bench.base.progress import count_parts
from bench.base.settings import Settings
from bench.records.trial_result import SeenTrial, TrialResult
from bench.report.trial_figures import TrialToDraw, draw_trial
from bench.session.signals import forward_strokes, read_signals
from bench.trials.seen import see_trial
from bench.trials.trial_frames import TrialInputs
from bench.trials.unit import Unit
from bench.workflows.live_push import ProcessorClock, RecordedPush, live_bench
from vision import UNKNOWN, Value
from vision.geometry import VisionSettings


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
    for unit in count_parts(units, f"{settings.seeing.name}, trials", len(units)):
        signals = read_signals(unit.trial)
        inputs = TrialInputs(unit.session, unit.trial, signals, unit.calibration, settings)
        seen.append(see_trial(inputs))
    return seen


def draw_all(results: Sequence[tuple[Unit, TrialResult]]) -> None:
    """Draw sensing planes and overlays into a folder that is removed."""
    with TemporaryDirectory() as folder:
        for unit, result in count_parts(results, "trials drawn", len(results)):
            alpha = (unit.settings.alpha_est_rad, "assumed")
            whisker = unit.session.whisker
            draw_trial(TrialToDraw(unit.trial, result, whisker, alpha, Path(folder)))


@dataclass(frozen=True)
class LiveTiming:
    """d_x of whisks that were evaluated while they were recorded, and what that took of one core.

    d_x_mm: a whisk each, NaN without a number. after_s: of the time from the last frame to the number, the
    mean over those that were played; busy_s: all work on them; both NaN where none was.
    """

    d_x_mm: list[Value]
    after_s: float
    busy_s: float


def play_all(units: Sequence[Unit], lead_s: float) -> LiveTiming:
    """Play all trials at their own speeds on a clock of processor time.

    lead_s: by so much the first pictures come before the push. A trial that cannot be evaluated while
    it is recorded has whisks without a number.
    """
    d_x_mm = []
    late_s = []
    busy_s = []
    for unit in count_parts(units, "trials played", len(units)):
        own = [UNKNOWN] * len(forward_strokes(read_signals(unit.trial)))
        try:
            recording = RecordedPush.read(unit.trial)
            settings = VisionSettings(clock_sigma_s=recording.times.clock_sigma_s)
            bench = live_bench(unit.session, unit.trial, unit.calibration, settings)
            for played in recording.play_all(bench, ProcessorClock, lead_s):
                own[played.truth.whisk] = played.truth.d_x_mm
                late_s.append(played.late_s)
                busy_s.append(played.clock.busy_s)
        except BadInput:
            pass
        d_x_mm += own
    if not late_s:
        return LiveTiming(d_x_mm, np.nan, np.nan)
    return LiveTiming(d_x_mm, float(np.mean(late_s)), float(np.mean(busy_s)))
