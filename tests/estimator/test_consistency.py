"""Friction from consistency: one object, seen from several sides, is smooth only with the right α."""

import numpy as np
import pytest

from estimator import slip
from estimator.consistency import CURVES, ONE_SLOPE, TOO_FEW, Contacts, most_consistent_alpha

pytestmark = pytest.mark.filterwarnings("error")

C, THETA = 8835.7, np.radians(3.0)
TILTS = np.radians([-60, -40, -20, 0, 20, 40])
HEIGHTS = np.array([-20.0, -10.0, 0.0, 10.0, 20.0])


def tilted(roll):
    """Pose of the array in the object's frame, turned by `roll` about x."""
    pose = np.eye(3, 4)
    pose[1:, 1:3] = [[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]]
    return pose


def contacts_on_a_bar(alpha, tilts=TILTS, heights=HEIGHTS, noise=0.0, seed=0, direction=(0.2, 0.3, 0.95)):
    """Whisks of an array of whiskers against a straight bar through (60, 0, 0), from several tilts of the array.

    Every number comes from the geometry: where the bar crosses each whisker's plane, its slope in the sensing plane
    there, and the forward model.
    """
    rng = np.random.default_rng(seed)
    rows = []
    for roll in tilts:
        rotation = tilted(roll)[:, :3]
        through, along = rotation.T @ [60.0, 0.0, 0.0], rotation.T @ np.array(direction)
        for height in heights:
            x, y, z = through + (height - through[2]) / along[2] * along
            d_x, touch = np.hypot(x, y), np.arctan2(y, x)
            sideways = along[1] * np.cos(touch) - along[0] * np.sin(touch)
            moments = slip.moments(d_x, THETA, np.arctan2(sideways, along[2]), alpha, C)
            rows.append((*(m * (1 + noise * rng.normal()) for m in moments), touch, z, tilted(roll)))
    m_y, m_z, touch, z, poses = (np.array(column) for column in zip(*rows))
    return Contacts(np.full(m_y.shape, THETA), m_y, m_z, C, touch, z, poses)


def test_contacts_lie_on_the_bar_with_the_right_angle_only():
    contacts = contacts_on_a_bar(0.25)
    direction = np.array([0.2, 0.3, 0.95]) / np.linalg.norm([0.2, 0.3, 0.95])
    for alpha, on_it in ((0.25, True), (0.1, False)):
        off = contacts.points(alpha) - [60.0, 0.0, 0.0]
        distance = np.linalg.norm(off - np.outer(off @ direction, direction), axis=1)
        assert (distance.max() < 1e-9) == on_it


@pytest.mark.parametrize("curve", CURVES)
def test_exact_contacts_give_the_angle_back(curve):
    """The bounded search stops within 1e-10, the sum of squares is flat within √ε of its least."""
    found = most_consistent_alpha(contacts_on_a_bar(0.25), curve=curve)
    assert found.alpha_rad == pytest.approx(0.25, abs=1e-7)
    assert found.rms_mm < 1e-5
    assert found.status == ""


def test_noise_stays_within_its_sigma():
    """30 noisy arrays: bias below half a sigma, scatter within a factor of 1.5 of it (few of 30 contacts are steep)."""
    found = [most_consistent_alpha(contacts_on_a_bar(0.25, noise=0.005, seed=seed)) for seed in range(30)]
    scores = np.array([(f.alpha_rad - 0.25) / f.sigma_rad for f in found])
    assert abs(scores.mean()) < 0.5
    assert 0.6 < scores.std() < 1.5
    assert np.std([f.alpha_rad for f in found]) < np.radians(0.5)


def test_one_slope_holds_no_angle():
    """Straight up along the rotation axis there is one slope for all heights, and any α shrinks all distances alike."""
    contacts = contacts_on_a_bar(
        0.25, tilts=np.radians([40.0]), heights=np.linspace(-0.2, 0.2, 6), direction=(0, 0.3, 0.95)
    )
    found = most_consistent_alpha(contacts)
    assert np.isnan(found.alpha_rad)
    assert found.status == ONE_SLOPE


def test_contacts_that_never_slip_hold_no_angle():
    contacts = contacts_on_a_bar(0.8, tilts=np.radians([-20.0, 0.0, 10.0]))
    assert most_consistent_alpha(contacts).status == ONE_SLOPE


def test_few_contacts_are_refused():
    assert most_consistent_alpha(contacts_on_a_bar(0.25, tilts=TILTS[:1], heights=HEIGHTS[:4])).status == TOO_FEW


def test_spline_follows_a_bent_object():
    """Facets of 20° and 50° in turn, at one distance: only the right α keeps the distance of both the same."""
    z = np.concatenate([np.linspace(-20, -2, 8), np.linspace(2, 20, 8)])
    slopes = np.radians(np.tile([20.0, 50.0], 8))
    m_y, m_z = slip.moments(60.0, THETA, slopes, 0.25, C)
    contacts = Contacts(np.full(16, THETA), m_y, m_z, C, np.zeros(16), z)
    assert most_consistent_alpha(contacts, curve="spline").alpha_rad == pytest.approx(0.25, abs=1e-6)


def test_weights_let_a_bad_contact_be_ignored():
    contacts = contacts_on_a_bar(0.25)
    m_z = contacts.m_z.copy()
    m_z[3] *= 1.3
    weights = np.ones(m_z.size)
    weights[3] = 1e-9
    spoilt = Contacts(contacts.theta, contacts.m_y, m_z, C, contacts.touch, contacts.z_c, contacts.poses)
    ignored = Contacts(contacts.theta, contacts.m_y, m_z, C, contacts.touch, contacts.z_c, contacts.poses, weights)
    assert abs(most_consistent_alpha(spoilt).alpha_rad - 0.25) > 1e-3
    assert most_consistent_alpha(ignored).alpha_rad == pytest.approx(0.25, abs=1e-5)


def test_shapes_and_names_are_checked():
    with pytest.raises(ValueError, match="of one length"):
        Contacts(np.ones(3), np.ones(3), np.ones(2), C, np.ones(3), np.ones(3))
    with pytest.raises(ValueError, match="poses has shape"):
        Contacts(*[np.ones(3)] * 3, C, np.ones(3), np.ones(3), np.ones((2, 3, 4)))
    with pytest.raises(ValueError, match="no push"):
        Contacts(np.ones(3), np.ones(3), np.array([1.0, -1.0, 1.0]), C, np.ones(3), np.ones(3))
    with pytest.raises(ValueError, match="curve = 'circle'"):
        most_consistent_alpha(contacts_on_a_bar(0.25), curve="circle")
