"""Every estimator gives the same answer in whatever units of length and force it is asked, for whiskers of any size,
stiffness and taper: x → s x, EI → f s² EI, moments → f s m."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from estimator import compliance, friction, load_cell, profile, slip
from estimator.beam import Beam
from estimator.both_ways import there_and_back
from estimator.builtin import ESTIMATORS, OF_CURVED, printed_17
from estimator.contact_state import contact_of
from estimator.contour import TouchingLines, contour
from estimator.longitudinal import compliance_with_rolling
from estimator.moving import known_motion
from estimator.onset import felt_touch
from estimator.reorientation import next_turn_rad, reoriented
from estimator.seen_shape import contact_of_shape
from estimator.sensors import SENSORS
from estimator.signal import moment_at
from estimator.two_tilts import _Equations, shared_contact
from estimator.whisk import EstimatorSettings, ObjectMotion, OtherSensors, Whisk
from tests.scenes.seen_shapes import shown

SAME = 1e-9
# A derivative is a difference over a millionth: rounding of its two values comes out a million times as large.
SAME_SIGMA = 1e-7


@dataclass(frozen=True)
class Units:
    """Length and force that are called 1."""

    length: float
    force: float

    @property
    def moment(self) -> float:
        return self.length * self.force

    @property
    def rigidity(self) -> float:
        return self.force * self.length**2


units = st.builds(Units, st.floats(1e-3, 1e3), st.floats(1e-6, 1e6))
MM_N = Units(1.0, 1.0)


@dataclass(frozen=True)
class Scene:
    """A whisker that pushes against a slope, by (13), (14), and how well this is felt."""

    rigidity_Nmm2: float
    length_mm: float
    diameter_mm: float
    loss: float
    part: float
    theta: float
    beta: float
    alpha: float
    noise: float
    turn: float = 0.0

    def beam(self, unit: Units) -> Beam:
        shape = ("cylinder",) if self.loss == 0 else ("cone",)
        if 0 < self.loss < 1:
            shape = ("tapered", 1 - self.loss)
        length = self.length_mm * unit.length
        tip = 0.5 * self.turn * length
        beam = Beam.from_rigidity(self.rigidity_Nmm2 * unit.rigidity, length, *shape)
        rest = ((0.0, 0.0, tip), (0.0, 0.0, -0.5 * tip))
        return replace(beam, rest_mm=rest, taper_sigma_per_mm=self.noise * self.loss / length)

    def felt(self, unit: Units, *, alpha=None, beta=None, theta=None) -> np.ndarray:
        """Return θ, m_y, m_z."""
        theta = theta or self.theta
        beam = self.beam(unit)
        d = beam.as_cylinder_mm(self.part * beam.length_mm)
        alpha = self.alpha if alpha is None else alpha
        m_y, m_z = slip.moments(d, theta, self.beta if beta is None else beta, alpha, beam.C_Nmm2)
        return np.array([theta, m_y, m_z])

    def whisk(self, unit: Units, **changed) -> Whisk:
        """Return the whisk with readings of all sensors, on an object that moves."""
        theta, m_y, m_z = self.felt(unit, **changed)
        beam = self.beam(unit)
        sigma = self.noise * np.hypot(*self.felt(unit)[1:])
        d_x = self.part * beam.length_mm
        force = np.array([0.0, m_z, -m_y]) / d_x
        others = OtherSensors(
            force,
            np.eye(3) * (sigma / d_x) ** 2,
            0.01,
            np.array([m_y, m_z]) / theta,
            np.eye(2) * (sigma / theta) ** 2,
        )
        motion = ObjectMotion(d_x * np.array([0.05, 0.1, -0.03]), np.eye(3) * (0.01 * d_x) ** 2)
        return replace(
            Whisk.without_samples(
                theta,
                (m_y, m_z),
                sigma**2 * np.array([[1.0, 0.2], [0.2, 1.5]]),
                beam,
                theta_sigma_rad=self.noise * theta,
                theta_moment_covariance_at=0.1 * self.noise * theta * sigma * np.ones(2),
            ),
            others=others,
            object_motion=motion,
        )

    def told(self, unit: Units) -> EstimatorSettings:
        """Return settings that allow for a bar and for the whisker's own radius."""
        radius = 0.5 * self.diameter_mm
        return EstimatorSettings(
            0.17,
            0.05,
            object_reach_mm=(radius + 0.03 * self.length_mm) * unit.length,
            tilt_sigma_rad=0.05,
            object_radius_mm=0.03 * self.length_mm * unit.length,
            whisker_radius_mm=radius * unit.length,
        )


