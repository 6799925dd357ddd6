"""Drift of the channels over each free stroke of a trial, kept with the calibration: a session of
many trials asks for all of them at each run.
"""

from dataclasses import dataclass

from bench.base.results import hash_of, hash_of_code, read_result, write_result
from bench.gauges.drift import FreeSlope, force_slope, free_slope
from bench.gauges.felt import strokes_of
from bench.records.plain import from_plain, to_plain
from bench.session.signals import read_signals
from bench.trials.unit import Unit

_CODE = (
    "estimator",
    "bench/gauges",
    "bench/session",
    "bench/records",
    "bench/trials/free_strokes.py",
)


@dataclass(frozen=True)
class FreeStrokes:
    """Slopes of each stroke that has a touch: of the gauges' channels, and of the load cell's
    forces, where there is one.
    """

    channels: tuple[FreeSlope, ...]
    forces: tuple[FreeSlope, ...]


def free_strokes(unit: Unit) -> FreeStrokes:
    """Return the slopes of a trial's free strokes, and keep them."""
    path = unit.out / "calibration" / "free" / f"{unit.trial.name}.json"
    key = hash_of(hash_of_code(_CODE), unit.files, unit.trial)
    kept = read_result(path)
    if not kept or kept.get("hash") != key:
        kept = {"hash": key, "free": to_plain(_measured(unit))}
        write_result(path, kept)
    return from_plain(FreeStrokes, kept["free"])


def _measured(unit: Unit) -> FreeStrokes:
    """Measure the slopes of a trial's free strokes."""
    strokes = strokes_of(read_signals(unit.trial), unit.trial, unit.settings)
    channels = filter(None, map(free_slope, strokes))
    forces = filter(None, map(force_slope, strokes))
    return FreeStrokes(tuple(channels), tuple(forces))
