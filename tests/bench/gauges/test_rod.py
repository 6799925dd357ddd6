"""The rod against closed forms of the elastica, small deflections, and the recorded-like session's exact mechanics."""

import tomllib

import numpy as np
import pytest

from bench.gauges.clamped_rod import moment_at_clamp

EI = 2945.2431  # N·mm²: 60 GPa, 1 mm


def uniform(arc):
    return EI + 0.0 * arc


def elastica(end_angle: float, friction_angle: float) -> tuple[float, float]:
    """(across/along, moment · along / EI) of a clamped elastica with tangent angle `end_angle` at its contact.

    EI ψ'²/2 = F (sin(ψ_e − ψ + λ) − sin λ), by quadrature in u = √(ψ_e − ψ), where the integrand is smooth. No code and
    no method is shared with the fixed point of `bench.gauges.clamped_rod`.
    """
    u, w = np.polynomial.legendre.leggauss(60)
    u, w = 0.5 * np.sqrt(end_angle) * (u + 1), 0.5 * np.sqrt(end_angle) * w
    bend = np.sqrt(np.sin(u**2 + friction_angle) - np.sin(friction_angle))
    along, across = (np.sum(w * f(end_angle - u**2) * 2 * u / bend) for f in (np.cos, np.sin))
    return across / along, along * np.sqrt(
        np.sin(end_angle + friction_angle) - np.sin(friction_angle)
    )


@pytest.mark.parametrize("end_angle", [1e-3, 0.05, 0.2, 0.5])
@pytest.mark.parametrize("friction", [-0.4, 0.0, 0.2])
def test_closed_form_of_the_elastica(end_angle, friction):
    ratio, scaled = elastica(end_angle, np.arctan(friction))
    assert moment_at_clamp(50.0, 50.0 * ratio, uniform, friction)[0] == pytest.approx(
        EI / 50.0 * scaled, rel=1e-9
    )


def test_small_deflections_go_over_into_the_beam_equation():
    """m = C w/x² with an error of the order (w/x)²."""
    assert moment_at_clamp(60.0, 0.06, uniform)[0] == pytest.approx(
        3 * EI * 0.06 / 60.0**2, rel=1e-5
    )


def test_a_cone_follows_the_papers_equation():
    """Its compliance is that of the cylinder and 1/L more in 1/d_x: m = Cθ (1/d_x − 1/L)."""
    moment = moment_at_clamp(60.0, 60.0e-3, lambda s: EI * (1 - s / 100.0) ** 4)[0]
    assert moment == pytest.approx(3 * EI * 1e-3 * (1 / 60.0 - 1 / 100.0), rel=1e-4)


def test_scale_and_mirror():
    """A rod twice as large with the same shape has half the curvature; a push from the other side is the same push."""
    one, twice = moment_at_clamp([50.0, 100.0], [5.0, 10.0], uniform)
    assert twice == pytest.approx(one / 2, rel=1e-12)
    assert moment_at_clamp(50.0, -5.0, uniform)[0] == pytest.approx(one, rel=1e-9)


def test_friction_away_from_the_clamp_stiffens():
    """0.2 · μ · w/x to first order: bending lever and moment lever differ by a fifth."""
    smooth, rough = (moment_at_clamp(50.0, 1.0, uniform, friction)[0] for friction in (0.0, -0.2))
    assert rough / smooth - 1 == pytest.approx(0.2 * 0.2 * 1.0 / 50.0, rel=0.1)


@pytest.mark.parametrize(
    "trial, sliding_along", [("b60_4", 0.0), ("b30_3", 0.0), ("b00_2", 1.0), ("gauge_roll0", 1.0)]
)
def test_exact_mechanics_of_the_sample_session(steel_signals, trial, sliding_along):
    """Within 0.02 %. Where the whisker slips across, friction is spent there; at β = 0 it acts along the rod."""
    folder = steel_signals / "trials" / trial
    table = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    table = table[table["contact"] == 1]
    mu = tomllib.loads((folder / "truth.toml").read_text())["mu_kinetic"]
    motor = np.radians(table["motor_deg"])
    x, y, z = (table[name] for name in ("x_mm", "y_mm", "z_mm"))
    along, across = (
        np.cos(motor) * x + np.sin(motor) * y,
        np.hypot(np.cos(motor) * y - np.sin(motor) * x, z),
    )
    expected = np.hypot(table["m_y_Nmm"], table["m_z_Nmm"])
    assert moment_at_clamp(along, across, uniform, -mu * sliding_along) == pytest.approx(
        expected, rel=2e-4
    )


@pytest.mark.parametrize("along, across", [(-1.0, 0.0), (10.0, 8.0)])
def test_refuses_what_no_whisker_does(along, across):
    with pytest.raises(ValueError, match="in front of the clamp"):
        moment_at_clamp(along, across, uniform)
