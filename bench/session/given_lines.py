"""Lines on the givens of a session: how well each is known, and by whom."""

from collections.abc import Iterator, Sequence

from bench.session.givens import Given
from bench.session.session import Session
from bench.session.signals import has_moments

_ASSUMED = "*"  # before a sigma that nobody stated
_MOMENTS = "[trial] moments in N·mm"
_HOW_TO_STATE = "state a sigma beside its key, 0 where it is exact: docs/formats.md"


def givens_of(session: Session) -> tuple[Given, ...]:
    """Return what session.toml and its trials state, each once.

    What cameras.toml replaces is left out, and the gain of moments where volts were recorded.
    """
    found = [given for given in session.givens if not _is_replaced(given, session)]
    for trial in session.trials:
        found += [given for given in trial.givens if given.key != _MOMENTS or has_moments(trial)]
    return tuple(dict.fromkeys(found))


def given_lines(session: Session, *, cameras_are_exact: bool = False) -> Iterator[str]:
    """Yield a line for each given with a sigma, those assumed marked, and one for all that are exact.

    cameras_are_exact: of a cameras.toml without sigmas.
    """
    givens = givens_of(session)
    known = [given for given in givens if given.source != "exact"]
    if any(given.source == "assumed" for given in known):
        yield f"{_ASSUMED} assumed, for nothing was stated ({_HOW_TO_STATE})"
    for given in known:
        mark = _ASSUMED if given.source == "assumed" else " "
        yield f"{mark} {given.text}"
    exact = [given.key for given in givens if given.source == "exact"]
    if exact:
        yield f"  exact, as said: {', '.join(dict.fromkeys(exact))}"
    if cameras_are_exact:
        yield "  taken as exact: cameras.toml, which has no sigmas"


def assumed_line(views: Sequence[Session]) -> str:
    """Return one line on all sigmas that are assumed, and how to state them; '' without any."""
    givens = dict.fromkeys(given for view in views for given in givens_of(view))
    assumed = [f"{given.key} {given.size}" for given in givens if given.source == "assumed"]
    return f"{', '.join(assumed)}; {_HOW_TO_STATE}" if assumed else ""


def _is_replaced(given: Given, session: Session) -> bool:
    """Return whether a given of the board is replaced by cameras.toml."""
    return session.cameras_toml is not None and given.key.startswith(("[board]", "[rig]"))
