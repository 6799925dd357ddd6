"""Where a session's truth comes from: one interface, by pictures or by a stage.

Whatever the source, a trial's truth is a `SeenTrial`: analyses ask it for d_x and slopes with their
sigmas, for what whisks share of these, and for its name.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping

from bench.records.trial_result import SeenTrial
from bench.session.session import Session
from bench.session.signals import Signals
from bench.trials.kept_fits import kept_fits
from bench.trials.seen import see_trial
from bench.trials.stated_truth import by_stage
from bench.trials.unit import Unit
from vision.pictures import Others

Wires = Mapping[str, Others]  # by camera and name, the wires of an array's whiskers


class TruthSource(ABC):
    """A way to the truth of a trial's whisks."""

    @abstractmethod
    def truth(self, unit: Unit, signals: Signals, wires: Wires) -> SeenTrial:
        """Return the truth of each whisk of a trial; a status where there is none. Raise BadInput."""


class Pictures(TruthSource):
    """What the cameras show."""

    def truth(self, unit: Unit, signals: Signals, wires: Wires) -> SeenTrial:
        """Return what the cameras show of each whisk of a trial."""
        inputs = unit.inputs(signals)
        return see_trial(inputs, wires, kept_fits(unit))


class Stage(Pictures):
    """What a stage states, compared with what the cameras show where there are pictures."""

    def truth(self, unit: Unit, signals: Signals, wires: Wires) -> SeenTrial:
        """Return the stage's distances and slopes in place of those that are seen. Raise BadInput."""
        seen = super().truth(unit, signals, wires)
        return by_stage(unit.session, unit.trial, signals, unit.settings, seen)


def truth_source(session: Session) -> TruthSource:
    """Return the source that session.toml names."""
    return Pictures() if session.truth is None else Stage()
