"""An evaluated session: what figures, summary and report are made from."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from bench.analyses.curved import Curved
from bench.analyses.friction_tables import SurfaceFriction, friction_of
from bench.analyses.runs import with_runs
from bench.analyses.soft import Soft
from bench.analyses.tilted import Tilted
from bench.base.settings import Settings
from bench.cameras.session_cameras import SessionCalibration
from bench.gauges.certificate import Certificate
from bench.gauges.matrix import GaugeCalibration
from bench.records.trial_result import FeltWhisk, TrialResult
from bench.session.session import Session
from bench.session.whisker import Whisker
from bench.trials.clocks import shared_doubt, shared_touch, with_shared_touch
from vision.geometry.reasons import Reason


@dataclass(frozen=True, eq=False)
class Finished:
    """Results of all trials with what only all of them tell: (10) by the session's friction, the error of touch that
    all share and what is doubtful of it ('' for nothing), friction of each surface and speed."""

    results: tuple[TrialResult, ...]
    friction: tuple[SurfaceFriction, ...]
    doubt: Reason


def finished(results: Iterable[TrialResult], whisker: Whisker, settings: Settings) -> Finished:
    """The results as they stand in trials/, brought together."""
    results = tuple(with_runs(results, whisker, settings))
    shared = shared_touch(results)
    doubt = shared_doubt(shared)
    results = with_shared_touch(results, shared)
    return Finished(results, tuple(friction_of(results, whisker, settings.alpha_est_rad)), doubt)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Results of all trials in the folder `out`. calibration: the cameras as placed in the rig, with its notes; doubts:
    lines that the user should read; friction: a surface and speed each; gauges: None where volts cannot become moments;
    recordings: hash of each trial's files, by name; soft: pairs of distances that tell how soft an object is; shapes:
    how each whisk's object is curved; certificate: of gauges that the session's own trials calibrated; tilted:
    what whisks at several slopes tell together."""

    session: Session
    out: Path
    settings: Settings
    results: tuple[TrialResult, ...]
    friction: tuple[SurfaceFriction, ...]
    gauges: GaugeCalibration | None
    calibration: SessionCalibration
    doubts: tuple[str, ...]  # each a Reason where it has a code
    recordings: Mapping[str, str]
    soft: tuple[Soft, ...] = ()
    shapes: tuple[tuple[TrialResult, FeltWhisk, Curved], ...] = ()
    certificate: Certificate | None = None
    tilted: tuple[Tilted, ...] = ()
