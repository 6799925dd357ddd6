"""Which refinements of the model a scene requires: ledger.csv, a row a refinement and whisk.

Each row says by how much truth, felt touch and estimate would differ without the refinement, beside their sigmas. What
is less than a tenth of every sigma may be left out: it adds no more than a two-hundredth to an error. It is kept even
so, at every preset, for leaving it out would save next to nothing: beside it stands what it costs.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analyses.left_out import COST_PERCENT, NAMES, WhiskAtHand, of_estimate, of_truth
from bench.base.doubts import in_one_status
from bench.base.tables import TRIAL, WHISK, Column, Kind, Table, alike, status
from bench.records.trial_result import TrialResult, whisks
from bench.session.whisker import Whisker
from bench.trials.clocks import shared_touch
from vision.truth.value import NAN, UNKNOWN

MATTERS = 0.1  # of a sigma: the user's own bound
NEEDED, MAY_GO, NOT_KNOWN = "needed", "may be left out, kept", "not known"
QUANTITIES = ("d_x_mm", "touch_deg", "slip_mm", "touch_felt_deg", "d_x_est_mm")
_SIDE = {"touch_deg": "d_x_mm", "slip_mm": "d_x_mm"}  # there where that is


def _columns(quantity: str) -> tuple[str, str]:
    """Return the columns of the effect on a quantity, and of the quantity's sigma."""
    stem, _, unit = quantity.rpartition("_")
    return f"{stem}_effect_{unit}", f"{stem}_sigma_{unit}"


LEDGER = Table(
    "ledger",
    "A row a refinement and whisk: by how much each result would differ without it (without less "
    "with), and that result's sigma. Effects on the truth are the fit's own linear sensitivities; "
    "where they are many sigmas, they give a size. An empty effect is not known, and `status` says "
    "why; the reason of an effect of 0 may stand there, too.",
    (
        TRIAL,
        WHISK,
        Column(
            "refinement",
            "large bending, bar radius, psi, friction along the whisker, taper, sag and set, "
            "lens k1 k2, lens k3, lens p1 p2, gauges' delay, cross-talk, drift, one-sided light, "
            "clock, second friction coefficient",
            Kind.TEXT,
        ),
        *alike(_columns("d_x_mm"), "on the d_x of the truth"),
        *alike(_columns("touch_deg"), "on the touch of the truth"),
        *alike(_columns("slip_mm"), "on the slip of the truth at the largest pushing angle"),
        *alike(_columns("touch_felt_deg"), "on touch felt"),
        *alike(_columns("d_x_est_mm"), "on d_x by (10)"),
        Column("largest_over_sigma", "the largest of the effects, each over its sigma"),
        Column(
            "verdict",
            '"needed": largest_over_sigma is above 0.1; "may be left out, kept": it is not, but '
            "leaving the refinement out would save next to nothing, so no preset does; "
            '"not known": one of the effects is not',
            Kind.TEXT,
        ),
        Column(
            "cost_percent",
            "what it costs at most, of a whisk's processor time as measured once "
            "(`tests/studies/speed/refinements.py`); 0: below 0.1 %",
        ),
        status("why an effect is 0 or not known"),
    ),
)


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
        known = {
            name: (abs(effect), self.sigmas[name])
            for name, effect in self.effects.items()
            if np.isfinite(effect)
        }
        return {
            name: effect / sigma if effect else 0.0
            for name, (effect, sigma) in known.items()
            if effect == 0.0 or sigma > 0
        }

    @property
    def largest(self) -> float:
        """The largest of `ratios`; NaN where there is none."""
        return max(self.ratios.values(), default=NAN)

    @property
    def verdict(self) -> str:
        """Whether any effect is more than a tenth of its sigma; not known where one of them is not."""
        if self.largest > MATTERS:
            return NEEDED
        there = (
            effect
            for name, effect in self.effects.items()
            if np.isfinite(self.sigmas[_SIDE.get(name, name)])
        )
        return NOT_KNOWN if not self.ratios or any(map(np.isnan, there)) else MAY_GO

    @property
    def row(self) -> dict:
        """By column."""
        cells = {}
        for name in QUANTITIES:
            cells |= zip(_columns(name), (self.effects[name], self.sigmas[name]))
        about = {
            "trial": self.trial,
            "whisk": self.whisk,
            "refinement": self.refinement,
            "status": self.status,
        }
        said = {"largest_over_sigma": self.largest, "verdict": self.verdict}
        return about | cells | said | {"cost_percent": COST_PERCENT[self.refinement]}


def ledger(results: Sequence[TrialResult], whisker: Whisker) -> list[Entry]:
    """Every refinement of every whisk."""
    shared = shared_touch(results)
    here = [WhiskAtHand(*whisk, whisker, shared) for whisk in whisks(results)]
    return [_entry(name, one) for one in here for name in NAMES]


def _entry(name: str, here: WhiskAtHand) -> Entry:
    seen, felt = of_truth(name, here), of_estimate(name, here)
    effects = (
        seen.d_x_mm,
        np.degrees(seen.touch_rad),
        seen.slip_mm,
        np.degrees(felt.touch_rad),
        felt.d_x_est_mm,
    )
    slips = (
        here.seen.frames.slip_mm.sigma[here.seen.frames.touching]
        if here.seen.frames is not None
        else ()
    )
    d_x_est = here.given.d_x_est_mm if here.given else UNKNOWN
    sigmas = (
        here.seen.d_x_mm.sigma,
        np.degrees(here.seen.touch_rad.sigma),
        slips[-1] if len(slips) else NAN,
        np.degrees(here.felt.touch_felt_rad.sigma),
        d_x_est.sigma,
    )
    status = in_one_status(seen.why, felt.why)
    named = (dict(zip(QUANTITIES, map(float, values))) for values in (effects, sigmas))
    return Entry(here.result.trial.name, here.seen.whisk, name, *named, status)


def write_ledger(out: Path, results: Sequence[TrialResult], whisker: Whisker) -> list[Entry]:
    """The table; its rows."""
    entries = ledger(results, whisker)
    LEDGER.write(out, (entry.row for entry in entries))
    return entries


def ledger_lines(entries: Iterable[Entry]) -> Iterator[str]:
    """A line a refinement: its largest effect over sigma, and in how many whisks it is needed."""
    entries = list(entries)
    for name in NAMES if entries else ():
        yield f"{name:<28}{_line([entry for entry in entries if entry.refinement == name])}"


def _line(mine: Sequence[Entry]) -> str:
    known = [entry for entry in mine if entry.verdict != NOT_KNOWN]
    if not known:
        return f"{NOT_KNOWN}: {mine[0].status}"
    worst, needed = (
        max(known, key=lambda entry: entry.largest),
        sum(entry.verdict == NEEDED for entry in known),
    )
    cost = COST_PERCENT[worst.refinement]
    kept = f"{MAY_GO} at {f'{cost:g} % of the time at most' if cost else 'no cost'}"
    verdict = f"{NEEDED} in {needed} of {len(known)}" if needed else kept
    if not worst.largest:
        return f"{verdict}: no effect" + (f" ({worst.status})" if worst.status else "")
    name = max(worst.ratios, key=worst.ratios.get)
    stem, _, unit = name.rpartition("_")
    return f"{verdict}: at most {worst.effects[name]:+.2g} {unit} of {stem}, {worst.largest:.2g} sigma ({worst.trial})"
