"""One trial as it is recorded: object, whisks, frame times and signals; pictures are made from it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.rig import build
from bench.rig.bar import TouchedBar, UnloadedTouch, find_first_touch
from bench.rig.contact_microphone import sample_pressure_Pa
from bench.rig.elastic_rod import Rod
from bench.rig.force_sensor import sample_forces_N
from bench.rig.linear import rotate_about_z
from bench.rig.loading import base_force_N, quasi_static_Nmm, ringing_Nmm
from bench.rig.protocol import Protocol, ProtocolRun
from bench.rig.protocol_tables import GaugesTable
from bench.rig.round_objects import OBJECTS
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.strain_gauges import fine_times_s, sample_times_s, sample_volts
from bench.rig.stroke import Stroke
from bench.rig.touched_object import TouchedObject
from bench.rig.whisk_mechanics import WhiskMechanics

# rad: half of it changes nothing that is seen (tests/bench/rig/test_contact_march.py)
_STEP_RAD = math.radians(0.1)
_RESTS = 500  # more than a stroke of 25° has teeth of 0.05°


@dataclass(frozen=True, eq=False)
class GaugedWhisker:
    """A whisker with the gauges at its base."""

    rod: Rod
    gauges: GaugesTable


@dataclass(frozen=True, eq=False)
class Exposures:
    """The middles of the cameras' exposures, over all whisks, each (n,): times, motor angles,
    number of the whisk, and whether on its way back."""

    time_s: np.ndarray
    motor_rad: np.ndarray
    whisk: np.ndarray
    back: np.ndarray

    def __iter__(self) -> Iterator[tuple[float, float, int, bool]]:
        """Iterate over (time_s, motor_rad, number of the whisk, back) of each frame."""
        return zip(
            self.time_s.tolist(), self.motor_rad.tolist(), self.whisk.tolist(), self.back.tolist()
        )


@dataclass(frozen=True, eq=False)
class Recording:
    """A trial of one whisker.

    signals (n, k): columns of signals.csv, of the names in channels.
    stated_velocity_mm_s (3,): of the object, as trial.toml has it; None where it stands still.
    """

    run: ProtocolRun
    rod: Rod
    bar: TouchedObject
    touch: UnloadedTouch
    stroke: Stroke
    whisks: tuple[WhiskMechanics, ...]
    frames: Exposures
    signals: np.ndarray
    channels: tuple[str, ...]
    stated_velocity_mm_s: np.ndarray | None = None

    @classmethod
    def make(cls, run: ProtocolRun, rng: np.random.Generator) -> "Recording":
        """Simulate a run, the chance in it drawn from `rng`.

        Raises ArithmeticError where the whisker cannot go on.
        """
        whisker = GaugedWhisker(build.rod(run.protocol), run.protocol.gauges)
        bar, *near = place_object(run, whisker.rod, rng)
        touch = find_first_touch(whisker.rod, bar, *near)
        velocity_mm_s = run.table.object_velocity_mm_s
        if velocity_mm_s:
            velocity_mm_rad = np.array(velocity_mm_s) / math.radians(run.speed_deg_s)
            bar = replace(bar, velocity_mm_rad=velocity_mm_rad, touch_rad=touch.motor_rad)
        before_rad = math.radians(run.before_deg)
        after_rad = math.radians(run.after_deg)
        stroke = plan_stroke(run, touch.motor_rad - before_rad, touch.motor_rad + after_rad)
        frames = _take_frames(run, touch, stroke)
        return cls.record(run, whisker, bar, touch, stroke, frames, rng)

    @classmethod
    def record(
        cls,
        run: ProtocolRun,
        whisker: GaugedWhisker,
        bar: TouchedObject,
        touch: UnloadedTouch,
        stroke: Stroke,
        frames: Exposures,
        rng: np.random.Generator,
    ) -> "Recording":
        """Simulate what a whisker senses on a stroke that takes it to an object.

        Raises ArithmeticError where the whisker cannot go on.
        """
        frictions = _draw_frictions(run, len(stroke.forward), rng)
        in_first = (frames.whisk == 0) & ~frames.back
        mechanics = {}  # whisks of one friction are alike
        for friction in dict.fromkeys(frictions):
            mechanics[friction] = WhiskMechanics.run(
                whisker.rod,
                bar,
                friction,
                touch,
                float(stroke.angles_rad.max()),
                step_rad=_STEP_RAD,
                stops_rad=frames.motor_rad[in_first],
                back=bool(stroke.back),
            )
        whisks = tuple(mechanics[friction] for friction in frictions)
        signals = sample_signals(run, stroke, whisks, whisker.gauges, rng)
        return cls(
            run,
            whisker.rod,
            bar,
            touch,
            stroke,
            whisks,
            frames,
            signals,
            channel_names(run.protocol),
            _state_velocity(run, rng),
        )


def place_object(
    run: ProtocolRun, rod: Rod, rng: np.random.Generator
) -> tuple[TouchedObject, float, float]:
    """Place the object as people set it, near what they wanted of the unloaded whisker.

    Returns it, and about the motor angle (rad) and arc (mm) of first touch.
    """
    table = run.table
    beta_deg, psi_deg, d_x_mm, touch_deg = _draw_place(run, rng)
    touch_rad = math.radians(touch_deg)
    bar = TouchedBar.at_contact(
        d_x_mm=d_x_mm,
        beta_rad=math.radians(beta_deg),
        psi_rad=math.radians(psi_deg),
        touch_rad=touch_rad,
        radius_mm=(table.bar_diameter_mm or run.protocol.bar_diameter_mm) / 2,
        whisker_radius_mm=float(rod.radius_mm(min(d_x_mm, rod.length_mm))),
        stiffness_N_mm=table.stiffness_N_mm or math.inf,
    )
    arc_mm = rod.rest.arc_at_mm(d_x_mm)
    beside_mm = rod.rest.point_mm(arc_mm) - [d_x_mm, 0.0, 0.0]
    bar = bar.shift(rotate_about_z(beside_mm, touch_rad))
    touched_mm = rotate_about_z(rod.rest.point_mm(arc_mm), touch_rad)
    placed = OBJECTS[table.object or TouchedBar.shape].from_trial(bar, touched_mm, table)
    return placed, touch_rad, arc_mm


def _draw_place(run: ProtocolRun, rng: np.random.Generator) -> np.ndarray:
    """Return β and ψ, deg, d_x, mm, and the angle of touch, deg, near those that are wanted."""
    table = run.table
    wanted = np.array([run.beta_deg, run.psi_deg, run.d_x_mm, table.touch_deg])
    scatter = np.array(
        [
            table.beta_scatter_deg,
            table.psi_scatter_deg,
            table.d_x_scatter_mm,
            table.touch_scatter_deg,
        ]
    )
    return wanted + scatter * rng.standard_normal(4)


def plan_stroke(run: ProtocolRun, low_rad: float, high_rad: float) -> Stroke:
    """Return a run's motion between two motor angles."""
    motor = run.protocol.motor
    return Stroke.plan(
        low_rad,
        high_rad,
        math.radians(run.speed_deg_s),
        whisks=run.table.whisks,
        ramp_s=motor.ramp_s,
        pause_s=motor.pause_s,
        back=run.goes_back,
    )


