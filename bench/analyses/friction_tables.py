"""What a session tells of friction: friction.csv (whisks), phases.csv (stick and slip), surfaces.csv, summary lines."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analyses.alphas import UNKNOWN, WhiskAlphas, alphas_of, mean_alpha
from bench.analyses.section_vii import (
    Way,
    by_consistency,
    by_smoothness,
    by_tilting,
    contacts,
    weights,
)
from bench.analyses.surfaces import Surface, surfaces
from bench.base.tables import (
    SPEED,
    SURFACE,
    TRIAL,
    WHISK,
    Column,
    Kind,
    Table,
    alike,
    sigma_name,
    with_sigma,
)
from bench.records.phases import KINETIC, STATIC
from bench.records.trial_result import TrialResult
from bench.session.whisker import Whisker
from bench.trials.estimate_errors import Judged, judge

RECORDS = ("seen", "felt")
WAYS = ("tilting", "consistency", "smoothness")
_APART = tuple((kind, record) for kind in (STATIC, KINETIC) for record in RECORDS)


# What the records of whisks hold of α: in the friction of a whisk, and as means in that of a surface.
_OF_WHISK = (*RECORDS, *(f"{kind}_{record}" for kind, record in _APART))
FRICTION = Table(
    "friction",
    "A row a whisk: friction angles α, each with its sigma.",
    (
        TRIAL,
        WHISK,
        SURFACE,
        SPEED,
        Column("beta_deg", "slope of the bar"),
        Column("beta_from", "pictures; or manifest, where no picture shows the slope", Kind.TEXT),
        *with_sigma(
            "alpha_seen_deg",
            "from the deflection, pictures alone, with the friction that acts along the whisker",
        ),
        *with_sigma(
            "alpha_felt_deg",
            "from the moments and the slope seen, with the friction that acts along the whisker",
        ),
        *with_sigma("alpha_static_seen_deg", "where rests end, seen"),
        *with_sigma("alpha_static_felt_deg", "where rests end, felt"),
        *with_sigma("alpha_kinetic_seen_deg", "where jumps end, seen"),
        *with_sigma("alpha_kinetic_felt_deg", "where jumps end, felt"),
        *alike(
            ("rests_seen", "jumps_seen", "rests_felt", "jumps_felt"),
            "how many of each",
            Kind.WHOLE,
        ),
        Column("confidence", "weight of section VII, from φ felt"),
    ),
)
PHASES = Table(
    "phases",
    "A row an end of a rest or of a jump.",
    (
        TRIAL,
        WHISK,
        Column("record", "seen or felt", Kind.TEXT),
        Column("kind", "static (the rest breaks) or kinetic (the jump stops)", Kind.TEXT),
        Column("theta_deg", "pushing angle there"),
        *with_sigma("alpha_deg", "friction angle there"),
    ),
)
_MEAN = "mean over the whisks, as in friction.csv"
SURFACES = Table(
    "surfaces",
    "A row a surface and speed.",
    (
        SURFACE,
        SPEED,
        Column("whisks", "how many whisks", Kind.WHOLE),
        *with_sigma("alpha_seen_deg", _MEAN),
        *with_sigma("alpha_felt_deg", _MEAN),
        *with_sigma("alpha_static_seen_deg", _MEAN),
        *with_sigma("alpha_static_felt_deg", _MEAN),
        *with_sigma("alpha_kinetic_seen_deg", _MEAN),
        *with_sigma("alpha_kinetic_felt_deg", _MEAN),
        *with_sigma("alpha_least_squares_deg", "the fit of Fig. 8"),
        *with_sigma("alpha_tilting_deg", "by tilting, section VII"),
        *with_sigma("alpha_consistency_deg", "by consistency, section VII"),
        *with_sigma(
            "alpha_smoothness_deg",
            "by smoothness, section VII: consistency over several distances",
        ),
        Column("error_rms_percent", "of (10) with α_est as given, all whisks alike"),
        Column(
            "error_rms_weighted_percent",
            "of (10) with α_est as given, whisks weighted by confidence",
        ),
        Column(
            "notes",
            "why a way of section VII has no result, or what is doubtful of it",
            Kind.SENTENCE,
        ),
    ),
)


@dataclass(frozen=True)
class SurfaceFriction:
    """All that one surface at one speed tells of α: of its whisks, Fig. 8's fit, the ways of section VII.

    error_rms_percent, error_rms_weighted_percent: of (10), α_est given, all whisks alike or by confidence.
    """

    surface: Surface
    whisks: tuple[WhiskAlphas, ...]
    ways: tuple[Way, ...]
    error_rms_percent: float
    error_rms_weighted_percent: float

    def alpha(self, name: str) -> tuple[float, float]:
        """(value, sigma) in rad by the name in the columns; NaN where it is not known."""
        if name in RECORDS:
            return mean_alpha(getattr(w, name) for w in self.whisks)
        if name == "least_squares":
            fit = self.surface.fit
            return (fit.alpha_rad, fit.sigma_rad) if fit else UNKNOWN
        kind, _, record = name.partition("_")
        if record:
            return mean_alpha(w.apart(kind, record) for w in self.whisks)
        way = next(way for way in self.ways if way.name == name)
        return way.alpha_rad, way.sigma_rad


def friction_of(
    results: Sequence[TrialResult], whisker: Whisker, alpha_est_rad: float
) -> list[SurfaceFriction]:
    """Every surface and speed among the measure trials."""
    alphas = alphas_of(results)
    return [
        _friction(s, results, alphas, whisker, alpha_est_rad)
        for s in surfaces(results, whisker.beam)
    ]


def _friction(
    surface: Surface,
    results: Sequence[TrialResult],
    alphas: Sequence[WhiskAlphas],
    whisker: Whisker,
    alpha_est_rad: float,
) -> SurfaceFriction:
    mine = tuple(a for a in alphas if a.purpose == "measure" and a.panel == surface.panel)
    felt = contacts(results, surface.panel)
    ways = by_tilting(felt), by_consistency(felt, whisker), by_smoothness(felt, whisker)
    errors = {(j.trial, j.whisk): j.error_percent for j in judge(results) if _is_given(j)}
    phi = {(f.trial, f.whisk): np.radians(f.phi_deg) for f in surface.felt}
    known = [k for k in phi if np.isfinite(errors.get(k, np.nan))]
    squares = np.array([errors[k] ** 2 for k in known])
    trusted = weights([phi[k] for k in known], alpha_est_rad)
    return SurfaceFriction(
        surface, mine, ways, _rms(squares, np.ones(len(squares))), _rms(squares, trusted)
    )


def _is_given(judged: Judged) -> bool:
    return judged.estimator == "with_friction" and not judged.one_factor


def _rms(squares, shares) -> float:
    return (
        float(np.sqrt(shares @ squares / shares.sum()))
        if len(squares) and shares.sum() > 0
        else float("nan")
    )


def write_friction(
    out: Path,
    results: Sequence[TrialResult],
    friction: Sequence[SurfaceFriction],
    alpha_est_rad: float,
) -> None:
    """Write friction.csv, phases.csv and surfaces.csv."""
    alphas = alphas_of(results)
    phi = {(f.trial, f.whisk): np.radians(f.phi_deg) for s in friction for f in s.surface.felt}
    FRICTION.write(out, (_whisk_row(a, phi.get(a.key), alpha_est_rad) for a in alphas))
    PHASES.write(out, (row for a in alphas for row in _phase_rows(a)))
    SURFACES.write(out, map(_surface_row, friction))


def _whisk_row(a: WhiskAlphas, phi_rad: float | None, alpha_est_rad: float) -> dict:
    row = {"trial": a.trial, "whisk": a.whisk, "surface": a.surface, "speed_deg_s": a.speed_deg_s}
    row |= {
        "beta_deg": float(np.degrees(a.beta_rad)),
        "beta_from": "manifest" if a.nominal else "pictures",
    }
    row |= _cells("seen", a.seen) | _cells("felt", a.felt)
    for kind, record in _APART:
        row |= _cells(f"{kind}_{record}", a.apart(kind, record))
    for record, phases in (("seen", a.phases_seen), ("felt", a.phases_felt)):
        row |= {f"rests_{record}": phases.rests, f"jumps_{record}": phases.jumps}
    return row | {
        "confidence": None if phi_rad is None else float(weights([phi_rad], alpha_est_rad)[0])
    }


def _phase_rows(a: WhiskAlphas) -> Iterator[dict]:
    for record, phases in (("seen", a.phases_seen), ("felt", a.phases_felt)):
        for angle in phases.angles:
            row = {"trial": a.trial, "whisk": a.whisk, "record": record, "kind": angle.kind}
            degrees = np.degrees([angle.theta_rad, angle.alpha_rad, angle.sigma_rad])
            yield row | dict(zip(("theta_deg", "alpha_deg", "alpha_sigma_deg"), degrees.tolist()))


def _surface_row(s: SurfaceFriction) -> dict:
    row = {"surface": s.surface.name, "speed_deg_s": s.surface.speed_deg_s, "whisks": len(s.whisks)}
    for name in (*_OF_WHISK, "least_squares", *WAYS):
        row |= _cells(name, s.alpha(name))
    notes = [f"{way.name}: {way.status}" for way in s.ways if way.status]
    row |= {
        "error_rms_percent": s.error_rms_percent,
        "error_rms_weighted_percent": s.error_rms_weighted_percent,
    }
    return row | {"notes": "; ".join(notes)}


def _cells(name: str, pair: tuple[float, float]) -> dict:
    column = f"alpha_{name}_deg"
    return {column: float(np.degrees(pair[0])), sigma_name(column): float(np.degrees(pair[1]))}


def alpha_lines(friction: Sequence[SurfaceFriction]) -> Iterator[str]:
    """The summary's table: α by every way, a line a surface; then stick–slip and section VII."""
    if not friction:
        return
    yield f"{'surface':<24}{'whisks':>7}  {'seen':>15}  {'felt':>15}  {'Fig. 8 fit':>15}"
    for s in friction:
        cells = "  ".join(f"{_shown(s.alpha(name)):>15}" for name in (*RECORDS, "least_squares"))
        yield f"{s.surface.title:<24}{len(s.whisks):>7}  {cells}"
    for s in friction:
        yield from (f"{s.surface.title}: {line}" for line in (*_stick_slip(s), *_section_vii(s)))