scenes = st.builds(
    Scene,
    rigidity_Nmm2=st.floats(1e-3, 1e6),
    length_mm=st.floats(10.0, 500.0),
    diameter_mm=st.floats(0.05, 5.0),
    loss=st.one_of(st.just(0.0), st.just(1.0), st.floats(0.01, 0.99)),
    part=st.floats(0.05, 0.95),
    theta=st.floats(np.radians(0.1), np.radians(30.0)),
    beta=st.floats(-1.2, 1.2),
    alpha=st.floats(0.0, 0.5),
    noise=st.floats(1e-5, 0.03),
    turn=st.floats(-0.4, 0.4),
)


def same(one, other, rel=SAME):
    """Alike in parts of the larger, missing where the other is missing."""
    largest = np.abs(np.nan_to_num(one)).max(initial=0.0)
    np.testing.assert_allclose(other, one, rtol=rel, atol=rel * largest)


OTHERS = (printed_17, known_motion, reoriented, compliance_with_rolling)
NAMED = ESTIMATORS | OF_CURVED | SENSORS | {other.__name__: other for other in OTHERS}


@pytest.mark.parametrize("name", NAMED)
@settings(max_examples=30)
@given(scene=scenes, unit=units)
def test_estimates(name, scene, unit):
    one = NAMED[name](scene.whisk(MM_N), scene.told(MM_N))
    other = NAMED[name](scene.whisk(unit), scene.told(unit))
    assert getattr(one.status, "code", "") == getattr(other.status, "code", "")
    same(one.d_x_mm, other.d_x_mm / unit.length)
    same(one.sigma_mm, other.sigma_mm / unit.length, SAME_SIGMA)
    for end in ("low_mm", "high_mm"):
        found = getattr(other, end) / unit.length
        np.testing.assert_allclose(found, getattr(one, end), atol=SAME_SIGMA * scene.length_mm)
    same(one.beta_rad, other.beta_rad)


@settings(max_examples=60)
@given(scene=scenes, unit=units)
def test_the_contact_of_an_estimate(scene, unit):
    contacts = []
    for asked in (MM_N, unit):
        whisk = scene.whisk(asked)
        estimate = ESTIMATORS["with_friction"](whisk, scene.told(asked))
        contact = contact_of(whisk, estimate, 0.05)
        contacts.append(np.array(list(vars(contact).values())) / asked.length)
    same(*contacts, SAME_SIGMA)


@settings(max_examples=60)
@given(scene=scenes, unit=units)
def test_there_and_back(scene, unit):
    """On the way back friction pulls the other way."""
    found = []
    for asked in (MM_N, unit):
        there = scene.whisk(asked)
        back = scene.whisk(asked, alpha=0.5 * scene.alpha)
        contact = there_and_back(there, back, scene.told(asked))
        found.append((contact, asked))
    (one, _), (other, _) = found
    assert getattr(one.status, "code", "") == getattr(other.status, "code", "")
    for name in ("d_x_mm", "sigma_mm", "low_mm", "high_mm"):
        np.testing.assert_allclose(
            getattr(other, name) / unit.length,
            getattr(one, name),
            rtol=SAME_SIGMA,
            atol=SAME_SIGMA * scene.length_mm,
        )
    same(one.beta_rad, other.beta_rad, SAME_SIGMA)


@settings(max_examples=60)
@given(scene=scenes, unit=units, turned=st.floats(0.3, 0.8), apart=st.floats(0.0, 0.02))
def test_two_tilts(scene, unit, turned, apart):
    found = []
    for asked in (MM_N, unit):
        slopes = (0.6 * abs(scene.beta), 0.6 * abs(scene.beta) + turned)
        whisks = [scene.whisk(asked, beta=beta) for beta in slopes]
        settings_ = scene.told(asked)
        apart_mm = apart * scene.length_mm * asked.length
        contact = shared_contact(whisks, settings_, apart_sigma_mm=apart_mm)
        scale = np.array([asked.length, 1.0])
        found.append((contact.status, [contact.d_x_mm / asked.length, contact.alpha_rad]))
        found.append(contact.covariance / np.outer(scale, scale))
    (one, values), covariance, (other, in_units), its_covariance = found
    assert getattr(one, "code", "") == getattr(other, "code", "")
    same(values[0], in_units[0], SAME_SIGMA)
    np.testing.assert_allclose(in_units[1], values[1], atol=SAME_SIGMA)
    np.testing.assert_allclose(its_covariance, covariance, rtol=1e-5)


