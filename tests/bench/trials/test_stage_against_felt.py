"""What a stage states against what is felt: a place or an origin that is off is named, and nothing that is right."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from bench.base.statuses import TRUTH, reaching
from bench.records.trial_result import FeltWhisk, StageContact
from bench.session.whisker import Whisker
from bench.trials.stage_against_felt import compare, with_stage_against_felt
from bench.trials.stage_contact import Offsets
from estimator.slip import moments
from tests.scenes.results import seen_whisk, trial_result
from vision import Value

WHISKER = Whisker(shape="cylinder", length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
THETA_RAD = math.radians(3.0)  # of `trial_result`
FRICTION_RAD = math.radians(10.0)
TOUCH_SIGMA_RAD = math.radians(0.006)
MOMENT_SHARE = 0.002
PLACE_MM = 0.03
ORIGIN_MM = 0.1
# d_x, mm, and slope, degrees, of a whisk each.
WHISKS = [(45.0, 0.0), (60.0, 20.0), (75.0, 20.0), (85.0, 0.0), (60.0, 35.0)]
LEAN_RAD = math.radians(6.0)  # of the whisker at touch from x


def contact(d_x_mm: float, slope_rad: float, *, stands: bool) -> StageContact:
    """Return the contact of a bar whose place is known to PLACE_MM, its slope to 0.5°, the origin to ORIGIN_MM."""
    by_offset = np.zeros((3, len(Offsets.none().vector)))
    # By x, y and z of the place: what is across the whisker turns touch, what is along it is d_x.
    across = [-math.sin(LEAN_RAD), math.cos(LEAN_RAD), -math.tan(slope_rad)]
    by_offset[0, :3] = np.array(across) / d_x_mm
    by_offset[1, :2] = [math.cos(LEAN_RAD), math.sin(LEAN_RAD)]
    by_offset[2, 3] = 1.0
    own = Offsets.none()
    own.place_mm[:] = PLACE_MM
    shared = Offsets.none()
    shared.place_mm[:] = ORIGIN_MM
    own = replace(own, slope_rad=math.radians(0.5))
    return StageContact(0.05, by_offset, own.vector, shared.vector, stands)


def results(off_mm=(), whisks=WHISKS, scale=1.0, scale_sigma=0.0, late_deg=0.0, stands=True):
    """Return a trial a whisk. off_mm (n, 3): of the stated places, of those that are left out none.

    scale: by which moments are too large, of which scale_sigma is said. late_deg: of touch felt.
    """
    found = []
    for k, (d_x_mm, slope_deg) in enumerate(whisks):
        slope_rad = math.radians(slope_deg)
        stage = contact(d_x_mm, slope_rad, stands=stands)
        off = np.array(off_mm[k] if k < len(off_mm) else (0.0, 0.0, 0.0))
        touch_rad, stated_mm, _ = stage.by_offset[:, :3] @ off
        seen = seen_whisk(
            d_x_mm=Value(d_x_mm + stated_mm, 0.1), beta_rad=Value(slope_rad, math.radians(0.5))
        )
        seen = replace(seen, stage_contact=replace(stage, motor_rad=0.05 + touch_rad))
        m_y, m_z = moments(d_x_mm, THETA_RAD, slope_rad, FRICTION_RAD, WHISKER.C_Nmm2)
        felt_Nmm = scale * np.array([m_y, m_z])
        sigma_Nmm = MOMENT_SHARE * float(np.linalg.norm(felt_Nmm))
        by_scale = np.vstack([np.zeros((5, 2)), scale_sigma * felt_Nmm])
        felt = FeltWhisk(
            0,
            touch_felt_rad=Value(0.05 + math.radians(late_deg), TOUCH_SIGMA_RAD),
            m_y_Nmm=Value(float(felt_Nmm[0]), sigma_Nmm),
            m_z_Nmm=Value(float(felt_Nmm[1]), sigma_Nmm),
            theta_sigma_rad=TOUCH_SIGMA_RAD,
            covariance_at=sigma_Nmm**2 * np.eye(2) + by_scale.T @ by_scale,
            theta_moment_covariance_at=np.zeros(2),
            shared_Nmm=by_scale,
            delay_s=Value(0.0, 1e-5),
        )
        found.append(trial_result([seen], [felt], name=f"t{k}"))
    return found


def named(found) -> dict[str, str]:
    """Return what is said of the whisks that are named, by trial."""
    compared = with_stage_against_felt(found, WHISKER)
    whisks = {one.trial.name: one.seen.whisks[0] for one in compared}
    found = {name: whisk.status for name, whisk in whisks.items() if whisk.contradicted}
    assert all(reaching((TRUTH,), status) for status in found.values())
    return {name: str(status) for name, status in found.items()}


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"late_deg": 1.5},  # the motor's zero
        {"scale": 1.03, "scale_sigma": 0.03},
        {"off_mm": [(ORIGIN_MM, ORIGIN_MM, -ORIGIN_MM)] * 5},
        {"off_mm": [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], "stands": False},  # it may have moved
    ],
)
def test_what_is_right_or_cannot_be_known_is_not_named(given):
    assert named(results(**given)) == {}


@pytest.mark.parametrize(("off_mm", "axis"), [((1.5, 0.0, 0.0), "x"), ((0.0, 0.0, 0.5), "z")])
def test_the_place_that_is_off_is_named_with_its_size(off_mm, axis):
    found = named(results([(0.0, 0.0, 0.0), off_mm]))
    assert list(found) == ["t1"]
    size = re.search(rf"its place ([+-][\d.]+) mm off along {axis}", found["t1"])
    assert float(size.group(1)) == pytest.approx(max(off_mm), rel=0.1)


@pytest.mark.parametrize("part", ["by_offset", "own", "shared"])
def test_a_whisk_whose_errors_are_unknown_hides_no_other(part):
    found = results([(0.0, 0.0, 0.0), (1.5, 0.0, 0.0)])
    seen = found[0].seen.whisks[0]
    stage = seen.stage_contact
    stage = replace(stage, **{part: np.full_like(getattr(stage, part), math.nan)})
    found[0] = trial_result([replace(seen, stage_contact=stage)], found[0].felt.whisks, name="t0")
    assert list(named(found)) == ["t1"]


def test_two_places_that_are_off_are_both_named():
    assert set(named(results([(0.0, 4.0, 0.0), (0.0, 0.0, 0.0), (0.0, -6.0, 0.0)]))) == {"t0", "t2"}


def test_an_origin_that_is_off_speaks_against_all_whisks():
    found = named(results([(1.5, 0.0, 0.0)] * 5, scale_sigma=0.001))
    assert len(found) == 5
    assert all("the stage's origin +1.5" in said for said in found.values())


def test_a_scale_of_the_moments_that_is_off_is_a_cause_of_its_own():
    found = named(results(scale=1.03, scale_sigma=0.001))
    assert len(found) == 5
    assert all("the moments' scale +3.0 % off" in said for said in found.values())


def test_moments_that_no_place_explains_are_named_as_such():
    """Of a whisk whose moments are a third of what they are no place within the whisker has the touch."""
    found = results()
    found[1] = results(scale=0.33)[1]
    said = named(found)
    assert list(said) == ["t1"] and "look at the moments" in said["t1"]


def test_of_two_whisks_none_is_the_better_one():
    assert set(named(results([(3.0, 0.0, 0.0)], WHISKS[:2]))) == {"t0", "t1"}


def test_the_least_error_that_is_noticed_is_as_far_as_chance_goes():
    """An error a tenth larger is named, one a tenth smaller is not."""
    least_mm = compare(results(), WHISKER).least_noticed(0, 1)
    assert named(results([(0.0, 0.0, 0.0), (0.9 * least_mm, 0.0, 0.0)])) == {}
    assert list(named(results([(0.0, 0.0, 0.0), (1.1 * least_mm, 0.0, 0.0)]))) == ["t1"]
