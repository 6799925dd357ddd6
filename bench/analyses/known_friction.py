"""How far off (10) is with what is known of the friction: fitted, seen, or felt to slide."""

from bench.analyses.accuracy_line import accuracy_line
from bench.analyses.analysis import Analysis, EvaluatedRun
from bench.analyses.estimates_again import FITTED, KINETIC, SEEN
from bench.analyses.friction_tables import FRICTION_ANGLE


class KnownFriction(Analysis):
    """How much better (10) is where the friction angle is known."""

    heading = FRICTION_ANGLE

    def compute(self, run: EvaluatedRun) -> list[str]:
        """Return a sentence for each way in which the friction is known, where any whisk is judged."""
        found = []
        for one in run.accuracy.estimators:
            if one.estimator in (FITTED, SEEN, KINETIC) and one.judged:
                found.append(accuracy_line(one, run.settings))
        return found

    def lines(self, found: list[str]) -> list[str]:
        """Return the sentences, which stand with the friction angles."""
        return found
