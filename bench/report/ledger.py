"""Which refinements of the model a scene requires: ledger.csv, a row a refinement and whisk.

Each row says by how much truth, felt touch and estimate would differ without the refinement, beside their sigmas. What
is less than a tenth of every sigma may be left out: it adds no more than a two-hundredth to an error. Effects on the
truth are the fit's own answers (`vision.fit.refinements`); those on the estimate are made from the moments once more,
or are the closed forms of docs/maps.md, with slope, tilt and friction as seen.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bench.base.tables import write_table
from bench.friction.alphas import felt_friction, seen_friction
from bench.friction.runs import GIVEN, KINETIC
from bench.gauges.felt import GAUGE_DELAY_S, motor_speed
from bench.records.trial import EstimateRow, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.session.whisker import Whisker
from bench.trials.clocks import SharedTouch, shared_touch
from estimator import first_order
from vision.fit.refinements import ALONG, LENS_TERMS, LeftOut
from vision.truth.value import NAN, UNKNOWN

TABLE = "ledger.csv"
MATTERS = 0.1  # of a sigma: the user's own bound
NEEDED, MAY_GO, UNTOLD = "needed", "may be left out", "not told"
QUANTITIES = ("d_x_mm", "touch_deg", "slip_mm", "touch_felt_deg", "d_x_est_mm")
NAMES = (
    *("large bending", "bar radius", "psi", ALONG, "taper", "sag and set", *LENS_TERMS),
    *("gauges' delay", "cross-talk", "drift", "one-sided light", "clock", "second friction coefficient"),
)
_SIDE = {"touch_deg": "d_x_mm", "slip_mm": "d_x_mm"}  # there where that is
_NO_TRUTH, _NO_MOMENTS = "no truth", "no moments"


def _columns(quantity: str) -> tuple[str, str]:
    stem, _, unit = quantity.rpartition("_")
    return f"{stem}_effect_{unit}", f"{stem}_sigma_{unit}"


COLUMNS = (
    *("trial", "whisk", "refinement"),
    *(column for quantity in QUANTITIES for column in _columns(quantity)),
    *("largest_over_sigma", "verdict", "status"),
)


@dataclass(frozen=True)
class Felt:
    """By how much felt touch (rad) and d_x by (10) (mm) differ without a refinement; NaN where it is not known. why: of
    a zero or a NaN."""

    touch_rad: float = 0.0
    d_x_est_mm: float = 0.0
    why: str = ""


@dataclass(frozen=True)
class Entry:
    """One refinement of one whisk: effects and sigmas by QUANTITIES, NaN where they are not known, and why."""

    trial: str
    whisk: int
    refinement: str
    effects: dict[str, float]
    sigmas: dict[str, float]
    status: str = ""

    @property
    def ratios(self) -> dict[str, float]:
        """Effects over their sigmas, where both are known; of no effect 0, whatever the sigma."""
        known = {name: (abs(effect), self.sigmas[name]) for name, effect in self.effects.items() if np.isfinite(effect)}
        return {name: effect / sigma if effect else 0.0 for name, (effect, sigma) in known.items()
                if effect == 0.0 or sigma > 0}  # fmt: skip

    @property
    def largest(self) -> float:
        """The largest of `ratios`; NaN where there is none."""
        return max(self.ratios.values(), default=NAN)

    @property
    def verdict(self) -> str:
        """Whether any effect is more than a tenth of its sigma; not told where one is not known."""
        if self.largest > MATTERS:
            return NEEDED
        there = (effect for name, effect in self.effects.items() if np.isfinite(self.sigmas[_SIDE.get(name, name)]))
        return UNTOLD if not self.ratios or any(map(np.isnan, there)) else MAY_GO

    @property
    def row(self) -> dict:
        """By column."""
        cells = {}
        for name in QUANTITIES:
            cells |= zip(_columns(name), (self.effects[name], self.sigmas[name]))
        about = {"trial": self.trial, "whisk": self.whisk, "refinement": self.refinement, "status": self.status}
        return about | cells | {"largest_over_sigma": self.largest, "verdict": self.verdict}


@dataclass(frozen=True)
class _Here:
    """One whisk, and what (10) says of it: None without moments. alpha_rad: its friction angle, as well as it is known;
    held: whether the contact is held against slip to the side."""

    result: TrialResult
    seen: SeenWhisk
    felt: FeltWhisk
    whisker: Whisker
    shared: SharedTouch | None
    given: EstimateRow | None = field(init=False)

    def __post_init__(self):
        rows = (row for row in self.felt.estimates if row.estimator == GIVEN and np.isfinite(row.d_x_est_mm.value))
        object.__setattr__(self, "given", next(rows, None))

    @property
    def alpha_rad(self) -> float:
        known = (pair[0] for pair in (seen_friction(self.seen), felt_friction(self.seen, self.felt, self.theta_rad)))
        assumed = self.given.alpha_est_rad if self.given else NAN
        return max(next((alpha for alpha in known if np.isfinite(alpha)), assumed), 0.0)

    @property
    def dragged(self) -> float:
        """Share of friction that is left to act along the whisker: 0 of a contact that slips to the side."""
        slope = abs(np.tan(self.seen.beta_rad.value)) / max(np.tan(self.alpha_rad), 1e-12)
        return float(np.sqrt(1.0 - slope**2)) if slope < 1 else 0.0

    @property
    def speed_rad_s(self) -> float:
        frames = self.seen.frames
        return motor_speed(frames) if frames is not None and len(frames.time_s) > 1 else NAN

    @property
    def theta_rad(self) -> float:
        return float(np.radians(self.result.theta_deg))

    @property
    def left(self) -> float:
        """Share of the base's diameter that is left at the contact."""
        return 1.0 - self.whisker.beam.taper * self.given.d_x_est_mm.value / self.whisker.beam.length_mm

    @property
    def phi_rad(self) -> float:
        return 0.0 if self.dragged else self.felt.phi_felt_rad.value


