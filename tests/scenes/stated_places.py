"""Drawn whisks before objects whose place a stage states, with the errors that its sigmas say."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import RestShape, Rod
from bench.rig.round_objects import TouchedCone, TouchedRing, TouchedSphere
from bench.rig.session_files import object_keys
from bench.rig.touched_object import TouchedObject
from bench.session.manifest import ObjectKeys
from bench.session.session import Session
from bench.session.signals import Signals
from bench.trials.stated_truth import stated_whisk

# One sigma of what a lab knows of place, origin, slope and diameter.
PLACE_MM = 0.05
ORIGIN_MM = 0.1
SLOPE_DEG = 0.5
BAR_MM = 0.02
SET_MM = 1.0  # at the tip of the whisker, as the stage's truth allows for
_RING_MM = 40.0  # radius of its circle
_CONE_RAD = math.radians(20.0)
_SPHERE_MM = 20.0  # radius: a whisker with a set passes no smaller one's pole
_TURNED = ("ring", "cone")  # their direction is stated, and wrong


@dataclass(frozen=True)
class DrawnWhisk:
    """What a stage's truth is off by in one whisk: d_x, mm, slope, rad, each with its sigma."""

    d_x_error_mm: float
    d_x_sigma_mm: float
    beta_error_rad: float
    beta_sigma_rad: float


# By shape: from a straight bar, and the point at which it is touched.
OBJECTS: dict[str, Callable[[TouchedBar, np.ndarray], TouchedObject]] = {
    "bar": lambda bar, at_mm: bar,
    "ring": lambda bar, at_mm: TouchedRing.from_bar(bar, at_mm, _RING_MM),
    "sphere": lambda bar, at_mm: TouchedSphere.from_trial(bar, at_mm, None),
    "cone": lambda bar, at_mm: TouchedCone.from_bar(bar, at_mm, _CONE_RAD),
}


def drawn_whisk(
    session: Session, trial: str, rng: np.random.Generator, shape: str = "bar"
) -> DrawnWhisk:
    """Return what the stage's truth of a drawn whisk is off by.

    First touch is the rig's, which shares no code with the bench's. The whisker keeps a set that nobody
    stated; the object is thinner or thicker, and stands elsewhere and otherwise, than is stated.
    """
    set_y_mm, set_z_mm = SET_MM * rng.standard_normal(2)
    rod = Rod("cylinder", 100.0, 1.0, 60.0, 6450.0, RestShape(100.0, 0.0, set_y_mm, set_z_mm))
    d_x_mm = rng.uniform(40.0, 80.0)
    beta_deg = rng.uniform(-65.0, 65.0)
    touch_rad = math.radians(rng.uniform(2.0, 6.0))
    radius_mm = _SPHERE_MM if shape == "sphere" else 3.0
    bar = TouchedBar.at_contact(
        d_x_mm=d_x_mm,
        beta_rad=math.radians(beta_deg),
        psi_rad=math.radians(SLOPE_DEG * rng.standard_normal()) if shape == "bar" else 0.0,
        touch_rad=touch_rad,
        radius_mm=radius_mm + 0.5 * BAR_MM * rng.standard_normal(),
        whisker_radius_mm=0.5,
    )
    touched_mm = d_x_mm * np.array([math.cos(touch_rad), math.sin(touch_rad), 0.0])
    touched = OBJECTS[shape](bar, touched_mm)
    touch = find_first_touch(rod, touched, touch_rad, d_x_mm)
    stated = _stated_keys(touched, rng)
    nominal = {"beta_deg": beta_deg + SLOPE_DEG * rng.standard_normal()} if shape == "bar" else {}
    known = replace(
        session.trial(trial),
        d_x_mm=None,
        object=stated,
        beta_deg=nominal.get("beta_deg"),
        beta_sigma_deg=SLOPE_DEG,
        bar_diameter_mm=2.0 * radius_mm,
        bar_diameter_sigma_mm=BAR_MM,
    )
    motor_rad = np.radians(np.linspace(-8.0, 15.0, 500))
    time_s = np.linspace(0.0, 2.3, 500)
    signals = Signals(time_s, motor_rad, np.zeros(500), np.zeros(500), "V")
    truth = stated_whisk(session, known, signals, slice(0, 500)).truth
    local = touched.local_bar(touch.point_mm)
    x, y, z = local.axis
    beta_rad = math.atan2(y * math.cos(touch.motor_rad) - x * math.sin(touch.motor_rad), z)
    return DrawnWhisk(
        truth.d_x_mm.value - touch.d_x_mm,
        truth.d_x_mm.sigma,
        truth.beta_rad.value - beta_rad,
        truth.beta_rad.sigma,
    )


def _stated_keys(touched: TouchedObject, rng: np.random.Generator) -> ObjectKeys:
    """Return what is stated of an object: its place, off by what stage and origin are, and its direction."""
    keys = (
        {"point_mm": touched.point_mm.tolist()} if touched.shape == "bar" else object_keys(touched)
    )
    keys["point_mm"] = (
        np.array(keys["point_mm"]) + np.hypot(PLACE_MM, ORIGIN_MM) * rng.standard_normal(3)
    ).tolist()
    if touched.shape in _TURNED:
        keys["axis"] = (
            np.array(keys["axis"]) + math.radians(SLOPE_DEG) * rng.standard_normal(3)
        ).tolist()
    return ObjectKeys(**keys, point_sigma_mm=PLACE_MM)
