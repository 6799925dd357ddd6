"""Gauge trials of the recorded-like session with exact truth: moments from the deflection, and coefficients."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bench.base.settings import Settings
from bench.gauges.drift import drift_rate, free_slope
from bench.gauges.felt import gauge_delay, strokes_of
from bench.gauges.fit import fit_gauges
from bench.gauges.gauge_readings import (
    SEEN,
    WIRE_ALONE,
    _share_along_rod,
    pairs_of,
    reference_from_nominal,
    reference_from_pictures,
)
from bench.gauges.whisker_rods import SeenContacts
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.rig.rod_contact import moments_Nmm
from bench.rig.stick_slip import FrictionCoefficients, March
from bench.session.session import load_session
from bench.session.signals import forward_strokes, read_signals
from bench.session.whisker import Whisker
from estimator.signal import FeltTouch
from vision import WhiskTruth
from vision.geometry import Reason

WHISKER = Whisker(shape="cylinder", length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
# 155 times as soft.
POLYMER = Whisker(shape="cylinder", length_mm=100.0, diameter_mm=0.6, youngs_modulus_GPa=3.0)


@pytest.fixture
def session(steel_signals):
    return load_session(steel_signals)


@pytest.fixture
def exactly_seen(exact_record):
    return exact_record


def test_moments_from_the_deflection_seen(session, exactly_seen):
    """Within 0.15 % of the exact moments, which is the friction along the rod that is not known (0.1 % at 3°)."""
    for name in ("gauge_roll0", "gauge_roll90"):
        trial = session.trial(name)
        reference = reference_from_pictures(exactly_seen(trial), WHISKER)
        truth = np.genfromtxt(trial.folder / "truth.csv", delimiter=",", names=True)
        truth = truth[truth["contact"] == 1]
        assert reference.moments[:, 1] == pytest.approx(truth["m_z_Nmm"], rel=1.5e-3)
        assert np.abs(reference.moments[:, 0] - truth["m_y_Nmm"]).max() < 0.005


def test_coefficients_of_the_sample_session(session, exactly_seen):
    """Diagonal within 1 %, cross-talk within 1 point of its column's diagonal, and inside the stated U95."""
    settings = Settings()
    strokes = {t.name: strokes_of(read_signals(t), t, settings) for t in session.trials}
    rate = drift_rate([free_slope(s) for many in strokes.values() for s in many])
    made = fit_gauges(
        [
            pairs_of(t, exactly_seen(t), strokes[t.name][0], rate, WHISKER, settings.theta_rad)
            for t in session.trials
            if t.purpose == "gauge"
        ]
    )
    true = np.array(json.loads((session.path / "truth.json").read_text())["gauge_matrix_Nmm_per_V"])
    assert np.diag(made.all.matrix) == pytest.approx(np.diag(true), rel=0.01)
    cross = made.all.matrix / np.diag(made.all.matrix) - true / np.diag(true)
    assert np.abs(cross).max() < 0.01
    assert np.all(np.abs(made.all.matrix - true) < 1.96 * made.all.sigma)


def test_a_whisk_without_a_truth_serves_by_its_wire(session, exactly_seen):
    """Its pairs are those that it has with one, and the certificate can say so."""
    trial = session.trial("gauge_roll0")
    seen = exactly_seen(trial)
    stroke = strokes_of(read_signals(trial), trial, Settings())[0]
    with_truth, without = (
        pairs_of(trial, whisk, stroke, np.zeros(2), WHISKER, 0.05)
        for whisk in (seen, replace(seen, truth=WhiskTruth(0)))
    )
    np.testing.assert_array_equal(without.moments, with_truth.moments)
    np.testing.assert_array_equal(without.paper_moment, with_truth.paper_moment)
    assert (with_truth.source, without.source) == (SEEN, WIRE_ALONE)


