"""The verb `plan`: of a rig that does not stand yet, or of a session as it was recorded."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import msgspec
import numpy as np

from bench.base.atomic import lock_output, whole_file
from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.plan.painted import Painter
from bench.plan.picture import Bench, board_outline, painted_views, write_picture
from bench.plan.plan_rows import RigTask, Row, painter_of, plan_run
from bench.plan.planned_cameras import BoardWork, expected_cameras
from bench.plan.recorded import SeenTask, plan_seen, stage_again
from bench.plan.staged import Staged, of_run
from bench.plan.tries import Try, tries
from bench.plan.where import place_cameras
from bench.plan.written import Plan, write_plan
from bench.rig import build
from bench.rig.protocol import Protocol, load
from bench.session.inside import check_outside
from bench.session.session import MANIFEST
from bench.session.session_check import checked_session
from bench.trials.of_session import placed_units, trials_with_whisks
from bench.trials.trial_evaluation import see_unit
from vision.calibration.views import MeasuredPose
from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused

_MOST_DRAWN = 12  # bars in a drawing
_AS_RECORDED = (
    "Expected: rods and cameras where they were seen, the frames as recorded, an exact beam, and each "
    "camera's lines as sure as they were in that whisk."
)
EXAMPLE = Path(__file__).with_name("example.toml")


@dataclass(frozen=True)
class Options:
    """theta_deg: of slip, φ, α. changes: whether to try any. follow_links: a session's pictures may lie elsewhere."""

    theta_deg: float = 3.0
    changes: bool = True
    follow_links: bool = False

    def __post_init__(self):
        if not 0.0 < self.theta_deg <= 25.0:
            raise BadInput(f"--theta-deg {self.theta_deg:g}: above 0, up to 25")


def plan(
    what: Path,
    out: Path,
    options: Options,
    *,
    workers: int = 1,
    progress: bool = False,
    announce: Callable[[str], object] = print,
) -> Plan:
    """Plan a RIG.toml or a SESSION into the folder `out`. Raises BadInput. announce: is given the text."""
    make = plan_session if what.is_dir() else plan_rig
    with Workers(workers, progress) as pool:
        made = make(what, out, options, pool)
    announce(write_plan(out, made).rstrip())
    return made


def plan_rig(path: Path, out: Path, options: Options, pool: Workers) -> Plan:
    """A rig as a protocol describes it. Raises BadInput."""
    if path.name == MANIFEST:
        raise BadInput(
            "is a recorded session's; give the session's folder, or a RIG.toml", file=path
        )
    protocol = load(str(path))
    if not protocol.cameras:
        raise BadInput("has no [[cameras]]: there is nothing to see by", file=path)
    if any(trial.object for trial in protocol.trials):
        found = "how sure a ring, sphere or cone is seen is not planned"
        raise BadInput(f"object: {found}; leave such trials out", file=path)
    _check_can_be_built(protocol, path)
    staged = dict(_staged(protocol))
    if not staged:
        raise BadInput(
            "the whisker slips off its bar in every trial; push less far (motor.after_deg)",
            file=path,
        )
    target = np.mean([one.touch.point_mm for one in staged.values()], axis=0)
    try:
        protocol = place_cameras(protocol, list(staged.values()), target)
        painter = painter_of(protocol)
        work = _board_work(painter)
        cameras = expected_cameras(painter.cameras, work)
    except BadInput as bad:
        raise BadInput(bad.reason, file=path) from None
    except (Refused, ValueError, cv2.error) as problem:
        raise BadInput(" ".join(str(problem).split()), file=path) from None
    tried = tuple(tries(cameras, work, target, light=True)) if options.changes else ()
    theta, runs = float(np.radians(options.theta_deg)), protocol.runs()
    tasks = [RigTask(protocol, run, cameras, tried, theta) for run in runs]
    rows = pool.run(plan_run, tasks, "trials")
    with lock_output(out):
        _draw_rig(out, protocol, painter, cameras, staged)
    return Plan(
        f"{protocol.name}: {len(runs)} trials planned",
        tuple(_described(cameras, list(staged.values()))),
        tuple(rows),
        options.theta_deg,
        tuple(_assumed(work)),
        tried,
    )


def _check_can_be_built(protocol: Protocol, path: Path) -> None:
    """Whisker, board, and the cameras that have a place, say themselves what is wrong with them."""
    placed = [camera for camera in protocol.cameras if camera.position_mm is not None]
    try:
        (
            build.rod(protocol),
            build.scene(protocol),
            build.cameras(msgspec.structs.replace(protocol, cameras=placed)),
        )
    except (ValueError, cv2.error) as problem:
        raise BadInput(" ".join(str(problem).split()), file=path) from None


def _staged(protocol: Protocol) -> Iterator[tuple[str, Staged]]:
    """The whisks of trials that can be staged, by trial; a protocol's many speeds are alike."""
    for run in protocol.runs():
        try:
            yield run.name, of_run(protocol, run)
        except ArithmeticError:
            continue


