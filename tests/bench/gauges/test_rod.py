"""The rod against closed forms of the elastica in 50 digits, small deflections, and the recorded-like session's exact
mechanics; and the same answer in whatever unit it is asked."""

import tomllib

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from bench.gauges.clamped_rod import load_at_clamp

EI = 2945.2431  # N·mm²: 60 GPa, 1 mm


def uniform(arc):
    return EI + 0.0 * arc


def moment_at_clamp(*rod):
    return load_at_clamp(*rod).moment_Nmm


def elastica(end_angle: float, friction: float) -> tuple[float, float]:
    """(across/along, moment · along / EI) of a clamped elastica with tangent angle `end_angle` at its contact.

    EI ψ'²/2 = F (sin(ψ_e − ψ + λ) − sin λ), by quadrature in u = √(ψ_e − ψ), where the integrand is smooth, in 50
    digits. No code and no method is shared with `bench.gauges.clamped_rod`.
    """
    with mp.workdps(50):
        end, cone = mp.mpf(end_angle), mp.atan(mp.mpf(friction))

        def along(f):
            """∫ f(ψ) ds in units of √(EI/2F)."""
            return mp.quad(
                lambda u: (
                    f(end - u**2) * 2 * u / mp.sqrt(2 * mp.cos(cone + u**2 / 2) * mp.sin(u**2 / 2))
                ),
                [0, mp.sqrt(end)],
                method="gauss-legendre",
            )

        x, y = along(mp.cos), along(mp.sin)
        return float(y / x), float(x * mp.sqrt(mp.sin(end + cone) - mp.sin(cone)))


@settings(max_examples=25)
@given(
    end_angle=st.floats(1e-4, 0.75),
    friction=st.floats(-0.4, 0.3),
    along_mm=st.floats(2.0, 480.0),
    rigidity_Nmm2=st.floats(1e-3, 1e6),
)
def test_closed_form_of_the_elastica(end_angle, friction, along_mm, rigidity_Nmm2):
    """Of any size and stiffness. An angle of 1e-4 is held to ε/1e-4 by the contact's own rounding."""
    ratio, scaled = elastica(end_angle, friction)
    found = moment_at_clamp(
        along_mm, along_mm * ratio, lambda arc: rigidity_Nmm2 + 0 * arc, friction
    )
    assert found[0] * along_mm / rigidity_Nmm2 == pytest.approx(scaled, rel=1e-10)


def marched(loss: float, load: float, friction: float) -> tuple[float, float, float]:
    """(along, across, moment) of a tapering rod of EI = 1 at its clamp that is loaded at an arc of 1.

    From the contact, where all is known but its place, back to the clamp, and turned so that the clamp lies along x. loss:
    share of the diameter that is lost up to there.
    """

    def change(s, state):
        """ψ, x, y from the contact; the force's lever about (x, y)."""
        angle, x, y = state
        lever = -x * load - y * load * friction
        return lever / (1 - loss * s) ** 4, np.cos(angle), np.sin(angle)

    how = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
    angle, x, y = solve_ivp(change, (1.0, 0.0), np.zeros(3), **how).y[:, -1]
    c, s = np.cos(angle), np.sin(angle)
    return -x * c - y * s, x * s - y * c, -x * load - y * load * friction


@settings(max_examples=25)
@given(
    loss=st.floats(0.0, 0.85),
    load=st.floats(0.001, 1.0),
    friction=st.floats(-0.3, 0.3),
    scale=st.floats(0.1, 500.0),
)
def test_a_tapering_rod_follows_its_equation_marched_from_the_contact(loss, load, friction, scale):
    """The load's part of the rigidity there is that of the bend at the contact; up to 45°."""
    load = load * (1 - loss) ** 2
    along, across, moment = marched(loss, load, friction)

    def rigidity(arc):
        return (1 - loss * arc / scale) ** 4

    found = moment_at_clamp(along * scale, across * scale, rigidity, friction)
    assert found[0] * scale == pytest.approx(moment, rel=1e-8)


@settings(max_examples=100)
@given(
    length_mm=st.floats(10.0, 500.0),
    part=st.floats(0.05, 0.95),
    theta_deg=st.floats(0.1, 30.0),
    loss=st.floats(0.0, 1.0),
    friction=st.floats(-0.4, 0.0),
    rigidity_Nmm2=st.floats(1e-3, 1e6),
    length_unit=st.floats(1e-3, 1e3),
    force_unit=st.floats(1e-6, 1e6),
)
def test_the_answer_is_the_same_in_every_unit(
    length_mm, part, theta_deg, loss, friction, rigidity_Nmm2, length_unit, force_unit
):
    """Moment, force and the turn of the end; a rod that no force bends so is refused in every unit. The moment is near 1
    of small angles'."""
    theta = np.radians(theta_deg)

    def asked(length, rigidity):
        """Moment and force over their units, and the end's turn; None where the rod is refused."""
        x, w = part * length * np.cos(theta), part * length * np.sin(theta)
        try:
            load = load_at_clamp(
                x, w, lambda arc: rigidity * (1 - loss * arc / length) ** 4, friction
            )
        except ArithmeticError:
            return None
        force = load.force_N[:, 0] * length**2
        return (
            np.array([load.moment_Nmm[0] * length, *force, load.end_rad[0] * rigidity]) / rigidity
        )

    one = asked(length_mm, rigidity_Nmm2)
    other = asked(length_mm * length_unit, rigidity_Nmm2 * force_unit * length_unit**2)
    assert (one is None) == (other is None)
    if one is not None:
        np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-9 * np.abs(one).max())
        bent = theta / (1 - loss * part)  # how far the rod's end turns, but for a factor near 1
        small = 3 * theta * (1 / part - loss)
        assert one[0] / small == pytest.approx(1.0, abs=bent * (0.3 + bent))
    else:
        assert theta_deg / (1 - loss * part) > 30.0


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
    with pytest.raises(ArithmeticError, match="in front of the clamp"):
        moment_at_clamp(along, across, uniform)
