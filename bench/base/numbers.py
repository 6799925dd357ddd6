"""Numbers as a reader takes them: as many digits as their standard deviation makes sense of; lists of names."""

import math
from collections.abc import Iterable

MISSING = "–"
# [digits] Of a standard deviation: a third would be noise. Stated.
_SIGMA_DIGITS = 2


def number(value: float | None, digits: int = 2) -> str:
    """Return a number with so many digits after the point; a dash for what is missing."""
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{value:.{digits}f}".replace("-", "−")


def with_sigma(value: float, sigma: float, *, sign: bool = False) -> str:
    """Return value ± sigma, to two digits of the sigma.

    >>> with_sigma(55.25149, 0.01234)
    '55.251 ± 0.012'
    >>> with_sigma(204.31, 14.2, sign=True)
    '+204 ± 14'
    >>> with_sigma(float("nan"), 0.1)
    '–'
    """
    if not math.isfinite(value):
        return MISSING
    plus = "+" if sign and value > 0 else ""
    if not (math.isfinite(sigma) and sigma > 0):
        return plus + f"{value:.4g}".replace("-", "−")
    digits = max(0, _SIGMA_DIGITS - 1 - math.floor(math.log10(sigma)))
    return plus + number(value, digits) + f" ± {sigma:.{digits}f}"


def number_range(low: float, high: float, digits: int) -> str:
    """Return both ends of a range; a dash where one of them is missing."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return MISSING
    return f"{number(low, digits)} to {number(high, digits)}"


def first_names(names: Iterable[object], most: int) -> str:
    """Return the first names in one line, and how many more there are; "none" where there is none.

    >>> first_names(["b30", "b45", "b60"], 2)
    'b30, b45 and 1 more'
    """
    listed = list(map(str, names))
    text = ", ".join(listed[:most]) or "none"
    return f"{text} and {len(listed) - most} more" if len(listed) > most else text
