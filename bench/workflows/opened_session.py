"""A recorded session, opened for a job on whisks that are both seen and felt."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from bench.base.atomic import lock_output
from bench.base.input_problems import InputProblems
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.session.inside import check_outside
from bench.session.session import Session
from bench.session.session_check import checked_session, trials_with_whisks
from bench.session.trial import Trial
from bench.trials.of_session import placed_units, require_some, with_gauges
from bench.trials.unit import Unit


@contextmanager
def opened_session(
    path: Path,
    out: Path,
    settings: Settings,
    workers: int,
    require: Callable[[Sequence[Trial], Settings], None] = require_some,
) -> Iterator[tuple[Session, list[Unit], Workers]]:
    """Yield a session, a unit of work for each trial that the settings take, and the processes for them.

    Cameras and gauges are calibrated; what of that the folder `out` holds already is not made again. It is
    locked meanwhile. require: raises BadInput, before anything is calibrated, where the settings take
    none of the trials that the job needs. Raise BadInput.
    """
    check_outside(out, path)
    problems = InputProblems()
    session = checked_session(path, problems, follow_links=settings.follow_links)
    recorded = trials_with_whisks(session)
    require(recorded, settings)
    with lock_output(out), Workers(workers) as pool:
        _, units = placed_units(session, recorded, out, settings, pool, problems)
        *_, units = with_gauges(units, pool, problems)
        yield session, [unit for unit in units if settings.takes(unit.trial.name)], pool