def channel_names(protocol: Protocol) -> tuple[str, ...]:
    """Return the names of the columns that the DAQ writes, in the order of `sample_signals`."""
    names = ("time_s", "motor_deg", "y_V", "z_V")
    if protocol.load_cell:
        names += ("f_x_N", "f_y_N", "f_z_N")
    return (*names, "p_Pa") if protocol.microphone else names


def sample_signals(
    run: ProtocolRun,
    stroke: Stroke,
    whisks: Sequence[WhiskMechanics],
    gauges: GaugesTable,
    rng: np.random.Generator,
) -> np.ndarray:
    """Return what the DAQ writes (n, k), of the columns `channel_names`; without whisks, of a whisker that
    touches nothing."""
    protocol = run.protocol
    fine_s = fine_times_s(gauges, stroke.end_s)
    moments = quasi_static_Nmm(stroke, whisks, fine_s)
    if gauges.vibration and whisks:
        moments += ringing_Nmm(stroke, whisks, fine_s, gauges.damping)
    times_s = sample_times_s(gauges, stroke.end_s)
    motor_deg = np.degrees(stroke.angle_rad(times_s))
    step_deg = protocol.motor.encoder_step_deg
    if step_deg:
        motor_deg = np.rint(motor_deg / step_deg) * step_deg
    roll_rad = math.radians(run.table.follicle_roll_deg)
    columns = [times_s, motor_deg, sample_volts(gauges, moments, roll_rad, rng)]
    force_N = base_force_N(stroke, whisks, fine_s)
    if protocol.load_cell:
        columns.append(sample_forces_N(protocol.load_cell, gauges, force_N, rng))
    if protocol.microphone:
        columns.append(sample_pressure_Pa(protocol.microphone, gauges, moments, force_N, rng))
    return np.column_stack(columns)


def _state_velocity(run, rng) -> np.ndarray | None:
    """Draw what people say of the velocity (3,), mm/s, of an object that moves."""
    table = run.table
    if not table.object_velocity_mm_s:
        return None
    sigma = table.object_velocity_sigma_mm_s or 0.0
    return np.array(table.object_velocity_mm_s) + sigma * rng.standard_normal(3)


def _take_frames(run, touch, stroke) -> Exposures:
    """Return the exposures of all whisks, the camera triggered anew in each.

    On the way back, where that is wanted, they are at the same angles but the furthest, where the
    motor may turn.
    """
    pictures = run.protocol.pictures
    up = touch.motor_rad + np.radians(pictures.frame_angles_deg(run.speed_deg_s))
    passes = [(up, False)]
    if pictures.back_stroke:
        passes.append((up[-2::-1], True))
    parts = []  # (4, n): the columns of frames of one way of one whisk
    for whisk in range(len(stroke.forward)):
        for angles, back in passes:
            times = stroke.time_s(whisk, angles, back)
            constant = np.ones(len(angles))
            parts.append([times, angles, whisk * constant, back * constant])
    times, angles, whisks, backs = np.concatenate(parts, axis=1)
    return Exposures(times, angles, whisks.astype(int), backs.astype(bool))


def _draw_frictions(run, count: int, rng) -> list[FrictionCoefficients]:
    """Draw the friction in each of the whisks; regular rests draw nothing."""
    table = run.protocol.friction
    kinetic = run.table.friction
    static = kinetic if run.table.static_friction is None else run.table.static_friction
    frictions = []
    for factor in np.exp(table.scatter * rng.standard_normal(count)):
        rests = (1.0,)
        if table.irregular:
            rests = tuple(np.exp(table.irregular * rng.standard_normal(_RESTS)).tolist())
        finest_rad = math.radians(table.finest_deg)
        frictions.append(FrictionCoefficients(static * factor, kinetic * factor, finest_rad, rests))
    return frictions
