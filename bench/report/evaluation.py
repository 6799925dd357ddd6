"""An evaluated session: what figures, summary and report are made from."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from bench.analyses.analysis import EvaluatedRun
from bench.analyses.estimates_again import alpha_est_sigma, with_estimates_again
from bench.analyses.friction_tables import friction_of
from bench.base.settings import Settings
from bench.cameras.session_cameras import SessionCalibration
from bench.gauges.certificate import Certificate
from bench.gauges.matrix import GaugeCalibration
from bench.records.trial_result import TrialResult
from bench.session.session import Session
from bench.session.whisker import Whisker
from bench.trials.clocks import shared_touch, shared_touch_warning, with_shared_touch
from bench.trials.stage_against_felt import with_stage_against_felt


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A run with what its report needs, its results in the folder `out`.

    calibration: the cameras as placed in the rig, with its notes. gauges: None where volts cannot become
    moments; certificate: of gauges that the session's own trials calibrated. warnings: lines that the user
    should read, each a Reason where it has a code. recordings: hash of each trial's files, by name.
    """

    run: EvaluatedRun
    out: Path
    gauges: GaugeCalibration | None
    certificate: Certificate | None
    calibration: SessionCalibration
    warnings: tuple[str, ...]
    recordings: Mapping[str, str]


def evaluated_run(
    results: Iterable[TrialResult],
    whisker: Whisker,
    settings: Settings,
    session: Session | None = None,
) -> EvaluatedRun:
    """Return the run of all trials' results, as they stand in trials/.

    Each whisk has (10) by the session's friction, and the error of touch that all whisks share.
    """
    results = with_estimates_again(results, whisker, settings)
    shared = shared_touch(results)
    results = with_stage_against_felt(with_shared_touch(results, shared), whisker)
    friction = tuple(friction_of(results, whisker, settings.alpha_est_rad))
    return EvaluatedRun(
        whisker=whisker,
        settings=settings,
        results=results,
        friction=friction,
        alpha_est_sigma_rad=alpha_est_sigma([one.surface for one in friction], settings),
        touch_warning=shared_touch_warning(shared),
        session=session,
    )
