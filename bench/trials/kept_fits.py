"""Fits of the pass that placed the rig, from which its trials are fitted again where the rig stands."""

from pathlib import Path

from bench.base.results import read_result
from bench.records.plain import from_plain
from bench.records.trial_result import SeenTrial
from bench.trials.unit import Unit
from vision import KeptFit


def kept_fits(unit: Unit) -> tuple[KeptFit, ...]:
    """Return the fits of a trial's whisks by the cameras as they stood before the rig was placed; none of
    a trial that did not place it, or whose whisks may be evaluated by several presets.
    """
    path, seen_hash = unit.placing_pass
    if not seen_hash or unit.settings.accuracy_mm is not None:
        return ()
    seen = seen_in(path, seen_hash)
    return seen.fits if seen else ()


def seen_in(path: Path, seen_hash: str) -> SeenTrial | None:
    """Return the seen half in a result's file that has these inputs; None without one."""
    kept = read_result(path)
    if not kept or kept.get("seen_hash") != seen_hash:
        return None
    return from_plain(SeenTrial, kept["seen"])
