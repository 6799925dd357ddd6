"""Which refinements of the model a scene requires: ledger.csv, a row a refinement and whisk.

Each row says by how much truth, felt touch and estimate would differ without the refinement, and their sigmas. What
is less than a tenth of every sigma may be left out: it adds no more than a two-hundredth to an error. It is kept even
so, at every preset.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading
from bench.analyses.left_out import (
    NAMES,
    WhiskModel,
    effect_on_estimate,
    effect_on_truth,
)
from bench.analyses.pooling import grouped
from bench.base.input_problems import in_one_status
from bench.base.tables import TRIAL, WHISK, Column, Kind, Table, alike, status
from bench.records.trial_result import TrialResult, whisks
from bench.session.whisker import Whisker
from bench.trials.clocks import shared_touch
from vision import NAN, UNKNOWN

# [sigma] A refinement that moves a result by less is of no account. Stated.
MATTERS = 0.1
NEEDED = "needed"
MAY_GO = "may be left out, kept"
NOT_KNOWN = "not known"
QUANTITIES = ("d_x_mm", "touch_deg", "slip_mm", "touch_felt_deg", "d_x_est_mm")
# Quantities that a whisk has only where it has the other.
_KNOWN_WITH = {"touch_deg": "d_x_mm", "slip_mm": "d_x_mm"}


def _columns(quantity: str) -> tuple[str, str]:
    """Return the columns of the effect on a quantity, and of the quantity's sigma."""
    stem, _, unit = quantity.rpartition("_")
    return f"{stem}_effect_{unit}", f"{stem}_sigma_{unit}"


LEDGER = Table(
    "ledger",
    "A row a refinement and whisk: by how much each result would differ without it (without less "
    "with), and that result's sigma. Effects on the truth are linear: of many sigmas they give a "
    "size. `status` says why an effect is not known (empty) or 0.",
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
            '"needed": largest_over_sigma is above 0.1; "may be left out, kept": it is not, though '
            'every preset has it; "not known": an effect is not',
            Kind.TEXT,
        ),
        status("why an effect is 0 or not known"),
    ),
)


@dataclass(frozen=True)
class Entry:
    """One refinement of one whisk.

    effects, sigmas: by QUANTITIES, NaN where they are not known; status says why.
    """

    trial: str
    whisk: int
    refinement: str
    effects: dict[str, float]
    sigmas: dict[str, float]
    status: str = ""

    @property
    def ratios(self) -> dict[str, float]:
        """Return effects over their sigmas, where both are known; of no effect 0."""
        found = {}
        for name, effect in self.effects.items():
            sigma = self.sigmas[name]
            if effect == 0.0:
                found[name] = 0.0
            elif np.isfinite(effect) and sigma > 0:
                found[name] = abs(effect) / sigma
        return found

    @property
    def largest(self) -> float:
        """Return the largest of `ratios`; NaN where there is none."""
        return max(self.ratios.values(), default=NAN)

    @property
    def verdict(self) -> str:
        """Return whether any effect is above a tenth of its sigma; not known where one effect is not."""
        if self.largest > MATTERS:
            return NEEDED
        if not self.ratios:
            return NOT_KNOWN
        for name, effect in self.effects.items():
            sigma = self.sigmas[_KNOWN_WITH.get(name, name)]
            if np.isnan(effect) and np.isfinite(sigma):
                return NOT_KNOWN
        return MAY_GO

    @property
    def row(self) -> dict:
        """Return the row of LEDGER."""
        row = {
            "trial": self.trial,
            "whisk": self.whisk,
            "refinement": self.refinement,
            "largest_over_sigma": self.largest,
            "verdict": self.verdict,
            "status": self.status,
        }
        for name in QUANTITIES:
            effect_column, sigma_column = _columns(name)
            row[effect_column] = self.effects[name]
            row[sigma_column] = self.sigmas[name]
        return row


class Ledger(Analysis):
    """Which refinements of the model the scene requires."""

    tables = (LEDGER,)
    heading = Heading(
        "ledger", "Only what the scene requires: the effect of leaving it out (ledger.csv)"
    )

    def compute(self, run: EvaluatedRun) -> list[Entry]:
        """Return every refinement of every whisk."""
        return ledger(run.results, run.whisker)

    def row(self, one: Entry) -> dict:
        """Return the row of a refinement and whisk."""
        return one.row

    def lines(self, found: Sequence[Entry]) -> Iterator[str]:
        """Yield a line a refinement: its largest effect, and in how many whisks it is needed."""
        for name, entries in grouped(found, lambda entry: entry.refinement).items():
            yield f"{name:<28}{_verdict_of_all(entries)}"


def ledger(results: Sequence[TrialResult], whisker: Whisker) -> list[Entry]:
    """Return every refinement of every whisk."""
    shared = shared_touch(results)
    entries = []
    for result, seen, felt in whisks(results):
        model = WhiskModel(result, seen, felt, whisker, shared)
        sigmas = _sigmas(model)
        entries += [_entry(name, model, sigmas) for name in NAMES]
    return entries


def _entry(name: str, model: WhiskModel, sigmas: dict[str, float]) -> Entry:
    """Return the effects of one refinement on a whisk."""
    truth = effect_on_truth(name, model)
    estimate = effect_on_estimate(name, model)
    effects = {
        "d_x_mm": float(truth.d_x_mm),
        "touch_deg": math.degrees(truth.touch_rad),
        "slip_mm": float(truth.slip_mm),
        "touch_felt_deg": math.degrees(estimate.touch_rad),
        "d_x_est_mm": float(estimate.d_x_est_mm),
    }
    reason = in_one_status(truth.why, estimate.why)
    return Entry(model.result.trial.name, model.seen.whisk, name, effects, sigmas, reason)


def _sigmas(model: WhiskModel) -> dict[str, float]:
    """Return the standard deviation of each of QUANTITIES."""
    seen = model.seen
    d_x_est_mm = model.given.d_x_est_mm if model.given else UNKNOWN
    slip_sigmas = () if seen.frames is None else seen.frames.slip_mm.sigma[seen.frames.touching]
    return {
        "d_x_mm": float(seen.d_x_mm.sigma),
        "touch_deg": math.degrees(seen.touch_rad.sigma),
        "slip_mm": float(slip_sigmas[-1]) if len(slip_sigmas) else NAN,
        "touch_felt_deg": math.degrees(model.felt.touch_felt_rad.sigma),
        "d_x_est_mm": float(d_x_est_mm.sigma),
    }


def _verdict_of_all(entries: Sequence[Entry]) -> str:
    """Return the verdict on one refinement over all whisks."""
    known = [entry for entry in entries if entry.verdict != NOT_KNOWN]
    if not known:
        return f"{NOT_KNOWN}: {entries[0].status}"
    worst = max(known, key=lambda entry: entry.largest)
    needed = sum(entry.verdict == NEEDED for entry in known)
    verdict = f"{NEEDED} in {needed} of {len(known)}" if needed else MAY_GO
    if not worst.largest:
        reason = f" ({worst.status})" if worst.status else ""
        return f"{verdict}: no effect{reason}"
    name = max(worst.ratios, key=worst.ratios.get)
    stem, _, unit = name.rpartition("_")
    effect = f"{worst.effects[name]:+.2g} {unit} of {stem}"
    return f"{verdict}: at most {effect}, {worst.largest:.2g} sigma ({worst.trial})"
