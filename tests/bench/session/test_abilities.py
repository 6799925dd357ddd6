"""What `check` says that a recording can give, and what one thing more would give."""

import shutil
from pathlib import Path

from bench.session.abilities import Ability, abilities, ability_lines
from bench.session.session import load_session

FIXTURES = Path(__file__).parents[3] / "fixtures"


def by_quantity(session) -> dict[str, Ability]:
    """Return the rows of a session's table by quantity."""
    return {ability.quantity: ability for ability in abilities(load_session(session))}


def test_two_cameras_boards_and_gauge_trials_give_all(small_session):
    rows = by_quantity(small_session)
    assert {row.count for row in rows.values() if row.quantity != "gauges"} == {4}
    assert rows["gauges"].count == rows["gauges"].of == 2
    assert not any(row.missing for row in rows.values())


def test_a_stage_gives_distance_and_no_slip():
    rows = by_quantity(FIXTURES / "bring" / "stage")
    assert rows["truth of d_x"].count == rows["Fig. 8"].count == 6
    assert rows["slip, deflection"].count == 0
    assert "cameras with a board" in rows["slip, deflection"].missing


def test_pictures_without_a_motor_log_lack_the_log_alone(small_session, tmp_path):
    copy = tmp_path / "session"
    shutil.copytree(small_session, copy)
    manifest = copy / "session.toml"
    stated = '[trial]\nangle_from = "speed"\nspeed_sigma_deg_s = 0.1\n'
    manifest.write_text(manifest.read_text() + stated)
    rows = by_quantity(copy)
    assert rows["truth of d_x"].count == rows["gauges"].count == 0
    assert rows["slip, deflection"].missing.startswith("a motor log (motor_deg), or angle_from")
    lines = list(ability_lines(load_session(copy)))
    assert lines[0].startswith("angle: 4 of 4 trials by the stated speed")


def test_signals_alone_lack_cameras_and_gauges():
    rows = by_quantity(FIXTURES / "steel-signals")
    assert [row.count for row in rows.values()] == [0] * len(rows)
    assert all(row.missing for row in rows.values())
