"""How soft an object is, from whisks at two distances (section VII): compliance.csv, a row a pair of distances.

The whisker is moved along itself by a known shift, between trials of one surface and speed whose nominal distances
(d_x_mm in trial.toml) differ. Only whisks that do not slip sideways serve, for the equation has no slip. No picture is
looked at; where they show the object giving way, what they tell stands beside it (`bench.analyses.gave`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from bench.analyses.gave import mean_give
from bench.base.tables import SPEED, SURFACE, Column, Table, alike, status, with_sigma
from bench.gauges.gauge_readings import NOMINAL_SHARE
from bench.records.trial_result import FeltWhisk, TrialFacts, TrialResult, whisks
from bench.session.session import Session
from bench.session.whisker import Whisker
from bench.trials.estimate_errors import is_sound
from estimator import compliance, first_order
from estimator.beam import Beam
from estimator.uncertainty import Z_95, model_share
from vision.truth.value import UNKNOWN, Value

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
            "whisks of that surface and speed in which the object was seen to give way; these three "
            "columns are there only where there is such a whisk",
        ),
        *with_sigma(
            "give_seen_mm_N",
            "by them: the way seen over the force felt",
            "give_seen_sigma_mm_N",
        ),
    ),
)
_LEAST_SHIFT_MM = 2.0  # nominal distances that differ by less are one distance set up again
_HELD_SIGMAS = 3.0  # of φ felt: beyond, the contact slips sideways
NOT_SOFT = "no softer than a rigid object within the noise"
NO_PUSH = "no distance explains both compliances"


@dataclass(frozen=True)
class Place:
    """Whisks at one nominal distance: mean compliance k_θ with its own sigma, rad/(N·mm), of so many whisks; what it
    changes by at one sigma of each cause that all whisks have in common, (k,)."""

    nominal_mm: float
    nominal_sigma_mm: float
    compliance: float
    sigma: float
    whisks: int
    shared: np.ndarray


@dataclass(frozen=True)
class Soft:
    """What two places tell of one surface: the nearer distance, how far the object gives way, mm/N; NaN and why. seen:
    the same by pictures and force, of whisks_seen."""

    surface: str
    speed_deg_s: float | None
    near: Place
    far: Place
    d_x_mm: float
    d_x_sigma_mm: float
    give_mm_N: float
    give_sigma_mm_N: float
    status: str = ""
    seen: Value = UNKNOWN
    whisks_seen: int = 0

    @property
    def stiffness_N_mm(self) -> tuple[float, float, float]:
        """k and both ends of its 95 % interval; infinite where the object gives way no more than a rigid one."""
        reach = Z_95 * self.give_sigma_mm_N
        middle, low, high = (
            1 / g if g > 0 else np.inf
            for g in (self.give_mm_N, self.give_mm_N + reach, self.give_mm_N - reach)
        )
        return (middle, low, high) if np.isfinite(self.give_mm_N) else (np.nan,) * 3


def soft_objects(
    session: Session, results: Sequence[TrialResult], alpha_est_rad: float, sigma_rad: float
) -> list[Soft]:
    """A row for each two neighbouring nominal distances of a surface and speed; sigma_rad: of alpha_est."""
    found, alpha_est = [], Value(alpha_est_rad, sigma_rad)
    for panel in dict.fromkeys(r.trial.panel for r in results if r.trial.purpose == "measure"):
        mine = [r for r in results if r.trial.purpose == "measure" and r.trial.panel == panel]
        places = [place for place in _places(session, mine) if place is not None]
        facts, theta = mine[0].trial, float(np.radians(mine[0].theta_deg))
        seen, count = mean_give(mine)
        told = (
            softness(session.whisker, facts, *pair, theta, alpha_est)
            for pair in pairwise(places)
            if pair[1].nominal_mm - pair[0].nominal_mm >= _LEAST_SHIFT_MM
        )
        found += [replace(soft, seen=seen, whisks_seen=count) for soft in told]
    return found


def _places(session: Session, results: Sequence[TrialResult]) -> Iterator[Place | None]:
    """By nominal distance, from near to far; None where no whisk serves. Where nobody says how well a distance is known
    it was set by a ruler, for each recording anew."""
    nominal = {r.trial.d_x_nominal_mm for r in results}
    for d_x in sorted(d for d in nominal if np.isfinite(d)):
        there = [r for r in results if r.trial.d_x_nominal_mm == d_x]
        by_ruler = NOMINAL_SHARE * d_x / np.sqrt(len(there))
        sigma_mm = max(session.trial(r.trial.name).d_x_sigma_mm for r in there) or by_ruler
        rows = [
            _compliance(r, felt)
            for r, seen, felt in whisks(there)
            if is_sound(seen, felt) and _is_held(felt)
        ]
        yield _place(d_x, sigma_mm, *map(np.array, zip(*rows))) if rows else None


def _place(
    d_x: float, sigma_mm: float, compliances: np.ndarray, sigmas: np.ndarray, shared: np.ndarray
) -> Place:
    """The mean of n whisks: compliances and their own sigmas (n,), what all have in common (n, k)."""
    n = len(compliances)
    own = float(np.sqrt(np.sum(sigmas**2))) / n
    return Place(d_x, sigma_mm, float(compliances.mean()), own, n, shared.mean(axis=0))


def _is_held(felt: FeltWhisk) -> bool:
    phi = felt.phi_felt_rad
    return felt.has_moments and abs(phi.value) <= _HELD_SIGMAS * phi.sigma


def _compliance(result: TrialResult, felt: FeltWhisk) -> tuple[float, float, np.ndarray]:
    """k_θ = θ/m_z, its own sigma, and what it changes by with each shared cause (k,)."""
    theta, m_z = float(np.radians(result.theta_deg)), felt.m_z_Nmm
    k, shared = theta / m_z.value, felt.shared_Nmm[:, 1] / m_z.value
    of_moment = (m_z.sigma / m_z.value) ** 2 - shared @ shared
    mixed = felt.theta_moment_covariance_at[1] / (theta * m_z.value)
    own = (felt.theta_sigma_rad / theta) ** 2 + of_moment - 2 * mixed
    return k, k * float(np.sqrt(max(own, 0.0))), -k * shared


def softness(
    whisker: Whisker, trial: TrialFacts, near: Place, far: Place, theta_rad: float, alpha_est: Value
) -> Soft:
    """What two places tell, whose whisks are those of `trial` but for the distance; alpha_est: rad, as assumed."""
    described = trial.surface, trial.speed_deg_s, near, far
    C, taper = whisker.C_Nmm2, whisker.beam.taper / whisker.length_mm
    shift = far.nominal_mm - near.nominal_mm
    known = whisker.beam, 0.5 * np.nan_to_num(trial.bar_diameter_mm), 0.5 * whisker.diameter_mm
    k_near, k_far = (_corrected(place, *known, theta_rad, alpha_est.value) for place in (near, far))
    d_x, _ = compliance.two_distances(k_near, k_far, shift, C, taper)
    if not np.isfinite(d_x):
        return Soft(*described, *(np.nan,) * 4, NO_PUSH)
    give = compliance.give(d_x, k_near, C, taper)
    shift_sigma = float(np.hypot(near.nominal_sigma_mm, far.nominal_sigma_mm))
    own = compliance.two_distances_spread(
        d_x, give, shift, C, near.sigma, far.sigma, shift_sigma, taper
    )
    alike = (
        np.append(place.shared, _left(place, whisker.beam, theta_rad, alpha_est))
        for place in (near, far)
    )
    shared = compliance.two_distances_moved(d_x, give, shift, C, *alike, taper)
    sigmas = [float(np.hypot(*pair)) for pair in zip(own, np.linalg.norm(shared, axis=1))]
    status = NOT_SOFT if give <= Z_95 * sigmas[1] else ""
    return Soft(*described, float(d_x), sigmas[0], float(give), sigmas[1], status)


def _corrected(
    place: Place,
    beam: Beam,
    bar_radius_mm: float,
    base_radius_mm: float,
    theta: float,
    alpha_rad: float,
) -> float:
    """k_θ of a place without the first order of what (2) leaves out (`estimator.first_order`)."""
    left = beam.left(place.nominal_mm)
    reach = bar_radius_mm + base_radius_mm * left
    share = first_order.rolling(theta, reach, 0.0, alpha_rad, place.nominal_mm, left)
    share += first_order.HELD_SHARE * first_order.dragging(theta, alpha_rad)
    return place.compliance - share * _compliance_of_distance(beam, place)


def _left(place: Place, beam: Beam, theta: float, alpha_est: Value) -> float:
    """What is left of that in k_θ, of a cause that both places have alike: the contact is the same, and so is α."""
    alpha, left = alpha_est.value, beam.left(place.nominal_mm)
    share = model_share(theta, 0.0, alpha, 1.0, left=left, held_spread=first_order.HELD_SPREAD)
    by_alpha = first_order.dragging(theta, alpha + alpha_est.sigma) - first_order.dragging(
        theta, alpha
    )
    return float(np.hypot(share, first_order.HELD_SHARE * by_alpha)) * _compliance_of_distance(
        beam, place
    )


def _compliance_of_distance(beam: Beam, place: Place) -> float:
    """What k_θ changes by with a relative error of the distance: d_x ∂(d/C)/∂d_x."""
    return place.nominal_mm / (beam.C_Nmm2 * beam.left(place.nominal_mm) ** 2)


def write_compliance(out: Path, found: Sequence[Soft]) -> None:
    """Write compliance.csv: with what was seen, where anything was."""
    table = COMPLIANCE_SEEN if any(soft.whisks_seen for soft in found) else COMPLIANCE
    table.write(out, map(_row, found))


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
        "shift_mm": far.nominal_mm - near.nominal_mm,
        "shift_sigma_mm": float(np.hypot(near.nominal_sigma_mm, far.nominal_sigma_mm)),
        "d_x_mm": soft.d_x_mm,
        "d_x_sigma_mm": soft.d_x_sigma_mm,
        "give_mm_N": soft.give_mm_N,
        "give_sigma_mm_N": soft.give_sigma_mm_N,
        "stiffness_N_mm": stiffness,
        "stiffness_low_N_mm": low,
        "stiffness_high_N_mm": high,
        "status": soft.status,
        "whisks_seen": soft.whisks_seen,
        "give_seen_mm_N": soft.seen.value,
        "give_seen_sigma_mm_N": soft.seen.sigma,
    }


def soft_lines(found: Sequence[Soft]) -> Iterator[str]:
    """A line a pair of distances that tells something."""
    for soft in found:
        if not np.isfinite(soft.give_mm_N):
            continue
        k, low, high = soft.stiffness_N_mm
        told = f"gives way by {soft.give_mm_N:.3f} ± {soft.give_sigma_mm_N:.3f} mm/N: "
        told += (
            f"stiffness {k:.3g} N/mm ({low:.3g} to {high:.3g})"
            if not soft.status
            else (f"{NOT_SOFT}, stiffer than {low:.2g} N/mm (95 %)")
        )
        shift = soft.far.nominal_mm - soft.near.nominal_mm
        speed = f", {soft.speed_deg_s:g}°/s" if soft.speed_deg_s is not None else ""
        yield (
            f"{soft.surface or 'surface not named'}{speed}: two distances {shift:g} mm apart (section VII): {told}; "
            f"d_x {soft.d_x_mm:.2f} ± {soft.d_x_sigma_mm:.2f} mm"
        )
