"""What is known of the friction stands in the summary beside the friction angles."""

from types import SimpleNamespace

from bench.analyses.catalogue import ANALYSES
from bench.analyses.estimates_again import FITTED, SEEN
from bench.analyses.estimator_accuracy import Accuracy
from bench.analyses.friction_tables import FrictionAngles
from bench.analyses.known_friction import KnownFriction
from bench.base.settings import Settings
from bench.trials.estimate_errors import Judged


def accuracy_of(estimator: str, *errors_mm: float) -> Accuracy:
    """Return the accuracy of an estimator with these errors at 60 mm."""
    judged = []
    for error_mm in errors_mm:
        one = Judged(
            "t", 0, "measure", "steel", 1.0, estimator, 20.0, 60.0, 0.1, 60 + error_mm, 0.1
        )
        judged.append(one)
    return Accuracy(estimator, 1, tuple(judged), (), (), (), len(judged), len(judged), 1)


def test_only_estimators_that_know_the_friction_and_are_judged_have_a_line():
    estimators = (accuracy_of("no_slip", 6.0), accuracy_of(FITTED, 0.6), accuracy_of(SEEN))
    accuracy = SimpleNamespace(estimators=estimators)
    run = SimpleNamespace(accuracy=accuracy, settings=Settings())
    (line,) = KnownFriction().lines(KnownFriction().compute(run))
    assert "+1.0 ±" in line and "fitted to the other whisks" in line


def test_they_stand_directly_behind_the_friction_angles():
    kinds = [type(analysis) for analysis in ANALYSES]
    assert kinds.index(KnownFriction) == kinds.index(FrictionAngles) + 1
    assert KnownFriction.heading == FrictionAngles.heading
