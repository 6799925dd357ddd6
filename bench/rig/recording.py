"""One trial as it is recorded: bar, whisks, frame times, signals. Its pictures are taken from it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from bench.rig import build
from bench.rig.bar import Bar, Touch, first_touch, turned
from bench.rig.elastic_rod import Rod
from bench.rig.loading import base_force_N, quasi_static_Nmm, ringing_Nmm
from bench.rig.marched import MarchedWhisk
from bench.rig.protocol import Protocol, Run
from bench.rig.round_objects import Cone, Ring, Sphere
from bench.rig.stick_slip import Friction
from bench.rig.strain_gauges import Gauges
from bench.rig.stroke import Stroke

_STEP_RAD = math.radians(
    0.1
)  # rad: half of it changes nothing that is seen (tests/bench/rig/test_contact_march.py)
_RESTS = 500  # more than a stroke of 25° has teeth of 0.05°


@dataclass(frozen=True, eq=False)
class Frames:
    """The middles of the cameras' exposures, over all whisks: times, motor angles, number of the whisk, and whether on
    its way back.
    """

    time_s: np.ndarray
    motor_rad: np.ndarray
    whisk: np.ndarray
    back: np.ndarray

    def __iter__(self):
        """(time_s, motor_rad, number of the whisk, back) of each."""
        return zip(
            self.time_s.tolist(), self.motor_rad.tolist(), self.whisk.tolist(), self.back.tolist()
        )


@dataclass(frozen=True, eq=False)
class Recording:
    """A trial. `signals` (n, 4): time_s, motor_deg, y_V, z_V; with a load cell (n, 7): f_x_N, f_y_N, f_z_N too.
    `stated_velocity_mm_s` (3,): of the bar, as trial.toml has it; None where it stands."""

    run: Run
    rod: Rod
    bar: Bar
    touch: Touch
    stroke: Stroke
    whisks: tuple[MarchedWhisk, ...]
    frames: Frames
    signals: np.ndarray
    stated_velocity_mm_s: np.ndarray | None = None

    @classmethod
    def make(cls, protocol: Protocol, run: Run, rng: np.random.Generator) -> "Recording":
        """The trial that a seeded generator makes of a run. Raises ArithmeticError where the whisker cannot go on."""
        rod = build.rod(protocol)
        bar, *near = placed_bar(protocol, run, rod, rng)
        touch = first_touch(rod, bar, *near)
        if run.table.object_velocity_mm_s:
            bar = bar.moving(
                np.array(run.table.object_velocity_mm_s) / math.radians(run.speed_deg_s),
                touch.motor_rad,
            )
        stroke = _stroke(protocol, run, touch)
        frames = _frames(protocol, run, touch, stroke)
        return cls.pushed(
            protocol, run, rod, bar, touch, stroke, frames, build.gauges(protocol), rng
        )

    @classmethod
    def pushed(
        cls,
        protocol: Protocol,
        run: Run,
        rod: Rod,
        bar: Bar,
        touch: Touch,
        stroke: Stroke,
        frames: Frames,
        gauges: Gauges,
        rng: np.random.Generator,
    ) -> "Recording":
        """What a whisker feels on a stroke that takes it to a bar. Raises ArithmeticError as `make`."""
        frictions = _frictions(protocol, run.table, len(stroke.forward), rng)
        end_rad, stops_rad = (
            float(stroke.angles_rad.max()),
            frames.motor_rad[(frames.whisk == 0) & ~frames.back],
        )
        march = partial(
            MarchedWhisk.run,
            rod,
            bar,
            touch=touch,
            end_rad=end_rad,
            step_rad=_STEP_RAD,
            stops_rad=stops_rad,
            back=bool(stroke.back),
        )
        made = {
            friction: march(friction) for friction in dict.fromkeys(frictions)
        }  # whisks of one friction are alike
        whisks = tuple(made[friction] for friction in frictions)
        recorded = signals(protocol, run, stroke, whisks, gauges, rng)
        return cls(
            run, rod, bar, touch, stroke, whisks, frames, recorded, _stated_velocity(run.table, rng)
        )


def placed_bar(
    protocol: Protocol, run: Run, rod: Rod, rng: np.random.Generator
) -> tuple[Bar, float, float]:
    """The bar as people set it, near what they wanted; about the motor angle (rad) and arc (mm) of first touch."""
    table = run.table
    wanted = (run.beta_deg, run.psi_deg, run.d_x_mm, table.touch_deg)
    scatter = (
        table.beta_scatter_deg,
        table.psi_scatter_deg,
        table.d_x_scatter_mm,
        table.touch_scatter_deg,
    )
    beta, psi, d_x, touch = np.array(wanted) + np.array(scatter) * rng.standard_normal(4)
    whisker = float(rod.radius_mm(min(d_x, rod.length_mm)))
    bar = Bar.placed(
        d_x_mm=d_x,
        beta_rad=math.radians(beta),
        psi_rad=math.radians(psi),
        touch_rad=math.radians(touch),
        radius_mm=(table.bar_diameter_mm or protocol.bar_diameter_mm) / 2,
        whisker_radius_mm=whisker,
        stiffness_N_mm=table.stiffness_N_mm or math.inf,
    )
    return _rounded(table, bar, touch, d_x), math.radians(touch), d_x


def _rounded(table, bar: Bar, touch_deg: float, d_x_mm: float) -> Bar:
    """What is touched in the bar's place, at the same point with the same slope."""
    if table.object == "sphere":
        return Sphere(bar.point_mm, bar.axis, bar.radius_mm, bar.stiffness_N_mm)
    touched = turned(np.array([d_x_mm, 0.0, 0.0]), math.radians(touch_deg))
    if table.object == "cone":
        return Cone.narrowing(bar, touched, math.radians(table.cone_half_angle_deg))
    if table.object == "ring":
        return Ring.bent(bar, touched, 0.5 * table.ring_diameter_mm)
    return bar


