"""tilts.csv: whisks at several nominal slopes of one surface, solved together; who serves, and what is written."""

import csv
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bench.analyses.tilted import TILTS, Tilts, tilted_whisks
from estimator.two_tilts import ALIKE
from tests.scenes.friction_results import ALPHA, WHISKER, result


def session(sigma_mm: float = 0.0):
    """What is asked of the session: its whisker, and the sigma of a trial's nominal distance."""
    return SimpleNamespace(
        whisker=WHISKER, trial=lambda name: SimpleNamespace(d_x_sigma_mm=sigma_mm)
    )


def flagged(one):
    (felt,) = one.felt.whisks
    return replace(
        one, felt=replace(one.felt, whisks=(replace(felt, status="channels exchanged"),))
    )


def test_distance_and_friction_are_those_of_the_whisks(tmp_path):
    """Within what 3° of pushing leaves out of (10) to first order, 0.5 % of d_x and 0.3° of α, and 2 sigma."""
    whisks = [
        result(5.0),
        result(40.0),
        result(60.0),
        flagged(result(70.0)),
        result(50.0, nominal_mm=80.0),
    ]
    (found,) = tilted_whisks(session(0.1), whisks)
    assert (found.trials, found.whisks, found.beta_deg) == (3, 3, (5.0, 60.0))
    sigma_mm, sigma_rad = np.sqrt(np.diag(found.contact.covariance))
    assert found.contact.d_x_mm == pytest.approx(60.0, abs=0.3 + 2 * sigma_mm)
    assert found.contact.alpha_rad == pytest.approx(ALPHA, abs=np.radians(0.3) + 2 * sigma_rad)
    Tilts().write(tmp_path, [found])
    (row,) = csv.DictReader((tmp_path / "tilts.csv").read_text().splitlines())
    assert tuple(row) == TILTS.names
    assert float(row["error_mm"]) == pytest.approx(found.contact.d_x_mm - 60.0, abs=1e-6)
    (line,) = Tilts().lines([found])
    assert "3 whisks at slopes from 5 to 60° together, without α_est: d_x" in line


def test_a_distance_set_by_a_ruler_is_known_to_one_percent():
    whisks = [result(5.0), result(60.0)]
    ruler, stated = (tilted_whisks(session(sigma), whisks)[0].contact for sigma in (0.0, 0.6))
    assert ruler.covariance == pytest.approx(stated.covariance)


def test_one_slope_set_up_twice_is_no_tilt():
    assert tilted_whisks(session(), [result(40.0, name="a"), result(41.0, name="b")]) == []


def test_held_whisks_do_not_tell(tmp_path):
    (found,) = tilted_whisks(session(), [result(0.0), result(11.0)])
    assert found.contact.status == ALIKE and list(Tilts().lines([found])) == []
    Tilts().write(tmp_path, [found])
    (row,) = csv.DictReader((tmp_path / "tilts.csv").read_text().splitlines())
    assert row["d_x_mm"] == row["alpha_deg"] == "" and row["status"] == ALIKE