@settings(max_examples=100)
@given(scene=scenes, turned=st.floats(0.3, 0.8))
def test_two_tilts_have_converged_or_say_that_they_have_not(scene, turned):
    """Solved once more from its answer, it moves by less than a thousandth of its sigma."""
    slopes = (0.6 * abs(scene.beta), 0.6 * abs(scene.beta) + turned)
    whisks = [scene.whisk(MM_N, beta=beta) for beta in slopes]
    contact = shared_contact(whisks, scene.told(MM_N))
    if contact.status and contact.status.code != "friction_below_zero":
        assert contact.status.code in ("whisks_unconverged", "whisks_slip_alike")
        return
    d = scene.beam(MM_N).as_cylinder_mm(contact.d_x_mm)
    again = _Equations(whisks, scene.told(MM_N), 0.0 * np.eye(2), ())
    if contact.alpha_rad > 0:
        moved, covariance = again.refine(np.array([d, np.tan(contact.alpha_rad)]))
        assert abs(moved[0] - d) < 1e-3 * np.sqrt(covariance[0, 0]) + 1e-6 * d


@settings(max_examples=60)
@given(scene=scenes, unit=units, shift=st.floats(0.05, 0.5), give=st.floats(1e-3, 10.0))
def test_two_distances_of_a_soft_object(scene, unit, shift, give):
    """Two roots lie apart where the object gives way less than the whisker bends."""
    answers = []
    for asked in (MM_N, unit):
        beam = scene.beam(asked)
        per_mm = beam.taper / beam.length_mm
        near = 0.5 * scene.part * beam.length_mm
        far = shift * scene.part * beam.length_mm
        stiffness = beam.C_Nmm2 / (give * near**3)
        both = [
            compliance.compliance_on_soft_object(d, stiffness, beam.C_Nmm2, per_mm)
            for d in (near, near + far)
        ]
        d_x, found = compliance.two_distances(*both, far, beam.C_Nmm2, per_mm)
        answers.append([d_x / near, found / stiffness])
    np.testing.assert_allclose(answers[1], answers[0], rtol=1e-6)
    np.testing.assert_allclose(answers[0][0], 1.0, rtol=1e-5)


@settings(max_examples=40)
@given(scene=scenes, unit=units)
def test_the_fit_of_figure_8(scene, unit):
    """Fig. 8's least squares over slopes; rms goes with the moments."""
    slopes = np.radians(np.arange(0.0, 76.0, 5.0))
    noise = 0.05 * np.random.default_rng(1).standard_normal((2, len(slopes)))
    fits = []
    for asked in (MM_N, unit):
        beam = scene.beam(asked)
        d_x = beam.as_cylinder_mm(scene.part * beam.length_mm)
        moments = np.array(slip.moments(d_x, scene.theta, slopes, scene.alpha, beam.C_Nmm2))
        m_y, m_z = moments + noise * moments[1].max()
        pushes = friction.Pushes(slopes, m_y, m_z, d_x, scene.theta, beam.C_Nmm2)
        fits.append(friction.fit_alpha(pushes))
    one, other = fits
    assert getattr(one.status, "code", "") == getattr(other.status, "code", "")
    # Golden sections end where the sum of squares is flat to rounding: the root of ε.
    np.testing.assert_allclose(other.alpha_rad, one.alpha_rad, atol=1e-7)
    np.testing.assert_allclose(other.sigma_rad, one.sigma_rad, rtol=1e-5, atol=1e-7)
    same(one.rms, other.rms / unit.moment, SAME_SIGMA)


@settings(max_examples=60)
@given(scene=scenes, unit=units)
def test_a_load_cell_s_distance(scene, unit):
    found = []
    for asked in (MM_N, unit):
        theta, m_y, m_z = scene.felt(asked)
        d_x = scene.part * scene.length_mm * asked.length
        beam = scene.beam(asked)
        found.append(load_cell.distance(theta, m_y, m_z, 0.0, m_z / d_x, -m_y / d_x, beam) / d_x)
    same(*found)


@settings(max_examples=40)
@given(scene=scenes, unit=units)
def test_the_turn_of_a_reorientation(scene, unit):
    turns = [next_turn_rad(scene.whisk(asked), scene.told(asked)) for asked in (MM_N, unit)]
    same(*np.array(turns))


