"""The verb `plan`: of a rig that does not stand yet, or of a session as it was recorded."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np

from bench.base.atomic import lock_output, whole_file
from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.progress import begin_step, count_parts
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.plan.camera_places import place_cameras
from bench.plan.changes import Change, list_changes
from bench.plan.painter import Painter
from bench.plan.plan_drawing import Bench, PaintedTrial, board_outline, write_drawing
from bench.plan.plan_files import write_plan
from bench.plan.plan_rows import Plan, RigTask, painter_of, plan_trial
from bench.plan.planned_cameras import PlannedCalibration, expected_cameras
from bench.plan.recorded_whisk import SeenTask, plan_seen, stage_again
from bench.plan.staged import StagedWhisk, stage_run
from bench.records.trial_result import SeenTrial
from bench.rig import build
from bench.rig.protocol import Protocol, load
from bench.session.file_names import SESSION_TOML
from bench.session.inside import check_outside
from bench.session.session import Session
from bench.session.session_check import checked_session, trials_with_whisks
from bench.session.trial import Trial
from bench.trials.of_session import placed_units
from bench.trials.trial_evaluation import see_unit
from bench.trials.unit import Unit
from vision.calibration import MeasuredPose
from vision.geometry import Board, Cameras, Refused, spread

# [bars] In a drawing, at most. A layout.
_MOST_DRAWN = 12
# [deg] Largest pushing angle of a plan. Stated.
_MOST_THETA_DEG = 25.0
_AS_RECORDED = (
    "Expected: rods and cameras where they were seen, the frames as recorded, an exact beam, and each "
    "camera's lines as sure as they were in that whisk."
)


@dataclass(frozen=True)
class Options:
    """The options of the verb. Raises BadInput where the angle is out of range.

    theta_deg: of slip, φ, α. changes: whether to try any. follow_links: a session's pictures may
    lie elsewhere.
    """

    theta_deg: float = 3.0
    changes: bool = True
    follow_links: bool = False

    def __post_init__(self):
        """Raise BadInput where the angle is out of range."""
        if not 0.0 < self.theta_deg <= _MOST_THETA_DEG:
            raise BadInput(f"--theta-deg {self.theta_deg:g}: above 0, up to {_MOST_THETA_DEG:g}")


def plan(
    what: Path,
    out: Path,
    options: Options,
    *,
    workers: int = 1,
    announce: Callable[[str], object] = print,
) -> Plan:
    """Write the plan of a RIG.toml or a SESSION into the folder `out`, and return it.

    announce: is given the text. Raises BadInput.
    """
    make = plan_session if what.is_dir() else plan_rig
    with Workers(workers) as pool:
        made = make(what, out, options, pool)
    announce(write_plan(out, made).rstrip())
    return made


def plan_rig(path: Path, out: Path, options: Options, pool: Workers) -> Plan:
    """Return the plan of a rig as a protocol describes it, and draw it. Raises BadInput."""
    protocol = _load_rig(path)
    staged = _stage_runs(protocol)
    if not staged:
        raise BadInput(
            "the whisker slips off its bar in every trial; push less far (motor.after_deg)",
            file=path,
        )
    whisks = list(staged.values())
    try:
        rig = _place_rig(protocol, whisks)
    except BadInput as bad:
        raise BadInput(bad.reason, file=path) from None
    except (Refused, ValueError, cv2.error) as problem:
        raise _on_one_line(problem, path) from None
    rows = pool.run(plan_trial, _rig_tasks(rig, options), "trials")
    begin_step("drawing")
    with lock_output(out):
        _draw_rig(out, rig.painter, rig.cameras, staged)
    return Plan(
        title=f"{rig.protocol.name}: {len(rows)} trials planned",
        cameras=tuple(_describe_cameras(rig.cameras, whisks)),
        rows=tuple(rows),
        theta_deg=options.theta_deg,
        assumptions=tuple(_assumptions(rig.calibration)),
    )


@dataclass(frozen=True, eq=False)
class _PlacedRig:
    """A rig whose cameras all have a place.

    target_mm (3,): what they are aimed at. calibration: what they would be calibrated from. cameras: with the
    covariance that this leaves.
    """

    protocol: Protocol
    target_mm: np.ndarray
    painter: Painter
    calibration: PlannedCalibration
    cameras: Cameras


def _place_rig(protocol: Protocol, whisks: Sequence[StagedWhisk]) -> _PlacedRig:
    """Return the rig with a place for each camera, which is aimed at the whisks' mean contact.

    Raises BadInput, Refused, ValueError or cv2.error where that cannot be.
    """
    target_mm = _mean_contact_mm(whisks)
    placed = place_cameras(protocol, whisks, target_mm)
    begin_step("pictures of the board")
    painter = painter_of(placed)
    calibration = _planned_calibration(painter)
    begin_step("cameras as they would be calibrated")
    return _PlacedRig(
        placed, target_mm, painter, calibration, expected_cameras(painter.cameras, calibration)
    )


def _rig_tasks(rig: _PlacedRig, options: Options) -> list[RigTask]:
    """Return a task for each trial of a rig."""
    changes: Sequence[Change] = ()
    if options.changes:
        changes = list_changes(rig.cameras, rig.calibration, rig.target_mm, light=True)
    theta_rad = math.radians(options.theta_deg)
    return [RigTask(run, rig.cameras, changes, theta_rad) for run in rig.protocol.runs()]


def _load_rig(path: Path) -> Protocol:
    """Load the protocol of a rig that can be planned. Raises BadInput."""
    if path.name == SESSION_TOML:
        raise BadInput(
            "is a recorded session's; give the session's folder, or a RIG.toml", file=path
        )
    protocol = load(str(path))
    if not protocol.cameras:
        raise BadInput("has no [[cameras]]: there is nothing to see by", file=path)
    if any(trial.object for trial in protocol.trials):
        raise BadInput(
            "object: how sure a ring, sphere or cone is seen is not planned; leave such trials out",
            file=path,
        )
    placed = [camera for camera in protocol.cameras if camera.position_mm is not None]
    try:  # whisker, board, and the cameras that have a place say what is wrong with them
        build.rod(protocol)
        build.scene(protocol)
        build.cameras(msgspec.structs.replace(protocol, cameras=placed))
    except (ValueError, cv2.error) as problem:
        raise _on_one_line(problem, path) from None
    return protocol


def _on_one_line(problem: Exception, path: Path) -> BadInput:
    """Return what is wrong with a file, on one line."""
    return BadInput(" ".join(str(problem).split()), file=path)


def _stage_runs(protocol: Protocol) -> dict[str, StagedWhisk]:
    """Return by trial the whisks that can be staged."""
    staged = {}
    runs = protocol.runs()
    for run in count_parts(runs, "whisks staged", len(runs)):
        try:
            staged[run.name] = stage_run(run)
        except ArithmeticError:
            continue
    return staged


def _mean_contact_mm(staged: Sequence[StagedWhisk]) -> np.ndarray:
    """Return the mean contact (3,) at first touch."""
    return np.mean([whisk.known.contact_mm for whisk in staged], axis=0)


def _planned_calibration(painter: Painter) -> PlannedCalibration:
    """Return what the cameras would be calibrated from.

    Raises Refused or ValueError where board or light would not do.
    """
    table = painter.protocol.board
    on_rig = MeasuredPose(
        build.T_rig_board(painter.protocol),
        table.pose_sigma_mm,
        math.radians(table.pose_sigma_deg),
    )
    return PlannedCalibration(
        painter.board, painter.printed, on_rig, table.views, painter.corner_px()
    )


def _assumptions(calibration: PlannedCalibration) -> Iterator[str]:
    """Yield sentences on what the plan of a rig takes for granted."""
    yield (
        "Taken for granted: light and noise of the file, lines of wire and bar as sure as they are in pictures "
        f"painted so; {calibration.views} views of the board a camera, corners to {calibration.largest_corner_px:.3f} px."
    )
    yield (
        "Changes are tried with lines as sure, in pixels, as before; a camera that is new, or did not see the bar, "
        "sees it as others do."
    )


def _describe_cameras(cameras: Cameras, staged: Sequence[StagedWhisk]) -> Iterator[str]:
    """Yield a line on each camera."""
    contact_mm = _mean_contact_mm(staged)
    for camera in cameras:
        sight_mm = contact_mm - camera.centre_mm
        distance_mm = float(np.linalg.norm(sight_mm))
        to_bar_deg = []
        for whisk in staged:
            cosine = abs(sight_mm @ whisk.known.axis.direction) / distance_mm
            to_bar_deg.append(np.degrees(np.arccos(cosine)))
        place = "({:.0f}, {:.0f}, {:.0f})".format(*camera.centre_mm)
        focal_px = camera.lens[0]
        yield (
            f"camera {camera.name}: at {place} mm, {distance_mm:.0f} mm from the contact, f {focal_px:.0f} px, "
            f"{camera.size_px[0]} x {camera.size_px[1]} px, {distance_mm / focal_px:.3f} mm a px there; "
            f"{min(to_bar_deg):.0f} to {max(to_bar_deg):.0f} deg to the bars"
        )


def _draw_rig(
    out: Path, painter: Painter, cameras: Cameras, staged: dict[str, StagedWhisk]
) -> None:
    """Write the drawing of a rig, and what each camera will see of the trial with the steepest bar."""
    name = max(staged, key=lambda trial: abs(staged[trial].mechanics.slope[0]))
    painted = PaintedTrial(name, staged[name], painter.last_frames(staged[name]))
    (out / "views").mkdir(parents=True, exist_ok=True)
    for camera, picture in painted.pictures.items():
        with whole_file(out / "views" / f"{camera}.png") as temporary:
            temporary.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
    table = painter.protocol.board
    T_rig_board = build.T_rig_board(painter.protocol)
    outline_mm = board_outline(T_rig_board, tuple(table.squares), table.square_mm)
    drawn = spread(list(staged.values()), _MOST_DRAWN)
    write_drawing(out, Bench(cameras, drawn, outline_mm), painted)


def plan_session(path: Path, out: Path, options: Options, pool: Workers) -> Plan:
    """Return the plan of a session as recorded, and draw it. Raises BadInput."""
    check_outside(out, path)
    problems = InputProblems()
    session = checked_session(path, problems, follow_links=options.follow_links)
    trials = _pictured_trials(session)
    settings = Settings(theta_deg=options.theta_deg)
    with lock_output(out):
        calibration, units = placed_units(session, trials, out, settings, pool, problems)
        tasks = _see_whisks(units, calibration.cameras, options, pool)
        rows = pool.run(plan_seen, tasks, "whisks")
        staged = [stage_again(task) for task, row in zip(tasks, rows) if row.outlook.has_truth]
        if staged:
            outline_mm = _session_outline(session.board, calibration.T_rig_board)
            write_drawing(out, Bench(calibration.cameras, spread(staged, _MOST_DRAWN), outline_mm))
    return Plan(
        title=f"{session.name}: {len(rows)} whisks as recorded",
        cameras=tuple(_describe_cameras(calibration.cameras, staged)) if staged else (),
        rows=tuple(rows),
        theta_deg=options.theta_deg,
        assumptions=(_AS_RECORDED,) if staged else (),
    )


def _pictured_trials(session: Session) -> list[Trial]:
    """Return the trials with whisks that have pictures. Raise BadInput where there are none."""
    trials = [trial for trial in trials_with_whisks(session) if trial.camera_sources]
    if not trials:
        raise BadInput("has no pictures: there is nothing to plan", file="trials")
    return trials


def _see_whisks(
    units: Sequence[Unit], cameras: Cameras, options: Options, pool: Workers
) -> list[SeenTask]:
    """See the trials of the units, and return a task for each of their whisks."""
    seen = pool.run(see_unit, units, "trials")
    changes = _changes_of_session(cameras, seen) if options.changes else ()
    tasks = []
    for unit, trial in zip(units, seen):
        theta_rad = unit.settings.theta_rad
        for whisk in trial.whisks:
            task = SeenTask(unit.session, unit.trial, trial, whisk, cameras, changes, theta_rad)
            tasks.append(task)
    return tasks


def _changes_of_session(cameras: Cameras, seen: Sequence[SeenTrial]) -> list[Change]:
    """Return the changes to be tried; none where no whisk has a truth."""
    points_mm = []
    for trial in seen:
        points_mm += [whisk.point_mm.value for whisk in trial.whisks if whisk.has_truth]
    if not points_mm:
        return []
    return list_changes(cameras, None, np.mean(points_mm, axis=0), light=False)


def _session_outline(board: Board | None, T_rig_board: np.ndarray | None) -> np.ndarray | None:
    """Return the outline (4, 3), mm, of the board that stands on a session's rig, if one does."""
    if board is None or T_rig_board is None:
        return None
    return board_outline(T_rig_board, board.squares, board.square_mm)