def test_a_badly_known_place_along_the_wire_counts_little_and_not_nothing(session, exactly_seen):
    """An error of the contact's place that all frames share is a share of their moments: 2/x of it, where the
    deflection is that of the place. It is in scale_sigma and nowhere twice."""
    seen = exactly_seen(session.trial("gauge_roll0"))
    d = seen.deflection
    n = len(d.theta_rad)
    by_place = np.tile([1.0, 0.0, 0.0], n)
    sigma_mm = 0.5
    vague = replace(d, covariance=d.covariance + sigma_mm**2 * np.outer(by_place, by_place))
    sharp, wide = (
        reference_from_pictures(replace(seen, deflection=one), WHISKER) for one in (d, vague)
    )
    assert wide.scale_sigma == pytest.approx(2 * sigma_mm / d.d_x_mm, rel=0.02)
    np.testing.assert_allclose(wide.covariance, sharp.covariance, atol=1e-4)


def test_slip_that_is_hardly_known_leaves_open_how_much_friction_acts_along_the_rod():
    """A rod drawn along itself by 0.6 · 2² / 50 mm: all of its sliding without slip, and anything down to a tenth of it
    where half a millimetre of slip is possible."""
    contacts = SeenContacts(np.full(3, 50.0), np.array([[0.0, 2.0]] * 3), np.full(3, 0.04), 50.0)
    share = _share_along_rod(contacts, np.array([0.0, 0.048, 0.0]), np.array([0.0, 0.0, 0.5]))
    assert share.value[:2] == pytest.approx([1.0, np.sqrt(0.5)])
    assert share.sigma[:2] == pytest.approx([0.0, 0.0])
    assert share.value[2] - share.sigma[2] > 0.2 and share.value[2] + 1.5 * share.sigma[2] > 1.0


def test_a_nominal_bar_gives_the_moments_of_2(session):
    """Without pictures: (2) at small angles, a distance known to 1 %, and the touch's sigma in all of it."""
    trial = SimpleNamespace(d_x_mm=50.0, d_x_sigma_mm=0.0, beta_deg=0.0, bar_diameter_mm=6.0)
    reference = reference_from_nominal(trial, FeltTouch(0.04, 1e-4), WHISKER)
    assert reference.moments[:, 1] == pytest.approx(
        WHISKER.C_Nmm2 * reference.theta_rad / 50.0, rel=5e-3
    )
    own = np.sqrt(np.diag(reference.covariance))[1::2] / reference.moments[:, 1]
    sigma = np.hypot(own, reference.scale_sigma)
    assert np.all(sigma > 0.01) and np.all(sigma < 0.013)


@pytest.mark.parametrize("bar_radius_mm", [3.0, 8.0])
@pytest.mark.parametrize("whisker", [WHISKER, POLYMER], ids=["nitinol", "polymer"])
def test_a_nominal_bar_gives_the_moments_of_the_exact_contact(bar_radius_mm, whisker):
    """The rig marches the whole contact. Left out here is the second order of its lean in θ: (4°)² / 8 = 0.06 %."""
    rod = Rod("cylinder", whisker.length_mm, whisker.diameter_mm, whisker.implied_modulus_GPa)
    bar = TouchedBar.at_contact(
        d_x_mm=50.0,
        beta_rad=0.0,
        psi_rad=0.0,
        touch_rad=0.0,
        radius_mm=bar_radius_mm,
        whisker_radius_mm=whisker.diameter_mm / 2,
    )
    trial = SimpleNamespace(
        d_x_mm=50.0, d_x_sigma_mm=0.0, beta_deg=0.0, bar_diameter_mm=2 * bar_radius_mm
    )
    reference = reference_from_nominal(trial, FeltTouch(0.0, 1e-4), whisker)
    march = March(rod, bar, FrictionCoefficients(0.2, 0.2), find_first_touch(rod, bar, 0.0, 50.0))
    exact = [moments_Nmm(state)[1] for state in march.along(reference.theta_rad)[1]]
    assert reference.moments[:, 1] == pytest.approx(exact, rel=6e-4)


