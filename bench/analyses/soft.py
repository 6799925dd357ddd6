"""How soft an object is, from whisks at two distances (section VII): compliance.csv, a row a pair of distances.

The whisker is moved along itself by a known shift, between trials of one surface and speed whose nominal distances
(d_x_mm in trial.toml) differ. Only whisks that do not slip sideways serve, for the equation has no slip. No picture is
used; where pictures show the object giving way, that stands in the same row (`bench.analyses.gave`).
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, PageTable, read_rows
from bench.analyses.cells import cell_with_sigma, panel_cell, panel_title, value_cells
from bench.analyses.gave import OBJECT, mean_give
from bench.analyses.pooling import grouped, measured, sound_measured_whisks
from bench.base.combined import Measurement, Measurements
from bench.base.numbers import MISSING, number_range
from bench.base.statuses import reason
from bench.base.tables import SPEED, SURFACE, Column, Table, alike, status, with_sigma
from bench.gauges.gauge_readings import NOMINAL_SHARE
from bench.records.trial_result import FeltWhisk, TrialFacts, TrialResult
from bench.session.session import Session
from bench.session.whisker import Whisker
from estimator import compliance, first_order
from estimator.beam import Beam
from estimator.uncertainty import Z_95, model_share
from vision import UNKNOWN, Value

COMPLIANCE = Table(
    "compliance",
    "A row for each two neighbouring nominal distances of one surface and speed: section VII's soft "
    "object, without pictures.",
    (
        SURFACE,
        SPEED,
        Column("near_nominal_mm", "the nearer of the two distances"),
        Column("far_nominal_mm", "the farther of the two distances"),
        Column("whisks_near", "whisks there that do not slip sideways"),
        Column("whisks_far", "whisks there that do not slip sideways"),
        *with_sigma("shift_mm", "from the near to the far distance, as the manifests have them"),
        *with_sigma("d_x_mm", "of the nearer whisks, the object's softness taken out"),
        *with_sigma("give_mm_N", "one over the stiffness; below zero by noise", "give_sigma_mm_N"),
        *alike(
            ("stiffness_N_mm", "stiffness_low_N_mm", "stiffness_high_N_mm"),
            "stiffness, and the ends of its 95 % interval; an end that is empty is infinite",
        ),
        status("that it is not softer than a rigid object, or why there is none"),
    ),
)
COMPLIANCE_SEEN = Table(
    COMPLIANCE.name,
    COMPLIANCE.rows,
    (
        *COMPLIANCE.columns,
        Column(
            "whisks_seen",
            "whisks in which the object was seen to give way; without one these three columns are "
            "left out",
        ),
        *with_sigma(
            "give_seen_mm_N",
            "by them: the way seen over the force felt",
            "give_seen_sigma_mm_N",
        ),
    ),
)
# [mm] Nominal distances that differ by less are one distance set up again. Stated.
_LEAST_SHIFT_MM = 2.0
# [sigma] Of φ felt: beyond, the contact slips sideways. Stated.
_HELD_SIGMAS = 3.0
NOT_SOFT = reason("not_soft")
NO_PUSH = reason("compliances_contradict")


@dataclass(frozen=True)
class Place:
    """Whisks at one nominal distance.

    compliance: mean k_θ, rad/(N·mm); sigma: its own, without what all whisks share. shared (k,): what
    it changes by at one sigma of each cause that all whisks have in common.
    """

    nominal_mm: float
    nominal_sigma_mm: float
    compliance: float
    sigma: float
    whisks: int
    shared: np.ndarray


@dataclass(frozen=True)
class Soft:
    """One surface by whisks at two places: the nearer distance, and how far the object gives way.

    NaN where that is not known, and status says why. seen: the same by pictures and force, mm/N, of so
    many whisks_seen.
    """

    surface: str
    speed_deg_s: float | None
    near: Place
    far: Place
    d_x_mm: Value = UNKNOWN
    give_mm_N: Value = UNKNOWN
    status: str = ""
    seen: Value = UNKNOWN
    whisks_seen: int = 0

    @property
    def shift_mm(self) -> float:
        """Return by how much the whisker was moved along itself."""
        return self.far.nominal_mm - self.near.nominal_mm

    @property
    def shift_sigma_mm(self) -> float:
        """Return the standard deviation of that shift."""
        return math.hypot(self.near.nominal_sigma_mm, self.far.nominal_sigma_mm)

    @property
    def stiffness_N_mm(self) -> tuple[float, float, float]:
        """Return the stiffness and both ends of its 95 % interval.

        Infinite where the object gives way no more than a rigid one.
        """
        give = self.give_mm_N.value
        if not np.isfinite(give):
            return np.nan, np.nan, np.nan
        reach = Z_95 * self.give_mm_N.sigma
        return _inverse(give), _inverse(give + reach), _inverse(give - reach)


def _inverse(give_mm_N: float) -> float:
    """Return a stiffness; infinite of what does not give way."""
    return 1 / give_mm_N if give_mm_N > 0 else np.inf


class Softness(Analysis):
    """How soft the objects are, without pictures."""

    tables = (COMPLIANCE_SEEN,)
    heading = OBJECT
    needs_session = True

    def compute(self, run: EvaluatedRun) -> list[Soft]:
        """Return what each two neighbouring nominal distances of a surface and speed give."""
        return soft_objects(run)

    def rows(self, found: Sequence[Soft]) -> dict[Table, list[dict]]:
        """Return a row a pair of distances; with columns of what was seen where anything was."""
        table = COMPLIANCE_SEEN if any(soft.whisks_seen for soft in found) else COMPLIANCE
        return {table: [_row(soft) for soft in found]}

    def lines(self, found: Sequence[Soft]) -> Iterator[str]:
        """Yield a line a pair of distances that says anything."""
        for soft in found:
            d_x_mm = soft.d_x_mm
            give = soft.give_mm_N
            if not give.is_known:
                continue
            stiffness, low, high = soft.stiffness_N_mm
            if soft.status:
                verdict = f"{NOT_SOFT}, stiffer than {low:.2g} N/mm (95 %)"
            else:
                verdict = f"stiffness {stiffness:.3g} N/mm ({low:.3g} to {high:.3g})"
            yield (
                f"{panel_title(soft.surface, soft.speed_deg_s)}: two distances {soft.shift_mm:g} mm "
                f"apart (section VII): gives way by {give.value:.3f} ± {give.sigma:.3f} "
                f"mm/N: {verdict}; d_x {d_x_mm.value:.2f} ± {d_x_mm.sigma:.2f} mm"
            )

    def page_table(self, out: Path) -> PageTable:
        """Return a row a pair of distances."""
        head = ("surface", "whisks", "distances set [mm]", "d_x [mm]", "gives way [mm/N]")
        head += ("stiffness, 95 % [N/mm]", "status")
        rows = []
        for row in read_rows(out, COMPLIANCE):
            cells = (
                panel_cell(row),
                f"{row['whisks_near']:g} + {row['whisks_far']:g}",
                number_range(row["near_nominal_mm"], row["far_nominal_mm"], 0),
                cell_with_sigma(row, "d_x", "mm"),
                cell_with_sigma(row, "give", "mm_N"),
                _stiffness_cell(row["stiffness_low_N_mm"], row["stiffness_high_N_mm"]),
                row["status"] or MISSING,
            )
            rows.append(cells)
        title = "Softness of the object, from whisks at two distances"
        return PageTable(title, COMPLIANCE.file, head, tuple(rows))


def _stiffness_cell(low: float, high: float) -> str:
    """Return a range of stiffness, N/mm; an end that is missing is infinite."""
    if not np.isfinite(low):
        return MISSING
    return f"{low:.3g} to {high:.3g}" if np.isfinite(high) else f"more than {low:.3g}"


def soft_objects(run: EvaluatedRun) -> list[Soft]:
    """Return the softness by each two neighbouring nominal distances of a surface and speed."""
    found = []
    alpha_est = Value(run.settings.alpha_est_rad, run.alpha_est_sigma_rad)
    by_panel = grouped(measured(run.results), lambda result: result.trial.panel)
    for results in by_panel.values():
        facts = results[0].trial
        theta_rad = results[0].theta_rad
        seen, whisks_seen = mean_give(results)
        for near, far in pairwise(_places(run.session, results)):
            if far.nominal_mm - near.nominal_mm >= _LEAST_SHIFT_MM:
                soft = softness(run.whisker, facts, near, far, theta_rad, alpha_est)
                found.append(replace(soft, seen=seen, whisks_seen=whisks_seen))
    return found


def _places(session: Session, results: Sequence[TrialResult]) -> list[Place]:
    """Return the places with whisks that serve, from near to far.

    Where nobody says how well a distance is known it was set by a ruler, for each recording anew.
    """
    places = []
    known = [one for one in results if np.isfinite(one.trial.d_x_nominal_mm)]
    for d_x_mm, there in sorted(grouped(known, lambda one: one.trial.d_x_nominal_mm).items()):
        by_ruler_mm = NOMINAL_SHARE * d_x_mm / np.sqrt(len(there))
        sigma_mm = max(session.trial(one.trial.name).d_x_sigma_mm for one in there) or by_ruler_mm
        held = []
        for result, _, felt in sound_measured_whisks(there):
            if _is_held(felt):
                held.append((result.trial.name, _compliance(result, felt)))
        if held:
            places.append(_place(d_x_mm, sigma_mm, held))
    return places


def _place(d_x_mm: float, sigma_mm: float, held: Sequence[tuple[str, Measurement]]) -> Place:
    """Average the compliances of whisks, each with the name of its trial.

    Trials weigh alike. What they differ by because each was set up anew is in sigma_mm already.
    """
    measurements = Measurements.of(held)
    of_trials = list(measurements.by_setting().values())
    compliances = np.array([one.value for one in of_trials])
    sigmas = np.array([one.sigma for one in of_trials])
    own = float(np.linalg.norm(sigmas)) / len(sigmas)
    shared = measurements.common.mean(axis=0)
    return Place(d_x_mm, sigma_mm, float(compliances.mean()), own, len(held), shared)


def _is_held(felt: FeltWhisk) -> bool:
    """Return whether the contact does not slip sideways."""
    phi = felt.phi_felt_rad
    return felt.has_moments and abs(phi.value) <= _HELD_SIGMAS * phi.sigma


def _compliance(result: TrialResult, felt: FeltWhisk) -> Measurement:
    """Return k_θ = θ/m_z."""
    theta = result.theta_rad
    m_z = felt.m_z_Nmm
    k_theta = theta / m_z.value
    shared = felt.shared_Nmm[:, 1] / m_z.value  # (k,) of the moment, relative
    own_of_moment = (m_z.sigma / m_z.value) ** 2 - shared @ shared
    covariance = felt.theta_moment_covariance_at[1] / (theta * m_z.value)
    variance = (felt.theta_sigma_rad / theta) ** 2 + own_of_moment - 2 * covariance
    own = k_theta * float(np.sqrt(max(variance, 0.0)))
    return Measurement(k_theta, own, common=tuple((-k_theta * shared).tolist()))


def softness(
    whisker: Whisker, trial: TrialFacts, near: Place, far: Place, theta_rad: float, alpha_est: Value
) -> Soft:
    """Return distance and compliance of the object by two places.

    trial: of the places' whisks, but for the distance. alpha_est: as assumed, rad.
    """
    beam = whisker.beam
    taper = beam.taper / whisker.length_mm
    shift_mm = far.nominal_mm - near.nominal_mm
    bar_mm = trial.bar_diameter_mm
    k_near = _corrected(near, whisker, bar_mm, theta_rad, alpha_est.value)
    k_far = _corrected(far, whisker, bar_mm, theta_rad, alpha_est.value)
    d_x, _ = compliance.two_distances(k_near, k_far, shift_mm, beam.C_Nmm2, taper)
    soft = Soft(*trial.panel, near, far)
    if not np.isfinite(d_x):
        return replace(soft, status=NO_PUSH)
    give = compliance.give(d_x, k_near, beam.C_Nmm2, taper)
    shared = [_shared(place, beam, theta_rad, alpha_est) for place in (near, far)]
    d_x_sigma, give_sigma = _sigmas(soft, d_x, give, beam.C_Nmm2, taper, shared)
    return replace(
        soft,
        d_x_mm=Value(float(d_x), d_x_sigma),
        give_mm_N=Value(float(give), give_sigma),
        status=NOT_SOFT if give <= Z_95 * give_sigma else "",
    )


def _shared(place: Place, beam: Beam, theta_rad: float, alpha_est: Value) -> np.ndarray:
    """Return how a place's compliance errs (k,) by each cause that all places share, rad/(N·mm)."""
    return np.append(place.shared, _model_sigma(place, beam, theta_rad, alpha_est))