@settings(max_examples=12)
@given(scene=scenes, unit=units, pull=st.floats(-0.3, 0.3))
def test_a_contact_by_the_shape_of_the_whisker(scene, unit, pull):
    """By force and moment, with the covariance of both; pull: force along the whisker over that across it."""
    found = []
    for asked in (MM_N, unit):
        _, m_y, m_z = scene.felt(asked)
        beam = replace(scene.beam(asked), rest_mm=((0.0,), (0.0,)))
        d_x = scene.part * beam.length_mm
        force = np.array([pull * np.hypot(m_y, m_z), m_z, -m_y]) / d_x
        sigma = scene.noise * np.hypot(m_y, m_z)
        both = (sigma**2 * np.eye(2), force, (sigma / d_x) ** 2 * np.eye(3))
        point, covariance, why_none = profile.contact(np.array([m_y, m_z]), *both, beam)
        found.append((point / asked.length, covariance / asked.length**2, why_none))
    (one, covariance, why_none), (other, in_units, why_not) = found
    assert why_none == why_not
    same(one, other)
    same(covariance, in_units, SAME_SIGMA)


@settings(max_examples=40)
@given(unit=units, seed=st.integers(0, 99), size_mm=st.floats(0.5, 500.0))
def test_a_contour(unit, seed, size_mm):
    """Of lines that touch a disc."""
    rng = np.random.default_rng(seed)
    turns = np.sort(rng.uniform(0.0, 2 * np.pi, 9))
    normal = np.stack([-np.sin(turns), np.cos(turns)], axis=1)
    noise = 1 + 1e-3 * rng.normal(size=(9, 1))
    found = []
    for length in (size_mm, size_mm * unit.length):
        sizes = np.full(9, 0.01 * length)
        lines = TouchingLines(-length * noise * normal, turns, np.full(9, 0.01), sizes, sizes)
        outline = contour(lines)
        parts = [] if isinstance(outline, str) else list(vars(outline).items())
        found.append({name: values / (length if "mm" in name else 1) for name, values in parts})
    assert found[0].keys() == found[1].keys()
    for name, values in found[0].items():
        same(values, found[1][name], SAME_SIGMA)


@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(unit=units, seed=st.integers(0, 99), vibration=st.floats(0.0, 0.02))
def test_touch_and_moments_felt(stroke, unit, seed, vibration):
    """Of volts or moments of any size."""
    found = []
    one = stroke(np.random.default_rng(seed), vibration=vibration)
    for size in (1.0, unit.moment):
        touch = felt_touch(one.motor_rad, size * one.moments, one.time_s)
        at = moment_at(np.radians(3.0), one.motor_rad, size * one.moments, touch, time_s=one.time_s)
        angles = [touch.motor_rad, touch.sigma_rad]
        found.append((angles, at.values / size, at.covariance / size**2))
    for first, second in zip(*found):
        same(np.array(first), np.array(second))


@pytest.mark.parametrize("shape, length, force", [("tapered", 0.1, 1e-6), ("cone", 4.53, 1e3)])
def test_the_seen_shape(shape, length, force):
    """A fit ends where its cost is flat to 1e-8 of it, its step then being the root of that of a sigma; the step before is
    the same in all units to what differences for derivatives leave, the root of ε."""
    one = shown(np.random.default_rng(3), shape=shape)
    unit = Units(length, force)
    beam = Beam.from_rigidity(
        one.beam.rigidity_Nmm2 * unit.rigidity,
        one.beam.length_mm * unit.length,
        shape,
        *([one.beam.tip_share] if shape == "tapered" else []),
    )
    seen = replace(one.seen, eye_mm=one.seen.eye_mm * unit.length)
    first = contact_of_shape(one.seen, one.theta_rad, one.beam, reach_mm=3.0)
    second = contact_of_shape(seen, one.theta_rad, beam, reach_mm=3.0 * unit.length)
    assert first.status == second.status == ""
    scales = {"rad": 1.0, "mm": unit.length, "N": unit.force, "N_mm": unit.force / unit.length}
    for name, value in vars(first).items():
        if name == "status":
            continue
        scale = scales["N_mm"] if name.endswith("N_mm") else scales[name.rsplit("_", 1)[1]]
        tolerance = SAME if "sigma" not in name and "stiffness" not in name else 1e-6
        np.testing.assert_allclose(getattr(second, name) / scale, value, rtol=tolerance)
