"""`whisker-bench calibrate rig`: rig.toml, where the board on the rig stands, measured by what turns with the motor."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile

import numpy as np

from bench.base.atomic import whole_file
from bench.base.errors import BadInput
from bench.base.exit_codes import print_written
from bench.base.input_problems import InputProblems
from bench.base.results import hash_of_files
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.cameras.first_look import MOST_TRIALS
from bench.cameras.measured_place import contradiction
from bench.cameras.session_cameras import SessionCalibration
from bench.session.footage import rig_picture
from bench.session.rig_file import (
    RIG_FILE,
    MeasuredRig,
    RigFileKeys,
    covariance_as_written,
    hash_of_rig,
    write_rig,
)
from bench.session.session import Session
from bench.session.session_check import checked_session, trials_with_whisks
from bench.session.trial import Trial
from bench.trials.of_session import first_units
from bench.trials.placing import measure_rig, require_swing
from bench.workflows.rig_picture import draw_rig
from vision.boards import find_corners
from vision.calibration import Placement
from vision.geometry import Reason, counted, spread

# [deg] Axis known worse: 60 mm along the whisker a bar then is 0.5 mm higher or lower than said. Stated.
_HELPED_AXIS_SIGMA_DEG = 0.5
# [component] Of a placement: the turn about the axis. A layout, no threshold.
_ZERO = 2
# [1] Of a sigma: beyond, most of its variance is what all free strokes share. Derived.
_MOSTLY = np.sqrt(0.5)
_NO_MARKER = (
    "fasten a marker of the board's dictionary to the hub, with a number that the board does not use and in view of "
    "two cameras: it shows axis and centre in all frames, bent ones included"
)
_NO_BOARD = (
    "record the board standing on the rig, whose place is measured; without one `evaluate` finds the rig by the free "
    "strokes"
)
_NO_TOUCH = (
    "measure how far from the motor's axis a trial's first contact is, and state d_x_mm and d_x_sigma_mm in its "
    "trial.toml: it fixes the centre along the whisker"
)


@dataclass(frozen=True)
class RigCalibration:
    """The measured rig: calibration in its frame, the placement by each source and by all (the last),
    and the trials that were read.
    """

    session: Session
    calibration: SessionCalibration
    sources: tuple[Placement, ...]
    trials: tuple[Trial, ...]

    @property
    def placement(self) -> Placement:
        """Return the placement by all sources."""
        return self.sources[-1]

    @property
    def covariance(self) -> np.ndarray:
        """Return the covariance (6, 6) of the rig frame along its own axes, rad and mm."""
        return self.calibration.cameras.placement


def calibrate_rig_command(
    session: Path, out: Path | None = None, *, workers: int = 1, follow_links: bool = False
) -> int:
    """Measure the rig, write `out` (rig.toml in the session where it is None) and its picture next to it,
    and print what was found.

    Return 0, or 1 with warnings. Raise BadInput; nothing is overwritten.
    """
    problems = InputProblems()
    loaded = checked_session(session, problems, follow_links=follow_links)
    target = session / RIG_FILE if out is None else out
    _check_target(target)
    found = calibrate_rig(loaded, problems, workers=workers)
    lines = list(report_lines(found))
    measured = MeasuredRig(found.calibration.T_rig_board, found.covariance, "these strokes")
    disagreement = contradiction(replace(loaded, measured_rig=measured))
    if disagreement is not None:
        problems.warn(disagreement)
    picture = target.with_suffix(".png")
    _write(target, picture, found, lines)
    advice = [f"to know it better: {line}" for line in what_would_help(found)]
    written = f": {target}, {picture.name}"
    return print_written([*lines, *advice, ""], problems.warnings, written)


def _write(target: Path, picture: Path, found: RigCalibration, lines: list[str]) -> None:
    """Write rig.toml with `lines` as comments, and its picture: both, or none."""
    with whole_file(picture) as temporary:
        figure = draw_rig(found.calibration, found.covariance)
        figure.savefig(temporary, metadata={"Software": None})
        write_rig(target, rig_file_keys(found), lines)


def _check_target(target: Path) -> None:
    """Raise BadInput where the file cannot be written, before minutes of work, or where it, or the
    picture next to it, exists: a measurement is never overwritten.
    """
    for path in (target, target.with_suffix(".png")):
        if path.exists():
            raise BadInput("is there already; remove it, or give --out", file=str(path))
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=target.parent):
            pass
    except OSError as problem:
        raise BadInput(f"cannot be written ({problem.strerror})", file=str(target)) from None


def calibrate_rig(session: Session, problems: InputProblems, *, workers: int = 1) -> RigCalibration:
    """Measure where the board on the rig stands, by a marker on the hub, by the free strokes, and by
    touches at a distance that was measured.

    A stated T_rig_board enters nothing. Raise BadInput where that cannot be found, saying what to
    record.
    """
    _check_measurable(session)
    alone = replace(
        session,
        T_rig_board=None,
        T_rig_board_sigma_mm=0.0,
        T_rig_board_sigma_rad=0.0,
        measured_rig=None,
    )
    recorded = [trial for trial in trials_with_whisks(alone) if trial.camera_sources]
    touches = [trial for trial in recorded if trial.d_x_sigma_mm]
    without_distance = [trial for trial in recorded if not trial.d_x_sigma_mm]
    trials = [*spread(without_distance, MOST_TRIALS), *touches]
    with TemporaryDirectory() as folder, Workers(workers) as pool:
        units = first_units(alone, trials, Path(folder), Settings())
        calibration, sources = measure_rig(alone, units, pool, problems)
    found = RigCalibration(alone, calibration, sources, tuple(trials))
    _warn(found, problems)
    return found


def _check_measurable(session: Session) -> None:
    """Raise BadInput where the session lacks what the rig is measured by."""
    if session.cameras_toml is not None:
        found = "has the cameras in the rig frame already; without it the rig is measured"
        raise BadInput(found, file="cameras.toml")
    if not session.has_pictures:
        raise BadInput(
            "no trial has pictures: the rig is measured by the whisker in them", file="trials"
        )
    if len(session.camera_names) < 2:
        raise BadInput(
            "one camera alone does not show where the rig is; record with two", file="trials"
        )
    for name in session.camera_names:
        if name not in session.rig_pictures:
            raise BadInput(f"has no picture {name}.png: {_NO_BOARD}", file="boards/rig")
        if session.board and not len(
            find_corners(rig_picture(session.rig_pictures[name]), session.board)
        ):
            raise BadInput(f"picture {name} shows no board: {_NO_BOARD}", file="boards/rig")


def _warn(found: RigCalibration, problems: InputProblems) -> None:
    """Add warnings on sources that disagree, and on strokes that are short.

    Raise BadInput where a ruler would do better.
    """
    placement = replace(found.placement, covariance=found.covariance)
    if placement.alarm:
        problems.warn(Reason("board_misplaced", placement.alarm))
    marker = ", ".join(source.basis for source in found.sources[:-1])
    require_swing(placement, problems, marker)


def report_lines(found: RigCalibration) -> Iterator[str]:
    """Yield plain lines on what was measured, and what from."""
    names = ", ".join(trial.name for trial in found.trials)
    yield f"{found.session.name}: the board on the rig, by {counted(len(found.trials), 'trial')} ({names})"
    for source in found.sources:
        yield source.notes[0]
    yield f"All together: {replace(found.placement, covariance=found.covariance).spread}."
    sigma = np.sqrt(np.diag(found.covariance))
    turns = ", ".join(f"{value:.4f}" for value in np.degrees(sigma[:3]))
    shifts = ", ".join(f"{value:.4f}" for value in sigma[3:])
    yield f"Sigmas about and along rig x, y, z: {turns} degrees; {shifts} mm."


def what_would_help(found: RigCalibration) -> Iterator[str]:
    """Yield lines on what would make the place more certain."""
    if len(found.sources) == 1:
        yield _NO_MARKER
    if not any(trial.d_x_sigma_mm for trial in found.trials):
        yield _NO_TOUCH
    sigma = np.sqrt(np.diag(found.covariance))
    if np.degrees(max(sigma[:2])) > _HELPED_AXIS_SIGMA_DEG:
        yield "wider strokes: the axis is known as well as the motor turns far in the pictures"
    zero_deg, shared_deg = np.degrees([sigma[_ZERO], np.sqrt(found.placement.shared[_ZERO, _ZERO])])
    if shared_deg > _MOSTLY * zero_deg:
        yield (
            f"softer light, or another camera: ± {shared_deg:.3f} of the encoder's zero's ± {zero_deg:.3f} degrees is "
            "what all free strokes share (light on the wire, lenses), and more trials do not lower it"
        )
    else:
        yield (
            f"more trials: the encoder's zero, ± {zero_deg:.3f} degrees now, comes down to the ± {shared_deg:.3f} that "
            "all free strokes share (light on the wire, lenses)"
        )


def rig_file_keys(found: RigCalibration) -> RigFileKeys:
    """Return what rig.toml holds of it."""
    return RigFileKeys(
        T_rig_board=found.calibration.T_rig_board.tolist(),
        covariance_deg_mm=covariance_as_written(found.covariance),
        rig_pictures=hash_of_rig(found.session.rig_pictures.values()),
        measured_from=[source.basis for source in found.sources],
        trials=[trial.name for trial in found.trials],
        trial_files=hash_of_files(trial.folder for trial in found.trials),
    )
