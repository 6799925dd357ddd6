"""Which refinements a scene requires: effects beside sigmas, and what is not known said so."""

from dataclasses import replace

import numpy as np
import pytest

from bench.analyses.ledger import (
    LEDGER,
    MAY_GO,
    NEEDED,
    NOT_KNOWN,
    QUANTITIES,
    Entry,
    Ledger,
    ledger,
)
from bench.analyses.left_out import NAMES
from bench.gauges.felt import gauge_delay
from bench.records.trial_result import EstimateRow, WithDrift
from bench.session.whisker import Whisker
from estimator import first_order
from tests.scenes.friction_results import ALPHA, WHISKER, result
from vision.fit.refinements import LeftOut
from vision.truth.value import Value


def by_name(whisk, whisker=WHISKER) -> dict[str, Entry]:
    return {entry.refinement: entry for entry in ledger([whisk], whisker)}


def with_felt(whisk, **fields):
    (felt,) = whisk.felt.whisks
    return replace(whisk, felt=replace(whisk.felt, whisks=(replace(felt, **fields),)))


def with_seen(whisk, **fields):
    (seen,) = whisk.seen.whisks
    return replace(
        whisk,
        seen=replace(whisk.seen, whisks=(replace(seen, truth=replace(seen.truth, **fields)),)),
    )


def entry(effect: float, sigma: float, other: float = 0.0) -> Entry:
    effects = {"d_x_mm": effect, "touch_deg": other}
    return Entry("a", 0, "psi", effects, {"d_x_mm": sigma, "touch_deg": 0.01})


def test_a_tenth_of_a_sigma_decides():
    assert entry(0.0011, 0.01).verdict == NEEDED
    assert entry(-0.0009, 0.01).verdict == MAY_GO
    assert entry(0.0, np.nan).verdict == MAY_GO


def test_what_may_be_left_out_is_kept_and_its_largest_effect_is_said():
    effects, sigmas = dict.fromkeys(QUANTITIES, 1e-4), dict.fromkeys(QUANTITIES, 0.01)
    entries = [Entry("a", 0, name, effects, sigmas) for name in NAMES]
    said = {line[:28].strip(): line[28:] for line in Ledger().lines(entries)}
    assert said["psi"].startswith("may be left out, kept: at most +0.0001 mm of d_x")


def test_what_is_not_known_is_not_left_out():
    assert entry(0.0, 0.01, np.nan).verdict == NOT_KNOWN
    assert entry(0.01, 0.01, np.nan).verdict == NEEDED  # whatever the other is
    assert (
        entry(np.nan, np.nan).verdict == MAY_GO
    )  # no such quantity: touch is known, and does not move
    assert entry(np.nan, 0.01).verdict == NOT_KNOWN


def test_closed_forms_of_the_estimate():
    """(10)'s first order, with what is seen: a bar of 6 mm, a slope of 50° and a tilt of 10°."""
    whisk = with_seen(result(50.0), psi_rad=Value(np.radians(10.0), 0.01))
    whisk = replace(whisk, trial=replace(whisk.trial, bar_diameter_mm=6.0))
    (felt,), found = whisk.felt.whisks, by_name(whisk)
    d_x, phi, theta = felt.estimates[0].d_x_est_mm.value, felt.phi_felt_rad.value, np.radians(3.0)
    rolling = first_order.rolling(theta, 3.5, phi, ALPHA, d_x, 1.0)
    assert found["bar radius"].effects["d_x_est_mm"] == pytest.approx(rolling * d_x, rel=1e-3)
    leaning = first_order.leaning(theta, np.radians(10.0), phi, ALPHA)
    assert found["psi"].effects["d_x_est_mm"] == pytest.approx(leaning * d_x, rel=1e-3)
    assert found["large bending"].effects["d_x_est_mm"] == pytest.approx(theta**2 / 6 * d_x)
    assert found["friction along the whisker"].effects["d_x_est_mm"] == 0  # it slips to the side


def test_friction_along_a_held_contact_drags_by_what_is_left_of_it():
    whisk = with_seen(
        result(0.0), refinements={"friction along the whisker": LeftOut(0.01, 1e-5, -0.02)}
    )
    found = by_name(whisk)["friction along the whisker"]
    alpha = whisk.felt.whisks[0].estimates[0].alpha_est_rad  # no slip tells it: as assumed
    assert found.effects["d_x_mm"] == pytest.approx(0.01)  # the fit knows of it
    assert found.effects["d_x_est_mm"] == pytest.approx(
        first_order.dragging(np.radians(3.0), alpha)
        * whisk.felt.whisks[0].estimates[0].d_x_est_mm.value
    )


def test_taper_drift_cross_talk_and_teeth_are_the_estimate_made_again():
    one = EstimateRow("with_friction", Value(61.0, 0.1))
    whisk = result(50.0)
    rows = whisk.felt.whisks[0].estimates
    kinetic = replace(rows[0], estimator="with_friction_kinetic", d_x_est_mm=Value(58.0, 0.1))
    drifted = WithDrift(np.radians(0.02), 59.0)
    whisk = with_felt(whisk, one_factor=(one,), with_drift=drifted, estimates=(*rows, kinetic))
    d_x, found = rows[0].d_x_est_mm.value, by_name(whisk)
    assert found["cross-talk"].effects["d_x_est_mm"] == pytest.approx(61.0 - d_x)
    assert found["drift"].effects["d_x_est_mm"] == pytest.approx(59.0 - d_x)
    assert found["drift"].effects["touch_felt_deg"] == pytest.approx(0.02)
    assert found["second friction coefficient"].effects["d_x_est_mm"] == pytest.approx(d_x - 58.0)
    assert found["taper"].effects["d_x_est_mm"] == 0
    cone = by_name(
        whisk, Whisker(shape="cone", length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
    )["taper"]
    assert 1 / (d_x + cone.effects["d_x_est_mm"]) == pytest.approx(1 / d_x - 1 / 100.0)


def test_what_no_row_has_is_missing_with_a_reason():
    found = by_name(result(50.0))
    assert (
        found["cross-talk"].verdict == NOT_KNOWN
        and "factors_unknown" in found["cross-talk"].status.codes
    )
    assert found["clock"].verdict == NOT_KNOWN and found["clock"].status
    assert "effect_not_fitted" in found["psi"].status.codes
    assert (
        found["drift"].effects["d_x_est_mm"] == 0
        and "drift_not_removed" in found["drift"].status.codes
    )


def test_summary_and_page_say_it(exact_run):
    title = "Only what the scene requires"
    assert title in (exact_run / "summary.txt").read_text()
    assert (
        f"<h3>Ledger: {title[0].lower()}{title[1:]}</h3>" in (exact_run / "report.html").read_text()
    )


def test_the_table_and_the_lines(exact_run):
    table = LEDGER.read(exact_run)
    assert table.dtype.names == LEDGER.names and set(table["refinement"]) == set(NAMES)
    trials = set(table["trial"].tolist())
    assert len(table) == len(NAMES) * len(trials)
    delay = table[(table["refinement"] == "gauges' delay") & (table["trial"] == "b60_4")]
    assert delay["touch_felt_effect_deg"][0] == pytest.approx(
        gauge_delay(None).value * 10.0, rel=0.02
    )  # 10°/s
    assert delay["verdict"].tolist() == [NEEDED]
    lines = list(Ledger().lines(ledger([result(50.0)], WHISKER)))
    assert len(lines) == len(NAMES) and any("needed in 1 of 1" in line for line in lines)
    assert list(Ledger().lines([])) == []
