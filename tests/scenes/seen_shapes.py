"""A stroke by the rig's exact mechanics as one camera sees the whisker's shape: sights with noise, and what is true."""

from dataclasses import dataclass

import numpy as np

from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics
from estimator.beam import Beam
from estimator.seen_shape import SeenShape
from tests.scenes.marches import touched_bar

E_GPA, LENGTH_MM = 60.0, 100.0
ABOVE_MM, ASIDE_MM = np.array([50.0, 0.0, 400.0]), np.array([150.0, 150.0, 300.0])
_CLEAR_MM = 6.0  # of the wire to either side of the contact: the bar is before or behind it


@dataclass(frozen=True)
class Shown:
    """What one camera saw, and the truth at θ: touch, d_x, force across in the whisking plane, the contact's way."""

    seen: SeenShape
    beam: Beam
    theta_rad: float
    touch_rad: float
    d_x_mm: float
    force_N: float
    moved_mm: float


def shown(
    rng: np.random.Generator,
    *,
    shape: str = "cylinder",
    beta_deg: float = 0.0,
    alpha_deg: float = 10.0,
    psi_deg: float = 0.0,
    d_x_mm: float = 60.0,
    bar_mm: float = 6.0,
    theta_deg: float = 3.0,
    stiffness_N_mm: float = np.inf,
    eye_mm: np.ndarray = ABOVE_MM,
    sigma_mm: float = 0.01,
    off_mm: float = 0.0,
) -> Shown:
    """A stroke of 24 frames, a point each 3 mm. sigma_mm: of a point; off_mm: of what all points share, an offset and
    a tilt. Raises ArithmeticError where the whisker finds no hold."""
    rod = Rod(
        shape,
        LENGTH_MM,
        1.0,
        E_GPA,
        rest=RestShape(LENGTH_MM, 0.2, rng.normal(), rng.normal()),
        **({"tip_diameter_mm": 0.4} if shape == "tapered" else {}),
    )
    beta, psi, theta, mu = (
        *np.radians([beta_deg, psi_deg, theta_deg]),
        np.tan(np.radians(alpha_deg)),
    )
    bar, touch = touched_bar(
        rod,
        d_x_mm,
        beta_rad=beta,
        psi_rad=psi,
        touch_rad=0.05,
        radius_mm=0.5 * bar_mm,
        stiffness_N_mm=stiffness_N_mm,
    )
    wanted = touch.motor_rad + theta
    motor = np.append(np.linspace(touch.motor_rad - 0.05, wanted + 0.01, 23), wanted)
    motor.sort()
    whisk = WhiskMechanics.run(
        rod,
        bar,
        FrictionCoefficients(mu, mu),
        touch,
        motor.max(),
        step_rad=0.004,
        stops_rad=motor[motor > touch.motor_rad],
    )
    arc = np.arange(4.0, LENGTH_MM - 1.0, 3.0)
    arc = arc[np.abs(arc - d_x_mm) > _CLEAR_MM]
    curves = [whisk.centreline_mm(m, whisk.forward.state_between(m), arc) for m in motor]
    seen = _sights(rng, motor, np.array(curves), eye_mm, sigma_mm, off_mm)
    row = whisk.forward.row_at(wanted)
    moved = _towards(whisk.forward.point_mm[row], touch.motor_rad) - _towards(
        touch.point_mm, touch.motor_rad
    )
    beam = Beam.from_modulus(E_GPA, 1.0, LENGTH_MM, shape, *[0.4] * (shape == "tapered"))
    force = whisk.forward.force_N[row, 1]
    return Shown(seen, beam, theta, touch.motor_rad, touch.d_x_mm, float(force), moved)


def _towards(point_mm: np.ndarray, touch_rad: float) -> float:
    return float(-np.sin(touch_rad) * point_mm[0] + np.cos(touch_rad) * point_mm[1])


def _sights(rng, motor, curves, eye, sigma_mm, off_mm) -> SeenShape:
    """Lines from the eye to points of the curves (f, m, 3), each off across by noise and by what all share."""
    points, frame = curves.reshape(-1, 3), np.repeat(np.arange(len(motor)), curves.shape[1])
    tangents = np.gradient(curves, axis=1).reshape(-1, 3)
    ranges = np.linalg.norm(points - eye, axis=1)
    across = np.cross(tangents, points - eye)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    place = np.linspace(-1.0, 1.0, curves.shape[1])
    shared = (
        np.tile(np.stack([np.ones(len(place)), place], axis=1), (len(motor), 1))
        * (off_mm / ranges)[:, None]
    )
    off = sigma_mm * rng.normal(size=len(points)) + ranges * (shared @ rng.normal(size=2))
    sight = points + off[:, None] * across - eye
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    across -= np.einsum("ni,ni->n", across, sight)[:, None] * sight
    return SeenShape(motor, frame, eye, sight, across, sigma_mm / ranges, shared)
