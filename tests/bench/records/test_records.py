"""Records come back from JSON as they went, and what is no record is refused."""

import json

import numpy as np
import pytest

from bench.base.statuses import reason
from bench.records.phases import STATIC, Angle, Phases
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import EstimateRow, FeltWhisk, SeenTrial, TrialFacts
from tests.scenes.results import seen_whisk
from vision.fit.bend_onset import Onset
from vision.geometry.reasons import NO_REASON, Reason
from vision.truth.kept_fit import KeptFit
from vision.truth.records import WhiskTruth
from vision.truth.value import Value
from vision.wire.one_sided import SeenWidth, WireAppearance
from vision.wire.points import LinePoints, Observed


def there_and_back(record):
    return from_plain(type(record), json.loads(json.dumps(to_plain(record), allow_nan=False)))


def test_a_value_is_two_keys_and_its_sigma_stands_before_the_unit():
    plain = to_plain(
        WhiskTruth(0, d_x_mm=Value(60.0, 0.01), point_mm=Value(np.arange(3.0), np.ones(3)))
    )
    assert (plain["d_x_mm"], plain["d_x_sigma_mm"]) == (60.0, 0.01)
    assert (plain["point_mm"], plain["point_sigma_mm"]) == ([0.0, 1.0, 2.0], [1.0, 1.0, 1.0])


def test_felt_whisks_come_back_to_the_last_bit():
    third = 1.0 / 3.0
    row = EstimateRow("no_slip", Value(60.0 + third, third), status="doubtful")
    phases = Phases(2, 1, (Angle(STATIC, 0.05, third, 0.01),))
    made = FeltWhisk(
        3, Value(third, 1e-4), covariance_at=third * np.eye(2), phases=phases, estimates=(row,)
    )
    felt = there_and_back(made)
    assert felt.touch_felt_rad.value == third and felt.phases == phases and felt.whisk == 3
    assert felt.covariance_at[1, 1] == third and felt.theta_moment_covariance_at is None
    (back,) = felt.estimates
    assert (
        back.d_x_est_mm.value == row.d_x_est_mm.value
        and back.status == "doubtful"
        and np.isnan(back.beta_est_rad)
    )


def test_whole_records_come_back_with_all_that_vision_told(exact_record, steel_trial):
    record = exact_record(steel_trial)
    back = there_and_back(SeenTrial((record,))).whisks[0]
    for one, other in (
        (record.frames.slip_mm, back.frames.slip_mm),
        (record.at.alpha_rad, back.at.alpha_rad),
    ):
        np.testing.assert_array_equal(one.value, other.value)
        np.testing.assert_array_equal(one.sigma, other.sigma)
    assert back.frames.touching.dtype == bool and back.frames.status == record.frames.status
    np.testing.assert_array_equal(back.deflection.covariance, record.deflection.covariance)


def test_a_kept_fit_comes_back_with_what_is_not_known_of_its_lines():
    points = LinePoints(np.ones((3, 2)), np.eye(3)[:, :2], np.ones(3), np.arange(3.0))
    fit = KeptFit(
        number=1,
        cameras=("low",),
        indices=(4, 5),
        frames=(5,),
        point_mm=np.arange(3.0),
        direction=np.array([0.0, 0.0, 1.0]),
        vector=np.full(5, 1.0 / 3.0),
        arcs_mm=np.ones(1),
        touching=np.array([True]),
        bent=np.array([True]),
        seen=(Observed(0, 0, points), Observed(-1, 0, points, side=1)),
        onset=Onset(0.1, 0.01),
        neighbour_correlation=(0.5,),
        light={"low": WireAppearance(0.8, SeenWidth(9.0, 10.0, 0.1))},
        left_out=Reason("camera_left_out", "its cap is on"),
        warning=NO_REASON,
    )
    back = there_and_back(fit)
    for one, other in zip(fit.observed(), back.observed()):
        assert (one.frame, one.camera, one.side) == (other.frame, other.camera, other.side)
        np.testing.assert_array_equal(one.points.widened_px2, other.points.widened_px2)
    assert np.all(np.isinf(back.observed()[0].points.widened_px2[:, 1]))
    assert back.touching.dtype == bool and back.onset == fit.onset and back.light == fit.light
    assert back.left_out.codes == ("camera_left_out",) and not back.warning
    assert (back.cameras, back.frames) == (fit.cameras, fit.frames)
    np.testing.assert_array_equal(back.vector, fit.vector)


def test_missing_is_nan_and_no_truth():
    seen = there_and_back(seen_whisk(1, reason("no_pictures")))
    assert np.isnan(seen.d_x_mm.value) and not seen.has_truth and seen.frames is None


def test_a_speed_that_is_not_given_is_none_and_whisks_without_one_belong_together():
    one, other = (there_and_back(TrialFacts(name, "measure", "steel", None)) for name in "ab")
    assert one.panel == other.panel == ("steel", None)


@pytest.mark.parametrize(
    "plain", [{"name": "t"}, [], "t", None, {"name": "t", "purpose": "measure"}]
)
def test_what_is_no_record_is_refused(plain):
    with pytest.raises(ValueError, match="TrialFacts"):
        from_plain(TrialFacts, plain)
