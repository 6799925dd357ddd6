"""Where a session's truth comes from: one interface, by pictures or by a stage.

Whatever the source, a trial's truth is a `SeenTrial`: analyses ask it for d_x and slope with their
sigmas, for what whisks share of these, and for its name.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping

from bench.base.settings import Settings
from bench.cameras.session_cameras import SessionCalibration
from bench.records.trial_result import SeenTrial
from bench.session.session import Session
from bench.session.signals import Signals
from bench.session.trial import Trial
from bench.trials.seen import see_trial
from bench.trials.stated_truth import by_stage
from vision.pictures import Others


class TruthSource(ABC):
    """A way to the truth of a trial's whisks."""

    @abstractmethod
    def truth(
        self,
        session: Session,
        trial: Trial,
        signals: Signals,
        calibration: SessionCalibration,
        settings: Settings,
        wires: Mapping[str, Others],
    ) -> SeenTrial:
        """Return the truth of each whisk; the arguments are those of `see_trial`. Raise BadInput."""


class Pictures(TruthSource):
    """What the cameras show."""

    def truth(self, session, trial, signals, calibration, settings, wires) -> SeenTrial:
        """Return what the cameras show."""
        return see_trial(session, trial, signals, calibration, settings, wires)


class Stage(TruthSource):
    """What a stage states, compared with what the cameras show where there are pictures."""

    def truth(self, session, trial, signals, calibration, settings, wires) -> SeenTrial:
        """Return the stage's distances and slopes in place of those that are seen. Raise BadInput."""
        seen = see_trial(session, trial, signals, calibration, settings, wires)
        return by_stage(session, trial, signals, settings, seen)


def truth_source(session: Session) -> TruthSource:
    """Return the source that session.toml names."""
    return Pictures() if session.truth is None else Stage()
