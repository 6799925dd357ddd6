"""What session.toml states, with a sigma for each number that needs one."""

from dataclasses import dataclass
from typing import Any

from bench.session import manifest
from bench.session.givens import Given, with_sigmas
from bench.session.strict_toml import convert

_OF_TRIALS = ("[trial]", "[object]")


@dataclass(frozen=True)
class StatedSession:
    """session.toml with all sigmas. givens: of all its tables but [trial].

    trial_table: [trial] as it stands there, from which trials take what they do not state.
    """

    keys: manifest.SessionKeys
    givens: tuple[Given, ...]
    trial_table: dict[str, Any]

    @classmethod
    def of(cls, tables: dict[str, Any]) -> "StatedSession":
        """Return what the checked tables of a session.toml state."""
        filled, givens = with_sigmas(tables, manifest.SessionKeys)
        of_session = tuple(given for given in givens if not given.key.startswith(_OF_TRIALS))
        keys = convert(filled, manifest.SessionKeys)
        return cls(keys, of_session, tables.get("trial", {}))

    def givens_of(self, whisker: str = "") -> tuple[Given, ...]:
        """Return what is given of the session, and of this one of [[whiskers]]."""
        own = f"{whisker_label(whisker)} "
        found = []
        for given in self.givens:
            if not given.key.startswith("[[whiskers]]") or given.key.startswith(own):
                found.append(given)
        return tuple(found)


def whisker_label(name: str) -> str:
    """Return how messages name one of [[whiskers]]."""
    return f"[[whiskers]] {name}"
