"""run.json: the run in its folder, so that report, comparison and video need no session. `.session` says where that
is, and only the video asks."""

import json
from collections.abc import Sequence
from pathlib import Path

from bench.base.atomic import write_whole
from bench.base.environment import versions
from bench.base.errors import BadInput
from bench.cameras.session_cameras import SessionCalibration
from bench.records.plain import from_plain, to_plain
from bench.report.evaluation import Evaluation
from bench.report.run_facts import BoardFacts, CameraFacts, GaugeFacts, GaugePoints, RunRecord
from bench.report.summary.compose import Summary
from bench.session.session import Session
from vision.geometry.reasons import as_reason

RECORD, SESSION = "run.json", ".session"
ARRAY, RUNS = (
    "array.json",
    "whiskers",
)  # of several whiskers: each one's run stands in a folder of its own
_AGAIN = "evaluate the session again into this folder"


def record_of(evaluation: Evaluation, summary: Summary, figures: Sequence[str]) -> RunRecord:
    """All that the report needs beside the trials' results. figures: names of the pictures."""
    session, calibration = evaluation.session, evaluation.calibration
    return RunRecord(
        session.name,
        session.whisker,
        evaluation.settings,
        summary.verdict,
        summary.doubtful,
        tuple(as_reason(line).codes for line in summary.doubtful),
        summary.sections,
        tuple(figures),
        any(trial.camera_sources for trial in session.trials),
        _cameras(calibration),
        _board(session, calibration),
        _gauges(evaluation),
        dict(evaluation.recordings),
        {result.trial.name: result.hash for result in evaluation.results},
        versions(),
    )


def _cameras(calibration: SessionCalibration) -> tuple[CameraFacts, ...]:
    return tuple(
        CameraFacts(c.name, c.size_px, c.matrix, c.distortion, c.T_camera_rig, float(c.rms_px))
        for c in calibration.cameras or ()
    )


def _board(session: Session, calibration: SessionCalibration) -> BoardFacts | None:
    if session.board is None or calibration.T_rig_board is None:
        return None
    return BoardFacts(
        tuple(session.board.squares), session.board.square_mm, calibration.T_rig_board
    )


def _gauges(evaluation: Evaluation) -> GaugeFacts | None:
    gauges, made = evaluation.gauges, evaluation.certificate
    if gauges is None:
        return None
    matrix, lines = gauges.all.matrix, () if made is None else tuple(made.lines())
    points = tuple(
        GaugePoints(p.trial, p.whisk, p.roll_deg, p.moments, p.residuals(matrix), p.moments_sigma)
        for p in (() if made is None else made.pairs)
    )
    return GaugeFacts(gauges.source, matrix, gauges.all.sigma, lines, points)


def write_record(out: Path, record: RunRecord, session: Path) -> RunRecord:
    """run.json and .session, each whole. The record as the file holds it, which is what is used in every run."""
    write_whole(
        out / RECORD,
        json.dumps(to_plain(record), sort_keys=True, ensure_ascii=False, indent=1) + "\n",
    )
    write_whole(out / SESSION, f"{session.resolve()}\n")
    return read_record(out)


def read_record(out: Path) -> RunRecord:
    """The run of a folder. Raises BadInput where it is no finished run of this version."""
    if (out / ARRAY).is_file():
        raise BadInput(
            f"is of several whiskers; give the folder of one of them, {RUNS}/<name> in it", file=out
        )
    if not (out / RECORD).is_file():
        raise BadInput(
            f"is no evaluated run (there is no {RECORD} in it); give the OUT of `evaluate`",
            file=out,
        )
    try:
        return from_plain(RunRecord, json.loads((out / RECORD).read_text(encoding="utf-8")))
    except (ValueError, BadInput):
        raise BadInput(f"is damaged or of an older version; {_AGAIN}", file=out / RECORD) from None
