"""One trial as it is recorded: bar, whiskers' mechanics, signals, frame times and truth. Pictures come on top."""

import math
from dataclasses import dataclass

import numpy as np

from bench.rig import build
from bench.rig.bar import Bar, Touch, first_touch
from bench.rig.contact import State
from bench.rig.friction import Friction
from bench.rig.protocol import Protocol, Run
from bench.rig.rod import Rod
from bench.rig.stroke import Stroke
from bench.rig.vibration import Mode, ring
from bench.rig.whisk import Whisk

_STEP_RAD = math.radians(0.1)


@dataclass(frozen=True, eq=False)
class Frames:
    """The instants at which the cameras' exposures are at their middle, over all whisks."""

    time_s: np.ndarray
    motor_rad: np.ndarray
    whisk: np.ndarray


@dataclass(frozen=True, eq=False)
class Recording:
    """A trial's mechanics and signals. `states` holds the contact at each frame, None where free."""

    run: Run
    rod: Rod
    bar: Bar
    touch: Touch
    stroke: Stroke
    whisks: tuple[Whisk, ...]
    frames: Frames
    states: tuple[State | None, ...]
    signals: np.ndarray  # (n, 4): time_s, motor_deg, y_V, z_V

    @classmethod
    def make(cls, protocol: Protocol, run: Run, rng: np.random.Generator) -> "Recording":
        """The trial that a seeded generator makes of a run; the same in every process."""
        rod = build.rod(protocol)
        bar, touch = _placed(protocol, run, rod, rng)
        stroke = _stroke(protocol, run, touch)
        frames = _frames(protocol, run, touch, stroke)
        whisks = tuple(_whisks(protocol, run, rod, bar, touch, stroke, frames, rng))
        states = tuple(whisks[w].state_at(m) for w, m in zip(frames.whisk, frames.motor_rad))
        signals = _signals(protocol, run, stroke, whisks, rng)
        return cls(run, rod, bar, touch, stroke, whisks, frames, states, signals)


def _placed(protocol, run, rod, rng):
    """The bar as the bench's people set it, near what they wanted, and the angle at which the whisker touches it."""
    table = run.table
    beta, psi, d_x, touch = (value + scatter * rng.standard_normal() for value, scatter in (
        (run.beta_deg, table.beta_scatter_deg), (run.psi_deg, table.psi_scatter_deg),
        (run.d_x_mm, table.d_x_scatter_mm), (table.touch_deg, table.touch_scatter_deg)))
    diameter = table.bar_diameter_mm or protocol.bar_diameter_mm
    bar = Bar.placed(d_x_mm=d_x, beta_rad=math.radians(beta), psi_rad=math.radians(psi), touch_rad=math.radians(touch),
                     radius_mm=diameter / 2, whisker_radius_mm=float(rod.radius_mm(min(d_x, rod.length_mm))))
    return bar, first_touch(rod, bar, math.radians(touch), d_x)


def _stroke(protocol, run, touch):
    motor, whisks = protocol.motor, run.table.whisks
    back = whisks > 1 if motor.back_stroke is None else motor.back_stroke
    return Stroke.plan(touch.motor_rad - math.radians(motor.before_deg), touch.motor_rad + math.radians(motor.after_deg),
                       math.radians(run.speed_deg_s), whisks=whisks, ramp_s=motor.ramp_s, pause_s=motor.pause_s,
                       back=back or whisks > 1)


def _frames(protocol, run, touch, stroke):
    """The camera is triggered anew in each whisk."""
    pictures = protocol.pictures
    step = run.speed_deg_s / pictures.rate_Hz if pictures.rate_Hz else pictures.step_deg
    count = int((pictures.before_deg + pictures.after_deg) / step + 1e-9) + 1
    angles = touch.motor_rad + np.radians(-pictures.before_deg + step * np.arange(count))
    whisks = range(len(stroke.forward))
    times = np.concatenate([stroke.time_s(w, angles) for w in whisks])
    return Frames(times, np.tile(angles, len(whisks)), np.repeat(whisks, count))


def _whisks(protocol, run, rod, bar, touch, stroke, frames, rng):
    highest = float(stroke.angles_rad.max())
    back = bool((stroke.speeds_rad_s < 0).any())
    table, friction = run.table, protocol.friction
    static = table.friction if table.static_friction is None else table.static_friction
    made = None
    for whisk in range(len(stroke.forward)):
        factor = math.exp(friction.scatter * rng.standard_normal())
        if made is None or friction.scatter:
            coefficients = Friction(static * factor, table.friction * factor, math.radians(friction.finest_deg))
            made = Whisk.run(rod, bar, coefficients, touch, highest, stops_rad=frames.motor_rad[frames.whisk == whisk],
                             back=back, step_rad=_STEP_RAD)
        yield made


