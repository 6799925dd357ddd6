"""A whisk before any camera sees it: the rig's exact mechanics, in the terms in which vision fits it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from bench.rig.bar import TouchedBar, UnloadedTouch
from bench.rig.elastic_rod import Rod
from bench.rig.linear import rotate_about_z
from bench.rig.protocol import ProtocolRun
from bench.rig.recording import Recording
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics
from vision import KnownWhisk
from vision.geometry import Bar, BarAxis, ProfiledWire, Rods, Wire

# [rad] Step of the mechanics between frames. Stated.
_STEP_RAD = math.radians(0.1)
# [Hz] Of signals, which no plan reads. Stated.
_SLOW_HZ = 100.0
# [points] Along the rod, to which its rest shape is fitted. Stated.
_REST_POINTS = 50


@dataclass(frozen=True, eq=False)
class StagedWhisk:
    """One whisk of a plan.

    mechanics: of the rig. known: in vision's terms, in its frames. recording: what the
    rig paints it from; None of a session that was recorded.
    """

    mechanics: WhiskMechanics
    known: KnownWhisk
    recording: Recording | None = None


def stage_run(run: ProtocolRun) -> StagedWhisk:
    """Return a whisk of a rig's trial, with everything exactly where it is wanted.

    Raises ArithmeticError where the whisker slips off or buckles.
    """
    exact = {}
    for name in run.table.__struct_fields__:
        if name.endswith(("_scatter_deg", "_scatter_mm")):
            exact[name] = 0.0
    table = msgspec.structs.replace(run.table, whisks=1, **exact)
    protocol = run.protocol
    gauges = msgspec.structs.replace(
        protocol.gauges, vibration=False, filter_Hz=0.0, rate_Hz=_SLOW_HZ
    )
    friction = msgspec.structs.replace(protocol.friction, scatter=0.0, irregular=0.0)
    alone = msgspec.structs.replace(protocol, gauges=gauges, friction=friction)
    run = msgspec.structs.replace(run, table=table, protocol=alone)
    recording = Recording.make(run, np.random.default_rng(0))
    frames = recording.frames
    forth = ~frames.back
    whisk = as_staged(recording.whisks[0], frames.motor_rad[forth], frames.time_s[forth])
    return replace(whisk, recording=recording)


def stage_on_bar(
    rod: Rod,
    bar: TouchedBar,
    touch: UnloadedTouch,
    friction: float,
    motor_rad: Sequence[float],
    time_s: np.ndarray,
) -> StagedWhisk:
    """Return a whisk with one coefficient of friction, in frames at these motor angles (f,).

    Raises ArithmeticError where the whisker slips off or buckles.
    """
    motor = np.asarray(motor_rad, dtype=float)
    mechanics = WhiskMechanics.run(
        rod,
        bar,
        FrictionCoefficients(friction, friction),
        touch,
        float(motor.max()),
        step_rad=_STEP_RAD,
        stops_rad=motor,
    )
    return as_staged(mechanics, motor, time_s)


def as_staged(mechanics: WhiskMechanics, motor_rad: np.ndarray, time_s: np.ndarray) -> StagedWhisk:
    """Return a whisk of the rig in frames at these motor angles (f,); its diameters are exact."""
    rod = mechanics.rod
    touch = mechanics.touch
    bend_rad, arc_mm = _bends_and_arcs(mechanics, motor_rad)
    wire = _wire(rod)
    bar = Bar(2.0 * mechanics.bar.radius_mm)
    share = np.linspace(0.0, 1.0, _REST_POINTS)
    rest_offset_mm = rod.rest.point_mm(share * rod.length_mm)[:, 1:]
    foot_mm = mechanics.bar.foot_mm(touch.point_mm)  # of the bar's axis, opposite the contact
    known = KnownWhisk(
        rods=Rods(wire, bar),
        axis=BarAxis(foot_mm, mechanics.bar.axis).upward(),
        motor_rad=np.asarray(motor_rad),
        time_s=np.asarray(time_s),
        bend_rad=bend_rad,
        arc_mm=arc_mm,
        rest_mm=KnownWhisk.rest_shape(share, rest_offset_mm),
        touch_rad=touch.motor_rad,
        contact_mm=touch.point_mm,
    )
    return StagedWhisk(mechanics, known)


def _wire(rod: Rod) -> Wire:
    """Return a rod of the rig as cameras see it; its rest shape stands elsewhere."""
    tip = {"tip_diameter_mm": rod.tip_diameter_mm}
    if rod.widths:
        return ProfiledWire(rod.shape, rod.length_mm, rod.diameter_mm, **tip, widths=rod.widths)
    return Wire(rod.shape, rod.length_mm, rod.diameter_mm, **tip)


def _bends_and_arcs(
    mechanics: WhiskMechanics, motor_rad: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return bends (f, 2), rad, and contact arcs (f,), mm, at motor angles (f,)."""
    touch = mechanics.touch
    bends = []
    arcs_mm = []
    for motor in motor_rad:
        if motor > touch.motor_rad:
            state = mechanics.forward.state_at(motor)
            bends.append(_bend_rad(mechanics.rod, state))
            arcs_mm.append(state.arc_mm)
        else:
            bends.append(np.zeros(2))
            arcs_mm.append(touch.arc_mm)
    return np.array(bends), np.array(arcs_mm)


def _bend_rad(rod: Rod, state) -> np.ndarray:
    """Return the tangent angle (2,) at the contact, across and along the rotation axis, hub frame."""
    tangent = rotate_about_z(state.tangent, -state.motor_rad)
    deviation = tangent[1:] / np.linalg.norm(tangent) - rod.rest.tangent(state.arc_mm)[1:]
    sine = float(np.linalg.norm(deviation))
    if sine == 0.0:
        return deviation
    return deviation * (math.asin(min(sine, 1.0)) / sine)
