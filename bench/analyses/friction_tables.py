"""The friction of a session: friction.csv (whisks), phases.csv (stick and slip), surfaces.csv."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import degrees
from pathlib import Path

import numpy as np

from bench.analyses.alphas import WhiskAlphas, alphas_of, mean_alpha
from bench.analyses.analysis import (
    Analysis,
    EvaluatedRun,
    Heading,
    PageTable,
    Scored,
    TrueRun,
    read_rows,
)
from bench.analyses.cells import angle_text, cell_with_sigma, panel_cell, value_cells
from bench.analyses.pooling import column, measured
from bench.analyses.section_vii import (
    Way,
    by_consistency,
    by_smoothness,
    by_tilting,
    contacts,
    weights,
)
from bench.analyses.surfaces import FittedSurface, surfaces
from bench.base.tables import SPEED, SURFACE, TRIAL, WHISK, Column, Kind, Table, alike, with_sigma
from bench.records.phases import KINETIC, STATIC, Phases
from bench.records.trial_result import TrialResult
from bench.session.whisker import Whisker
from bench.trials.estimate_errors import judge
from vision import Value

FRICTION_ANGLE = Heading("friction", "Friction angle α (± one sigma)")
RECORDS = ("seen", "felt")
WAYS = ("tilting", "consistency", "smoothness")
# Angles of a whisk, by their names in the columns and in `WhiskAlphas.angle`.
_OF_STICK_AND_SLIP = tuple("_".join(pair) for pair in product((STATIC, KINETIC), RECORDS))
_ANGLES = (*RECORDS, *_OF_STICK_AND_SLIP)
FRICTION = Table(
    "friction",
    "A row a whisk: friction angles α, each with its sigma.",
    (
        TRIAL,
        WHISK,
        SURFACE,
        SPEED,
        Column("beta_deg", "slope of the bar"),
        Column("beta_from", "pictures or stage; manifest, where no truth has the slope", Kind.TEXT),
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
        Column("error_rms_weighted_percent", "of (10), whisks weighted by confidence"),
        Column(
            "notes",
            "why a way of section VII has no result, or its warnings",
            Kind.SENTENCE,
        ),
    ),
)


# What a mean over slopes of both signs does not know (`bench.analyses.alphas.mean_alpha`).
_WIDE = (
    "± of seen and felt is an upper bound: what all slopes seen share may cancel between slopes of "
    "both signs, and counts in full"
)
# Columns of SURFACES on the page, where any surface has a number there.
_ON_PAGE = {
    "seen": "seen",
    "felt": "felt",
    "least_squares": "fit of Fig. 8",
    "tilting": "tilting",
    "consistency": "one distance",
    "smoothness": "several distances",
}


@dataclass(frozen=True)
class SurfaceFriction:
    """The friction angle of one surface at one speed, by every way that finds it.

    surface: the fit of Fig. 8. ways: those of section VII. error_rms_percent: of (10) with α_est as
    given, all whisks alike; error_rms_weighted_percent: weighted by confidence.
    """

    surface: FittedSurface
    whisks: tuple[WhiskAlphas, ...]
    ways: tuple[Way, ...]
    error_rms_percent: float
    error_rms_weighted_percent: float

    def alpha(self, name: str) -> Value:
        """Return α, rad, by its name in the columns of SURFACES; NaN if not known."""
        if name == "least_squares":
            return self.surface.alpha
        for way in self.ways:
            if way.name == name:
                return way.alpha
        return mean_alpha(self.whisks, name)

    @property
    def best_alpha_rad(self) -> float:
        """Return the angle as seen, else by the fit of Fig. 8; NaN where neither has one."""
        seen = self.alpha("seen")
        return seen.value if seen.is_known else self.surface.alpha_rad


@dataclass(frozen=True, eq=False)
class FrictionResult:
    """Friction angles of all whisks, those of the surfaces, and the assumed one."""

    whisks: tuple[WhiskAlphas, ...]
    surfaces: tuple[SurfaceFriction, ...]
    alpha_est_rad: float


class FrictionAngles(Analysis):
    """How rough each surface is, seen and felt."""

    tables = (FRICTION, PHASES, SURFACES)
    heading = FRICTION_ANGLE

    def compute(self, run: EvaluatedRun) -> FrictionResult:
        """Return the friction angles of whisks and surfaces."""
        alphas = tuple(alphas_of(run.results))
        return FrictionResult(alphas, run.friction, run.settings.alpha_est_rad)

    def rows(self, found: FrictionResult) -> dict[Table, Iterable[dict]]:
        """Return a row a whisk, a row an end of a rest or jump, a row a surface and speed."""
        phi_rad = {}
        for one in found.surfaces:
            for felt in one.surface.felt:
                phi_rad[felt.key] = felt.phi_rad
        of_whisks = []
        for whisk in found.whisks:
            confidence = None
            if whisk.key in phi_rad:
                confidence = float(weights([phi_rad[whisk.key]], found.alpha_est_rad)[0])
            of_whisks.append(_whisk_row(whisk, confidence))
        of_surfaces = [_surface_row(one) for one in found.surfaces]
        return {FRICTION: of_whisks, PHASES: _phase_rows(found.whisks), SURFACES: of_surfaces}

    def lines(self, found: FrictionResult) -> Iterator[str]:
        """Yield a line a surface with α seen, felt and fitted; then stick–slip and section VII."""
        if not found.surfaces:
            return
        yield f"{'surface':<24}{'whisks':>7}  {'seen':>15}  {'felt':>15}  {'Fig. 8 fit':>15}"
        for one in found.surfaces:
            names = (*RECORDS, "least_squares")
            cells = "  ".join(f"{angle_text(one.alpha(name)):>15}" for name in names)
            yield f"{one.surface.title:<24}{len(one.whisks):>7}  {cells}"
        if any(_has_both_signs(one.whisks) for one in found.surfaces):
            yield _WIDE
        for one in found.surfaces:
            for line in (*_stick_slip_lines(one), *_section_vii_lines(one)):
                yield f"{one.surface.title}: {line}"

    def page_table(self, out: Path) -> PageTable | None:
        """Return a row a surface and speed, a column a way that finds any angle."""
        table = read_rows(out, SURFACES)
        ways = []
        for way in _ON_PAGE:
            if any(np.isfinite(row[f"alpha_{way}_deg"]) for row in table):
                ways.append(way)
        if not ways:
            return None
        head = ("surface", "whisks", *(f"{_ON_PAGE[way]} [°]" for way in ways))
        rows = []
        for row in table:
            cells = [cell_with_sigma(row, f"alpha_{way}", "deg") for way in ways]
            rows.append((panel_cell(row), str(row["whisks"]), *cells))
        title = "Friction angle α of each surface, way by way"
        return PageTable(title, SURFACES.file, head, tuple(rows))

    def scored(self, run: TrueRun) -> Iterator[Scored]:
        """Yield the friction angles.

        There is one angle where the coefficient at rest is that in motion, else there are two.
        """
        one_angle: list[tuple] = []
        two_angles: dict[str, list[tuple]] = {"static": [], "kinetic": []}
        for row in run.rows(FRICTION):
            truth = run.whisk(row)
            if truth is None or "mu_kinetic" not in truth:
                continue
            if truth["mu_static"] == truth["mu_kinetic"]:
                one_angle.append((row, degrees(np.arctan(truth["mu_kinetic"]))))
                continue
            for kind, pairs in two_angles.items():
                pairs.append((row, degrees(np.arctan(truth[f"mu_{kind}"]))))
        for source in RECORDS:
            yield Scored(f"alpha_{source}_deg", one_angle)
            for kind, pairs in two_angles.items():
                yield Scored(f"alpha_{kind}_{source}_deg", pairs)


def _has_both_signs(whisks: Sequence[WhiskAlphas]) -> bool:
    """Return whether a truth shows slopes of both signs."""
    slopes_rad = [whisk.beta_rad for whisk in whisks if not whisk.nominal]
    return bool(slopes_rad) and min(slopes_rad) < 0 < max(slopes_rad)


def friction_of(
    results: Sequence[TrialResult], whisker: Whisker, alpha_est_rad: float
) -> list[SurfaceFriction]:
    """Return the friction of every surface and speed among the trials that measure."""
    alphas = alphas_of(measured(results))
    error_percent = _errors_by_10(results)
    found = []
    for surface in surfaces(results, whisker.beam):
        felt = contacts(results, surface.panel)
        ways = (
            by_tilting(felt, whisker),
            by_consistency(felt, whisker),
            by_smoothness(felt, whisker),
        )
        errors = np.array([error_percent.get(one.key, np.nan) for one in surface.felt])
        phi_rad = column(surface.felt, "phi_rad")
        confidences = weights(phi_rad, alpha_est_rad)
        friction = SurfaceFriction(
            surface,
            tuple(alpha for alpha in alphas if alpha.panel == surface.panel),
            ways,
            _weighted_rms(errors, np.ones(len(errors))),
            _weighted_rms(errors, confidences),
        )
        found.append(friction)
    return found


def _errors_by_10(results: Sequence[TrialResult]) -> dict[tuple[str, int], float]:
    """Return the error of (10), percent, by trial and number of the whisk."""
    found = {}
    for judged in judge(results):
        if judged.is_by_ten:
            found[judged.trial, judged.whisk] = judged.error_percent
    return found


def _weighted_rms(errors: np.ndarray, shares: np.ndarray) -> float:
    """Return the root of the weighted mean square of the known errors; NaN without any weight."""
    known = np.isfinite(errors)
    errors = errors[known]
    shares = shares[known]
    if not shares.sum() > 0:
        return np.nan
    return float(np.sqrt(shares @ np.square(errors) / shares.sum()))


def _whisk_row(whisk: WhiskAlphas, confidence: float | None) -> dict:
    """Return the row of a whisk in FRICTION."""
    row = {
        "trial": whisk.trial,
        "whisk": whisk.whisk,
        "surface": whisk.surface,
        "speed_deg_s": whisk.speed_deg_s,
        "beta_deg": degrees(whisk.beta_rad),
        "beta_from": whisk.beta_from,
        "confidence": confidence,
    }
    for record in RECORDS:
        phases = whisk.phases(record)
        row |= {f"rests_{record}": phases.rests, f"jumps_{record}": phases.jumps}
    for name in _ANGLES:
        row |= value_cells(f"alpha_{name}_deg", whisk.angle(name))
    return row


def _phase_rows(whisks: Iterable[WhiskAlphas]) -> Iterator[dict]:
    """Yield the rows of PHASES."""
    for whisk in whisks:
        for record in RECORDS:
            for angle in whisk.phases(record).angles:
                yield {
                    "trial": whisk.trial,
                    "whisk": whisk.whisk,
                    "record": record,
                    "kind": angle.kind,
                    "theta_deg": degrees(angle.theta_rad),
                    **value_cells("alpha_deg", Value(angle.alpha_rad, angle.sigma_rad)),
                }


def _surface_row(one: SurfaceFriction) -> dict:
    """Return the row of a surface and speed in SURFACES."""
    row = {
        "surface": one.surface.name,
        "speed_deg_s": one.surface.speed_deg_s,
        "whisks": len(one.whisks),
        "error_rms_percent": one.error_rms_percent,
        "error_rms_weighted_percent": one.error_rms_weighted_percent,
        "notes": "; ".join(f"{way.name}: {way.status}" for way in one.ways if way.status),
    }
    for name in (*_ANGLES, "least_squares", *WAYS):
        row |= value_cells(f"alpha_{name}_deg", one.alpha(name))
    return row


def _stick_slip_lines(one: SurfaceFriction) -> Iterator[str]:
    """Yield a line on stick–slip as seen, and one as felt, where there is any."""
    for record in RECORDS:
        phases: list[Phases] = [whisk.phases(record) for whisk in one.whisks]
        jumps = sum(each.jumps for each in phases)
        if not jumps:
            continue
        rests = sum(each.rests for each in phases)
        sticking = sum(each.jumps > 0 for each in phases)
        static = angle_text(one.alpha(f"{STATIC}_{record}"))
        kinetic = angle_text(one.alpha(f"{KINETIC}_{record}"))
        is_nominal = any(whisk.nominal for whisk in one.whisks)
        by_hand = ", slopes as the manifest has them" if is_nominal else ""
        yield (
            f"stick–slip {record}{by_hand} in {sticking} whisks, {rests} rests and {jumps} jumps; "
            f"{STATIC} α = {static} and {KINETIC} α = {kinetic}"
        )


def _section_vii_lines(one: SurfaceFriction) -> Iterator[str]:
    """Yield α by the ways of section VII, and the error of (10) weighted by confidence."""
    for way in one.ways:
        if way.alpha.is_known:
            status = f"; {way.status}" if way.status else ""
            yield f"by {way.name} (section VII) α = {angle_text(way.alpha)}{status}"
    if np.isfinite(one.error_rms_weighted_percent) and len(one.whisks) > 1:
        yield (
            f"RMS error of (10), α_est given: {one.error_rms_percent:.2f} %, weighted by confidence "
            f"(section VII) {one.error_rms_weighted_percent:.2f} %"
        )
