"""The truth by a stage: d_x and slope as stated, what is shared of their sigmas, and faults in one line each."""

import math
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from scipy.special import chdtri

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.settings import Settings
from bench.base.statuses import TRUTH, reaching
from bench.records.trial_result import BY_STAGE
from bench.session.session import load_session
from bench.session.signals import forward_strokes, read_signals
from bench.trials.differences import LEAST_CHANCE
from bench.trials.seen import NO_PICTURES, NO_ZERO, unseen
from bench.trials.stage_contact import Offsets, StatedBar, StatedPush, StatedRounded
from bench.trials.stated_length import stated_in_other_unit
from bench.trials.stated_truth import by_stage, stated_whisk
from fixtures.bring_stage import bar_of
from tests.scenes.results import seen_whisk
from tests.scenes.stated_places import drawn_whisk
from vision import SharedSigmas, Value
from vision.geometry import Wire
from vision.geometry.cone import Cone
from vision.geometry.ring import Ring
from vision.geometry.sphere import Sphere

WHISKS = 40
STAGE = Path(__file__).parents[3] / "fixtures" / "bring" / "stage"
TRIAL = "steel_b20_v10"
RULER = "steel_b60_v10"
WIRE = Wire("cylinder", 100.0, 1.0)
REACH_MM = 3.5  # of the radii of a bar of 6 mm and a whisker of 1 mm


@pytest.fixture
def session(tmp_path):
    """A copy of the fixture, to be changed."""
    return Path(shutil.copytree(STAGE, tmp_path / "stage", copy_function=shutil.copyfile))


def change(file: Path, *without: str, **keys) -> None:
    """Write keys into a TOML file, and leave others out."""
    table = tomllib.loads(file.read_text()) | keys
    for key in without:
        table.pop(key)
    file.write_text(tomli_w.dumps(table))


def stated(folder: Path, name: str = TRIAL):
    """Return the stage's truth of the first whisk of a trial."""
    session = load_session(folder)
    trial = session.trial(name)
    signals = read_signals(trial)
    return stated_whisk(session, trial, signals, forward_strokes(signals)[0]).truth


def push(truth: dict[str, float], wire: Wire = WIRE, *, by_axis: bool = True) -> StatedPush:
    """Return a stroke of 20° against the bar of a truth."""
    place_mm, direction = bar_of(truth, REACH_MM)
    motor_rad = np.radians(np.linspace(-5.0, 15.0, 300))
    return StatedPush(
        motor_rad,
        lambda at: np.broadcast_to(place_mm, (*np.shape(at), 3)),
        wire,
        StatedBar(3.0, direction if by_axis else None, math.radians(truth["beta_deg"])),
    )


@pytest.mark.parametrize("by_axis", [True, False])
@pytest.mark.parametrize("beta_deg", [-50.0, 0.0, 35.0, 70.0])
def test_a_straight_whisker_touches_where_the_definitions_say(beta_deg, by_axis):
    """The bar is placed by touch, d_x, β and ψ: these come back to rounding, by its axis or its slope."""
    truth = {"touch_deg": 4.0, "d_x_mm": 60.0, "beta_deg": beta_deg, "psi_deg": 8.0 * by_axis}
    touch = push(truth, by_axis=by_axis).touch(Offsets.none())
    assert math.degrees(touch.motor_rad) == pytest.approx(4.0, abs=1e-7)
    assert touch.d_x_mm == pytest.approx(60.0, abs=1e-6)
    assert math.degrees(touch.beta_rad) == pytest.approx(beta_deg, abs=1e-6)
    assert math.degrees(touch.psi_rad) == pytest.approx(truth["psi_deg"], abs=1e-6)


