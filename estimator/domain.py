"""Arguments and results of every equation: their domain, their broadcasting, their types.

Measured arguments outside an equation's domain give NaN; settings that no measurement can excuse
raise ValueError. Scalars give floats, arrays give arrays, and NumPy never warns.
"""

from collections.abc import Callable, Sequence
from functools import reduce, wraps
from operator import and_
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from estimator.reasons import NamedReason

# [rad] Derived.
RIGHT_ANGLE = np.pi / 2
# Why several equations have no result.
VALUE_MISSING = NamedReason("value_missing", "a measured value is missing or infinite")
ANGLE_TOO_LARGE = NamedReason("angle_too_large", "the pushing angle is 90 degrees or more")
SLOPE_TOO_STEEP = NamedReason("slope_too_steep", "the slope beta is 90 degrees or more")
NOT_PUSHING = NamedReason(
    "not_pushing", "m_z is not positive: the whisker does not push towards the object"
)
# The result of an equation: a float for scalars, an array of their common shape for arrays.
Numbers: TypeAlias = float | np.ndarray


def elementwise(function: Callable) -> Callable:
    """Wrap a formula on float64 arrays: it takes anything array-like, and returns floats for
    scalars.

    Functions among the arguments pass through. Overflow, division by zero and NaN stay silent
    inside: the formula's own domain decides what they mean.
    """

    @wraps(function)
    def wrapper(*args, **kwargs):
        """Evaluate the formula on arrays of float64."""
        arrays = [_array(a) for a in args]
        named = {name: _array(a) for name, a in kwargs.items()}
        with np.errstate(all="ignore"):
            return _plain(function(*arrays, **named))

    return wrapper


def _array(argument):
    """Convert an argument to an array of float64, unless it is a function."""
    if type(argument) is float or isinstance(argument, np.ndarray) or not callable(argument):
        return np.asarray(argument, dtype=float)
    return argument


def _plain(result):
    """Convert arrays without axes to Python numbers, in tuples as well."""
    if isinstance(result, tuple):
        return tuple(_plain(part) for part in result)
    if isinstance(result, np.generic):
        return result.item()
    return np.asarray(result).item() if np.ndim(result) == 0 else result


def require_positive(name: str, value: ArrayLike, unit: str) -> None:
    """Raise ValueError unless every `value` is positive and finite."""
    if not _all(value, lambda x: (x > 0) & (x < np.inf)):
        raise ValueError(f"{name} = {value} {unit}: must be positive and finite")


def require_friction_angle(name: str, value: ArrayLike) -> None:
    """Raise ValueError unless every `value` [rad] lies in [0°, 90°)."""
    if not _all(value, lambda x: (x >= 0) & (x < RIGHT_ANGLE)):
        raise ValueError(
            f"{name} = {value} rad: must lie in [0, pi/2), that is from 0 to below 90 degrees"
        )


def require_sigma(name: str, value: ArrayLike) -> None:
    """Raise ValueError unless every `value` is a standard deviation: zero or positive, and
    finite.
    """
    if not _all(value, lambda x: (x >= 0) & (x < np.inf)):
        raise ValueError(
            f"{name} = {value}: a standard deviation must be zero or positive, and finite"
        )


def _all(value: ArrayLike, holds: Callable) -> bool:
    """Check that `holds` is true of every value; of a single one without the cost of arrays."""
    array = np.asarray(value, dtype=float)
    return bool(holds(array.item())) if array.ndim == 0 else bool(np.all(holds(array)))


def first_failure(
    conditions: Sequence[tuple[str, np.ndarray]], shape: tuple[int, ...]
) -> str | np.ndarray:
    """Return the text of the first condition that does not hold, element by element; else an empty
    one.

    `conditions` are pairs (what is wrong, mask of what must hold). Returns for shape () the text
    itself, which keeps its code, else an array of str.
    """
    reasons = np.full(shape, "", dtype=object)
    for text, holds in conditions:
        failed = np.logical_not(np.broadcast_to(holds, shape))
        reasons[failed & (reasons == "")] = text
    return reasons.item() if shape == () else reasons.astype(str)


def where_all(conditions: Sequence[tuple[str, np.ndarray]], value: np.ndarray) -> np.ndarray:
    """Return `value` where all conditions hold, NaN elsewhere."""
    holds = reduce(and_, (mask for _, mask in conditions))
    return np.where(holds, value, np.nan)
