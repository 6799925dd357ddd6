"""The study of thresholds sets a number wherever it is used, and tells what it moved."""

from tests.scenes.recorded import exact_cameras
from tests.studies.accuracy.thresholds import SESSION, compared, look_at, put, seen_values
from vision.fit import problem, reshaped


def test_a_number_is_set_wherever_it_was_taken_by_name():
    usual = problem.CONTACT_SIGMA_MM
    put(problem, "CONTACT_SIGMA_MM", 2 * usual)
    try:
        assert reshaped.CONTACT_SIGMA_MM == problem.CONTACT_SIGMA_MM == 2 * usual
    finally:
        put(problem, "CONTACT_SIGMA_MM", usual)
    assert usual == reshaped.CONTACT_SIGMA_MM


def test_moves_sigmas_and_lost_truths_are_told():
    before = {"a": {"d_x": (60.0, 0.1), "slip": (1.0, 0.01)}, "b": {"d_x": (50.0, 0.1)}}
    after = {"a": {"d_x": (60.2, 0.1), "slip": (1.0, 0.005)}, "b": {}}
    assert (
        compared(before, after)
        == "2.00 sigma (a d_x), a sigma times 0.50 (a slip); b lost its truth"
    )


def test_a_whisk_is_seen_as_on_a_trial():
    seen = seen_values(look_at(SESSION, "b60_4", exact_cameras(SESSION)))
    assert abs(seen["d_x"][0] - 64.949) < 3 * seen["d_x"][1] < 0.1  # truth.toml's
