"""Fits of the pass that placed the rig, from which its trials are fitted again where the rig stands."""

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
    kept = read_result(path)
    if not kept or kept.get("seen_hash") != seen_hash:
        return ()
    return from_plain(SeenTrial, kept["seen"]).fits
