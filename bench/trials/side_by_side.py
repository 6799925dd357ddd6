"""Whiskers of an array in each other's pictures: where each one's wire is, before any is measured.

At first all are taken to be straight and to turn with their motors. Then each is looked for where the others are not,
several times: each look knows the others as the one before has seen them.
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
from bench.trials.trial_frames import Shown
from bench.trials.unit import Unit
from vision.geometry.centreline import REST_POWERS, one_curve
from vision.geometry.refusals import Refused
from vision.pictures.others import RodLines
from vision.truth.observe import wire_lines
from vision.wire.trace import lines_of

_LOOKS = 3  # wires that others cross are up to 38 px off after the first, 18 after the second, 2 after the third


def array_units(
    views: Sequence[Session],
    recorded: Sequence[Sequence[Trial]],
    out: Path,
    folders: Sequence[Path],
    settings: Settings,
    pool: Workers,
) -> list[list[Unit]]:
    """As `first_units`, of each whisker of an array, by its view, recorded trials and folder: by one calibration of the
    whole in `out`, and with where the others' wires are. Raises BadInput."""
    calibration = calibrate_session(views[0].whole, out)
    known = [
        first_units(view, trials, folder, settings, at_base(calibration, view))
        for view, trials, folder in zip(views, recorded, folders)
    ]
    for look in range(_LOOKS + 1):
        staged = [
            replace(unit, stage=f"wires{look}")
            for units in known
            for unit in units
            if _is_seen(unit)
        ]
        pool.run(_look if look else _predict, staged, "wires side by side")
        known = [
            [_told(unit, known, look) if _is_seen(unit) else unit for unit in units]
            for units in known
        ]
    return known


def _is_seen(unit: Unit) -> bool:
    return bool(unit.trial.camera_sources) and unit.calibration.cameras is not None


def _told(unit: Unit, whiskers: Sequence[Sequence[Unit]], look: int) -> Unit:
    """The unit with the files of that look at it and the others."""
    files = tuple(
        (one.session.base.name, replace(one, stage=f"wires{look}").seen_path)
        for units in whiskers
        for one in units
        if one.trial.name == unit.trial.name
    )
    made_from = hash_of([name for name, _ in files], [hash_of_files([path]) for _, path in files])
    return replace(
        unit, wires=files, wires_hash=made_from, straight=unit.straight if look else files
    )


def _key(unit: Unit) -> str:
    return hash_of(
        hash_of_code(("bench/trials/side_by_side.py",)), hash_of_code(SEEING), unit.seen_hash
    )


def _predict(unit: Unit) -> None:
    """The straight wire of each frame."""
    if has_lines(unit.seen_path, _key(unit)):
        return
    signals, times = read_signals(unit.trial), frame_times(unit.trial)
    motor_rad = np.interp(times.time_s, signals.time_s, signals.motor_rad)
    wire, straight = unit.session.whisker.wire, np.zeros((2, REST_POWERS))
    curves = {
        k: one_curve(straight, np.zeros(2), wire.length_mm, motor, wire)
        for k, motor in enumerate(motor_rad)
    }
    lines = {camera.name: lines_of(camera, wire, curves) for camera in unit.calibration.cameras}
    write_lines(unit.seen_path, _key(unit), lines)


def _look(unit: Unit) -> None:
    """The wire where a first look finds it."""
    if not has_lines(unit.seen_path, _key(unit)):
        write_lines(unit.seen_path, _key(unit), _found(unit))


def _found(unit: Unit) -> dict[str, RodLines]:
    """By camera; straight in a trial that cannot be seen."""
    usual = replace(unit.settings.seeing.vision, every_frame=1, picture_scale=1)
    signals = read_signals(unit.trial)
    try:
        told = unit.trial, signals, unit.calibration, unit.settings, lines_in(unit.wires)
        shown = Shown.of(unit.session, *told)
        whisks = [*shown.places, *shown.back.values()]
        return wire_lines(shown.pictures, whisks, unit.calibration.cameras, shown.rods, usual)
    except Refused:
        name = unit.session.base.name
        return {
            camera: some[name] for camera, some in lines_in(unit.straight).items() if name in some
        }
