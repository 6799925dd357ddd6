"""One push by the rig's exact mechanics with the force at the base, and a whisk as six axes feel it."""

from dataclasses import dataclass

import numpy as np

from bench.rig.elastic_rod import Rod
from bench.rig.linear import rotate_about_z
from bench.rig.rod_contact import moments_Nmm
from estimator.beam import Beam
from tests.scenes.marches import whisk

E_GPA, LENGTH_MM = 60.0, 100.0


@dataclass(frozen=True)
class Push:
    """What the base exerts at θ, hub's axes: moment (m_y, m_z), force (3,); the contact there; d_x at first touch."""

    theta_rad: float
    d_x_mm: float
    moment_Nmm: tuple[float, float]
    force_N: np.ndarray
    point_hub_mm: np.ndarray


def beam_of(shape: str = "cylinder", tip_share: float = 0.4) -> Beam:
    """The whisker of `pushed` as an estimator has it."""
    return Beam.from_modulus(E_GPA, 1.0, LENGTH_MM, shape, *[tip_share] * (shape == "tapered"))


def pushed(
    shape: str = "cylinder",
    *,
    beta_deg: float = 0.0,
    alpha_deg: float = 0.0,
    psi_deg: float = 0.0,
    d_x_mm: float = 60.0,
    radius_mm: float = 0.05,
    theta_deg: float = 3.0,
) -> Push:
    """A straight whisker pushed against a bar. Raises ArithmeticError where it finds no hold."""
    tip = {"tip_diameter_mm": 0.4} if shape == "tapered" else {}
    _, touch, states = whisk(
        theta_deg * np.arange(1, 7) / 6,
        rod=Rod(shape, LENGTH_MM, 1.0, E_GPA, **tip),
        d_x=d_x_mm,
        beta=beta_deg,
        psi=psi_deg,
        mu=np.tan(np.radians(alpha_deg)),
        radius=radius_mm,
    )
    state = states[-1]
    if state is None:
        raise ArithmeticError("no contact")
    point = rotate_about_z(state.point_mm, -state.motor_rad)
    return Push(np.radians(theta_deg), touch.d_x_mm, moments_Nmm(state), -state.force_hub_N, point)
