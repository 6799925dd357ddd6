"""Whisks by surface and speed: the points of Fig. 8 and the friction angle α that (13), (14) fit them with."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.analyses.cells import angle_text, panel_title
from bench.analyses.felt_push import FeltPush
from bench.analyses.pooling import by_slope, column, measured
from bench.analyses.theory_left import as_theory_has_them
from bench.base.combined import add_common, student_factor
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.trials.estimate_errors import slope_deg
from estimator.beam import Beam
from estimator.friction import FrictionFit, Pushes, fit_alpha
from estimator.uncertainty import Z_95
from vision import UNKNOWN, Value
from vision.geometry import counted

# [recordings] From so many that slip on, the fit's own sigma is that of its residuals, the whisks of a recording counting
# together: what is wrong with its slope is wrong in all of them. With fewer it is that of moments and slopes. Stated.
_MANY = 3


@dataclass(frozen=True, kw_only=True)
class Felt(FeltPush):
    """The moments felt of one whisk with their sigmas, slope and distance as seen, else nominal.

    recording: number of the trial, whose whisks count together.
    """

    m_y_sigma_Nmm: float
    m_z_sigma_Nmm: float
    phi_sigma_deg: float
    nominal: bool
    recording: int = 0
    whisk: int = 0
    beta_sigma_rad: float = 0.0

    @property
    def key(self) -> tuple[str, int]:
        """Return trial and number of the whisk."""
        return self.trial, self.whisk

    @property
    def m_Nmm(self) -> float:
        """Return |m|."""
        return math.hypot(self.m_y_Nmm, self.m_z_Nmm)

    @property
    def m_sigma_Nmm(self) -> float:
        """Return the standard deviation of |m|."""
        by_y = self.m_y_Nmm * self.m_y_sigma_Nmm
        by_z = self.m_z_Nmm * self.m_z_sigma_Nmm
        return math.hypot(by_y, by_z) / self.m_Nmm


@dataclass(frozen=True)
class SlopePoint:
    """Whisks of one slope: mean and standard deviation, or the stated sigma of a single one."""

    beta_deg: float
    whisks: int
    m_Nmm: float
    m_sd_Nmm: float
    phi_deg: float
    phi_sd_deg: float


@dataclass(frozen=True)
class FittedSurface:
    """One panel of Fig. 8: whisks of one surface and speed, and the fitted α.

    fit: None where the whisks do not determine α.
    """

    name: str
    speed_deg_s: float | None
    felt: tuple[Felt, ...]
    fit: FrictionFit | None
    beam: Beam

    @property
    def panel(self) -> tuple[str, float | None]:
        """Return surface and speed, as `TrialFacts.panel` has them."""
        return self.name, self.speed_deg_s

    @property
    def title(self) -> str:
        """Return surface and speed in words."""
        return panel_title(self.name, self.speed_deg_s)

    @property
    def alpha(self) -> Value:
        """Return the fitted α, rad; UNKNOWN where there is none."""
        return UNKNOWN if self.fit is None else Value(self.fit.alpha_rad, self.fit.sigma_rad)

    @property
    def alpha_rad(self) -> float:
        """Return the fitted α, NaN where there is none."""
        return self.alpha.value

    @property
    def common_d_x_mm(self) -> float:
        """Return the distance to which moments are scaled for the figure, by (13), (14)."""
        return float(np.median(column(self.felt, "d_x_mm")))

    @property
    def theta_rad(self) -> float:
        """Return the pushing angle of the moments."""
        return float(np.median(column(self.felt, "theta_rad")))

    def fit_without(self, trial: str, whisk: int) -> FrictionFit | None:
        """Fit α without one whisk; None where the others do not determine it."""
        others = [felt for felt in self.felt if felt.key != (trial, whisk)]
        return _fit(others, self.beam)

    def points(self) -> list[SlopePoint]:
        """Return the points of the figure: whisks of alike slope, |m| scaled to the common distance."""
        groups = by_slope(self.felt, lambda one: one.beta_deg)
        return [_point(group, self.common_d_x_mm, self.beam) for group in groups]


def surfaces(results: Iterable[TrialResult], beam: Beam) -> list[FittedSurface]:
    """Return a FittedSurface for each surface and speed among the trials that measure, in their order."""
    groups: dict[tuple[str, float | None], list[Felt]] = {}
    for recording, result in enumerate(measured(results)):
        for _, seen, felt in whisks([result]):
            one = _felt(recording, result, seen, felt)
            if one is not None:
                groups.setdefault(result.trial.panel, []).append(one)
    fitted = []
    for panel, felt in groups.items():
        fitted.append(FittedSurface(*panel, tuple(felt), _fit(felt, beam), beam))
    return fitted


def friction_lines(fitted: Iterable[FittedSurface]) -> Iterator[str]:
    """Yield a line a surface and speed: the fitted α, or why there is none."""
    for surface in fitted:
        count = counted(len(surface.felt), "whisk")
        if surface.fit is None:
            yield f"{surface.title}: {count} cannot hold it (two slopes above α are needed)"
            continue
        status = f"; {surface.fit.status}" if surface.fit.status else ""
        yield f"{surface.title}: α = {angle_text(surface.alpha)} over {count}{status}"


def _felt(recording: int, result: TrialResult, seen: SeenWhisk, felt: FeltWhisk) -> Felt | None:
    """Return the whisk as the fit takes it; None without sound moments, slope or distance."""
    trial = result.trial
    nominal = not seen.has_truth
    d_x_mm = trial.d_x_nominal_mm if nominal else seen.d_x_mm.value
    beta_rad = math.radians(slope_deg(result, seen))
    if not felt.has_moments or felt.apart or not np.isfinite([d_x_mm, beta_rad]).all():
        return None
    return Felt(
        beta_rad,
        d_x_mm,
        result.theta_rad,
        felt.m_y_Nmm.value,
        felt.m_z_Nmm.value,
        felt.shared_Nmm,
        trial.name,
        result.reach_mm(d_x_mm),
        m_y_sigma_Nmm=felt.m_y_Nmm.sigma,
        m_z_sigma_Nmm=felt.m_z_Nmm.sigma,
        phi_sigma_deg=math.degrees(felt.phi_felt_rad.sigma),
        nominal=nominal,
        recording=recording,
        whisk=seen.whisk,
        beta_sigma_rad=trial.beta_nominal_sigma_rad if nominal else seen.beta_rad.sigma,
    )


def _fit(felt: Sequence[Felt], beam: Beam) -> FrictionFit | None:
    """Fit α; its sigma is half of the 95 % interval over 1.96. None where the whisks do not hold it.

    The interval holds what the scatter of the recordings shows, what all whisks have in common, and what
    (13), (14) leave out.
    """
    if len(felt) < 2:
        return None
    pushes = _pushes(felt, beam)
    sigma_y = column(felt, "m_y_sigma_Nmm")
    sigma_z = column(felt, "m_z_sigma_Nmm")
    fit = fit_alpha(replace(pushes, sigma_y=sigma_y, sigma_z=sigma_z))
    if not np.isfinite(fit.alpha_rad):
        return None
    recording = column(felt, "recording")
    slipping = np.abs(pushes.beta) > fit.alpha_rad
    by_theory = _alpha_by_theory(pushes, felt, beam, fit.alpha_rad)
    if len(set(recording[slipping])) < _MANY:
        return _widen(fit, np.append(_alphas_by_slopes(pushes, felt, recording), by_theory))
    by_residuals = fit_alpha(replace(pushes, recording=recording))
    if not np.isfinite(by_residuals.alpha_rad):
        return None
    return _widen(by_residuals, np.append(_alphas_by_shared(pushes, felt), by_theory))


def _pushes(felt: Sequence[Felt], beam: Beam) -> Pushes:
    """Return slopes, moments and distances of whisks as a fit of α takes them: of a cylinder."""
    return Pushes(
        column(felt, "beta_rad"),
        m_y=column(felt, "m_y_Nmm"),
        m_z=column(felt, "m_z_Nmm"),
        d_x=beam.as_cylinder_mm(column(felt, "d_x_mm")),
        theta=column(felt, "theta_rad"),
        C=beam.C_Nmm2,
    )


def _widen(fit: FrictionFit, others: np.ndarray) -> FrictionFit:
    """Return a fit whose interval is wider by other values of α (k,), each with one cause off by its sigma."""
    total = add_common(fit.sigma_rad, fit.freedom, others - fit.alpha_rad)
    sigma = float(np.sqrt(total.variance)) * student_factor(total.freedom)
    reach = Z_95 * sigma
    return replace(
        fit,
        sigma_rad=sigma,
        low_rad=max(fit.alpha_rad - reach, 0.0),
        high_rad=fit.alpha_rad + reach,
    )


def _alphas_by_slopes(pushes: Pushes, felt: Sequence[Felt], recording: np.ndarray) -> np.ndarray:
    """Return α (k,) with the slope of each of k recordings off by its sigma."""
    sigmas = column(felt, "beta_sigma_rad")
    alphas = []
    for one in dict.fromkeys(recording):
        beta = pushes.beta + np.where(recording == one, sigmas, 0.0)
        alphas.append(fit_alpha(replace(pushes, beta=beta)).alpha_rad)
    return np.array(alphas)


def _alphas_by_shared(pushes: Pushes, felt: Sequence[Felt]) -> np.ndarray:
    """Return α (k,) with each of k causes that all whisks have in common off by its sigma."""
    shared = column(felt, "shared_Nmm")  # (whisks, k, 2)
    if not shared.shape[1]:
        return np.zeros(0)
    m_y = pushes.m_y + shared[:, :, 0].T
    m_z = pushes.m_z + shared[:, :, 1].T
    return fit_alpha(replace(pushes, m_y=m_y, m_z=m_z)).alpha_rad


def _alpha_by_theory(pushes: Pushes, felt: Sequence[Felt], beam: Beam, alpha_rad: float) -> float:
    """Return α by the moments without what (13), (14) leave out of them at an α."""
    m_Nmm = as_theory_has_them(felt, alpha_rad, beam)
    return float(fit_alpha(replace(pushes, m_y=m_Nmm[:, 0], m_z=m_Nmm[:, 1])).alpha_rad)


def _point(group: Sequence[Felt], d_x_mm: float, beam: Beam) -> SlopePoint:
    """Return the point of whisks of alike slope, |m| scaled to a distance."""
    scale = beam.as_cylinder_mm(column(group, "d_x_mm")) / beam.as_cylinder_mm(d_x_mm)
    m = column(group, "m_Nmm") * scale
    phi = column(group, "phi_deg")
    beta_deg = float(np.mean(column(group, "beta_deg")))
    if len(group) == 1:
        m_sigma = group[0].m_sigma_Nmm * scale[0]
        return SlopePoint(beta_deg, 1, m[0], m_sigma, phi[0], group[0].phi_sigma_deg)
    return SlopePoint(beta_deg, len(group), m.mean(), m.std(ddof=1), phi.mean(), phi.std(ddof=1))