def _board_work(painter: Painter) -> BoardWork:
    """What the cameras would be calibrated from. Raises Refused, ValueError where board or light would not do."""
    board = painter.protocol.board
    sigma_rad = float(np.radians(board.pose_sigma_deg))
    on_rig = MeasuredPose(build.T_rig_board(painter.protocol), board.pose_sigma_mm, sigma_rad)
    return BoardWork(painter.board, on_rig, board.views, painter.corner_px())


def _assumed(work: BoardWork) -> Iterator[str]:
    corner = max(work.corner_px.values())
    yield (
        f"Taken for granted: light and noise of the file, lines of wire and bar as sure as they are in pictures "
        f"painted so; {work.views} views of the board a camera, corners to {corner:.3f} px."
    )
    yield (
        "Changes are tried with lines as sure, in pixels, as before; a camera that is new, or did not see the bar, "
        "sees it as others do."
    )


def _described(cameras: Cameras, staged: Sequence[Staged]) -> Iterator[str]:
    """A line a camera."""
    contact = np.mean([one.touch.point_mm for one in staged], axis=0)
    for camera in cameras:
        away = contact - camera.centre_mm
        distance = float(np.linalg.norm(away))
        to_bar = [
            np.degrees(np.arccos(abs(away @ one.axis.direction) / distance)) for one in staged
        ]
        at = "({:.0f}, {:.0f}, {:.0f})".format(*camera.centre_mm)
        yield (
            f"camera {camera.name}: at {at} mm, {distance:.0f} mm from the contact, f {camera.lens[0]:.0f} px, "
            f"{camera.size_px[0]} x {camera.size_px[1]} px, {distance / camera.lens[0]:.3f} mm a px there; "
            f"{min(to_bar):.0f} to {max(to_bar):.0f} deg to the bars"
        )


def _draw_rig(
    out: Path, protocol: Protocol, painter: Painter, cameras: Cameras, staged: dict[str, Staged]
) -> None:
    name, shown = max(staged.items(), key=lambda one: abs(one[1].whisk.slope[0]))
    views = painted_views(painter, shown)
    (out / "views").mkdir(parents=True, exist_ok=True)
    for camera, picture in views.items():
        with whole_file(out / "views" / f"{camera}.png") as temporary:
            temporary.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
    board = protocol.board
    outline = board_outline(build.T_rig_board(protocol), tuple(board.squares), board.square_mm)
    write_picture(out, Bench(cameras, _few(staged.values()), outline), views, shown, name)


def _few(staged: Iterable[Staged]) -> list[Staged]:
    """Not more than a drawing holds."""
    every = list(staged)
    return [
        every[k] for k in np.unique(np.linspace(0, len(every) - 1, _MOST_DRAWN).round().astype(int))
    ]


def plan_session(path: Path, out: Path, options: Options, pool: Workers) -> Plan:
    """A session as recorded. Raises BadInput."""
    check_outside(out, path)
    doubts = Doubts()
    session = checked_session(path, doubts, follow_links=options.follow_links)
    trials = [trial for trial in trials_with_whisks(session) if trial.camera_sources]
    if not trials:
        raise BadInput("has no pictures: there is nothing to plan", file="trials")
    settings = Settings(theta_deg=options.theta_deg)
    with lock_output(out):
        calibration, units = placed_units(session, trials, out, settings, pool, doubts)
        seen = pool.run(see_unit, units, "trials")
        whisks = [
            (unit.trial, trial, whisk) for unit, trial in zip(units, seen) for whisk in trial.whisks
        ]
        theta, known = settings.theta_rad, [whisk for *_, whisk in whisks if whisk.has_truth]
        tried: tuple[Try, ...] = ()
        if known and options.changes:
            target = np.mean([whisk.point_mm.value for whisk in known], axis=0)
            tried = tuple(tries(calibration.cameras, None, target, light=False))
        tasks = [SeenTask(session, *one, calibration.cameras, tried, theta) for one in whisks]
        rows: list[Row] = pool.run(plan_seen, tasks, "whisks")
        staged = [stage_again(task) for task, row in zip(tasks, rows) if row.outlook.has_truth]
        if staged:
            board = session.board
            stands = board is not None and calibration.T_rig_board is not None
            outline = (
                board_outline(calibration.T_rig_board, board.squares, board.square_mm)
                if stands
                else None
            )
            write_picture(out, Bench(calibration.cameras, _few(staged), outline), {}, None, "")
    described = tuple(_described(calibration.cameras, staged)) if staged else ()
    title = f"{session.name}: {len(rows)} whisks as recorded"
    return Plan(
        title, described, tuple(rows), options.theta_deg, (_AS_RECORDED,) if staged else (), tried
    )