def test_a_steep_nominal_bar_gives_none():
    steep = SimpleNamespace(d_x_mm=50.0, d_x_sigma_mm=0.0, beta_deg=30.0)
    assert reference_from_nominal(steep, FeltTouch(0.04, 1e-4), WHISKER) is None


def test_no_touch_no_pairs(session, exactly_seen):
    trial = session.trial("gauge_roll0")
    signals = read_signals(trial)
    stroke = strokes_of(signals, trial, Settings())[0]
    free = type(stroke)(
        *(getattr(stroke, name)[:250] for name in ("time_s", "motor_rad", "channels", "filtered"))
    )
    assert len(forward_strokes(signals)) == 1
    found = pairs_of(trial, exactly_seen(trial), free, np.zeros(2), WHISKER, 0.05)
    assert isinstance(found, Reason) and found


def test_a_rod_that_is_not_bent_so_is_a_reason_and_not_silence(session, exactly_seen):
    """A deflection of 0.7 of the distance is that of no clamped rod which a contact holds."""
    trial = session.trial("gauge_roll0")
    seen = exactly_seen(trial)
    stroke = strokes_of(read_signals(trial), trial, Settings())[0]
    d = seen.deflection
    far = replace(seen, deflection=replace(d, across_y_mm=0.7 * d.along_mm))
    found = pairs_of(trial, far, stroke, np.zeros(2), WHISKER, 0.05)
    assert found.codes == ("gauge_rod_unconverged",)
    assert "less than 0.6 of its distance aside" in found


def test_a_rest_shape_that_is_hardly_known_counts_in_moments(session, exactly_seen):
    """Moved by one sigma the moments are off by as much in z as is added to their sigma."""
    seen = exactly_seen(session.trial("gauge_roll0"))

    def reference(set_mm, sigma_mm):
        whisker = replace(
            WHISKER, rest_mm=((0.0, 0.0, set_mm), (0.0,)), rest_shape_sigma_mm=sigma_mm
        )
        return reference_from_pictures(seen, whisker)

    sure, vague, moved = reference(5.0, 0.0), reference(5.0, 1.0), reference(6.0, 0.0)
    added = np.sqrt(np.diag(vague.covariance) - np.diag(sure.covariance))[1::2]
    assert added == pytest.approx(np.abs(moved.moments - sure.moments)[:, 1], rel=0.05)


def test_volts_are_read_as_late_as_the_gauges_filter_has_them(session, exactly_seen):
    """A recording whose channels come 20 samples later, as the trial says by its filter, has the same volts."""
    trial = session.trial("gauge_roll0")
    stroke, late = strokes_of(read_signals(trial), trial, Settings())[0], 20
    later = {
        name: np.concatenate([np.repeat(every[:1], late, axis=0), every[:-late]])
        for name, every in (("channels", stroke.channels), ("filtered", stroke.filtered))
    }
    filter_Hz = gauge_delay(1.0).value / (late * np.diff(stroke.time_s).mean())

    def volts_of(filter_Hz, stroke):
        filtered = replace(trial, gauge_filter_Hz=filter_Hz)
        return pairs_of(filtered, exactly_seen(trial), stroke, np.zeros(2), WHISKER, 0.05)

    on_time, shifted = volts_of(0.0, stroke), volts_of(filter_Hz, replace(stroke, **later))
    count = min(len(on_time), len(shifted))
    # A window of samples that begins one sample off averages noise of 1e-2 V over a hundred others.
    np.testing.assert_allclose(shifted.volts[:count], on_time.volts[:count], atol=3e-3)
    unknown = volts_of(
        None, stroke
    )  # any delay from none to twice the paper's: 0.3 ms at 10°/s of some degrees
    assert np.all(
        np.diag(unknown.volts_covariance)[1::2]
        > np.diag(on_time.volts_covariance)[1 : 2 * len(unknown) : 2]
    )
