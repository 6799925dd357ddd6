"""Pushes of curved, tapering whiskers against a bar, by the rig's exact mechanics: what is felt, and what pictures
without noise would show of the deflection."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from bench.rig.bar import TouchedBar, find_first_touch, unloaded_curve
from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.linear import rotate_about_z
from bench.rig.rod_contact import moments_Nmm
from bench.rig.stick_slip import FrictionCoefficients, March
from bench.session.whisker import Whisker

# A rat's vibrissa, as `simulate --protocol vibrissa` has it.
VIBRISSA = Rod("cone", 45.0, 0.2, 3.0, rest=RestShape(45.0, 0.0, -3.0, -4.0))
# One that is thicker at its root than a cone.
PROFILED = Rod(
    "tapered",
    45.0,
    0.2,
    3.0,
    rest=RestShape(45.0, 0.0, -3.0, -4.0),
    tip_diameter_mm=0.04,
    widths=(1.0, -0.35, -0.9, 0.4, 0.05),
)
NITINOL = Rod("cylinder", 100.0, 1.0, 60.0)
_STEPS = 6  # of the march from touch, as `bench.theory.model_error` has it


@dataclass(frozen=True)
class CurvedPush:
    """A push by theta_deg against a bar at right angles to the base's direction, with slope beta_deg."""

    rod: Rod = VIBRISSA
    d_x_mm: float = 20.0
    beta_deg: float = 0.0
    friction: float = 0.3
    theta_deg: float = 3.0
    bar_radius_mm: float = 1.0


@dataclass(frozen=True)
class Felt:
    """Moments m_y, m_z (2,), the force on the whisker (3,), N, in the hub's axes, true d_x;
    of the contact, what `records.trial_result.Deflection` has of one frame:
    along and across (2,), z and y, mm."""

    moments_Nmm: np.ndarray
    force_N: np.ndarray
    d_x_mm: float
    along_mm: float
    across_mm: np.ndarray


def feel(push: CurvedPush) -> Felt:
    """Return what a push gives at its end. Raises ArithmeticError where the whisker finds no hold."""
    rod = push.rod
    arc_mm = rod.rest.arc_at_mm(push.d_x_mm)
    bar = TouchedBar.at_contact(
        d_x_mm=push.d_x_mm,
        beta_rad=np.radians(push.beta_deg),
        psi_rad=0.0,
        touch_rad=0.0,
        radius_mm=push.bar_radius_mm,
        whisker_radius_mm=float(rod.radius_mm(push.d_x_mm)),
    ).shift(rod.rest.point_mm(arc_mm) - [push.d_x_mm, 0.0, 0.0])
    touch = find_first_touch(rod, bar, 0.0, arc_mm)
    march = March(rod, bar, FrictionCoefficients(push.friction, push.friction), touch)
    steps = np.radians(push.theta_deg) * np.arange(1, _STEPS + 1) / _STEPS
    _, states = march.along(touch.motor_rad + steps)
    if states[-1] is None:
        raise ArithmeticError("the whisker slips off the bar")
    along_mm, across_mm = deflection(rod, touch, states[-1])
    moments = np.array(moments_Nmm(states[-1]))
    return Felt(moments, states[-1].force_hub_N, touch.d_x_mm, along_mm, across_mm)


def deflection(rod: Rod, touch, state) -> tuple[float, np.ndarray]:
    """Return where the contact is along and across (z, y) the unbent whisker, mm, as `vision.fit.quantities` has it."""
    theta = state.motor_rad - touch.motor_rad
    first = rotate_about_z(touch.point_mm, -touch.motor_rad)
    point = rotate_about_z(state.point_mm, -touch.motor_rad)

    def unbent(arc):
        return unloaded_curve(rod, theta, arc)[0]

    at = brentq(lambda arc: unbent(arc)[0] - first[0], 0.0, rod.length_mm, xtol=1e-13)
    _, d_y, d_z = (unbent(at) - point) * [1.0, 1.0, -1.0]
    d_x = touch.d_x_mm
    beyond = point[0] - d_x
    along = d_x / np.cos(theta) - d_y * np.sin(theta) + beyond * np.cos(theta)
    return along, np.array([d_z, d_y * np.cos(theta) + beyond * np.sin(theta)])


def whisker_of(rod: Rod) -> Whisker:
    """Return the whisker whose session states a rod of even curvature."""
    curvature = 2.0 / rod.length_mm**2 * np.array([rod.rest.set_y_mm, rod.rest.set_z_mm])
    return Whisker(
        shape=rod.shape,
        length_mm=rod.length_mm,
        diameter_mm=rod.diameter_mm,
        tip_diameter_mm=rod.tip_diameter_mm,
        youngs_modulus_GPa=rod.youngs_modulus_GPa,
        rest_curvature_per_mm=curvature.tolist(),
        widths=getattr(rod, "widths", ()),
    )
