"""Whisks by surface and speed: the points of Fig. 8 and the friction angle α that (13), (14) fit them with."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from bench.analyses.alphas import BETA_BY_HAND_RAD
from bench.records.trial_result import TrialResult, whisks
from bench.trials.estimate_errors import slope_deg
from estimator.beam import Beam
from estimator.friction import FrictionFit, Pushes, fit_alpha
from estimator.uncertainty import Z_95
from vision.geometry.counted import counted

# From so many recordings that slip on, the fit's own sigma is that of its residuals, the whisks of a recording counting
# together: what is wrong with its slope is wrong in all of them. With fewer it is that of moments and slopes as stated.
_MANY = 3
_SAME_SLOPE_DEG = 2.5  # °: half of the step of 5° that a protractor sets
_FITTED = {
    "m_y": "m_y_Nmm",
    "m_z": "m_z_Nmm",
    "d_x": "d_x_mm",
    "theta": "theta_rad",
}  # fields of Pushes and of Felt


@dataclass(frozen=True)
class Felt:
    """What was felt of one whisk: slope and distance as seen (else nominal), moments with sigma; which recording."""

    beta_deg: float
    d_x_mm: float
    theta_rad: float
    m_y_Nmm: float
    m_z_Nmm: float
    m_y_sigma_Nmm: float
    m_z_sigma_Nmm: float
    phi_deg: float
    phi_sigma_deg: float
    nominal: bool
    recording: int = 0
    trial: str = ""
    whisk: int = 0
    shared_Nmm: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))  # as of `FeltWhisk`
    beta_sigma_rad: float = 0.0

    @property
    def m_Nmm(self) -> float:
        """|m|."""
        return float(np.hypot(self.m_y_Nmm, self.m_z_Nmm))

    @property
    def m_sigma_Nmm(self) -> float:
        """One sigma of |m|."""
        return (
            float(np.hypot(self.m_y_Nmm * self.m_y_sigma_Nmm, self.m_z_Nmm * self.m_z_sigma_Nmm))
            / self.m_Nmm
        )


@dataclass(frozen=True)
class Point:
    """Whisks of one slope: mean and standard deviation (of the ten, or the stated sigma of the one)."""

    beta_deg: float
    whisks: int
    m_Nmm: float
    m_sd_Nmm: float
    phi_deg: float
    phi_sd_deg: float


@dataclass(frozen=True)
class Surface:
    """One panel of Fig. 8: whisks of one surface and speed, and the fitted α (None where they do not hold it)."""

    name: str
    speed_deg_s: float | None
    felt: tuple[Felt, ...]
    fit: FrictionFit | None
    beam: Beam

    @property
    def panel(self) -> tuple[str, float | None]:
        """Surface and speed, as `TrialFacts.panel` has them."""
        return self.name, self.speed_deg_s

    @property
    def title(self) -> str:
        """Surface and speed in words."""
        speed = f"{self.speed_deg_s:g}°/s" if self.speed_deg_s is not None else ""
        return ", ".join(filter(None, [self.name or "surface not named", speed]))

    @property
    def alpha_rad(self) -> float:
        """Fitted α, NaN where there is none."""
        return self.fit.alpha_rad if self.fit is not None else float("nan")

    @property
    def common_d_x_mm(self) -> float:
        """The distance to which moments are scaled for the figure, by (13), (14)."""
        return float(np.median([f.d_x_mm for f in self.felt]))

    @property
    def theta_rad(self) -> float:
        """The pushing angle of the moments."""
        return float(np.median([f.theta_rad for f in self.felt]))

    def fit_without(self, trial: str, whisk: int) -> FrictionFit | None:
        """The fit without one whisk; None where the others do not hold α."""
        return _fit([f for f in self.felt if (f.trial, f.whisk) != (trial, whisk)], self.beam)

    def points(self) -> list[Point]:
        """Means and standard deviations over whisks of alike slope, moments scaled to the common distance."""
        groups: list[list[Felt]] = []
        for felt in sorted(self.felt, key=lambda f: f.beta_deg):
            if groups and felt.beta_deg - groups[-1][0].beta_deg < _SAME_SLOPE_DEG:
                groups[-1].append(felt)
            else:
                groups.append([felt])
        return [_point(group, self.common_d_x_mm, self.beam) for group in groups]


def surfaces(results: Iterable[TrialResult], beam: Beam) -> list[Surface]:
    """A Surface for each surface and speed among the measure trials, in the order in which they come."""
    groups: dict[tuple[str, float | None], list[Felt]] = {}
    for key, felt in _felt(results):
        groups.setdefault(key, []).append(felt)
    return [Surface(*key, tuple(felt), _fit(felt, beam), beam) for key, felt in groups.items()]


def friction_lines(fitted: Iterable[Surface]) -> Iterator[str]:
    """A line a surface and speed: the fitted α, or why there is none."""
    for surface in fitted:
        if surface.fit is None:
            count = counted(len(surface.felt), "whisk")
            yield f"{surface.title}: {count} cannot hold it (two slopes above α are needed)"
            continue
        alpha, sigma = np.degrees([surface.fit.alpha_rad, surface.fit.sigma_rad])
        doubt = f"; {surface.fit.status}" if surface.fit.status else ""
        yield f"{surface.title}: α = {alpha:.2f} ± {sigma:.2f}° over {counted(len(surface.felt), 'whisk')}{doubt}"


def _felt(results: Iterable[TrialResult]) -> Iterator[tuple[tuple[str, float | None], Felt]]:
    every = ((place, *whisk) for place, result in enumerate(results) for whisk in whisks([result]))
    for recording, result, seen, felt in every:
        trial, nominal = result.trial, not seen.has_truth
        d_x = trial.d_x_nominal_mm if nominal else seen.d_x_mm.value
        beta = slope_deg(result, seen)
        sound = felt.has_moments and not felt.apart
        if trial.purpose == "measure" and sound and np.isfinite([d_x, beta]).all():
            m_y, m_z, phi = felt.m_y_Nmm, felt.m_z_Nmm, felt.phi_felt_rad
            moments = m_y.value, m_z.value, m_y.sigma, m_z.sigma
            angle = float(np.degrees(phi.value)), float(np.degrees(phi.sigma))
            theta = float(np.radians(result.theta_deg))
            beta_sigma = BETA_BY_HAND_RAD if nominal else seen.beta_rad.sigma
            place = recording, trial.name, seen.whisk, felt.shared_Nmm, beta_sigma
            yield trial.panel, Felt(beta, d_x, theta, *moments, *angle, nominal, *place)


def _fit(felt: list[Felt], beam: Beam) -> FrictionFit | None:
    """α with its sigma, half of the 95 % interval over 1.96; None where the whisks do not hold it."""
    if len(felt) < 2:
        return None
    columns = {
        name: np.array([getattr(f, column) for f in felt]) for name, column in _FITTED.items()
    }
    columns["d_x"] = beam.as_cylinder_mm(columns["d_x"])
    beta, sigmas = (
        np.radians([f.beta_deg for f in felt]),
        np.array([(f.m_y_sigma_Nmm, f.m_z_sigma_Nmm) for f in felt]),
    )
    pushes = Pushes(beta, **columns, C=beam.C_Nmm2)
    fit = fit_alpha(replace(pushes, sigma_y=sigmas[:, 0], sigma_z=sigmas[:, 1]))
    if not np.isfinite(fit.alpha_rad):
        return None
    recording = np.array([f.recording for f in felt])
    if len(set(recording[np.abs(beta) > fit.alpha_rad])) < _MANY:
        return _wider(fit, _by_slopes(pushes, felt, recording))
    own = fit_alpha(replace(pushes, recording=recording))
    return _wider(own, _shared(pushes, felt)) if np.isfinite(own.alpha_rad) else None


def _wider(fit: FrictionFit, others: np.ndarray) -> FrictionFit:
    """The fit whose interval holds, too, what other values of α (k,), one sigma of a cause each, differ from it by."""
    reach = float(
        np.hypot(
            fit.high_rad - fit.alpha_rad,
            Z_95 * np.linalg.norm(np.nan_to_num(others - fit.alpha_rad)),
        )
    )
    ends = {"low_rad": max(fit.alpha_rad - reach, 0.0), "high_rad": fit.alpha_rad + reach}
    return replace(fit, sigma_rad=reach / Z_95, **ends)


def _by_slopes(pushes: Pushes, felt: list[Felt], recording: np.ndarray) -> np.ndarray:
    """α (k,) with each recording's slope off by its sigma."""
    moved = [
        np.where(recording == one, [f.beta_sigma_rad for f in felt], 0.0)
        for one in dict.fromkeys(recording)
    ]
    return np.array([fit_alpha(replace(pushes, beta=pushes.beta + by)).alpha_rad for by in moved])


def _shared(pushes: Pushes, felt: list[Felt]) -> np.ndarray:
    """α (k,) with each cause off by its sigma that all whisks have in common."""
    m_y, m_z = (
        m + np.array([f.shared_Nmm[:, axis] for f in felt]).T
        for axis, m in enumerate((pushes.m_y, pushes.m_z))
    )
    return fit_alpha(replace(pushes, m_y=m_y, m_z=m_z)).alpha_rad if len(m_y) else np.zeros(0)


def _point(group: list[Felt], d_x_mm: float, beam: Beam) -> Point:
    to_common = beam.as_cylinder_mm([f.d_x_mm for f in group]) / beam.as_cylinder_mm(d_x_mm)
    m = np.array([f.m_Nmm for f in group]) * to_common
    phi, beta = np.array([f.phi_deg for f in group]), float(np.mean([f.beta_deg for f in group]))
    if len(group) == 1:
        return Point(
            beta, 1, m[0], group[0].m_sigma_Nmm * to_common[0], phi[0], group[0].phi_sigma_deg
        )
    return Point(beta, len(group), m.mean(), m.std(ddof=1), phi.mean(), phi.std(ddof=1))