def _sigmas(
    soft: Soft, d_x: float, give: float, C: float, taper: float, shared: Sequence[np.ndarray]
) -> tuple[float, float]:
    """Return the standard deviations of distance and compliance by whisks at two places.

    C: N·mm². taper: per mm. shared: changes (k,) of the near and of the far k_θ by each cause that
    all whisks have in common.
    """
    near = soft.near
    far = soft.far
    own = compliance.two_distances_spread(
        d_x, give, soft.shift_mm, C, near.sigma, far.sigma, soft.shift_sigma_mm, taper
    )
    moved = compliance.two_distances_moved(d_x, give, soft.shift_mm, C, *shared, taper)
    d_x_sigma = np.hypot(own[0], np.linalg.norm(moved[0]))
    give_sigma = np.hypot(own[1], np.linalg.norm(moved[1]))
    return float(d_x_sigma), float(give_sigma)


def _corrected(
    place: Place, whisker: Whisker, bar_diameter_mm: float, theta_rad: float, alpha_rad: float
) -> float:
    """Return k_θ of a place without the first order of what (2) leaves out.

    See `estimator.first_order`; a bar whose diameter is not known counts as thin.
    """
    beam = whisker.beam
    left = beam.thickness(place.nominal_mm)
    reach_mm = 0.5 * np.nan_to_num(bar_diameter_mm) + 0.5 * whisker.diameter_mm * left
    share = first_order.rolling(theta_rad, reach_mm, 0.0, alpha_rad, place.nominal_mm, left)
    share += first_order.HELD_SHARE * first_order.dragging(theta_rad, alpha_rad)
    return place.compliance - share * _compliance_of_distance(beam, place)


