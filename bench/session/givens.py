"""Givens: every number that a person states has a sigma: the stated one, else that of a careful lab.

Exact is what is said to be exact: by a sigma of 0, or by `exact = true` in its table or at the top
of session.toml.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from bench.session.strict_toml import Keys, declared_parts, inner_tables

_AS_READ = {"mm_s": "mm/s", "Nmm2": "N·mm²", "Nmm_per_V": "N·mm/V"}
Sigma: TypeAlias = float | list[float] | list[list[float]]
Source: TypeAlias = Literal["stated", "assumed", "exact"]


@dataclass(frozen=True, kw_only=True)
class GivenKeys(Keys):
    """A table that states numbers of a bench."""

    # true: what has no sigma here is exact
    exact: bool | None = None


@dataclass(frozen=True, kw_only=True)
class Assumed:
    """The sigma that is assumed of a value where nobody states one: that of a careful lab.

    absolute: in the sigma's own unit. share: of the value. The smaller of both counts; without both
    the recording says it. origin: where it comes from. of: the key of the value, where the sigma's
    name does not say it. unstated: the name of a value that stands in no key.
    """

    origin: str
    absolute: float = math.inf
    share: float = math.inf
    of: str = ""
    unstated: str = ""

    def sigma(self, value: Any) -> Sigma | None:
        """Return the sigma of a value, of the length of a vector; None where the recording says it."""
        size = float(np.linalg.norm(value)) if math.isfinite(self.share) else 1.0
        sigma = min(self.absolute, self.share * size)
        return sigma if math.isfinite(sigma) else None

    def exact(self, value: Any) -> Sigma:
        """Return the sigma of a value that is exact."""
        return 0.0

    def text(self, unit: str) -> str:
        """Return the assumption as documents have it: '± 0.02 mm, at most 2 % (a caliper)'."""
        sizes = []
        if math.isfinite(self.absolute):
            sizes.append(f"{self.absolute:g} {unit}" if unit else f"{100.0 * self.absolute:g} %")
        if math.isfinite(self.share):
            sizes.append(f"{100.0 * self.share:.2g} %")
        return f"± {', at most '.join(sizes)} ({self.origin})" if sizes else f"± {self.origin}"


@dataclass(frozen=True, kw_only=True)
class AssumedOfRows(Assumed):
    """The sigmas that are assumed of a matrix: every entry has the share of its row's largest entry."""

    def sigma(self, value: list[list[float]]) -> list[list[float]]:
        """Return the sigmas of a matrix, entry by entry."""
        rows = np.abs(np.array(value))
        largest = rows.max(axis=1, keepdims=True)
        return (self.share * np.broadcast_to(largest, rows.shape)).tolist()

    def exact(self, value: list[list[float]]) -> list[list[float]]:
        """Return the sigmas of a matrix that is exact."""
        return np.zeros_like(value, dtype=float).tolist()


@dataclass(frozen=True)
class Given:
    """A number that a person stated, and how well it is known.

    key: of the value, with its table. sigma: in `unit`, the largest of a matrix; None where the
    recording says it. origin: of an assumed sigma.
    """

    key: str
    sigma: float | None
    unit: str
    source: Source
    origin: str = ""

    @property
    def size(self) -> str:
        """Return the sigma in words: '± 0.5 mm'; its origin where only the recording says it."""
        if self.sigma is None:
            return f"± {self.origin}"
        if not self.unit:
            return f"± {100.0 * self.sigma:.3g} %"
        return f"± {self.sigma:.3g} {self.unit}"

    @property
    def text(self) -> str:
        """Return the given with its sigma, and where that comes from."""
        source = f"assumed: {self.origin}" if self.source == "assumed" else "stated"
        return f"{self.key} {self.size}, {source}"


def assumptions(kind: type[Keys]) -> dict[str, Assumed]:
    """Return what a table assumes, by the key of the sigma."""
    return declared_parts(kind, Assumed)


def value_key(sigma_key: str, assumed: Assumed) -> str:
    """Return the key of the value that a sigma belongs to."""
    return assumed.of or sigma_key.replace("_sigma", "")


def unit_of(sigma_key: str) -> str:
    """Return the unit of a sigma by its name: 'length_sigma_mm' -> 'mm'; '' of a share."""
    unit = sigma_key.partition("_sigma")[2].strip("_")
    return _AS_READ.get(unit, unit)


def with_sigmas(
    table: dict[str, Any], kind: type[Keys], label: str = "", *, exact: bool = False
) -> tuple[dict[str, Any], tuple[Given, ...]]:
    """Return a checked table with a sigma for each number that needs one, and what is so given.

    The tables within it are filled, too. label: how messages name the table. exact: whether unsaid
    sigmas are 0 where the table does not say.
    """
    exact = table.get("exact", exact)
    filled, givens = _with_own_sigmas(table, kind, label, exact)
    for key, inner in inner_tables(kind).items():
        if isinstance(table.get(key), list):
            filled[key], of_parts = _with_sigmas_in_all(table[key], inner, key, exact)
            givens += of_parts
        elif key in table:
            name = label if label.startswith("[[") else f"[{key}]"
            filled[key], of_table = with_sigmas(table[key], inner, name, exact=exact)
            givens += of_table
    return filled, tuple(givens)


def _with_own_sigmas(
    table: dict[str, Any], kind: type[Keys], label: str, exact: bool
) -> tuple[dict[str, Any], list[Given]]:
    """Return a table with sigmas of its own numbers, not of the tables within, and what is so given."""
    filled = dict(table)
    givens: list[Given] = []
    for key, assumed in assumptions(kind).items():
        if value_key(key, assumed) in table or assumed.unstated:
            filled[key], source = _sigma(table, key, assumed, exact)
            givens += _given(key, filled[key], source, assumed, label)
    return filled, givens


def _with_sigmas_in_all(
    tables: list[dict[str, Any]], kind: type[Keys], key: str, exact: bool
) -> tuple[list[dict[str, Any]], list[Given]]:
    """Return the tables of an array of tables [[key]] with sigmas, and what is given in all of them."""
    filled = []
    givens: list[Given] = []
    for table in tables:
        label = f"[[{key}]] {table.get('name', '')}".strip()
        filled_table, of_table = with_sigmas(table, kind, label, exact=exact)
        filled.append(filled_table)
        givens += of_table
    return filled, givens


def _sigma(
    table: dict[str, Any], key: str, assumed: Assumed, exact: bool
) -> tuple[Sigma | None, Source]:
    """Return the sigma of a key, and where it comes from."""
    if key in table:
        return table[key], "stated" if np.any(table[key]) else "exact"
    value = table.get(value_key(key, assumed), 1.0)
    if exact:
        return assumed.exact(value), "exact"
    return assumed.sigma(value), "assumed"


def _given(
    key: str, sigma: Sigma | None, source: Source, assumed: Assumed, label: str
) -> list[Given]:
    """Return the given of a sigma's key; none where a share is assumed of a value of 0."""
    largest = None if sigma is None else float(np.max(sigma))
    if source == "assumed" and largest == 0.0:
        return []
    name = f"{label} {assumed.unstated or value_key(key, assumed)}"
    origin = assumed.origin if source == "assumed" else ""
    return [Given(name, largest, unit_of(key), source, origin)]
