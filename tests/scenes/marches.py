"""Whisks of the rig's mechanics along pushing angles, and what the paper's small angles say of them."""

import math

import numpy as np

from bench.rig.bar import TouchedBar, UnloadedTouch, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.rig.rod_contact import moments_Nmm
from bench.rig.stick_slip import FrictionCoefficients, March

WIRE = Rod("cylinder", 100.0, 1.0, 60.0)
C = 3 * WIRE.rigidity_Nmm2
MU_10 = math.tan(math.radians(10))


def touched_bar(
    rod: Rod,
    d_x_mm: float,
    *,
    beta_rad: float = 0.0,
    psi_rad: float = 0.0,
    touch_rad: float = 0.0,
    radius_mm: float = 3.0,
    stiffness_N_mm: float = math.inf,
) -> tuple[TouchedBar, UnloadedTouch]:
    """Return a bar that a straight rod would touch at d_x and this motor angle, and where the rod, as it is
    unloaded, first touches it."""
    bar = TouchedBar.at_contact(
        d_x_mm=d_x_mm,
        beta_rad=beta_rad,
        psi_rad=psi_rad,
        touch_rad=touch_rad,
        radius_mm=radius_mm,
        whisker_radius_mm=float(rod.radius_mm(d_x_mm)),
        stiffness_N_mm=stiffness_N_mm,
    )
    return bar, find_first_touch(rod, bar, touch_rad, d_x_mm)


def whisk(
    thetas_deg,
    *,
    rod=WIRE,
    d_x=65.0,
    beta=60.0,
    psi=0.0,
    mu=MU_10,
    static=None,
    radius=3.0,
    touch_deg=0.0,
    rests=(1.0,),
):
    """(march, touch, states) along pushing angles."""
    bar, touch = touched_bar(
        rod,
        d_x,
        beta_rad=math.radians(beta),
        psi_rad=math.radians(psi),
        touch_rad=math.radians(touch_deg),
        radius_mm=radius,
    )
    march = March(
        rod, bar, FrictionCoefficients(mu if static is None else static, mu, rests=rests), touch
    )
    _, states = march.along(touch.motor_rad + np.radians(thetas_deg))
    return march, touch, states


def polar(state):
    """(|m|, φ in degrees)."""
    m_y, m_z = moments_Nmm(state)
    return math.hypot(m_y, m_z), math.degrees(math.atan2(m_y, m_z))


def small_angle(theta_deg, d_x, beta_deg, alpha_deg):
    """|m| and φ of equations (13), (14): (Cθ/d_x)·cos β/cos(β − φ), φ = max(0, β − α)."""
    phi = max(0.0, beta_deg - alpha_deg)
    share = math.cos(math.radians(beta_deg)) / math.cos(math.radians(beta_deg - phi))
    return C * math.radians(theta_deg) / d_x * share, phi


def slip_mm(march, touch, state):
    return (state.point_mm - touch.point_mm) @ march.contact.bar.axis
