"""Whiskers that taper, from a session's signals alone to α and d_x; and how the session states them."""

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.rig.simulation import simulate
from bench.session.session import load_session
from bench.session.whisker import Whisker
from bench.workflows.session_evaluation import evaluate
from tests.scenes.results import table

ALPHA_DEG, D_X_MM = 10.5, 55.0
PROTOCOL = """
name = "tapering"
[whisker]
shape = "{shape}"
length_mm = 100.0
diameter_mm = 1.0
{tip}
[gauges]
known = true
[[trials]]
beta_deg = [0, 15, 30, 50, 65]
d_x_mm = 55.0
beta_scatter_deg = 0.0
d_x_scatter_mm = 0.0
"""


@pytest.fixture(scope="module", params=["cylinder", "cone", "tapered"])
def evaluated(request, tmp_path_factory):
    """Folder of results of a session without pictures, on a bar as wanted."""
    folder = tmp_path_factory.mktemp(request.param)
    tip = "tip_diameter_mm = 0.4" if request.param == "tapered" else ""
    (folder / "protocol.toml").write_text(PROTOCOL.format(shape=request.param, tip=tip))
    session = simulate(
        folder / "session", protocol=str(folder / "protocol.toml"), signals_only=True, seed=3
    )
    evaluate(session, folder / "out", Settings(alpha_est_deg=ALPHA_DEG))
    return folder


def test_fitted_friction_is_that_of_the_rig(evaluated):
    (row,) = table(evaluated / "out" / "surfaces.csv")
    assert float(row["alpha_least_squares_deg"]) == pytest.approx(ALPHA_DEG, abs=0.4)


def test_10_at_the_right_friction_finds_the_distance(evaluated):
    rows = [
        r for r in table(evaluated / "out" / "estimates.csv") if r["estimator"] == "with_friction"
    ]
    gentle = [r for r in rows if r["trial"].split("_")[1] in ("b00", "b15", "b30")]
    assert len(gentle) == 3
    for row in gentle:
        assert float(row["d_x_est_mm"]) == pytest.approx(D_X_MM, rel=0.015)
    for row in rows:
        assert float(row["d_x_est_low_mm"]) < D_X_MM < float(row["d_x_est_high_mm"])


def test_the_session_states_the_whisker(evaluated):
    session = load_session(evaluated / "session")
    whisker = session.whisker
    assert whisker.wire.radius_mm(100.0) == pytest.approx(
        {"cylinder": 0.5, "cone": 0.0, "tapered": 0.2}[whisker.shape]
    )
    assert whisker.beam.taper == pytest.approx(
        {"cylinder": 0.0, "cone": 1.0, "tapered": 0.6}[whisker.shape]
    )


@pytest.mark.parametrize(
    "line, said",
    [
        ('shape = "tapered"', "tip_diameter_mm belongs to"),
        ('shape = "cone"\ntip_diameter_mm = 0.4', "tip_diameter_mm belongs to"),
        ('shape = "tapered"\ntip_diameter_mm = 1.2', "must be below diameter_mm"),
    ],
)
def test_tips_that_cannot_be_are_refused(without_pictures, line, said):
    path = without_pictures / "session.toml"
    path.write_text(path.read_text().replace('shape = "cylinder"', line))
    with pytest.raises(BadInput, match=said):
        load_session(without_pictures)


def test_a_cone_and_a_cylinder_are_the_ends_of_a_tapered_whisker():
    """Compliance against its own integral, ∫ (d_x − s)²/EI ds, and both ends within what is left of the taper."""
    from estimator.beam import Beam

    d_x, C = 60.0, 9000.0
    for share in (1e-6, 0.4, 1 - 1e-6):
        s = np.linspace(0.0, d_x, 20001)
        softness = (d_x - s) ** 2 / (C / 3 * (1 - (1 - share) * s / 100.0) ** 4)
        deflection = np.trapezoid(softness, s) / d_x  # of a moment of 1 at the base
        beam = Beam(C, 100.0, "tapered", share)
        assert beam.moment_Nmm(deflection / d_x, d_x) == pytest.approx(1.0, rel=1e-7)
        assert beam.distance_mm(beam.as_cylinder_mm(d_x)) == pytest.approx(d_x, rel=1e-12)
    assert Beam(C, 100.0, "tapered", 1 - 1e-9).as_cylinder_mm(d_x) == pytest.approx(60.0, rel=1e-8)
    assert Beam(C, 100.0, "cone").as_cylinder_mm(d_x) == pytest.approx(150.0)


def test_length_and_both_diameters_are_in_the_taper_s_sigma():
    """Each by what the taper per mm changes by at one sigma of it."""
    sizes = {"length_mm": 80.0, "diameter_mm": 1.5, "tip_diameter_mm": 0.6}
    whisker = Whisker(
        shape="tapered",
        youngs_modulus_GPa=3.0,
        length_sigma_mm=0.5,
        diameter_sigma_mm=0.02,
        **sizes,
    )

    def taper_per_mm(**changed):
        of = sizes | changed
        return (1.0 - of["tip_diameter_mm"] / of["diameter_mm"]) / of["length_mm"]

    moved = [
        taper_per_mm(length_mm=80.5) - taper_per_mm(),
        taper_per_mm(diameter_mm=1.52) - taper_per_mm(),
        taper_per_mm(tip_diameter_mm=0.62) - taper_per_mm(),
    ]
    assert whisker.beam.taper_sigma_per_mm == pytest.approx(np.linalg.norm(moved), rel=0.02)
    assert whisker.beam.length_sigma_mm == 0.5
