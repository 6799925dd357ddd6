"""run.json: the run in its folder, so that report, comparison and video need no session.

`.session` names the session's folder, which only the video needs.
"""

from collections.abc import Sequence
from pathlib import Path

from bench.base.atomic import write_whole
from bench.base.environment import versions
from bench.base.errors import BadInput
from bench.cameras.session_cameras import SessionCalibration
from bench.records.record_file import read_record_file, write_record_file
from bench.report.evaluation import Evaluation
from bench.report.run_facts import BoardFacts, CameraFacts, GaugeFacts, GaugePoints, RunRecord
from bench.report.summary.compose import Summary
from bench.session.session import Session
from vision.geometry import as_reason

RECORD = "run.json"
SESSION = ".session"
ARRAY = "array.json"  # of several whiskers
RUNS = "whiskers"  # folder of theirs, in which each has a run of its own


def record_of(evaluation: Evaluation, summary: Summary, figures: Sequence[str]) -> RunRecord:
    """Return all that the report needs beyond the trials' results. figures: names of the pictures."""
    run = evaluation.run
    session = run.session
    calibration = evaluation.calibration
    return RunRecord(
        session=session.name,
        whisker=session.whisker,
        settings=run.settings,
        verdict=summary.verdict,
        warnings=summary.warnings,
        warning_codes=tuple(as_reason(line).codes for line in summary.warnings),
        sections=summary.sections,
        figures=tuple(figures),
        has_pictures=any(trial.camera_sources for trial in session.trials),
        cameras=_cameras(calibration),
        board=_board(session, calibration),
        gauges=_gauges(evaluation),
        recordings=dict(evaluation.recordings),
        results={result.trial.name: result.hash for result in run.results},
        versions=versions(),
    )


def _cameras(calibration: SessionCalibration) -> tuple[CameraFacts, ...]:
    """Return the cameras as they were used."""
    cameras = []
    for camera in calibration.cameras or ():
        facts = CameraFacts(
            camera.name,
            camera.size_px,
            camera.matrix,
            camera.distortion,
            camera.T_camera_rig,
            float(camera.rms_px),
        )
        cameras.append(facts)
    return tuple(cameras)


def _board(session: Session, calibration: SessionCalibration) -> BoardFacts | None:
    """Return the board on the rig; None where there is none."""
    board = session.board
    if board is None or calibration.T_rig_board is None:
        return None
    return BoardFacts(tuple(board.squares), board.square_mm, calibration.T_rig_board)


def _gauges(evaluation: Evaluation) -> GaugeFacts | None:
    """Return the gauges as they were used; None where volts cannot become moments."""
    gauges = evaluation.gauges
    if gauges is None:
        return None
    matrix = gauges.all.matrix
    certificate = evaluation.certificate
    if certificate is None:
        return GaugeFacts(gauges.source, matrix, gauges.all.sigma)
    points = []
    for pair in certificate.pairs:
        residuals = pair.residuals(matrix)
        of_whisk = GaugePoints(
            pair.trial, pair.whisk, pair.roll_deg, pair.moments, residuals, pair.moments_sigma
        )
        points.append(of_whisk)
    lines = tuple(certificate.lines())
    return GaugeFacts(gauges.source, matrix, gauges.all.sigma, lines, tuple(points))


def write_record(out: Path, record: RunRecord, session: Path) -> RunRecord:
    """Write run.json and .session, each whole; return the record as the file holds it.

    Every report is made from that, so that one made again is the same.
    """
    write_record_file(out / RECORD, record)
    write_whole(out / SESSION, f"{session.resolve()}\n")
    return read_record(out)


def read_record(out: Path) -> RunRecord:
    """Read the run of a folder. Raises BadInput where it is no finished run of this version."""
    if (out / ARRAY).is_file():
        several = f"is of several whiskers; give the folder of one of them, {RUNS}/<name> in it"
        raise BadInput(several, file=out)
    if not (out / RECORD).is_file():
        none = f"is no evaluated run (there is no {RECORD} in it); give the OUT of `evaluate`"
        raise BadInput(none, file=out)
    return read_record_file(RunRecord, out / RECORD)
