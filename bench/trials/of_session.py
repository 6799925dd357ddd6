"""The steps that concern all trials of a session: cameras placed in the rig, drift of the zero, gauges. `evaluate` and
`calibrate gauges` share them."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from bench.base.digests import Digests
from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.base.results import hash_of_files
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.cameras.session_cameras import SessionCalibration, calibrate_session
from bench.gauges.certificate import Certificate
from bench.gauges.drift import drift_rate
from bench.gauges.felt import strokes_of
from bench.gauges.fit import fit_gauges
from bench.gauges.gauge_faults import Undetermined, check_alive
from bench.gauges.gauge_readings import pairs_of
from bench.gauges.gauges_file import given_gauges
from bench.gauges.matrix import FROM_ALL, GaugeCalibration
from bench.gauges.reversal import reversals
from bench.session.session import Session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from bench.trials.free_strokes import free_strokes
from bench.trials.lost import seen_units
from bench.trials.placing import place_rig
from bench.trials.unit import Unit, kept_seen
from vision.geometry.reasons import Reason

_MORE = "or let the other trials serve: --gauges-from-all"
_MOST_NAMED = 8  # trials in one line
_MOST_DRIFT_STROKES = 60  # trials; their mean square is then known to a fifth


def judged(session: Session) -> list[Trial]:
    """The trials with whisks: all but those with a weight. Raises BadInput where there is none, or no whisk in any."""
    trials = [trial for trial in session.trials if trial.purpose != "weight"]
    if not trials:
        raise BadInput("there is no trial to evaluate", file="trials")
    if not any(forward_strokes(read_signals(trial)) for trial in trials):
        found = "the motor goes forward in none of them; motor_deg grows as the whisker goes towards the bar"
        raise BadInput(f"there is no whisk: {found}", file="trials")
    return trials


def require_some(trials: Sequence[Trial], settings: Settings) -> None:
    """Raises BadInput where the settings take none of the trials, or ask a camera that has no pictures of any."""
    if not any(settings.takes(trial.name) for trial in trials):
        names = _some_of(trial.name for trial in trials)
        raise BadInput(f"--trials {settings.trials}: no trial has such a name; there are {names}")
    there = dict.fromkeys(name for trial in trials for name in trial.camera_sources)
    for name in settings.seeing.cameras:
        if name not in there:
            raise BadInput(
                f"cameras of {settings.seeing.name}: there is no camera {name}; there are {_some_of(there)}"
            )


def _some_of(names: Iterable[str]) -> str:
    first = list(islice(names, _MOST_NAMED + 1))
    return ", ".join([*first[:_MOST_NAMED], *["…"] * (len(first) > _MOST_NAMED)])


def placed_units(
    session: Session,
    trials: Sequence[Trial],
    out: Path,
    settings: Settings,
    pool: Workers,
    doubts: Doubts,
) -> tuple[SessionCalibration, list[Unit]]:
    """The session's cameras in the rig frame of board and free strokes, and a unit of work for each trial, so far
    without gauges. Raises BadInput."""
    return settled_units(session, first_units(session, trials, out, settings), pool, doubts)


def first_units(
    session: Session,
    trials: Sequence[Trial],
    out: Path,
    settings: Settings,
    calibration: SessionCalibration | None = None,
) -> list[Unit]:
    """A unit of work for each trial, by the cameras where the board has them; calibration: where there is one already.
    Raises BadInput."""
    calibration = calibration or calibrate_session(session, out)
    digests = Digests(out)
    hashes = [hash_of_files([trial.folder], digests.of) for trial in trials]
    digests.keep()
    return [
        Unit(session, trial, files, calibration, settings, out)
        for trial, files in zip(trials, hashes)
    ]


def settled_units(
    session: Session, units: Sequence[Unit], pool: Workers, doubts: Doubts
) -> tuple[SessionCalibration, list[Unit]]:
    """The session's cameras in the rig frame of board and free strokes, and the units by these. Raises BadInput."""
    calibration = units[0].calibration
    calibration = place_rig(session, calibration, units, pool, doubts)
    return calibration, [replace(unit, calibration=calibration) for unit in units]