def _model_sigma(place: Place, beam: Beam, theta_rad: float, alpha_est: Value) -> float:
    """Return the sigma of k_θ by what the correction leaves.

    Both places have that alike: the contact is the same, and so is α.
    """
    alpha = alpha_est.value
    left = beam.thickness(place.nominal_mm)
    share = model_share(
        theta_rad, 0.0, alpha, 1.0, thickness=left, held_spread=first_order.HELD_SPREAD
    )
    dragging = first_order.dragging(theta_rad, alpha)
    by_alpha = first_order.dragging(theta_rad, alpha + alpha_est.sigma) - dragging
    relative = math.hypot(share, first_order.HELD_SHARE * by_alpha)
    return relative * _compliance_of_distance(beam, place)


def _compliance_of_distance(beam: Beam, place: Place) -> float:
    """Return the change of k_θ with a relative error of the distance: d_x ∂(d/C)/∂d_x."""
    return place.nominal_mm / (beam.C_Nmm2 * beam.thickness(place.nominal_mm) ** 2)


def _row(soft: Soft) -> dict:
    """Return the row of two neighbouring distances, with what was seen of the object."""
    near = soft.near
    far = soft.far
    stiffness, low, high = soft.stiffness_N_mm
    return {
        "surface": soft.surface,
        "speed_deg_s": soft.speed_deg_s,
        "near_nominal_mm": near.nominal_mm,
        "far_nominal_mm": far.nominal_mm,
        "whisks_near": near.whisks,
        "whisks_far": far.whisks,
        "shift_mm": soft.shift_mm,
        "shift_sigma_mm": soft.shift_sigma_mm,
        **value_cells("d_x_mm", soft.d_x_mm),
        "give_mm_N": soft.give_mm_N.value,
        "give_sigma_mm_N": soft.give_mm_N.sigma,
        "stiffness_N_mm": stiffness,
        "stiffness_low_N_mm": low,
        "stiffness_high_N_mm": high,
        "status": soft.status,
        "whisks_seen": soft.whisks_seen,
        "give_seen_mm_N": soft.seen.value,
        "give_seen_sigma_mm_N": soft.seen.sigma,
    }