def ledger(results: Sequence[TrialResult], whisker: Whisker) -> list[Entry]:
    """Every refinement of every whisk."""
    shared = shared_touch(results)
    here = [_Here(*whisk, whisker, shared) for whisk in whisks(results)]
    return [_entry(name, one) for one in here for name in NAMES]


def _entry(name: str, here: _Here) -> Entry:
    seen, felt = _of_truth(name, here), _of_estimate(name, here)
    effects = seen.d_x_mm, np.degrees(seen.touch_rad), seen.slip_mm, np.degrees(felt.touch_rad), felt.d_x_est_mm
    slips = here.seen.frames.slip_mm.sigma[here.seen.frames.touching] if here.seen.frames is not None else ()
    d_x_est = here.given.d_x_est_mm if here.given else UNKNOWN
    sigmas = (
        here.seen.d_x_mm.sigma,
        np.degrees(here.seen.touch_rad.sigma),
        slips[-1] if len(slips) else NAN,
        np.degrees(here.felt.touch_felt_rad.sigma),
        d_x_est.sigma,
    )
    status = "; ".join(dict.fromkeys(filter(None, [seen.why, felt.why])))
    named = (dict(zip(QUANTITIES, map(float, values))) for values in (effects, sigmas))
    return Entry(here.result.trial.name, here.seen.whisk, name, *named, status)


def _of_truth(name: str, here: _Here) -> LeftOut:
    """What the truth would differ by."""
    if not here.seen.has_truth:
        return LeftOut(NAN, NAN, NAN, _NO_TRUTH)
    if name == "clock":
        return _clock(here)
    if name not in here.seen.refinements:
        in_vision = name in NAMES[: NAMES.index("gauges' delay")] or name == "one-sided light"
        return LeftOut(NAN, NAN, NAN, "the fit does not tell") if in_vision else LeftOut()
    found = here.seen.refinements[name]
    if name != ALONG:
        return found
    share = here.dragged * float(np.tan(here.alpha_rad))
    if not np.isfinite(share):
        return LeftOut(NAN, NAN, NAN, "no friction angle is known")
    why = "" if share else "the contact slips to the side, and friction acts there"
    scaled = (share * effect + 0.0 for effect in (found.d_x_mm, found.touch_rad, found.slip_mm))  # no −0
    return LeftOut(*scaled, why)


def _clock(here: _Here) -> LeftOut:
    if here.shared is None or not here.shared.tells_clock:
        return LeftOut(0.0, NAN, 0.0, "at one speed and in one direction a clock is not told from a zero")
    late_s, sigma_s = here.shared.values[1], np.sqrt(here.shared.covariance[1, 1])
    why = f"felt − seen says {1e3 * late_s:+.2f} ± {1e3 * sigma_s:.2f} ms"
    return LeftOut(0.0, float(late_s) * here.speed_rad_s, 0.0, why)


def _of_estimate(name: str, here: _Here) -> Felt:
    """What felt touch and (10) would differ by."""
    if here.given is None:
        touch = _delay(here).touch_rad if name == "gauges' delay" else NAN if name == "drift" else 0.0
        return Felt(touch, NAN, here.felt.status or _NO_MOMENTS)
    made = {
        "large bending": _large_bending,
        "bar radius": _bar_radius,
        "psi": _psi,
        ALONG: _along,
        "taper": _taper,
        "sag and set": _sag_and_set,
        "gauges' delay": _delay,
        "cross-talk": _cross_talk,
        "drift": _drift,
        "second friction coefficient": _kinetic,
    }
    return made[name](here) if name in made else Felt()