def _stated_velocity(table, rng) -> np.ndarray | None:
    """What people say of a bar that moves."""
    if not table.object_velocity_mm_s:
        return None
    return np.array(table.object_velocity_mm_s) + (
        table.object_velocity_sigma_mm_s or 0.0
    ) * rng.standard_normal(3)


def _stroke(protocol, run, touch):
    motor = protocol.motor
    low, high = (touch.motor_rad + math.radians(a) for a in (-run.before_deg, run.after_deg))
    return Stroke.plan(
        low,
        high,
        math.radians(run.speed_deg_s),
        whisks=run.table.whisks,
        ramp_s=motor.ramp_s,
        pause_s=motor.pause_s,
        back=protocol.goes_back(run),
    )


def _frames(protocol, run, touch, stroke):
    """The camera is triggered anew in each whisk; on the way back, where that is wanted, at the same angles but the
    furthest, where the motor may turn.
    """
    up = touch.motor_rad + np.radians(protocol.pictures.frame_angles_deg(run.speed_deg_s))
    ways = [(up, False), (up[-2::-1], True)] if protocol.pictures.back_stroke else [(up, False)]
    taken = [(w, angles, back) for w in range(len(stroke.forward)) for angles, back in ways]
    return Frames(
        np.concatenate([stroke.time_s(w, angles, back) for w, angles, back in taken]),
        np.concatenate([angles for _, angles, _ in taken]),
        np.concatenate([np.full(len(angles), w) for w, angles, _ in taken]),
        np.concatenate([np.full(len(angles), back) for _, angles, back in taken]),
    )


def _frictions(protocol, table, count: int, rng) -> list[Friction]:
    """Friction in each of the whisks."""
    friction = protocol.friction
    static = table.friction if table.static_friction is None else table.static_friction
    factors = np.exp(friction.scatter * rng.standard_normal(count))
    rests = [_rests(friction.irregular, rng) for _ in factors]
    finest = math.radians(friction.finest_deg)
    return [
        Friction(static * f, table.friction * f, finest, reached)
        for f, reached in zip(factors, rests)
    ]


def _rests(irregular: float, rng) -> tuple[float, ...]:
    """How much of its excess each rest of a whisk reaches; nothing is drawn for regular ones."""
    return tuple(np.exp(irregular * rng.standard_normal(_RESTS)).tolist()) if irregular else (1.0,)


def signals(
    protocol: Protocol,
    run: Run,
    stroke: Stroke,
    whisks: Sequence[MarchedWhisk],
    gauges: Gauges,
    rng: np.random.Generator,
) -> np.ndarray:
    """What the DAQ writes of a whisker's whisks, as `Recording.signals`; of one that touches nothing without any."""
    step = protocol.motor.encoder_step_deg
    fine = gauges.fine_times_s(stroke.end_s)
    moments = quasi_static_Nmm(stroke, whisks, fine)
    if protocol.gauges.vibration and whisks:
        moments += ringing_Nmm(stroke, whisks, fine, protocol.gauges.damping)
    volts = gauges.volts(moments, math.radians(run.table.follicle_roll_deg), rng)
    times = gauges.times_s(stroke.end_s)
    motor = np.degrees(stroke.angle_rad(times))
    cell = build.load_cell(protocol)
    forces = [] if cell is None else [cell.forces_N(base_force_N(stroke, whisks, fine), rng)]
    return np.column_stack([times, np.rint(motor / step) * step if step else motor, volts, *forces])
