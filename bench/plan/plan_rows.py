"""A trial of a plan: what it would give on the bench as it is, and after each change that was tried."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import msgspec
import numpy as np

from bench.plan.expected import expected
from bench.plan.outlook import Outlook, outlook, sigmas
from bench.plan.painted import Clamp, Painter
from bench.plan.sight import Hides, nothing_hides
from bench.plan.staged import Staged, of_run
from bench.plan.tries import LIGHT, Try
from bench.rig.protocol import Protocol, ProtocolRun
from vision.fit.line_noise import LineNoise
from vision.geometry.camera import Cameras
from vision.geometry.vision_settings import VisionSettings

_HALF = 0.5


@dataclass(frozen=True)
class Tried:
    """A change and the sigmas by column that it would leave; empty where there is still no truth."""

    kind: str
    words: str
    sigma: Mapping[str, float]


@dataclass(frozen=True)
class Facts:
    """What is wanted of a trial, or was seen of a whisk that was recorded."""

    trial: str
    whisk: int
    purpose: str
    surface: str
    speed_deg_s: float
    beta_deg: float
    psi_deg: float
    d_x_mm: float


@dataclass(frozen=True)
class Row:
    """A whisk of a plan; stated: sigmas by column that `evaluate` states, of a recorded session."""

    facts: Facts
    outlook: Outlook
    tried: tuple[Tried, ...] = ()
    lines: Mapping[str, LineNoise] = field(default_factory=dict)
    stated: Mapping[str, float] | None = None

    def best(self, column: str = "d_x_mm") -> tuple[Tried, float] | None:
        """The change that leaves least of a sigma, and what part of it; 0 where it gives a truth in the first place."""
        known = [one for one in self.tried if one.sigma]
        if not known:
            return None
        best = min(known, key=lambda one: one.sigma[column])
        return best, best.sigma[column] / self.outlook.sigma[
            column
        ] if self.outlook.has_truth else 0.0

    def halved(self, column: str = "d_x_mm") -> bool:
        """Whether the best change halves a sigma, or gives a truth."""
        best = self.best(column)
        return best is not None and best[1] <= _HALF


@dataclass(frozen=True, eq=False)
class RigTask:
    """One trial of a rig to be planned."""

    protocol: Protocol
    run: ProtocolRun
    cameras: Cameras
    tries: Sequence[Try]
    theta_rad: float


@lru_cache(maxsize=2)
def painter(protocol_json: bytes) -> Painter:
    """The painted cameras of a protocol, kept while a process works on one plan."""
    return Painter(msgspec.json.decode(protocol_json, type=Protocol))


def painter_of(protocol: Protocol) -> Painter:
    """The same of a protocol as it is."""
    return painter(msgspec.json.encode(protocol))


def brighter(protocol: Protocol) -> Protocol:
    """LIGHT times the light at as much less gain: the sensor's noise falls so much, that of quanta by the root."""
    pictures = protocol.pictures
    less = {
        "read_noise": pictures.read_noise / LIGHT,
        "shot_noise": pictures.shot_noise / math.sqrt(LIGHT),
    }
    return msgspec.structs.replace(protocol, pictures=msgspec.structs.replace(pictures, **less))


def plan_run(task: RigTask) -> Row:
    """A trial of a rig."""
    run, table = task.run, task.run.table
    facts = Facts(
        run.name,
        0,
        table.purpose,
        table.surface,
        run.speed_deg_s,
        run.beta_deg,
        run.psi_deg,
        run.d_x_mm,
    )
    try:
        staged = of_run(task.protocol, run)
    except ArithmeticError as problem:
        found = f"the whisker slips off or buckles ({problem}); push less far or nearer the base"
        return Row(facts, Outlook(status=found))
    lines = painter_of(task.protocol).lines(staged, task.cameras)

    def after(one: Try) -> Mapping[str, LineNoise]:
        if one.light:
            return painter_of(brighter(task.protocol)).lines(staged, task.cameras)
        return one.lines(lines, staged.axis)

    found = outlook(expected(staged, task.cameras, lines, Clamp.of(staged)), lines, task.theta_rad)
    tried = [
        tried_on(staged, one, after(one), task.theta_rad, Clamp.of(staged)) for one in task.tries
    ]
    return Row(facts, found, tuple(tried), lines)


def tried_on(
    staged: Staged,
    one: Try,
    lines: Mapping[str, LineNoise],
    theta_rad: float,
    hides: Hides = nothing_hides,
    settings: VisionSettings | None = None,
) -> Tried:
    """A change on one whisk."""
    truth = expected(staged, one.cameras, lines, hides, settings or VisionSettings()).truth
    known = np.isfinite(truth.d_x_mm.value)
    return Tried(one.kind, one.words, sigmas(truth, theta_rad) if known else {})