def _large_bending(here: _Here) -> Felt:
    size = here.theta_rad**2 / (6 * here.left)
    return Felt(0.0, size * here.given.d_x_est_mm.value, "of the estimate its size alone (docs/maps.md)")


def _bar_radius(here: _Here) -> Felt:
    reach = 0.5 * here.result.trial.bar_diameter_mm + 0.5 * here.whisker.diameter_mm * here.left
    d_x, known = here.given.d_x_est_mm.value, (here.phi_rad, here.alpha_rad)
    share = first_order.rolling(here.theta_rad, reach, *known, d_x, here.left)
    return _share(here, share, "no bar diameter or friction angle is known")


def _psi(here: _Here) -> Felt:
    share = first_order.leaning(here.theta_rad, here.seen.psi_rad.value, here.phi_rad, here.alpha_rad)
    return _share(here, share, "no tilt is known")


def _along(here: _Here) -> Felt:
    dragged = here.dragged if np.isfinite(here.seen.beta_rad.value) else NAN
    return _share(here, dragged * first_order.dragging(here.theta_rad, here.alpha_rad), "no slope is known")


def _share(here: _Here, share: float, unless: str) -> Felt:
    """An effect that is a share of d_x; why it is not known where it is not."""
    known = bool(np.isfinite(share))
    return Felt(0.0, float(share) * here.given.d_x_est_mm.value + 0.0, "" if known else unless)


def _taper(here: _Here) -> Felt:
    d_x, beam = here.given.d_x_est_mm.value, here.whisker.beam
    return Felt(0.0, float(beam.as_cylinder_mm(d_x)) - d_x, "" if beam.taper else "the whisker does not taper")


def _sag_and_set(_: _Here) -> Felt:
    return Felt(why="of the estimate none to first order: moments above the free stroke's are those of the deflection")


def _delay(here: _Here) -> Felt:
    late = GAUGE_DELAY_S * here.speed_rad_s
    unless = "" if np.isfinite(late) else "no speed is known"
    return Felt(-late, 0.0, unless or "a filter of 800 Hz; touch and moments are late alike")


def _cross_talk(here: _Here) -> Felt:
    row = next((row for row in here.felt.one_factor if row.estimator == GIVEN), None)
    if row is None:
        return Felt(0.0, NAN, "no gauges with one factor a channel are known")
    return Felt(0.0, row.d_x_est_mm.value - here.given.d_x_est_mm.value, row.status)


def _drift(here: _Here) -> Felt:
    drifted, touch = here.felt.with_drift, here.felt.touch_felt_rad.value
    if drifted is None:
        return Felt(why="no free stroke before and after the contact: none was taken out")
    return Felt(drifted.touch_felt_rad - touch, drifted.d_x_est_mm - here.given.d_x_est_mm.value)


def _kinetic(here: _Here) -> Felt:
    row = next((row for row in here.felt.estimates if row.estimator == KINETIC), None)
    if row is None:
        return Felt(why="the moments show no stick–slip")
    return Felt(0.0, here.given.d_x_est_mm.value - row.d_x_est_mm.value, row.status)


def write_ledger(out: Path, results: Sequence[TrialResult], whisker: Whisker) -> list[Entry]:
    """The table; its rows."""
    entries = ledger(results, whisker)
    write_table(out / TABLE, COLUMNS, (entry.row for entry in entries))
    return entries


def ledger_lines(entries: Iterable[Entry]) -> Iterator[str]:
    """A line a refinement: its largest effect over sigma, and in how many whisks it is needed."""
    entries = list(entries)
    for name in NAMES if entries else ():
        yield f"{name:<28}{_line([entry for entry in entries if entry.refinement == name])}"


def _line(mine: Sequence[Entry]) -> str:
    told = [entry for entry in mine if entry.verdict != UNTOLD]
    if not told:
        return f"{UNTOLD}: {mine[0].status}"
    worst, needed = max(told, key=lambda entry: entry.largest), sum(entry.verdict == NEEDED for entry in told)
    verdict = f"{NEEDED} in {needed} of {len(told)}" if needed else MAY_GO
    if not worst.largest:
        return f"{verdict}: no effect" + (f" ({worst.status})" if worst.status else "")
    name = max(worst.ratios, key=worst.ratios.get)
    stem, _, unit = name.rpartition("_")
    return f"{verdict}: at most {worst.effects[name]:+.2g} {unit} of {stem}, {worst.largest:.2g} sigma ({worst.trial})"
