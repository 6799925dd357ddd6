"""An object that was seen to give way, over the force felt: gives_way.csv, means, refusals."""

from dataclasses import replace

import numpy as np
import pytest

from bench.analyses.gave import GivesWay, gave_at, give_seen, mean_give
from bench.base.errors import BadInput
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import (
    FeltWhisk,
    SeenWhisk,
    TrialResult,
)
from bench.rig.simulation import simulate
from bench.session.session import load_session
from tests.scenes.results import seen_whisk, trial_result
from tests.scenes.rig_sessions import protocol_file, rows
from vision.truth.records import GaveWay
from vision.truth.value import UNKNOWN, Value

THETA_RAD = np.radians([1.0, 2.0, 4.0])
WAY_MM, ASIDE_MM = Value(0.25 * np.arange(1, 4), np.full(3, 0.01)), Value(*np.zeros((2, 3)))
GAVE = GaveWay(np.array([7, 8, 9]), THETA_RAD, WAY_MM, ASIDE_MM)


def result(beta_deg=0.0, gave=GAVE) -> TrialResult:
    """A normal force of 0.05 N at 60 mm, friction along the bar beside it."""
    beta = np.radians(beta_deg)
    across, along = (
        3.0 * np.array([np.sin(beta), np.cos(beta)]),
        0.5 * np.array([-np.cos(beta), np.sin(beta)]),
    )
    m_y, m_z = (Value(float(m), 0.01) for m in across + along)
    seen = seen_whisk(d_x_mm=Value(60.0, 0.0), beta_rad=Value(beta, 0.0), gave=gave)
    felt = FeltWhisk(0, m_y_Nmm=m_y, m_z_Nmm=m_z)
    return trial_result((seen,), (felt,), name="one", surface="foam")


@pytest.mark.parametrize("beta_deg", [0.0, 40.0, -40.0])
def test_compliance_is_the_way_over_the_normal_force(beta_deg):
    """0.625 mm at 3°, between the frames, by 0.05 N; sigmas of 0.01 mm and 0.01 N mm of 3."""
    one = result(beta_deg)
    give = give_seen(one, one.seen.whisks[0], one.felt.whisks[0])
    assert give.value == pytest.approx(0.625 / 0.05)
    assert give.sigma == pytest.approx(12.5 * np.hypot(0.01 / 0.625, 0.01 / 3.0), rel=1e-6)


def test_beyond_the_frames_nothing_is_told():
    one = result().seen.whisks[0]
    assert np.isnan(gave_at(one, np.radians(4.1)).value) and np.isnan(
        gave_at(one, np.radians(0.9)).value
    )
    assert mean_give([result(gave=None)]) == (UNKNOWN, 0)


def test_a_row_a_frame_and_none_where_it_stands(tmp_path):
    GivesWay().write(tmp_path, [result(gave=None)])
    assert not list(tmp_path.iterdir())
    GivesWay().write(tmp_path, [result()])
    written = rows(tmp_path / "gives_way.csv")
    assert [(row["frame"], float(row["gave_mm"])) for row in written] == [
        ("7", 0.25),
        ("8", 0.5),
        ("9", 0.75),
    ]


def test_a_record_has_no_key_of_an_object_that_stands():
    """Results of hard bars are the bytes that they were."""
    seen = result().seen.whisks[0]
    assert "gave" not in to_plain(replace(seen.truth, gave=None))
    assert from_plain(SeenWhisk, to_plain(seen)).truth.gave.normal_mm.value == pytest.approx(
        GAVE.normal_mm.value
    )


def test_what_moves_by_itself_does_not_give_way_too(tmp_path):
    session = simulate(
        tmp_path / "s",
        protocol=protocol_file(tmp_path, "[[trials]]\nstiffness_N_mm = 1\n"),
        signals_only=True,
    )
    (manifest,) = session.glob("trials/*/trial.toml")
    manifest.write_text(manifest.read_text() + "object_velocity_mm_s = [0, 1, 0]\n")
    with pytest.raises(BadInput, match="object_gives_way: an object that moves"):
        load_session(session)