def rounded(shape: str, truth: dict[str, float]) -> tuple[StatedRounded, np.ndarray]:
    """Return an object and its place (3,), such that the straight whisker touches it as a truth says.

    By the definitions: its surface's straightest way there is the bar's direction, its middle REACH_MM from
    the whisker's, and of a cone as far as its radius there says.
    """
    spot_mm, along = bar_of(truth, 0.0)
    middle_mm, _ = bar_of(truth, REACH_MM)
    inwards = (middle_mm - spot_mm) / REACH_MM
    if shape == "sphere":
        return StatedRounded(Sphere(6.0), np.array([0.0, 0.0, 1.0])), middle_mm
    if shape == "ring":
        centre_mm = middle_mm + 40.0 * inwards
        return StatedRounded(Ring(6.0, ring_diameter_mm=80.0), np.cross(along, inwards)), centre_mm
    half_rad = math.radians(20.0)
    radius_mm = 3.0  # along the normal there
    surface_mm = spot_mm + 0.5 * inwards
    tip_mm = surface_mm + radius_mm / math.tan(half_rad) * along
    axis = math.cos(half_rad) * along - math.sin(half_rad) * inwards
    return StatedRounded(Cone(half_rad), axis), tip_mm


@pytest.mark.parametrize("shape", ["sphere", "ring", "cone"])
@pytest.mark.parametrize("beta_deg", [-50.0, 0.0, 35.0])
def test_a_rounded_object_is_touched_where_the_definitions_say(shape, beta_deg):
    truth = {"touch_deg": 4.0, "d_x_mm": 60.0, "beta_deg": beta_deg, "psi_deg": 0.0}
    standing, place_mm = rounded(shape, truth)
    stroke = replace(
        push(truth),
        object=standing,
        place_at=lambda at: np.broadcast_to(place_mm, (*np.shape(at), 3)),
    )
    touch = stroke.touch(Offsets.none())
    assert math.degrees(touch.motor_rad) == pytest.approx(4.0, abs=1e-6)
    assert touch.d_x_mm == pytest.approx(60.0, abs=1e-5)
    assert math.degrees(touch.beta_rad) == pytest.approx(beta_deg, abs=1e-5)


def test_a_curved_whisker_touches_where_it_lies_tangent():
    """At the contact of y = κ s²/2 the tangent leans κ s from x, the chord κ s/2: the contact is off the foot of
    the chord by reach · κ s/2, to second order in κ s."""
    truth = {"touch_deg": 4.0, "d_x_mm": 60.0, "beta_deg": 0.0, "psi_deg": 0.0}
    kappa = 1e-4
    curved = replace(WIRE, rest_mm=((0.0, 0.0, 0.5 * kappa * 100.0**2), (0.0, 0.0, 0.0)))
    touch = push(truth, curved).touch(Offsets.none())
    from_base_mm = math.hypot(60.0, REACH_MM)
    lean = kappa * 60.0 / 2
    expected_mm = math.sqrt(from_base_mm**2 - REACH_MM**2) + REACH_MM * lean
    assert touch.d_x_mm == pytest.approx(expected_mm, abs=REACH_MM * (kappa * 60.0) ** 2)
    assert abs(expected_mm - 60.0) > 5 * REACH_MM * (kappa * 60.0) ** 2


@pytest.mark.parametrize("speed_mm_s", [-5.0, 5.0])
def test_a_bar_that_the_stage_moves_is_touched_where_it_then_is(session, speed_mm_s):
    """A bar that moves along y through the same place at the same time is touched there."""
    file = session / "trials" / TRIAL / "stage.csv"
    before = stated(session)
    truth = tomllib.loads((session / "trials" / TRIAL / "truth.toml").read_text())
    signals = read_signals(load_session(session).trial(TRIAL))
    touch_s = np.interp(math.radians(truth["touch_deg"]), signals.motor_rad, signals.time_s)
    header, row = file.read_text().splitlines()
    cells = [float(cell) for cell in row.split(",")]
    rows = [header]
    for time_s in (signals.time_s[0], signals.time_s[-1]):
        moved = [*cells]
        moved[0] = time_s
        moved[2] += speed_mm_s * (time_s - touch_s)
        rows.append(",".join(f"{cell:.9g}" for cell in moved))
    file.write_text("\n".join(rows) + "\n")
    # By the errors of the stated place, 0.4 mm at most, the whisker at 10 mm/s comes up to 80 ms sooner
    # or later, at twice that against a bar that runs away at half its speed: y then is off by 0.8 mm,
    # across a whisker at some 6° from x.
    moved_mm = stated(session).d_x_mm.value
    assert moved_mm == pytest.approx(before.d_x_mm.value, abs=0.8 * math.sin(math.radians(7.0)))
    assert moved_mm != before.d_x_mm.value


