"""What a trial would give, in a row: expected sigmas, what limits each, and what stands in the way."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from vision import LineNoise, PredictedTruth
from vision.geometry import joined

# The columns of a row, by vision's name of the quantity: at touch, then at a pushing angle.
COLUMNS = {
    "d_x": "d_x_mm",
    "touch": "touch_deg",
    "beta": "beta_deg",
    "slip": "slip_mm",
    "phi": "phi_deg",
    "alpha": "alpha_deg",
}
QUANTITIES = tuple(COLUMNS.values())
WORDS = {
    "wire": "scatter of the wire's line",
    "bar": "the bar's line",
    "touch": "roundness at touch",
    "diameters": "the diameters",
    "light": "light (lines off as a whole)",
    "priors": "the priors of rest shape and bend",
    "cameras": "the cameras' calibration",
    "placement": "where the rig board stands",
}
# [1] Least share of the wire outside a picture or behind the clamp that is reported. Stated.
_LEAST_HIDDEN_SHARE = 0.1
# [1] Least share of the wire behind the bar that is reported. Stated.
_LEAST_BEHIND_BAR = 0.3
# [1] Of the bar's middle in a picture: a smaller share is reported. Stated.
_LEAST_BAR_SEEN = 0.7


def in_unit(column: str, value: float) -> float:
    """Return a value in mm or rad in the unit of a column."""
    return value * math.degrees(1.0) if column.endswith("_deg") else value


@dataclass(frozen=True)
class Outlook:
    """What one whisk would give.

    sigma: by column, NaN where there is none. limits: by column, the cause of the largest part of
    the variance, and that part. obstacles: sentences on cameras. status: why there is no truth, or
    a warning.
    """

    sigma: Mapping[str, float] = field(
        default_factory=lambda: dict.fromkeys(QUANTITIES, float("nan"))
    )
    limits: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    obstacles: tuple[str, ...] = ()
    status: str = ""

    @property
    def has_truth(self) -> bool:
        """Return whether there would be a distance."""
        return bool(np.isfinite(self.sigma["d_x_mm"]))


def outlook(predicted: PredictedTruth, noise: Mapping[str, LineNoise], theta_rad: float) -> Outlook:
    """Return what a whisk would give; slip, φ and α at a pushing angle."""
    truth = predicted.truth
    sentences = tuple(obstacles(predicted, noise))
    if not predicted.is_known:
        return Outlook(status=truth.status, obstacles=sentences)
    limits = {}
    for name, limit in predicted.largest_causes(theta_rad).items():
        limits[COLUMNS[name]] = limit
    status = joined(truth.status, truth.at(theta_rad).status)
    return Outlook(sigmas(predicted, theta_rad), limits, sentences, status)


def sigmas(predicted: PredictedTruth, theta_rad: float) -> dict[str, float]:
    """Return the sigma of each column; slip, φ and α at a pushing angle."""
    found = {}
    for name, sigma in predicted.sigmas(theta_rad).items():
        found[COLUMNS[name]] = in_unit(COLUMNS[name], sigma)
    return found


def obstacles(predicted: PredictedTruth, noise: Mapping[str, LineNoise]) -> Iterator[str]:
    """Yield what keeps each camera from seeing the whole whisk, a sentence each."""
    for name in predicted.sights:
        yield from _obstacles_of(name, predicted, noise.get(name))


def _obstacles_of(name: str, predicted: PredictedTruth, own: LineNoise | None) -> Iterator[str]:
    """Yield what keeps one camera from seeing the whole whisk; own: the noise of its lines, if known."""
    sight = predicted.sights[name]
    if sight.is_along_bar:
        angle_deg = np.degrees(sight.angle_to_bar_rad)
        yield f"camera {name} looks along the bar ({angle_deg:.0f} deg to its axis)"
    elif own is not None and len(own.bar_px) == 0:
        yield f"camera {name} does not see the bar's edges"
    if sight.outside > _LEAST_HIDDEN_SHARE:
        yield f"camera {name} has {_percent(sight.outside)} of the whisker outside its picture"
    if sight.bar_share < _LEAST_BAR_SEEN:
        missing = _percent(1 - sight.bar_share)
        yield f"camera {name} has {missing} of the bar's middle outside its picture"
    if sight.behind_bar > _LEAST_BEHIND_BAR and sight.is_bar_nearer:
        yield f"camera {name} has the bar before {_percent(sight.behind_bar)} of the whisker"
    if sight.hidden > _LEAST_HIDDEN_SHARE:
        hidden = _percent(sight.hidden)
        yield f"camera {name} has the bar's clamp before {hidden} of the whisker"
    if own is not None and not np.isfinite(own.wire_px):
        yield f"camera {name} does not see the whisker"


def _percent(share: float) -> str:
    """Return a share as text."""
    return f"{100 * share:.0f} %"