def with_gauges(
    units: Sequence[Unit], pool: Workers, doubts: Doubts
) -> tuple[GaugeCalibration | None, Certificate | None, list[Unit]]:
    """The session's gauges, their certificate where its own trials calibrated them, and the units with the gauges and
    with the drift of the channels."""
    rate, of_forces = session_drift(units, pool)
    gauges, made = session_gauges(units, rate, pool, doubts)
    return gauges, made, [unit.with_gauges(rate, gauges, of_forces) for unit in units]


def session_drift(units: Sequence[Unit], pool: Workers) -> tuple[np.ndarray, np.ndarray | None]:
    """RMS drift per second, from free strokes all over the session: (2,) of the gauges' channels, and (3,) of the
    forces, None where no load cell was recorded."""
    every = max(1, len(units) // _MOST_DRIFT_STROKES)
    found = pool.run(free_strokes, units[::every], "free strokes")
    gauges, forces = (
        [one for of_trial in found for one in getattr(of_trial, kind)]
        for kind in ("channels", "forces")
    )
    return drift_rate(gauges), drift_rate(forces) if forces else None


def session_gauges(
    units: Sequence[Unit], rate: np.ndarray, pool: Workers, doubts: Doubts
) -> tuple[GaugeCalibration | None, Certificate | None]:
    """Gauges as brought along, without a certificate; else from the gauge trials, or from all where the settings say
    so; none, and a note on what is lacking, where these cannot fix them."""
    given, from_all = given_gauges(units[0].session), units[0].settings.gauges_from_all
    serves = [from_all or unit.trial.purpose == "gauge" for unit in units]
    trials = [unit for unit, one in zip(units, serves) if one and _has_volts(unit)]
    if given is not None or not trials:
        return given, None
    try:
        made = certified(trials, rate, pool, doubts)
    except Undetermined as reason:
        more = any(_has_volts(unit) for unit, one in zip(units, serves) if not one)
        line = "; ".join([str(reason), *_lacking(trials), *[_MORE] * more])
        doubts.note(Reason("gauges_undetermined", line))
        return None, None
    return (replace(made.gauges, source=FROM_ALL) if from_all else made.gauges), made


def _has_volts(unit: Unit) -> bool:
    return read_signals(unit.trial).kind == "V"


def certified(
    units: Sequence[Unit], rate: np.ndarray, pool: Workers, doubts: Doubts
) -> Certificate:
    """The gauges fitted to what the cameras and the gauges show of these trials, with all that they rest on.

    rate (2,): drift of the channels, V/s. Raises Undetermined where the trials do not fix the coefficients, BadInput
    where a channel is dead, swapped or reversed.
    """
    session, settings = units[0].session, units[0].settings
    strokes = [strokes_of(read_signals(unit.trial), unit.trial, settings) for unit in units]
    for of_trial in strokes:
        check_alive(of_trial)
    found = [
        pairs_of(unit.trial, whisk, stroke, rate, session.whisker, settings.theta_rad)
        for unit, seen, of_trial in zip(
            units, seen_units(units, pool, "gauge trials", doubts), strokes
        )
        for whisk, stroke in zip(seen.whisks, of_trial)
    ]
    pairs = tuple(p for p in found if p is not None)
    every_stroke = tuple(stroke for of_trial in strokes for stroke in of_trial)
    back = tuple(
        r for unit in units for r in reversals(unit.trial, read_signals(unit.trial), settings)
    )
    turn = max(unit.trial.follicle_roll_sigma_deg for unit in units)
    gauges = fit_gauges(pairs)
    return Certificate(
        session.name, session.whisker, gauges, pairs, every_stroke, rate, back, roll_sigma_deg=turn
    )


def _lacking(units: Sequence[Unit]) -> Iterator[str]:
    """What the truth of these trials lacks, of those that were seen."""
    for unit in units:
        seen = kept_seen(unit)
        whisks = seen.whisks if seen else ()
        lacks = dict.fromkeys(
            whisk.status for whisk in whisks if not whisk.has_truth and whisk.status
        )
        if lacks:
            yield f"{unit.trial.name} has no truth: {', '.join(lacks)}"
