"""The rig's rod and contact give the same answer in whatever units of length and force, for whiskers of any size and
stiffness, and refuse in all of them what has none."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.elastica import Elastica
from bench.rig.rod_contact import moments_Nmm
from bench.rig.stick_slip import FrictionCoefficients, March
from tests.scenes.marches import touched_bar

# Newton's last step is a millionth, after which the solution is exact to its square; a march adds up some twenty of them.
SAME = 1e-9

lengths = st.floats(10.0, 500.0)
rigidities = st.floats(1e-3, 1e6)
diameters = st.floats(0.05, 5.0)
length_units = st.floats(1e-2, 1e2)
force_units = st.floats(1e-6, 1e6)
losses = st.one_of(st.just(0.0), st.just(1.0), st.floats(0.05, 0.95))


def rod_of(length_mm, diameter_mm, rigidity_Nmm2, loss, bow=(0.0, 0.0, 0.0)) -> Rod:
    """A rod of EI at its base, and of a sag and a set in parts of its length."""
    shape = {0.0: "cylinder", 1.0: "cone"}.get(loss, "tapered")
    tip = {"tip_diameter_mm": (1 - loss) * diameter_mm} if shape == "tapered" else {}
    modulus_GPa = rigidity_Nmm2 / (1000 * np.pi * diameter_mm**4 / 64)
    rest = RestShape(length_mm, *(part * length_mm for part in bow))
    return Rod(shape, length_mm, diameter_mm, modulus_GPa, rest=rest, **tip)


def or_refused(solve, *arguments):
    """What is solved, or None where there is no equilibrium."""
    try:
        return solve(*arguments)
    except ArithmeticError:
        return None


@settings(max_examples=100)
@given(
    length_mm=lengths,
    rigidity=rigidities,
    diameter_mm=diameters,
    loss=losses,
    part=st.floats(0.1, 0.9),
    pull=st.floats(-2.0, 2.0),
    push=st.floats(0.0, 3.0),
    unit=length_units,
    force=force_units,
)
def test_the_elastica(length_mm, rigidity, diameter_mm, loss, part, pull, push, unit, force):
    """Loads in EI at the load's place over the arc's square."""
    answers = []
    for size, newton in ((1.0, 1.0), (unit, force)):
        rod = rod_of(
            length_mm * size, diameter_mm * size, rigidity * newton * size**2, loss, (0, 0, 0)
        )
        arc = part * rod.length_mm
        load = rod.rigidity_Nmm2 * float(rod.width(arc)) ** 2 / arc**2
        bent = or_refused(Elastica(rod).solve, pull * load, push * load, arc)
        answers.append(None if bent is None else np.append(bent.angle, bent.end_mm / arc))
    assert (answers[0] is None) == (answers[1] is None)
    if answers[0] is not None:
        np.testing.assert_allclose(answers[1], answers[0], rtol=SAME, atol=SAME)


@settings(max_examples=30)
@given(
    length_mm=lengths,
    rigidity=rigidities,
    diameter_mm=diameters,
    loss=losses,
    part=st.floats(0.2, 0.9),
    theta_deg=st.floats(0.1, 30.0),
    beta=st.floats(-1.2, 1.2),
    psi=st.floats(-0.3, 0.3),
    friction=st.floats(0.0, 0.4),
    excess=st.sampled_from([0.0, 0.0, 0.1]),
    bow=st.tuples(*[st.floats(-0.02, 0.02)] * 3),
    unit=length_units,
    force=force_units,
)
def test_a_contact_marched_from_touch(
    length_mm,
    rigidity,
    diameter_mm,
    loss,
    part,
    theta_deg,
    beta,
    psi,
    friction,
    excess,
    bow,
    unit,
    force,
):
    """Sliding, held or jumping between both, to the tip and off."""
    answers = []
    for size, newton in ((1.0, 1.0), (unit, force)):
        length = length_mm * size
        rod = rod_of(length, diameter_mm * size, rigidity * newton * size**2, loss, bow)
        answers.append(
            or_refused(_marched, rod, part * length, theta_deg, beta, psi, friction, excess)
        )
    one, other = answers
    assert (one is None) == (other is None)
    if one is not None:
        assert one[0] == other[0]
        np.testing.assert_allclose(other[1], one[1], rtol=SAME, atol=SAME)


def _marched(rod, d_x, theta_deg, beta, psi, friction, excess):
    """Status and values of each state on the way to θ, in lengths of the rod and EI."""
    radius_mm = 0.03 * rod.length_mm
    bar, touch = touched_bar(
        rod, d_x, beta_rad=beta, psi_rad=psi, touch_rad=0.04, radius_mm=radius_mm
    )
    march = March(rod, bar, FrictionCoefficients(friction + excess, friction), touch)
    path = touch.motor_rad + np.radians(theta_deg) * np.linspace(0.0, 1.0, 7)[1:]
    angles, states = march.along(path)
    values = [[touch.motor_rad, touch.arc_mm / rod.length_mm]]
    for state in states:
        if state is not None:
            moments = np.array(moments_Nmm(state)) * rod.length_mm / rod.rigidity_Nmm2
            values.append(state.point_mm / rod.length_mm)
            values.append([state.arc_mm / rod.length_mm, *moments])
    statuses = [None if state is None else state.status for state in states]
    return statuses, np.concatenate([angles, *values])
