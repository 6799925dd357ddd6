"""A trial of a plan: what it would give on the bench as it is, and after each change that is tried."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import msgspec

from bench.base.progress import begin_step, count_parts
from bench.plan.changes import LIGHT, Change
from bench.plan.outlook import Outlook, outlook, sigmas
from bench.plan.painter import Clamp, Painter
from bench.plan.staged import StagedWhisk, stage_run
from bench.rig.protocol import Protocol, ProtocolRun
from vision import LineNoise, PredictedTruth, predict_truth
from vision.geometry import Cameras

# [1] Of a sigma, that is left where a change halves it. Derived.
_HALF = 0.5


@dataclass(frozen=True)
class ChangedSigmas:
    """The sigmas that a change would leave, by column; empty where there is no truth with it."""

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
    """A whisk of a plan.

    changes: what each change that is tried would leave. noise: by camera, of its lines. stated: of
    a recorded session, the sigmas by column that `evaluate` states.
    """

    facts: Facts
    outlook: Outlook
    changes: tuple[ChangedSigmas, ...] = ()
    noise: Mapping[str, LineNoise] = field(default_factory=dict)
    stated: Mapping[str, float] | None = None

    def best(self) -> tuple[ChangedSigmas, float] | None:
        """Return the change that leaves least of d_x's sigma, and what share of it.

        The share is 0 where there is a truth only with the change. None where no change gives one.
        """
        known = [change for change in self.changes if change.sigma]
        if not known:
            return None
        best = min(known, key=lambda change: change.sigma["d_x_mm"])
        if not self.outlook.has_truth:
            return best, 0.0
        return best, best.sigma["d_x_mm"] / self.outlook.sigma["d_x_mm"]

    @property
    def name(self) -> str:
        """Return the trial, and the whisk where it is not the first."""
        return self.facts.trial + (f" {self.facts.whisk}" if self.facts.whisk else "")

    @property
    def is_halved(self) -> bool:
        """Return whether the best change halves the sigma of d_x, or gives a truth."""
        best = self.best()
        return best is not None and best[1] <= _HALF


@dataclass(frozen=True, eq=False)
class Plan:
    """What a plan says.

    title: of what. cameras: a line on each. theta_deg: pushing angle of slip, φ and α.
    assumptions: sentences on what it takes for granted.
    """

    title: str
    cameras: tuple[str, ...]
    rows: tuple[Row, ...]
    theta_deg: float
    assumptions: tuple[str, ...] = ()

    @property
    def is_recorded(self) -> bool:
        """Return whether it is of a session that was recorded."""
        return any(row.stated is not None for row in self.rows)

    @property
    def lacks_truth(self) -> bool:
        """Return whether a trial has no truth."""
        return not all(row.outlook.has_truth for row in self.rows)


@dataclass(frozen=True, eq=False)
class RigTask:
    """One trial of a rig to be planned."""

    run: ProtocolRun
    cameras: Cameras
    changes: Sequence[Change]
    theta_rad: float


def painter_of(protocol: Protocol) -> Painter:
    """Return the painter of a protocol, which is kept while a process works on one plan."""
    return _painter(msgspec.json.encode(protocol))


@lru_cache(maxsize=2)
def _painter(protocol_json: bytes) -> Painter:
    """Return the painter of a protocol in JSON."""
    return Painter(msgspec.json.decode(protocol_json, type=Protocol))


def _with_more_light(protocol: Protocol) -> Protocol:
    """Return a protocol with LIGHT times the light at as much less gain.

    The sensor's noise falls by that factor, that of quanta by its root.
    """
    pictures = msgspec.structs.replace(
        protocol.pictures,
        read_noise=protocol.pictures.read_noise / LIGHT,
        shot_noise=protocol.pictures.shot_noise / math.sqrt(LIGHT),
    )
    return msgspec.structs.replace(protocol, pictures=pictures)


def plan_trial(task: RigTask) -> Row:
    """Return the row of a rig's trial."""
    facts = _facts(task.run)
    try:
        staged = stage_run(task.run)
    except ArithmeticError as problem:
        status = f"the whisker slips off or buckles ({problem}); push less far or nearer the base"
        return Row(facts, Outlook(status=status))
    begin_step(f"{task.run.name}: pictures, and the truth that they would give")
    noise = painter_of(task.run.protocol).line_noise(staged, task.cameras)
    predicted = predict_truth(staged.known, task.cameras, noise, Clamp.of(staged))
    changes = []
    for change in count_parts(task.changes, f"{task.run.name}, changes", len(task.changes)):
        changed = _noise_with(change, task, staged, noise)
        after = predict_truth(staged.known, change.cameras, changed, Clamp.of(staged))
        changes.append(changed_sigmas(change, after, task.theta_rad))
    return Row(facts, outlook(predicted, noise, task.theta_rad), tuple(changes), noise)


def _noise_with(
    change: Change, task: RigTask, staged: StagedWhisk, noise: Mapping[str, LineNoise]
) -> dict[str, LineNoise]:
    """Return by camera the noise of its lines with a change; noise: on the present bench."""
    if not change.light:
        return change.line_noise(noise, staged.known)
    brighter = painter_of(_with_more_light(task.run.protocol))
    return brighter.line_noise(staged, task.cameras)


def _facts(run: ProtocolRun) -> Facts:
    """Return what is wanted of a trial."""
    return Facts(
        trial=run.name,
        whisk=0,
        purpose=run.table.purpose,
        surface=run.table.surface,
        speed_deg_s=run.speed_deg_s,
        beta_deg=run.beta_deg,
        psi_deg=run.psi_deg,
        d_x_mm=run.d_x_mm,
    )


def changed_sigmas(change: Change, predicted: PredictedTruth, theta_rad: float) -> ChangedSigmas:
    """Return the sigmas of a truth that is predicted with a change."""
    left = sigmas(predicted, theta_rad) if predicted.is_known else {}
    return ChangedSigmas(change.kind, change.words, left)
