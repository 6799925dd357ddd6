"""reorientation.csv: which trials are rotations of one contact, and what each row says."""

import csv
from types import SimpleNamespace

import pytest

from bench.analyses.reorientation import REORIENTATION, Reorientation, rotations_of
from bench.base.settings import Settings
from tests.scenes.friction_results import WHISKER, result

SETTINGS = Settings()


def session(contacts):
    """What is asked of the session: its whisker, and each trial's contact and turn."""

    def trial(name):
        contact, turn_deg = contacts[name]
        return SimpleNamespace(contact=contact, plane_turn_deg=turn_deg)

    return SimpleNamespace(whisker=WHISKER, trial=trial)


@pytest.fixture(scope="module")
def found():
    """Of a slope of 45°, the plane turned by 35°; and a push that belongs to no contact."""
    results = [result(45.0, name="a_r1"), result(10.0, name="a_r2"), result(30.0, name="alone")]
    contacts = {"a_r1": ("a", 0.0), "a_r2": ("a", 35.0), "alone": ("", 0.0)}
    return rotations_of(session(contacts), results, SETTINGS)


def test_trials_of_a_contact_are_its_rotations(found):
    assert [(one.contact, one.rotation, one.plane_turn_deg) for one in found] == [
        ("a", 1, 0.0),
        ("a", 2, 35.0),
    ]


def test_the_second_is_right_and_the_first_says_that_it_slips(found, tmp_path):
    first, second = found
    assert abs(first.estimate.error_percent(first.d_x_mm).value) > 10 and first.estimate.status
    sigma_mm = second.estimate.d_x_est_mm.sigma
    assert second.estimate.error_mm(second.d_x_mm).value == pytest.approx(0.0, abs=2 * sigma_mm)
    assert first.next_turn_rad > 0 and second.next_turn_rad == 0
    Reorientation().write(tmp_path, found)
    rows = list(csv.DictReader((tmp_path / REORIENTATION.file).read_text().splitlines()))
    assert tuple(rows[0]) == REORIENTATION.names
    assert [row["inside"] for row in rows] == ["1", "1"]
    lines = list(Reorientation().lines(found))
    assert len(lines) == 2 and "1 need no further turn" in lines[1]
