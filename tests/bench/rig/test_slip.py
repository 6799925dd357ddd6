"""Slip in both directions of a rounded surface: by the energy that friction takes, and by a rod that is shot."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.rig.elastica import Elastica
from bench.rig.linear import rotate_about_z
from bench.rig.round_objects import TouchedCone, TouchedRing, TouchedSphere
from bench.rig.simulation import simulate
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.surface_slip import slips_mm
from bench.rig.whisk_mechanics import WhiskMechanics
from tests.scenes.rig_sessions import protocol_file, rows

ROD = Rod("cylinder", 100.0, 1.0, 60.0)
TOUCHED = rotate_about_z(np.array([60.0, 0.0, 0.0]), 0.04)
BAR = TouchedBar.at_contact(
    d_x_mm=60.0, beta_rad=0.6, psi_rad=0.0, touch_rad=0.04, radius_mm=20.0, whisker_radius_mm=0.5
)
BALL = TouchedSphere(BAR.point_mm, BAR.axis, 20.0)
THINGS = [
    BAR,
    TouchedRing.from_bar(BAR, TOUCHED, 20.0),
    BALL,
    TouchedCone.from_bar(BAR, TOUCHED, 0.35),
]


def marched(
    thing: TouchedBar, mu: float, step_deg: float = 0.1, back: bool = False
) -> WhiskMechanics:
    touch = find_first_touch(ROD, thing, 0.04, 60.0)
    end, step = touch.motor_rad + math.radians(4.0), math.radians(step_deg)
    return WhiskMechanics.run(
        ROD, thing, FrictionCoefficients(mu, mu, 1e-3), touch, end, step_rad=step, back=back
    )


def shears(whisk: WhiskMechanics) -> np.ndarray:
    """(n, 2) N: force of the object on the whisker along its axis and round it."""
    found = []
    for state in whisk.forward.states:
        way, _, axis, _ = whisk.bar.local_bar(state.point_mm)
        force, normal = (
            rotate_about_z(state.force_hub_N, state.motor_rad),
            way / np.linalg.norm(way),
        )
        found.append([force @ axis, force @ np.cross(axis, normal)])
    return np.array(found)


def bending_Nmm(state) -> float:
    """Half of M²/EI over the arc, M the moment of the force about each place."""
    elastica, force = Elastica(ROD), state.force_hub_N
    across = math.hypot(force[1], force[2])
    bent, nodes = elastica.solve(force[0], across, state.arc_mm, state.shape), elastica.nodes
    x, e = (
        bent.arc_mm * nodes.from_base @ part for part in (np.cos(bent.angle), np.sin(bent.angle))
    )
    moment = across * (x[-1] - x) - force[0] * (e[-1] - e)
    return bent.arc_mm * float(nodes.weights @ moment**2) / (2 * ROD.rigidity_Nmm2)


@pytest.mark.parametrize("thing", THINGS, ids=lambda thing: type(thing).__name__)
@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_what_the_motor_does_is_bending_and_friction_over_the_slide(thing, mu):
    """By trapezes of 0.1°: 1e-4 of the work, where the largest that is left is 3.7e-5. Friction takes a tenth of it."""
    whisk = marched(thing, mu)
    way, shear = whisk.forward, shears(whisk)
    work = float(
        np.sum((way.moment_Nmm[1:, 1] + way.moment_Nmm[:-1, 1]) / 2 * np.diff(way.motor_rad))
    )
    slid = np.diff(slips_mm(whisk, False)[:, 2:], axis=0)
    taken = -float(np.sum((shear[1:] + shear[:-1]) / 2 * slid))
    assert work == pytest.approx(bending_Nmm(way.states[-1]) + taken, rel=1e-4)
    assert taken == pytest.approx(0.0, abs=1e-12) if mu == 0 else taken > 0.07 * work


def shot(force, arc, motor):
    """A rod as an initial-value problem: centreline (3,) and tangent (3,) over its arc under a force at `arc`."""
    base = np.append(np.zeros(3), [math.cos(motor), math.sin(motor), 0.0])

    def made(end):
        def rates(_, here):
            moment = np.cross(end - here[:3], force)
            return np.append(here[3:], np.cross(moment, here[3:]) / ROD.rigidity_Nmm2)

        return solve_ivp(rates, (0.0, arc), base, rtol=1e-9, atol=1e-11, dense_output=True)

    return made


def pushed_on(motor, guess, before, mu):
    """Unknowns (7,): force, arc, loaded point. The friction is against the motion of the loaded material since
    `before`, a centreline."""

    def residual(unknowns):
        force, arc, end = unknowns[:3], unknowns[3], unknowns[4:]
        last = shot(force, arc, motor)(end).y[:, -1]
        apart = end - BALL.point_mm
        normal = apart / np.linalg.norm(apart)
        moved = end - before(arc)
        aside = moved - (moved @ normal) * normal
        press = force @ normal
        shear = force - press * normal + mu * press * aside / np.linalg.norm(aside)
        law = shear @ np.linalg.svd(normal[None])[2][1:].T
        return [*(last[:3] - end), np.linalg.norm(apart) - 20.5, apart @ last[3:], *law]

    found, _, settled, _ = fsolve(residual, guess, full_output=True, xtol=1e-11)
    assert settled == 1
    return found


@pytest.mark.parametrize("mu", [1e-9, 0.2])
def test_a_sphere_by_shooting(mu):
    """Steps of 1° from the rig's own first one, which is taken over. The rig takes the old rod as straight at its
    load, where its moment is 0: to the third order in how far the contact went along it, and both solve to 1e-9."""
    states = marched(BALL, mu, step_deg=1.0).forward.states[1:]

    def centreline(unknowns, motor):
        path = shot(unknowns[:3], unknowns[3], motor)(unknowns[4:])
        last = path.y[:, -1]
        return lambda arc: (
            path.sol(arc)[:3] if arc <= unknowns[3] else last[:3] + (arc - unknowns[3]) * last[3:]
        )

    unknowns = np.concatenate(
        [
            rotate_about_z(states[0].force_hub_N, states[0].motor_rad),
            [states[0].arc_mm],
            states[0].point_mm,
        ]
    )
    motor = states[0].motor_rad
    for state in states[1:]:
        before = centreline(unknowns, motor)
        guess = np.concatenate(
            [rotate_about_z(state.force_hub_N, state.motor_rad), [state.arc_mm], state.point_mm]
        )
        motor = state.motor_rad
        unknowns = pushed_on(motor, guess + 1e-3, before, mu)
        np.testing.assert_allclose(unknowns[4:], state.point_mm, atol=1e-8)
        np.testing.assert_allclose(unknowns[:3], guess[:3], atol=1e-9)


def test_on_a_straight_bar_the_path_along_it_is_the_slip():
    whisk = marched(BAR, 0.2, back=True)
    for back in (False, True):
        sums = slips_mm(whisk, back)
        slip = whisk.slip_mm(whisk.path(back).point_mm, whisk.path(back).motor_rad)
        np.testing.assert_allclose(sums[:, 0], slip, atol=1e-9)


def test_truth_of_rounded_objects_has_both_directions(tmp_path):
    text = (
        '[[trials]]\nbeta_deg = 40\nbeta_scatter_deg = 0\nbar_diameter_mm = 40\nobject = "sphere"\n'
    )
    session = simulate(tmp_path / "s", protocol=protocol_file(tmp_path, text), signals_only=True)
    (path,) = session.glob("trials/*/truth.csv")
    touching = [row for row in rows(path) if row["contact"] == "1"]
    assert float(touching[-1]["along_mm"]) > 1.0 and float(touching[-1]["round_mm"]) < -0.3
    assert abs(float(touching[-1]["slid_round_mm"])) < 0.2
