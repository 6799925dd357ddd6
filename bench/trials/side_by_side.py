"""Whiskers of an array in each other's pictures: coarse passes that locate each wire before any is
measured.

At first all are taken to be straight and to turn with their motors. Then each is located where the
others are not, several times: each pass masks the others at the places of the pass before.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.base.results import SEEING, hash_of, hash_of_code, hash_of_files
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.cameras.session_cameras import at_base, calibrate_session
from bench.session.frame_times import frame_times
from bench.session.session import Session
from bench.session.signals import read_signals
from bench.session.trial import Trial
from bench.trials.of_session import first_units
from bench.trials.other_wires import has_lines, lines_in, write_lines
from bench.trials.trial_frames import TrialFrames
from bench.trials.unit import Unit
from vision import lines_of, wire_lines
from vision.geometry import REST_POWERS, Refused, unbent_curves
from vision.pictures import RodLines

# [passes] Wires that others cross are up to 38 px off after the first, 18 after the second, 2 after the
# third. Stated.
_PASSES = 3


def array_units(
    views: Sequence[Session],
    recorded: Sequence[Sequence[Trial]],
    out: Path,
    folders: Sequence[Path],
    settings: Settings,
    pool: Workers,
) -> list[list[Unit]]:
    """Return the units of work of each whisker of an array, with the places of the others' wires.

    views, recorded, folders: session, trials and output of each whisker. The cameras are those of
    one calibration of the whole, in `out`. Raises BadInput.
    """
    calibration = calibrate_session(views[0].whole, out)
    whiskers = []
    for view, trials, folder in zip(views, recorded, folders):
        placed = at_base(calibration, view)
        whiskers.append(first_units(view, trials, folder, settings, placed))
    for number in range(_PASSES + 1):
        seen = [unit for units in whiskers for unit in units if _is_seen(unit)]
        staged = [replace(unit, calibration_step=f"wires{number}") for unit in seen]
        job = _write_traced if number else _write_straight
        pool.run(job, staged, "wires side by side")
        whiskers = [_with_wires(units, staged, is_first=number == 0) for units in whiskers]
    return whiskers


def _is_seen(unit: Unit) -> bool:
    """Return whether there are pictures and cameras."""
    return bool(unit.trial.camera_sources) and unit.calibration.cameras is not None


def _with_wires(units: Sequence[Unit], staged: Sequence[Unit], *, is_first: bool) -> list[Unit]:
    """Return a whisker's units with the files of the pass for its own and the others' wires.

    staged: units of all whiskers in that pass. is_first: its wires are the straight ones.
    """
    known = []
    for unit in units:
        if _is_seen(unit):
            same = [one for one in staged if one.trial.name == unit.trial.name]
            files = tuple((one.session.base.name, one.seen_path) for one in same)
            hashes = [hash_of_files([path]) for _, path in files]
            wires_hash = hash_of([name for name, _ in files], hashes)
            straight = files if is_first else unit.straight_wires
            unit = replace(unit, wires=files, wires_hash=wires_hash, straight_wires=straight)
        known.append(unit)
    return known


def _key(unit: Unit) -> str:
    """Return the hash of all inputs of a unit's lines."""
    code = hash_of_code(("bench/trials/side_by_side.py",))
    return hash_of(code, hash_of_code(SEEING), unit.seen_hash)


def _write_straight(unit: Unit) -> None:
    """Write the lines of a straight wire in each frame, unless they are there."""
    key = _key(unit)
    if has_lines(unit.seen_path, key):
        return
    signals = read_signals(unit.trial)
    times = frame_times(unit.trial)
    motor_rad = signals.motor_nearest(times.time_s)
    wire = unit.session.whisker.wire
    curves = unbent_curves(np.zeros((2, REST_POWERS)), dict(enumerate(motor_rad)), wire)
    lines = {camera.name: lines_of(camera, wire, curves) for camera in unit.calibration.cameras}
    write_lines(unit.seen_path, key, lines)


def _write_traced(unit: Unit) -> None:
    """Write the lines of the wire as traced in the pictures, unless they are there."""
    key = _key(unit)
    if not has_lines(unit.seen_path, key):
        write_lines(unit.seen_path, key, _traced(unit))


def _traced(unit: Unit) -> dict[str, RodLines]:
    """Trace the wire in each camera; it is straight in a trial that cannot be evaluated."""
    vision = replace(unit.settings.seeing.vision, every_frame=1, picture_scale=1)
    cameras = unit.calibration.cameras
    try:
        signals = read_signals(unit.trial)
        inputs = unit.inputs(signals)
        frames = TrialFrames.read(inputs, lines_in(unit.wires))
        whisks = [*frames.places, *frames.back.values()]
        return wire_lines(frames.pictures, whisks, cameras, frames.rods, vision)
    except Refused:
        own = unit.session.base.name
        straight = lines_in(unit.straight_wires)
        return {camera: wires[own] for camera, wires in straight.items() if own in wires}