def test_the_shared_part_is_the_origin_and_each_trial_has_its_own():
    """Of an upright bar near x an error along x is one of d_x; one across it hardly."""
    truth = stated(STAGE, "steel_b00_v10")
    assert truth.shared.d_x_mm == pytest.approx(0.1, rel=0.1)  # 0.1 mm, and the whisker's shape
    own_mm = math.sqrt(truth.d_x_mm.sigma**2 - truth.shared.d_x_mm**2)
    assert own_mm == pytest.approx(0.03, rel=0.02)
    assert math.degrees(truth.beta_rad.sigma) == pytest.approx(0.5)
    by_ruler = stated(STAGE, RULER)
    assert by_ruler.shared.d_x_mm == 0.1
    assert by_ruler.d_x_mm.sigma == pytest.approx(math.hypot(0.3, 0.1))


def test_a_stage_without_pictures_says_what_it_does_not_know():
    session = load_session(STAGE)
    trial = session.trial(TRIAL)
    signals = read_signals(trial)
    (whisk,) = by_stage(session, trial, signals, Settings(), unseen(1, NO_PICTURES)).whisks
    assert whisk.has_truth and whisk.truth_source == BY_STAGE
    assert whisk.status.codes == ("slip_not_seen",)
    assert np.isnan([whisk.touch_rad.value, whisk.at.slip_mm.value, whisk.at.d_y_mm.value]).all()
    assert whisk.deflection is None and whisk.pictured is None


def test_pictures_that_show_no_truth_say_why_beside_the_stage_s():
    session = load_session(STAGE)
    trial = session.trial(TRIAL)
    (whisk,) = by_stage(session, trial, read_signals(trial), Settings(), unseen(1, NO_ZERO)).whisks
    assert whisk.has_truth and whisk.status.codes == ("slip_not_seen",)
    assert f"nor do the pictures show it: {NO_ZERO}" in whisk.status


@pytest.mark.parametrize(("apart_sigmas", "is_named"), [(2.0, False), (6.0, True)])
def test_pictures_that_disagree_beyond_chance_speak_against_the_truth(apart_sigmas, is_named):
    """Two sigma are chance, at a chance of LEAST_CHANCE; six are not."""
    assert math.erfc(6.0 / math.sqrt(2)) < LEAST_CHANCE < math.erfc(2.0 / math.sqrt(2))
    session = load_session(STAGE)
    trial = session.trial(TRIAL)
    truth = stated(STAGE)
    sigma_mm = math.hypot(truth.d_x_mm.sigma, 0.05)
    seen = seen_whisk()
    shared = SharedSigmas(0.001, 0.03, 0.001, 0.001, np.full(3, 0.03), np.ones(4))
    d_x_mm = Value(truth.d_x_mm.value + apart_sigmas * sigma_mm, 0.05)
    seen = replace(seen, truth=replace(seen.truth, d_x_mm=d_x_mm, shared=shared))
    trial_seen = replace(unseen(1, NO_PICTURES), whisks=(seen,))
    (whisk,) = by_stage(session, trial, read_signals(trial), Settings(), trial_seen).whisks
    assert whisk.d_x_mm.value == truth.d_x_mm.value and whisk.pictured.d_x_mm is d_x_mm
    assert whisk.touch_rad is seen.touch_rad and whisk.at is seen.at
    assert bool(reaching((TRUTH,), whisk.status)) == is_named
    assert ("stage_unlike_pictures" in whisk.status.codes) == is_named
    assert whisk.contradicted == is_named
    assert not whisk.truth.shared.d_x_by_camera_error_mm.any()


