"""One trial as a unit of work: all inputs of its result, and the hashes of these.

What is seen has a hash of its own, so that another α_est evaluates no picture again.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.results import ESTIMATING, SEEING, hash_of, hash_of_code
from bench.base.settings import Settings
from bench.cameras.session_cameras import SessionCalibration
from bench.gauges.matrix import GaugeCalibration
from bench.session.session import Session
from bench.session.signals import Signals
from bench.session.trial import Trial
from bench.trials.trial_frames import TrialInputs
from vision.geometry import NO_REASON, Reason


@dataclass(frozen=True)
class Unit:
    """All inputs of one trial's result.

    files: hash of the trial's files. drift_rate (2,): of the channels per second, and
    force_drift_rate (3,) of a load cell. gauges: None where volts cannot become moments.
    calibration_step: of the session's calibration, what it is seen for; names the folder of that
    seen half. places_rig: whether that is to place the rig. wires: of an array, by the names of its
    whiskers, files with the places of their wires in the pictures, and wires_hash of all of them.
    straight_wires: files with the places that the wires would have if all were straight.
    contradictions: warnings about the session or the trial
    that question its truth or its estimates.
    """

    session: Session
    trial: Trial
    files: str
    calibration: SessionCalibration
    settings: Settings
    out: Path
    drift_rate: np.ndarray | None = None
    gauges: GaugeCalibration | None = None
    calibration_step: str = "seen"
    places_rig: bool = False
    force_drift_rate: np.ndarray | None = None
    wires: tuple[tuple[str, Path], ...] = ()
    wires_hash: str = ""
    straight_wires: tuple[tuple[str, Path], ...] = ()
    contradictions: Reason = NO_REASON

    def inputs(self, signals: Signals) -> TrialInputs:
        """Return all that the trial is seen with."""
        return TrialInputs(self.session, self.trial, signals, self.calibration, self.settings)

    @property
    def path(self) -> Path:
        """Return the file of the result."""
        return self.out / "trials" / f"{self.trial.name}.json"

    @property
    def seen_path(self) -> Path:
        """Return the file of a seen half that is part of the session's calibration."""
        return self.out / "calibration" / self.calibration_step / f"{self.trial.name}.json"

    @property
    def placing_pass(self) -> tuple[Path, str]:
        """Return the file of the trial as it was seen to place the rig, and its hash; '' where it was not."""
        name = self.trial.name
        folder = self.out / "calibration" / self.calibration.placed_by
        return folder / f"{name}.json", self.calibration.hashes_before.get(name, "")

    @property
    def seen_hash(self) -> str:
        """Return the hash of all inputs of the seen half."""
        session = self.session
        return hash_of(
            hash_of_code(SEEING),
            self.files,
            self.trial,
            session.whisker,
            session.board,
            session.T_rig_board,
            session.truth,
            self.calibration.hash,
            self.calibration.hashes_before.get(self.trial.name, ""),
            self.settings.seen(),
            self.wires_hash,
            self.contradictions.parts,
        )

    @property
    def hash(self) -> str:
        """Return the hash of all inputs of the result."""
        return hash_of(
            hash_of_code(ESTIMATING),
            self.seen_hash,
            self.force_drift_rate,
            self.drift_rate,
            self.gauges,
            self.settings.estimated(),
            self.settings.own_code(),
        )
