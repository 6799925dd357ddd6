"""What a trial would give, in a row: expected sigmas, what limits each, and what stands in the way."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from bench.plan.expected import Expected
from bench.plan.sight import ALONG_RAD
from vision.fit.covariance import variance_by_cause
from vision.fit.line_noise import LineNoise
from vision.geometry.reasons import joined
from vision.truth.at_angle import scatter
from vision.truth.records import WhiskTruth

# Quantities of a row by their columns: the fit's name, and what turns its unit into the column's.
_DEG = float(np.degrees(1.0))
AT_TOUCH = {"d_x_mm": ("d_x", 1.0), "touch_deg": ("touch", _DEG), "beta_deg": ("beta", _DEG)}
AT_THETA = {"slip_mm": ("slip", 1.0), "phi_deg": ("phi", _DEG), "alpha_deg": ("alpha", _DEG)}
QUANTITIES = (*AT_TOUCH, *AT_THETA)
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
# What is said of a camera: shares of the wire, of the bar's stretch that its line is told from.
_MUCH, _SOME, _LEAST_OF_BAR = 0.3, 0.1, 0.7


@dataclass(frozen=True)
class Outlook:
    """One whisk as planned. sigma: by column, NaN where there is none; limits: by column, the cause of the largest part
    of the variance, and that part; obstacles: sentences on cameras; status: why there is no truth, or a doubt."""

    sigma: Mapping[str, float] = field(
        default_factory=lambda: dict.fromkeys(QUANTITIES, float("nan"))
    )
    limits: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    obstacles: tuple[str, ...] = ()
    status: str = ""

    @property
    def has_truth(self) -> bool:
        """Whether there would be a distance."""
        return bool(np.isfinite(self.sigma["d_x_mm"]))


def outlook(found: Expected, lines: Mapping[str, LineNoise], theta_rad: float) -> Outlook:
    """The row of a whisk; slip, φ and α at a pushing angle."""
    truth = found.truth
    said = tuple(obstacles(found, lines))
    if not np.isfinite(truth.d_x_mm.value) or found.fitted is None:
        return Outlook(status=truth.status, obstacles=said)
    status = joined(truth.status, truth.at(theta_rad).status)
    return Outlook(sigmas(truth, theta_rad), _limits(found, theta_rad), said, status)


def sigmas(truth: WhiskTruth, theta_rad: float) -> dict[str, float]:
    """Sigmas by column; at an angle with the scatter of its frames, which the staged ones do not have."""
    at = truth.at(theta_rad)
    found = {
        "d_x_mm": truth.d_x_mm,
        "touch_deg": truth.touch_rad,
        "beta_deg": truth.beta_rad,
        "slip_mm": at.slip_mm,
        "phi_deg": at.phi_rad,
        "alpha_deg": at.alpha_rad,
    }
    one_fit = truth.smooth is not None and not at.status
    expected = {
        name: scatter(truth.smooth, key, theta_rad).expected if one_fit else 0.0
        for name, (key, _) in AT_THETA.items()
    }
    return {
        name: float(np.hypot(found[name].sigma, expected.get(name, 0.0))) * scale
        for name, (_, scale) in (AT_TOUCH | AT_THETA).items()
    }


def _limits(found: Expected, theta_rad: float) -> dict[str, tuple[str, float]]:
    fitted = found.fitted
    frame = int(
        np.argmin(np.abs(fitted.problem.motor_rad - fitted.measured.whisk["touch"] - theta_rad))
    )
    gradients = {name: fitted.by_parameter.whisk[key] for name, (key, _) in AT_TOUCH.items()}
    gradients |= {
        name: fitted.by_parameter.frame[key][frame] for name, (key, _) in AT_THETA.items()
    }
    return {name: _largest(fitted, gradient) for name, gradient in gradients.items()}


def _largest(fitted, gradient: np.ndarray) -> tuple[str, float]:
    """The cause of the largest part of a variance, and that part."""
    parts = variance_by_cause(fitted.problem, fitted.state, fitted.uncertainty, gradient)
    parts = {name: part for name, part in parts.items() if np.isfinite(part)}
    cause = max(parts, key=lambda name: parts[name])
    return cause, float(parts[cause] / sum(parts.values()))


def obstacles(found: Expected, lines: Mapping[str, LineNoise]) -> Iterator[str]:
    """What keeps a camera from seeing the whole whisk, a sentence each."""
    for name, sight in found.sights.items():
        noise = lines.get(name)
        if sight.to_bar_rad < ALONG_RAD:
            yield f"camera {name} looks along the bar ({np.degrees(sight.to_bar_rad):.0f} deg to its axis)"
        elif noise is not None and len(noise.bar_px) == 0:
            yield f"camera {name} does not see the bar's edges"
        if sight.outside > _SOME:
            yield f"camera {name} has {100 * sight.outside:.0f} % of the whisker outside its picture"
        if sight.bar_share < _LEAST_OF_BAR:
            yield f"camera {name} has {100 * (1 - sight.bar_share):.0f} % of the bar's middle outside its picture"
        if sight.by_bar > _MUCH and sight.bar_nearer:
            yield f"camera {name} has the bar before {100 * sight.by_bar:.0f} % of the whisker"
        if sight.hidden > _SOME:
            yield f"camera {name} has the bar's clamp before {100 * sight.hidden:.0f} % of the whisker"
        if noise is not None and not np.isfinite(noise.wire_px):
            yield f"camera {name} does not see the whisker"
