"""An evaluated session: what figures and summary are made from."""

from dataclasses import dataclass
from pathlib import Path

from bench.base.settings import Settings
from bench.friction.curved import Curved
from bench.friction.soft import Soft
from bench.friction.tables import SurfaceFriction
from bench.gauges.matrix import Gauges
from bench.records.trial import FeltWhisk, TrialResult
from bench.session.session import Session


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Results of all trials in the folder `out`. camera_notes: lines on calibration and placing; doubts: lines that the
    user should read; friction: a surface and speed each; gauges: None where volts cannot become moments; soft: pairs of
    distances; shapes: how each whisk's object is curved."""

    session: Session
    out: Path
    settings: Settings
    results: tuple[TrialResult, ...]
    friction: tuple[SurfaceFriction, ...]
    gauges: Gauges | None
    camera_notes: tuple[str, ...]
    doubts: tuple[str, ...]
    soft: tuple[Soft, ...] = ()
    shapes: tuple[tuple[TrialResult, FeltWhisk, Curved], ...] = ()