def _signals(protocol, run, stroke, whisks, rng):
    gauges, table = build.gauges(protocol), run.table
    fine = gauges.fine_times_s(stroke.end_s)
    moments = _moments(stroke, whisks, fine)
    if protocol.gauges.vibration:
        moments = moments + _ringing(protocol, stroke, whisks, fine)
    times = gauges.times_s(stroke.end_s)
    volts = gauges.volts(moments, math.radians(table.follicle_roll_deg), rng)
    motor = np.degrees(stroke.angle_rad(times))
    step = protocol.motor.encoder_step_deg
    motor = np.rint(motor / step) * step if step else motor
    return np.column_stack([times, motor, volts])


def _periods(stroke, whisks):
    """(whisk, when its forward stroke begins, turns back, ends): the whole recording, cut where the next whisk begins."""
    starts = [0.0, *(start for start, _ in stroke.forward[1:])]
    ends = [*starts[1:], math.inf]
    for whisk, start, end, (_, turn) in zip(whisks, starts, ends, stroke.forward):
        yield whisk, start, turn, end


def _moments(stroke, whisks, times_s):
    motor, moments = stroke.angle_rad(times_s), np.zeros((len(times_s), 2))
    highest = stroke.angles_rad.max()
    for whisk, start, turn, end in _periods(stroke, whisks):
        rising = (times_s >= start) & (times_s <= turn)
        moments[rising] = whisk.forward.moments_at(motor[rising])
        above = (times_s > turn) & (times_s < end)
        falling = whisk.back.moments_at(motor[above]) if whisk.back else whisk.forward.moments_at(motor[above])
        moments[above] = falling
        del highest
        highest = None
    return moments


def _ringing(protocol, stroke, whisks, times_s):
    """Free mode from the motor's ramps; propped mode from touch and from every jump of stick–slip."""
    rod, damping = whisks[0].rod, protocol.gauges.damping
    free, propped = Mode.of(rod), Mode.of(rod, min(whisks[0].touch.arc_mm, 0.999 * rod.length_mm))
    total = np.zeros((len(times_s), 2))
    for whisk, start, turn, end in _periods(stroke, whisks):
        touch_s = float(stroke.time_s(whisks.index(whisk), whisk.touch.motor_rad))
        for when, change in _speed_steps(stroke, start, touch_s):
            speed = free.swing * change * free.moment_Nmm
            total[:, 1] += ring(times_s, when, touch_s, free.frequency_rad_s, damping, speed=speed)
        rate = (stroke.angle_rad(touch_s + 1e-4) - stroke.angle_rad(touch_s)) / 1e-4
        struck = propped.strike * rate * propped.moment_Nmm * _push_direction(whisk)
        for axis in (0, 1):
            total[:, axis] += ring(times_s, touch_s, end, propped.frequency_rad_s, damping, speed=struck[axis])
        for when, jump in _jumps(stroke, whisks.index(whisk), whisk, turn):
            for axis in (0, 1):
                total[:, axis] += ring(times_s, when, end, propped.frequency_rad_s, damping, amplitude=-jump[axis])
    return total


def _speed_steps(stroke, start, end):
    """Times and changes of the motor's speed, each ramp taken in steps of 0.5 ms."""
    fine = np.arange(start, end, 5e-4)
    speed = np.diff(stroke.angle_rad(fine)) / 5e-4
    change = np.diff(speed)
    for i in np.nonzero(np.abs(change) > 1e-6)[0]:
        yield fine[i + 1], change[i]


def _push_direction(whisk):
    """Direction and size of the first push's moment against that of a head-on push."""
    moment = whisk.forward.moment_Nmm
    first = moment[min(3, len(moment) - 1)]
    theta = whisk.forward.motor_rad[min(3, len(moment) - 1)] - whisk.touch.motor_rad
    head_on = 3 * whisk.rod.rigidity_Nmm2 * theta / whisk.touch.arc_mm
    return first / head_on if whisk.rod.shape == "cylinder" else first / np.linalg.norm(first)


def _jumps(stroke, index, whisk, turn):
    """Times and moment steps of stick–slip on the forward stroke."""
    angles = whisk.forward.motor_rad
    for i in np.nonzero(np.diff(angles) == 0)[0]:
        yield float(stroke.time_s(index, angles[i])), whisk.forward.moment_Nmm[i + 1] - whisk.forward.moment_Nmm[i]