def _stick_slip(s: SurfaceFriction) -> Iterator[str]:
    for record in RECORDS:
        phases = [getattr(w, f"phases_{record}") for w in s.whisks]
        jumps, rests = sum(p.jumps for p in phases), sum(p.rests for p in phases)
        if jumps:
            angles = " and ".join(
                f"{kind} α = {_shown(s.alpha(f'{kind}_{record}'))}" for kind in (STATIC, KINETIC)
            )
            sticking = sum(p.jumps > 0 for p in phases)
            by_hand = (
                ", slopes as the manifest has them" if any(w.nominal for w in s.whisks) else ""
            )
            yield f"stick–slip {record}{by_hand} in {sticking} whisks, {rests} rests and {jumps} jumps; {angles}"


def _section_vii(s: SurfaceFriction) -> Iterator[str]:
    for way in s.ways:
        if np.isfinite(way.alpha_rad):
            doubt = f"; {way.status}" if way.status else ""
            yield f"by {way.name} (section VII) α = {_shown((way.alpha_rad, way.sigma_rad))}{doubt}"
    if np.isfinite(s.error_rms_weighted_percent) and len(s.whisks) > 1:
        yield (
            f"RMS error of (10), α_est given: {s.error_rms_percent:.2f} %, weighted by confidence (section VII) "
            f"{s.error_rms_weighted_percent:.2f} %"
        )


def _shown(pair: tuple[float, float]) -> str:
    value, sigma = np.degrees(pair)
    return f"{value:.2f} ± {sigma:.2f}°" if np.isfinite(value) else "-"
