"""A number with its sigma, and the six that exist only while the whisker touches."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

NAN = float("nan")


@dataclass(frozen=True, eq=False)
class Value:
    """A measured quantity and its standard deviation, in one unit and of one shape; NaN where there
    is none.
    """

    value: float | np.ndarray = NAN
    sigma: float | np.ndarray = NAN

    @property
    def is_known(self) -> bool:
        """Return whether every number of it is finite; its sigma need not be."""
        return bool(np.all(np.isfinite(self.value)))

    def in_degrees(self) -> "Value":
        """Return an angle that is in rad in degrees."""
        return Value(np.degrees(self.value), np.degrees(self.sigma))

    def at(self, k: int) -> "Value":
        """Return one of several values."""
        return Value(self.value[k], self.sigma[k])


def as_values(pairs: Mapping[str, tuple[float, float]]) -> dict[str, Value]:
    """Return values with their sigmas, by name; pairs: of both."""
    return {name: Value(*pair) for name, pair in pairs.items()}


def propagated_sigma(rows: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return the standard deviations (...) of quantities with derivatives (..., p) by parameters of
    this covariance (p, p).
    """
    variances = np.sum((rows @ covariance) * rows, axis=-1)
    return np.sqrt(np.maximum(variances, 0.0))


UNKNOWN = Value()
UNKNOWN_POINT = Value(np.full(3, NAN), np.full(3, NAN))


@dataclass(frozen=True, kw_only=True, eq=False)
class WhileTouching:
    """Slip along the bar and along the whisker, deflection, its direction, and the force's angle
    from the contact's normal: floats at one pushing angle, or (n,) over frames.
    """

    slip_mm: Value = UNKNOWN
    longitudinal_slip_mm: Value = UNKNOWN
    d_y_mm: Value = UNKNOWN
    d_z_mm: Value = UNKNOWN
    phi_rad: Value = UNKNOWN
    alpha_rad: Value = UNKNOWN


# Fields of WhileTouching by the names that the fit has for them (`vision.fit.quantities`).
FIELDS = {field.rpartition("_")[0]: field for field in WhileTouching.__dataclass_fields__}
# Where the wire has the contact in the hub's axes, from the unbent wire: d_z is the third.
IN_HUB = ("along", "across_y")
