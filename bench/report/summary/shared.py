"""The error that the whisks of a session share: no mean over whisks makes it less, and no scatter shows it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from bench.records.trial_result import BY_STAGE, SeenWhisk, TrialResult, whisks
from vision.geometry import Reason, counted

# Chance by which whisks of one recording would scatter so much with a sound part of their own.
_FALSE_ALARM = 1e-3
# Angles whose scatter stands with that of the distance, by their names.
_ANGLES = {"touch": "touch_rad", "β": "beta_rad"}
_AXES = ("x", "y", "z")


@dataclass(frozen=True)
class Parts:
    """The part of a quantity's sigma that all whisks share, and each whisk's own, RMS."""

    shared: float
    own: float

    @classmethod
    def of(cls, sigma: np.ndarray, shared: np.ndarray) -> "Parts":
        """Return the parts of sigmas (n,) of which so much (n,) is shared."""
        own_variance = np.mean(np.maximum(sigma**2 - shared**2, 0.0))
        return cls(float(np.sqrt(np.mean(shared**2))), float(np.sqrt(own_variance)))

    def text(self, name: str, digits: int, unit: str) -> str:
        """Return name and parts in words."""
        return f"{name} {self.shared:.{digits}f} and {self.own:.{digits}f} {unit}"


@dataclass(frozen=True)
class SharedDistance:
    """The part of d_x's error that all n whisks share, and each whisk's own, RMS of sigmas in mm.

    settings: how many recordings they are of, each with a bar set up once. scatter_mm: of whisks of one
    recording about their mean, with so many degrees of freedom; NaN of none.
    """

    shared_mm: float
    own_mm: float
    n: int
    settings: int
    scatter_mm: float
    freedom: int

    @property
    def mean_sigma_mm(self) -> float:
        """Return the standard deviation of the mean error of all whisks.

        What is a whisk's own may be its bar's, which the whisks of a recording share.
        """
        return math.hypot(self.shared_mm, self.own_mm / np.sqrt(self.settings))

    @property
    def is_too_narrow(self) -> bool:
        """Return whether whisks of one recording scatter by more than their own part allows."""
        if not self.freedom:
            return False
        most = self.own_mm**2 * chdtri(self.freedom, _FALSE_ALARM)
        return self.freedom * self.scatter_mm**2 > most


def shared_distance(results: Sequence[TrialResult]) -> SharedDistance | None:
    """Return shared and own error; None where fewer than two whisks have a truth."""
    known = _known(results)
    if len(known) < 2:
        return None
    sigma = np.array([seen.d_x_mm.sigma for seen in known])
    shared = np.array([seen.truth.shared.d_x_mm for seen in known])
    parts = Parts.of(sigma, shared)
    settings = sum(_has_any(result, known) for result in results)
    scatter = _scatter(results, "d_x_mm")
    return SharedDistance(parts.shared, parts.own, len(known), settings, *scatter)


def _has_any(result: TrialResult, known: Sequence[SeenWhisk]) -> bool:
    """Return whether any of some whisks is of a trial."""
    return any(seen in known for seen in result.seen.whisks)


def _known(results: Sequence[TrialResult]) -> list[SeenWhisk]:
    """Return the whisks with a truth of which is known what they share."""
    seen = [one for _, one, _ in whisks(results)]
    return [one for one in seen if one.has_truth and one.truth.shared is not None]


def _other_parts(known: Sequence[SeenWhisk]) -> str:
    """Return in words what whisks share of the sigmas of touch, slopes, slip and the contact."""
    texts = []
    for name, field in _ANGLES.items():
        sigma = np.array([getattr(seen, field).sigma for seen in known])
        shared = np.array([getattr(seen.truth.shared, field) for seen in known])
        if np.isfinite(sigma).all():  # no stage knows touch
            texts.append(Parts.of(np.degrees(sigma), np.degrees(shared)).text(name, 4, "deg"))
    texts += _slip_part(known)
    sigmas = np.array([seen.point_mm.sigma for seen in known])
    shared = np.array([seen.truth.shared.point_mm for seen in known])
    for axis, own_sigma, own_shared in zip(_AXES, sigmas.T, shared.T):
        if not np.isfinite(own_sigma).all():
            continue
        texts.append(Parts.of(own_sigma, own_shared).text(f"contact {axis}", 3, "mm"))
    return ", ".join(texts)


def _slip_part(known: Sequence[SeenWhisk]) -> list[str]:
    """Return in words what whisks share of the sigma of slip; nothing where none has a slip at θ."""
    slips = []
    for seen in known:
        if seen.at is not None and np.isfinite(seen.at.slip_mm.sigma):
            slips.append((seen.at.slip_mm.sigma, seen.at.slip_shared_mm))
    if not slips:
        return []
    sigma, shared = np.array(slips).T
    return [Parts.of(sigma, shared).text("slip at θ", 4, "mm")]


def _causes(results: Sequence[TrialResult]) -> str:
    """Return what makes the error that all whisks share."""
    if _known(results)[0].source == BY_STAGE:
        return "the stage's origin, diameters, the whisker's shape"
    return "diameters, light, cameras, placement, clock"


def _scatter(results: Sequence[TrialResult], name: str) -> tuple[float, int]:
    """Return the standard deviation of whisks of one recording about their mean, pooled.

    With its degrees of freedom; name: of a `Value` of SeenWhisk.
    """
    freedom = 0
    squares = 0.0
    for result in results:
        values = [getattr(seen, name).value for seen in result.seen.whisks if seen.has_truth]
        if len(values) > 1:
            freedom += len(values) - 1
            squares += len(values) * np.var(values)
    return (float(np.sqrt(squares / freedom)) if freedom else np.nan), freedom


def shared_lines(results: Sequence[TrialResult]) -> Iterator[str]:
    """Yield the lines of the summary on what whisks share."""
    shared = shared_distance(results)
    if shared is None:
        return
    yield (
        f"d_x's sigma has two parts: ± {shared.shared_mm:.4f} mm of one error that all {shared.n} whisks share "
        f"({_causes(results)}), and ± {shared.own_mm:.4f} mm of each whisk's own; so the mean of "
        f"{counted(shared.settings, 'recording')} is known to ± {shared.mean_sigma_mm:.4f} mm"
    )
    yield f"  both parts (shared, own) of other sigmas: {_other_parts(_known(results))}"
    if shared.freedom:
        angles = []
        for name, field in _ANGLES.items():
            scatter_rad, _ = _scatter(results, field)
            if np.isnan(scatter_rad):
                continue
            angles.append(f"{name} {np.degrees(scatter_rad):.4f}°")
        yield (
            f"  whisks of one recording scatter about their mean by d_x {shared.scatter_mm:.4f} mm, "
            f"{', '.join(angles)} ({shared.freedom} degrees of freedom)"
        )


def scatter_warnings(results: Sequence[TrialResult]) -> Iterator[Reason]:
    """Yield a warning where whisks of one recording, which share bar and light, differ too much."""
    shared = shared_distance(results)
    if shared is not None and shared.is_too_narrow:
        yield Reason(
            "whisks_scatter",
            f"whisks of one recording scatter by {shared.scatter_mm:.4f} mm in d_x, {shared.own_mm:.4f} mm is stated "
            "as each whisk's own: bar or wire moves from whisk to whisk, or that part of the sigma is too narrow",
        )