def test_a_trial_that_states_nothing_has_no_truth_and_says_so(session):
    change(session / "trials" / RULER / "trial.toml", "d_x_mm", "d_x_sigma_mm")
    truth = stated(session, RULER)
    assert np.isnan(truth.d_x_mm.value) and truth.status.codes == ("stage_says_nothing",)


def test_a_place_and_a_distance_that_contradict_each_other_are_named(session):
    """d_x_mm that is the axis' distance and not the contact's is 0.1 mm too long, and chance; 5 mm are not."""
    near_mm = stated(session).d_x_mm.value
    file = session / "trials" / TRIAL / "trial.toml"
    change(file, d_x_mm=near_mm + 0.1)
    assert not stated(session).status
    change(file, d_x_mm=near_mm + 5.0)
    assert stated(session).status.codes == ("distance_unlike_stated",)


def test_a_whisker_that_comes_too_late_or_not_at_all_has_no_truth(session):
    file = session / "trials" / TRIAL / "stage.csv"
    header, row = file.read_text().splitlines()
    cells = row.split(",")
    for y_mm, code in ((60.0, "never_touches"), (0.0, "starts_touching")):
        cells[1:3] = ["60" if code == "starts_touching" else "30", str(y_mm)]
        file.write_text(f"{header}\n{','.join(cells)}\n")
        truth = stated(session)
        assert truth.status.codes == (code,) and np.isnan(truth.d_x_mm.value)


def stage_text(session: Path, *rows: str, header: str = "") -> None:
    """Write another stage.csv into the trial."""
    file = session / "trials" / TRIAL / "stage.csv"
    known = file.read_text().splitlines()
    file.write_text("\n".join([header or known[0], *(rows or known[1:])]) + "\n")


