"""Errors and sigmas of one quantity of many whisks, reduced to a few figures; columns and sessions of these."""

from collections.abc import Iterable, Sequence

import numpy as np

from tests.studies.accuracy.rows import HALF_WIDTH_95

OF_EACH = ("n", "held", "rms_z", "rms", "rms_sigma")
Figures = dict[str, float]  # OF_EACH


def of_whisks(found: Iterable[Sequence[float]]) -> Figures:
    """Reduce errors and sigmas (n, 2) of the whisks of which both are known."""
    table = np.array(list(found))
    error, sigma = table[np.isfinite(table).all(axis=1)].T
    z = error / sigma
    held = np.mean(np.abs(z) < HALF_WIDTH_95)
    roots = [np.sqrt(np.mean(values**2)) for values in (z, error, sigma)]
    return dict(zip(OF_EACH, map(float, (len(z), held, *roots))))


def pooled(figures: Iterable[Figures]) -> Figures:
    """Reduce the figures of several sessions to those of all their whisks."""
    n, held, *roots = np.array([[one[what] for what in OF_EACH] for one in figures]).T
    mean_squares = [n @ root**2 / n.sum() for root in roots]
    return dict(zip(OF_EACH, (n.sum(), n @ held / n.sum(), *np.sqrt(mean_squares))))


def columns_of(names: Iterable[str]) -> tuple[str, ...]:
    """Return the columns of a table that hold the figures of each name."""
    return tuple(f"{name}_{what}" for name in names for what in OF_EACH)


def as_columns(name: str, figures: Figures) -> dict[str, float]:
    """Return figures by the columns of a name."""
    return {f"{name}_{what}": value for what, value in figures.items()}


def of_columns(row: dict, name: str) -> Figures:
    """Return the figures of a name from the columns of a row."""
    return {what: row[f"{name}_{what}"] for what in OF_EACH}
