"""What a recording can give, by the files and keys of its session, and what one thing more would give."""

from collections.abc import Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass
from typing import Self

from bench.session.angle_source import angle_source, without_motor_log
from bench.session.session import Session
from bench.session.signals import has_moments
from bench.session.traces import has_points_in_one_camera
from bench.session.trial import Trial

# [cameras] A line in space is where two views of it meet. Derived.
_FEWEST_CAMERAS = 2
# [trials] The follicle in two positions, so that both channels are pushed. Derived.
_FEWEST_GAUGE_TRIALS = 2
# [trials] Of different slopes: Fig. 8 draws an error against the slope. Derived.
_FEWEST_SLOPES = 2
# The one thing more that gives a result to a trial without it.
_TO_STATE = "d_x_mm, point_mm of [object] or stage.csv in each trial"
_TO_FEEL = f"{_FEWEST_GAUGE_TRIALS} gauge trials with pictures (follicle at 0° and 90°), gauges.toml, or moments"
_TO_COMPARE = "truth and estimate of one trial"
_TO_DRAW = f"truth and estimate at {_FEWEST_SLOPES} slopes"


@dataclass(frozen=True)
class Ability:
    """One kind of result. quantity: its name. count: of trials that can have it, of `of`. missing: what
    one thing more gives the others; '' where there are none.
    """

    quantity: str
    count: int
    of: int
    missing: str = ""

    @classmethod
    def of_trials(cls, quantity: str, able: Sized, of: int, missing: str) -> Self:
        """Return the row of a quantity. missing: what gives it to the trials that are not able to."""
        return cls(quantity, len(able), of, "" if len(able) == of else missing)

    @property
    def line(self) -> str:
        """Return the row as `check` prints it."""
        row = f"  {self.quantity:<18}{self.count} of {self.of}"
        return f"{row}   {self.missing}".rstrip()


def abilities(session: Session) -> tuple[Ability, ...]:
    """Return what the measured trials of a session can give."""
    measured = [trial for trial in session.trials if trial.purpose != "weight"]
    lacks = {trial.name: _lacks_of_pictures(trial, session) for trial in measured}
    of_gauges = [lacks[trial.name] for trial in measured if trial.purpose == "gauge"]
    has_gauges = _has_gauges(session, of_gauges)
    able = _able_trials(session, measured, lacks, has_gauges=has_gauges)
    rows = []
    for quantity, (trials, missing) in able.items():
        rows.append(Ability.of_trials(quantity, trials, len(measured), missing))
    return (*rows, *_of_gauges(of_gauges, has_gauges=has_gauges))


def _able_trials(
    session: Session, measured: Sequence[Trial], lacks: Mapping[str, str], *, has_gauges: bool
) -> dict[str, tuple[Sequence[Trial], str]]:
    """Return of each quantity the trials that can have it, and what gives it to the others.

    lacks: what pictures of each trial need more.
    """
    seen = [trial for trial in measured if not lacks[trial.name]]
    to_see = _first(lacks.values())
    true, to_know = seen, f'{to_see}; or a stage: [truth] source = "stage"'
    if session.truth is not None:
        true, to_know = _stated(measured), _TO_STATE
    felt = [trial for trial in measured if has_gauges or has_moments(trial)]
    both = [trial for trial in true if trial in felt]
    drawn = both if _has_slopes(both, session) else []
    return {
        "truth of d_x": (true, to_know),
        "truth of β": (true, to_know),
        "slip, deflection": (seen, to_see),
        "estimates of d_x": (felt, _TO_FEEL),
        "errors": (both, _TO_COMPARE),
        "Fig. 8": (drawn, _TO_DRAW),
    }


def _has_slopes(trials: Sequence[Trial], session: Session) -> bool:
    """Return whether trials may differ in slope: by what they state, or by what pictures will show."""
    stated = {trial.beta_deg for trial in trials}
    is_seen = session.truth is None
    return len(stated) >= _FEWEST_SLOPES or (is_seen and len(trials) >= _FEWEST_SLOPES)


def _of_gauges(lacks: Sequence[str], *, has_gauges: bool) -> Iterator[Ability]:
    """Yield the row of the gauge trials, where there are any or volts need them.

    lacks: what pictures of each of them need more.
    """
    usable = [lack for lack in lacks if not lack]
    of = max(len(lacks), _FEWEST_GAUGE_TRIALS)
    if lacks or not has_gauges:
        missing = _first(lacks) or "gauge trials in two positions of the follicle"
        yield Ability.of_trials("gauges", usable, of, missing)


def _stated(trials: Sequence[Trial]) -> list[Trial]:
    """Return the trials that state where their contact is."""
    stated = []
    for trial in trials:
        has_place = trial.object is not None and trial.object.point_mm is not None
        if has_place or trial.d_x_mm is not None or trial.stage is not None:
            stated.append(trial)
    return stated


def ability_lines(session: Session) -> Iterator[str]:
    """Yield the table of what a session can give, and where its motor's angles are from."""
    found = abilities(session)
    if not found[0].of:
        return
    for source, count in without_motor_log(session.trials):
        of = f"{count} of {len(session.trials)} trials"
        yield f"angle: {of} by {source.by}, without a motor log; not known: {source.unknown}"
        if source.is_seen:
            yield "  estimates there have θ of their own pictures: seen, not felt alone"
    yield "this recording can give, of its trials:"
    for ability in found:
        yield ability.line


def _lacks_of_pictures(trial: Trial, session: Session) -> str:
    """Return the one thing more that pictures need to give a trial's truth; '' where they suffice."""
    if not trial.is_seen:
        return f"{_FEWEST_CAMERAS} cameras with a board"
    if not angle_source(trial).has_zero:
        return 'a motor log (motor_deg), or angle_from = "marker" or "whisker"'
    if angle_source(trial).lacks(trial):
        return angle_source(trial).lacks(trial)
    if trial.is_traced_alone and has_points_in_one_camera(trial):
        return "points of the bar (object_<camera>) in a second camera"
    if len(trial.cameras) < _FEWEST_CAMERAS and not trial.is_bar:
        return "a second camera, or a mirror ([[cameras]] of, crop, mirrored)"
    if session.cameras_toml is None and not session.board_sources:
        return "views of a board (boards/), or cameras.toml"
    return ""


def _has_gauges(session: Session, lacks: Sequence[str]) -> bool:
    """Return whether the session has gauges, or gauge trials that calibrate them.

    lacks: what pictures of each gauge trial need more.
    """
    are_brought = session.gauges is not None or session.gauges_toml is not None
    return are_brought or lacks.count("") >= _FEWEST_GAUGE_TRIALS


def _first(lacks: Iterable[str]) -> str:
    """Return the first of some lacks that is one; '' where nothing lacks."""
    return next(filter(None, lacks), "")