HEADER = "time_s,x_mm,y_mm,z_mm,x_sigma_mm,y_sigma_mm,z_sigma_mm"
FAULTS = {
    "a column of another name": (
        lambda s: stage_text(s, header=HEADER.replace("x_mm", "x_cm")),
        "stage.csv, row 1: column x_mm is missing",
    ),
    "no sigma": (
        lambda s: stage_text(s, "0,60,6,0,0.1,0.1", header=HEADER.removesuffix(",z_sigma_mm")),
        "stage.csv, row 1: column z_sigma_mm is missing",
    ),
    "a sigma below 0": (
        lambda s: stage_text(s, "0,60,6,0,0.1,-0.1,0.1"),
        "y_sigma_mm: -0.1; from 0 to 5000 is allowed",
    ),
    "a place beyond any bench": (
        lambda s: stage_text(s, "0,61000,6,0,0.1,0.1,0.1"),
        "x_mm: 61000; from -5000 to 5000 is allowed. Is it in micrometres? Then write 61.",
    ),
    "times that end before the stroke": (
        lambda s: stage_text(s, "0,60,6,0,0.1,0.1,0.1", "0.1,60,6,0,0.1,0.1,0.1"),
        "stage.csv: holds 0 to 0.1 s; a stroke of the signals goes from",
    ),
    "metres for millimetres": (
        lambda s: stage_text(s, "0,0.06,0.006,0,0.1,0.1,0.1"),
        "passes the whisker's base at 0.06",
    ),
    "centimetres for millimetres": (
        lambda s: stage_text(s, "0,2.0,0.6,0,0.1,0.1,0.1"),
        "nearer than its radius of 3 mm. Is it in centimetres?",
    ),
    "tenths of a millimetre": (
        lambda s: stage_text(s, "0,600,60,0,0.1,0.1,0.1"),
        "beyond the whisker's length of 100 mm. Is it in tenths of a millimetre?",
    ),
    "a stage that should move": (
        lambda s: change(s / "trials" / TRIAL / "trial.toml", object_velocity_mm_s=[0.0, 5.0, 0.0]),
        "stage.csv: is one place at all times, and object_velocity_mm_s says that the object moves",
    ),
    "an object that moves, nobody says where": (
        lambda s: change(
            s / "trials" / RULER / "trial.toml",
            object_velocity_mm_s=[0.0, 5.0, 0.0],
            object={"point_mm": [60.0, 5.0, 0.0]},
        ),
        "object_velocity_mm_s says that the object moves; write its places into stage.csv",
    ),
    "a distance without its sigma": (
        lambda s: (
            change(s / "trials" / RULER / "trial.toml", "d_x_sigma_mm"),
            change(s / "session.toml", exact=False),
        ),
        "d_x_mm is the truth here, and d_x_sigma_mm is missing",
    ),
    "a distance beyond the whisker": (
        lambda s: change(s / "trials" / RULER / "trial.toml", d_x_mm=600.0),
        "d_x_mm is 600, beyond the whisker's length of 100 mm. Is it in tenths of a millimetre?",
    ),
    "no slope": (
        lambda s: change(s / "trials" / RULER / "trial.toml", "beta_deg"),
        "beta_deg is missing: the truth of a stage needs the bar's slope",
    ),
    "a sphere about the whisker's base": (
        lambda s: (
            change(
                s / "trials" / TRIAL / "trial.toml", bar_diameter_mm=6.0, object={"shape": "sphere"}
            ),
            stage_text(s, "0,1.0,1.0,0,0.1,0.1,0.1"),
        ),
        "passes the whisker's base at 1.414 mm, nearer than its radius of 3 mm",
    ),
    "another source": (
        lambda s: change(s / "session.toml", truth={"source": "ruler"}),
        "[truth] source",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_one_clear_line(session, name):
    do, said = FAULTS[name]
    do(session)
    with pytest.raises(BadInput) as refusal:
        for trial in (TRIAL, RULER):
            stated(session, trial)
    line = str(refusal.value)
    assert said in line and "\n" not in line


@pytest.mark.parametrize(
    ("stated_mm", "by_moments_mm", "unit"),
    [
        (6.0, 61.0, "centimetres"),
        (2.4, 60.0, "inches"),
        (600.0, 58.0, "tenths of a millimetre"),
        (60.0, 190.0, ""),  # an estimator that ignores slip, on a slope of 60°
        (60.0, math.nan, ""),
    ],
)
def test_a_distance_in_another_unit_is_known_by_the_moments(stated_mm, by_moments_mm, unit):
    assert stated_in_other_unit(stated_mm, by_moments_mm) == unit


def test_a_log_that_no_key_asks_for_is_named(session):
    change(session / "session.toml", "truth")
    problems = InputProblems()
    load_session(session, problems)
    codes = {code for line in problems.warnings for code in line.codes}
    assert codes == {"stage_not_read"}


def test_one_log_serves_all_trials(session):
    """Of one place that all trials share the log stands once, beside session.toml."""
    own = session / "trials" / TRIAL / "stage.csv"
    before = stated(session)
    own.rename(session / "stage.csv")
    after = stated(session)
    assert after.d_x_mm.value == before.d_x_mm.value


def test_intervals_of_a_stage_hold_and_are_no_wider_than_they_must():
    """Over drawn whisks the squares of z add up as χ² says, at a chance of 1 in 10 000 to either side."""
    session = load_session(STAGE)
    rng = np.random.default_rng(7)
    drawn = [drawn_whisk(session, RULER, rng) for _ in range(WHISKS)]
    z = np.array(
        [(w.d_x_error_mm / w.d_x_sigma_mm, w.beta_error_rad / w.beta_sigma_rad) for w in drawn]
    )
    low, high = chdtri(WHISKS, 1.0 - 1e-4), chdtri(WHISKS, 1e-4)
    squares = np.sum(z**2, axis=0)
    assert low < squares[0] < high, squares
    assert low < squares[1] < high, squares
