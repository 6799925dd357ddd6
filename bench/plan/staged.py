"""A whisk before any camera sees it: the rig's exact mechanics, in the terms in which vision fits a whisk."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from bench.rig.bar import TouchedBar, UnloadedTouch
from bench.rig.elastic_rod import Rod
from bench.rig.linear import rotate_about_z
from bench.rig.protocol import Protocol, ProtocolRun
from bench.rig.recording import Recording
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics
from vision.geometry import rods as seen_rods
from vision.geometry.centreline import REST_POWERS
from vision.geometry.contact import BarAxis

_STEP_RAD = math.radians(0.1)  # of the mechanics between frames
_SLOW_HZ = 100.0  # of signals that nobody looks at


@dataclass(frozen=True, eq=False)
class Staged:
    """One whisk to be seen.

    motor_rad, time_s (f,): of its frames; bend_rad (f, 2), arc_mm (f,): bend and contact in each, before touch 0 and
    those of the touch; rest_mm (2, 4): the unbent whisker, as `vision.geometry.centreline` has it. recording: what
    the rig paints it from, None of a session that was recorded.
    """

    whisk: WhiskMechanics
    rods: seen_rods.Rods
    motor_rad: np.ndarray
    time_s: np.ndarray
    bend_rad: np.ndarray
    arc_mm: np.ndarray
    rest_mm: np.ndarray
    recording: Recording | None = None

    @property
    def touch(self) -> UnloadedTouch:
        """First touch."""
        return self.whisk.touch

    @property
    def foot_mm(self) -> np.ndarray:
        """The point (3,) of the bar's axis opposite the first contact."""
        return self.whisk.bar.foot_mm(self.touch.point_mm)

    @property
    def axis(self) -> BarAxis:
        """The bar's axis, its point opposite the first contact."""
        return BarAxis(self.foot_mm, self.whisk.bar.axis).upward()


def of_run(protocol: Protocol, run: ProtocolRun) -> Staged:
    """A whisk of a protocol's trial, everything where it was wanted. Raises ArithmeticError where the whisker slips off
    or buckles."""
    plain = {
        name: 0.0
        for name in run.table.__struct_fields__
        if name.endswith(("_scatter_deg", "_scatter_mm"))
    }
    table = msgspec.structs.replace(run.table, whisks=1, **plain)
    gauges = msgspec.structs.replace(
        protocol.gauges, vibration=False, filter_Hz=0.0, rate_Hz=_SLOW_HZ
    )
    friction = msgspec.structs.replace(protocol.friction, scatter=0.0, irregular=0.0)
    alone = msgspec.structs.replace(protocol, gauges=gauges, friction=friction)
    made = Recording.make(
        alone, msgspec.structs.replace(run, table=table), np.random.default_rng(0)
    )
    forth = ~made.frames.back
    return replace(
        staged(made.whisks[0], made.frames.motor_rad[forth], made.frames.time_s[forth]),
        recording=made,
    )


def on_bar(
    rod: Rod,
    bar: TouchedBar,
    touch: UnloadedTouch,
    friction: float,
    motor_rad: Sequence[float],
    time_s: np.ndarray,
) -> Staged:
    """A whisk over these motor angles with one coefficient of friction. Raises ArithmeticError as `of_run`."""
    motor = np.asarray(motor_rad, dtype=float)
    whisk = WhiskMechanics.run(
        rod,
        bar,
        FrictionCoefficients(friction, friction),
        touch,
        float(motor.max()),
        step_rad=_STEP_RAD,
        stops_rad=motor,
    )
    return staged(whisk, motor, time_s)


def staged(whisk: WhiskMechanics, motor_rad: np.ndarray, time_s: np.ndarray) -> Staged:
    """A whisk of the rig in vision's terms, at the motor angles of the frames (f,); diameters are exact."""
    states = [
        whisk.forward.state_at(motor) if motor > whisk.touch.motor_rad else None
        for motor in motor_rad
    ]
    bends = [np.zeros(2) if state is None else _bend(whisk.rod, state) for state in states]
    arcs = [whisk.touch.arc_mm if state is None else state.arc_mm for state in states]
    rod = whisk.rod
    wire = seen_rods.Wire(
        rod.shape, rod.length_mm, rod.diameter_mm, tip_diameter_mm=rod.tip_diameter_mm
    )
    rods = seen_rods.Rods(wire, seen_rods.Bar(2.0 * whisk.bar.radius_mm))
    return Staged(
        whisk,
        rods,
        np.asarray(motor_rad),
        np.asarray(time_s),
        np.array(bends),
        np.array(arcs),
        _rest(rod),
    )


def _bend(rod: Rod, state) -> np.ndarray:
    """Tangent angle (2,) at the contact, across and along the rotation axis, hub frame."""
    tangent = rotate_about_z(state.tangent, -state.motor_rad)
    aside = tangent[1:] / np.linalg.norm(tangent) - rod.rest.slope(state.arc_mm)[1:]
    size = float(np.linalg.norm(aside))
    return aside * (math.asin(min(size, 1.0)) / size if size > 0.0 else 1.0)


def _rest(rod: Rod) -> np.ndarray:
    """The rod's rest shape as polynomials (2, 4) of the share of its length."""
    share = np.linspace(0.0, 1.0, 50)
    powers = np.vander(share, REST_POWERS, increasing=True)
    return np.linalg.lstsq(powers, rod.rest.offset_mm(share * rod.length_mm)[:, 1:], rcond=None)[
        0
    ].T
