"""Place of the rig, from the free strokes of the session's own trials together with T_rig_board."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.results import hash_of
from bench.base.workers import Workers
from bench.cameras.first_look import MOST_TRIALS, by_first_look, first_look, look_at_strokes
from bench.cameras.measured_place import both_places, by_board_of, contradiction, stated_place
from bench.cameras.session_cameras import SessionCalibration
from bench.records.trial_result import SeenTrial
from bench.session.session import Session
from bench.trials.consistency import turn_cause
from bench.trials.lost import see_units
from bench.trials.unit import Unit
from vision import WhiskTruth
from vision.calibration import (
    Placement,
    by_marker,
    by_strokes,
    check_swing_suffices,
    combine,
    move_rig_frame,
    rescale,
    with_distance,
)
from vision.geometry import Reason, Refused, compose, invert_transform, spread

# A step beyond this is taken once more from where it led: lines far from where they were expected are read less well.
_SMALL_STEP = np.repeat([2e-3, 0.2], 3)
# [rounds] It ends before, where a step is small. Stated.
_MOST_ROUNDS = 3
# A first look finds the centre across the whisker to half a millimetre (docs/cameras.md).
_ELSEWHERE_MM = 2.0
# A T_rig_board known no better is a first guess: the strokes alone must then do.
_BY_RULER_MM = 1.0
_STAYS = (
    "The cameras stay where they were: brought along, or placed by a T_rig_board taken as exact."
)


class _Unread(Refused):
    """No free stroke shows the whisker."""


def place_rig(
    session: Session,
    calibration: SessionCalibration,
    units: Sequence[Unit],
    pool: Workers,
    problems: InputProblems,
) -> SessionCalibration:
    """Return the calibration with the cameras in the rig frame of board and free strokes together,
    and notes on both.

    Cameras that were brought along, or whose T_rig_board is taken as exact, stay; an alarm is then
    a warning in `problems`. Raises BadInput where neither board nor strokes determine the rig frame.
    """
    if calibration.cameras is None:
        return calibration
    if session.measured_rig is not None:
        return _placed_by_file(session, calibration, problems)
    before = _placement_before(session)
    chosen = spread([unit for unit in units if unit.trial.camera_sources], MOST_TRIALS)
    may_move = session.cameras_toml is None and before.covariance.any()
    try:
        if may_move:
            placed, placement = _converge(
                calibration, before, chosen, pool, problems, _by_strokes_too
            )
        else:
            trials = see_units(chosen, pool, "free strokes", problems)
            placement = _by_strokes_too(before, chosen, trials)
            is_by_board = session.cameras_toml is None
            placed = _with_scale(calibration, placement) if is_by_board else calibration
    except Refused as refusal:
        if not _has_rig_frame(session):
            raise _without_rig_frame(refusal) from None
        return _placed_by_board_alone(session, calibration, refusal, problems)
    _check_strokes(session, placement, chosen, problems)
    if not may_move:
        return placed.with_notes(placement.notes[0], _STAYS)
    notes = placement.notes if _has_rig_frame(session) else placement.notes[:1]
    return placed.with_notes(*notes)


def _has_rig_frame(session: Session) -> bool:
    """Return whether the session states the rig frame: by its board, or by cameras that are in it."""
    return session.T_rig_board is not None or session.cameras_toml is not None


def _check_strokes(
    session: Session, placement: Placement, units: Sequence[Unit], problems: InputProblems
) -> None:
    """Warn where free strokes contradict the stated rig frame.

    Raise BadInput where they must place the rig, and are too short for it.
    """
    is_by_ruler = session.T_rig_board_sigma_mm >= _BY_RULER_MM and session.cameras_toml is None
    if is_by_ruler or not _has_rig_frame(session):
        require_swing(placement, problems)
    if placement.alarm and _has_rig_frame(session):
        problems.warn(_misplaced(placement, session, units))


def _misplaced(placement: Placement, session: Session, units: Sequence[Unit]) -> Reason:
    """Return the warning of a placement with an alarm, with a size of the board's squares or a turn
    of the whisker that would explain it.
    """
    cause = ""
    scale = placement.scale
    if scale is not None and scale.is_why and session.board is not None:
        square_mm = session.board.square_mm
        looks_mm = square_mm / (1.0 + scale.share)
        cause = f"; a square_mm of {looks_mm:.4g} for {square_mm:g} explains it"
    elif placement.turn_share is not None:
        cause = turn_cause(placement.turn_share, [unit.trial for unit in units])
    return Reason("board_misplaced", f"{placement.alarm}{cause}")


def _placed_by_file(
    session: Session, calibration: SessionCalibration, problems: InputProblems
) -> SessionCalibration:
    """Return the calibration with the cameras placed by rig.toml, and by T_rig_board where it is stated.

    rig.toml was measured by the free strokes: they are not combined with it once more.
    """
    if session.T_rig_board is None:
        return calibration
    warning = contradiction(session)
    if warning is not None:
        problems.warn(warning)
    board = stated_place(session)
    both = both_places(session)
    if not board.covariance.any():
        return calibration.with_notes(*both.notes[:1], _STAYS)
    return _with_scale(_moved(calibration, board, both), both).with_notes(*both.notes)


def measure_rig(
    session: Session,
    units: Sequence[Unit],
    pool: Workers,
    problems: InputProblems,
) -> tuple[SessionCalibration, tuple[Placement, ...]]:
    """Return the calibration in the rig frame by what turns with the motor alone, and the placements
    that it combines: by a marker on the hub, where there is one, and by the free strokes.

    session: without T_rig_board. Raises BadInput where the free strokes cannot be read.
    """
    here, known, sources = _by_hub_marker(session, units[0].calibration)
    exact = _as_exact(by_first_look())
    known = replace(known, step=exact.step)
    placed, both = _converge_on_strokes(_moved(here, exact, known), known, units, pool, problems)
    return placed, (*sources, both)


def _by_hub_marker(
    session: Session, calibration: SessionCalibration
) -> tuple[SessionCalibration, Placement, tuple[Placement, ...]]:
    """Return the calibration moved to where a marker on the hub has the rig, taken as exact; that placement,
    with what is known before; and the placement by the marker alone, none where there is no marker.
    """
    coarse = by_first_look()
    exact = _as_exact(coarse)
    known = coarse
    here = _moved(calibration, coarse, exact)
    markers = look_at_strokes(session, here.cameras).markers
    sources: tuple[Placement, ...] = ()
    for _ in range(_MOST_ROUNDS):
        try:
            hub = by_marker(markers, here.cameras)
        except Refused:
            break
        known = combine(coarse, hub)
        here = _moved(here, exact, _as_exact(known))
        sources = (hub,)
        if np.all(np.abs(known.step) < _SMALL_STEP):
            break
    return here, known, sources


def _as_exact(placement: Placement) -> Placement:
    """Return a placement without uncertainty."""
    return replace(placement, covariance=np.zeros((6, 6)))


def _converge_on_strokes(
    calibration: SessionCalibration,
    known: Placement,
    units: Sequence[Unit],
    pool: Workers,
    problems: InputProblems,
) -> tuple[SessionCalibration, Placement]:
    """Return what `_converge` does of free strokes; raise BadInput where these cannot be read."""
    try:
        return _converge(calibration, known, units, pool, problems, _by_touches_too)
    except Refused as refusal:
        cure = "record free strokes of some 20 degrees in view of two cameras"
        raise BadInput(
            f"the free strokes do not show the whisker, {refusal}: {cure}", file="trials"
        ) from None


def _placed_by_board_alone(
    session: Session,
    calibration: SessionCalibration,
    refusal: Refused,
    problems: InputProblems,
) -> SessionCalibration:
    """Return the calibration as the board places it, with a note on why no free stroke serves.

    Where no stroke can be read, what turns elsewhere than the board has it is a warning.
    """
    if isinstance(refusal, _Unread):
        problems.warnings += _turning_elsewhere(session, calibration)
    return calibration.with_notes(f"The free strokes do not tell where the rig is: {refusal}")


def _without_rig_frame(refusal: Refused) -> BadInput:
    """Return the error of a session without T_rig_board whose free strokes do not give the rig frame."""
    cure = "record free strokes of some 10 degrees, or put a marker on the hub and run `whisker-bench calibrate rig`"
    return BadInput(f"T_rig_board is missing, and {refusal}: {cure}", file="trials")


def _turning_elsewhere(session: Session, calibration: SessionCalibration) -> list[Reason]:
    """Return a warning where the moving part is not where the board has the whisker.

    It is for sessions of which no stroke can be read.
    """
    try:
        first = first_look(session, calibration.cameras)
    except BadInput:
        return []
    across_mm = float(np.linalg.norm(invert_transform(first.T_rig_world)[1:, 3]))
    if across_mm < _ELSEWHERE_MM:
        return []
    placed_by = "T_rig_board"
    cure = "measure a square of the board and check square_mm, then check T_rig_board"
    if session.cameras_toml is not None:
        placed_by = "cameras.toml"
        cure = "are its cameras in the rig frame? `whisker-bench calibrate cameras` says so where they are not"
    line = (
        f"no free stroke can be read, and what turns with the motor turns about a centre some {across_mm:.0f} mm from "
        f"where {placed_by} has it: {cure}"
    )
    return [Reason("board_misplaced", line)]


def require_swing(placement: Placement, problems: InputProblems, marker: str = "") -> None:
    """Raise BadInput where the strokes are too short to place the rig; note where they nearly are."""
    try:
        warning = check_swing_suffices(placement, marker)
    except Refused as refusal:
        raise BadInput(str(refusal), file="trials") from None
    if warning:
        problems.warn(Reason("swing_narrow", warning))


def _converge(
    calibration: SessionCalibration,
    board: Placement,
    chosen: Sequence[Unit],
    pool: Workers,
    problems: InputProblems,
    place: Callable[[Placement, Sequence[Unit], Sequence[SeenTrial]], Placement],
) -> tuple[SessionCalibration, Placement]:
    """Return the calibration moved to the rig frame of board and strokes together, and that
    placement.

    place: the placement by the board, and by what is seen of the units. The strokes are read by
    cameras whose uncertainty leaves out T_rig_board's, which is in the board's placement. Raises
    Refused where no stroke can be read.
    """
    exact = _as_exact(board)
    here = _moved(calibration, board, exact)
    for round_number in range(_MOST_ROUNDS):
        units = [_of_swing(unit, here, f"swing{round_number}") for unit in chosen]
        both = place(board, units, see_units(units, pool, "free strokes", problems))
        if np.all(np.abs(both.step) < _SMALL_STEP):
            here = _as_placed_by(units, here)
            break
        here = _moved(here, exact, _as_exact(both))
        board = replace(board, step=board.step - both.step)
        both = replace(both, step=exact.step)
    return _with_scale(_moved(here, exact, both), both), both


def _as_placed_by(units: Sequence[Unit], calibration: SessionCalibration) -> SessionCalibration:
    """Return the calibration that names the units, as they were seen to place the rig."""
    hashes = {unit.trial.name: unit.seen_hash for unit in units}
    return replace(calibration, placed_by=units[0].calibration_step, hashes_before=hashes)


def _of_swing(unit: Unit, calibration: SessionCalibration, step: str) -> Unit:
    """Return a unit of which the free stroke is read, without checks of what bends, or sizes: nothing reads them."""
    return replace(
        unit,
        calibration=calibration,
        settings=unit.settings.with_vision(check_beam=False, measure_sizes=False),
        calibration_step=step,
        places_rig=True,
    )


def _with_scale(calibration: SessionCalibration, placed: Placement) -> SessionCalibration:
    """Return the calibration with the uncertainty that a board's scale gives to cameras so placed, and
    a note on that scale.
    """
    scale = placed.scale
    if scale is None or not scale.stated_sigma or calibration.T_rig_board is None:
        return calibration
    cameras = rescale(calibration.cameras, calibration.T_rig_board[:, 3], placed)
    new_hash = hash_of(cameras.covariance, calibration.hash)
    note = (
        f"By where the whisker turns, lengths are seen {1.0 + scale.share:.4f} ± {scale.sigma:.4f} times as long as they "
        f"are: the board's square counts as known to {100.0 * np.sqrt(scale.variance):.2g} %."
    )
    return replace(calibration, cameras=cameras, hash=new_hash).with_notes(note)


def _moved(
    calibration: SessionCalibration, before: Placement, after: Placement
) -> SessionCalibration:
    """Return the calibration with its cameras moved from one placement to another."""
    cameras = move_rig_frame(calibration.cameras, before, after)
    T_rig_board = calibration.T_rig_board
    if T_rig_board is not None:
        T_rig_board = compose(invert_transform(after.T_board_rig), T_rig_board)
    parts = [[camera, cameras.covariance, cameras.placement] for camera in cameras]
    new_hash = hash_of(parts, calibration.hash)
    return replace(calibration, cameras=cameras, T_rig_board=T_rig_board, hash=new_hash)


def _placement_before(session: Session) -> Placement:
    """Return what is known of the rig frame that the cameras came in."""
    T_rig_board = session.T_rig_board
    if T_rig_board is None:
        if session.cameras_toml is None:
            return by_first_look()
        T_rig_board = np.eye(3, 4)
    return by_board_of(session, T_rig_board)


def _by_strokes_too(
    known: Placement, units: Sequence[Unit], trials: Sequence[SeenTrial]
) -> Placement:
    """Return the placement by what is known and by free strokes. trials: what is seen of the units."""
    return combine(known, _placement_by_strokes(trials))


def _by_touches_too(
    known: Placement, units: Sequence[Unit], trials: Sequence[SeenTrial]
) -> Placement:
    """Return the placement by what is known, by free strokes, and by each first touch whose distance
    was measured: d_x_mm, with a sigma.

    trials: what is seen of the units, in the frame from which the placement steps.
    """
    placement = _by_strokes_too(known, units, trials)
    touches = []
    for unit, seen in zip(units, trials):
        stated = unit.trial
        truth = _first_known(seen)
        if truth is None or stated.d_x_mm is None or not stated.d_x_sigma_mm:
            continue
        sigma_mm = math.hypot(stated.d_x_sigma_mm, truth.d_x_mm.sigma)
        placement = with_distance(placement, truth.point_mm.value, stated.d_x_mm, sigma_mm)
        touches.append(f"{stated.name} touching at {stated.d_x_mm:g} ± {sigma_mm:.2g} mm")
    if not touches:
        return placement
    basis = ", ".join([placement.basis, *touches])
    by_strokes, *others = placement.notes
    by_both = f"{by_strokes} Measured distances count, too: {', '.join(touches)}."
    return replace(placement, basis=basis, notes=(by_both, *others))


def _first_known(seen: SeenTrial) -> WhiskTruth | None:
    """Return the first truth of a trial with a distance; the whisks of a trial err alike."""
    known = (whisk.truth for whisk in seen.whisks if whisk.truth.d_x_mm.is_known)
    return next(known, None)


def _placement_by_strokes(trials: Sequence[SeenTrial]) -> Placement:
    """Return the placement by the free strokes of these trials.

    It takes every whisk whose base is seen before touch. Raises Refused without any.
    """
    lines = []
    for trial in trials:
        for whisk in trial.whisks:
            if whisk.truth.base is not None:
                lines.append(whisk.truth.base)
    if not lines:
        raise _Unread("none of them can be read")
    return by_strokes(lines)
