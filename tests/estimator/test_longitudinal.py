"""(2) with rolling taken out: against exact mechanics on round bars, and what it leaves as it is."""

import numpy as np
import pytest

from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import MotorTable, PicturesTable, TrialTable
from bench.rig.recording import Recording
from estimator.beam import Beam
from estimator.builtin import no_slip
from estimator.longitudinal import compliance_with_rolling
from estimator.whisk import EstimatorSettings, Whisk

BEAM = Beam.from_modulus(60.0, 1.0, 100.0)
THETA = np.radians(3.0)


def pushed(bar_mm: float, d_x_mm: float) -> Whisk:
    """A push of 3° by exact mechanics, head-on and without friction."""
    table = TrialTable(
        d_x_mm=d_x_mm,
        bar_diameter_mm=bar_mm,
        friction=0.0,
        beta_scatter_deg=0.0,
        d_x_scatter_mm=0.0,
    )
    protocol = Protocol(
        trials=[table], motor=MotorTable(after_deg=4.0), pictures=PicturesTable(step_deg=3.0)
    )
    recording = Recording.make(protocol.runs()[0], np.random.default_rng(0))
    (whisk,) = recording.whisks
    (moments,) = whisk.forward.moments_at(np.array([recording.touch.motor_rad + THETA]))
    return Whisk.without_samples(THETA, moments, 1e-6 * np.eye(2), BEAM)


@pytest.mark.parametrize("bar_mm", [6.0, 20.0])
def test_rolling_is_taken_out_to_its_second_order(bar_mm):
    """It is θ (R/d) 3/8 of the distance; its square, and large bending of 1/4 θ², are left."""
    whisk = pushed(bar_mm, 50.0)
    settings = EstimatorSettings(0.0, object_radius_mm=bar_mm / 2, whisker_radius_mm=0.5)
    rolled = THETA * (bar_mm / 2 + 0.5) / 50.0 * 3 / 8
    left = abs(compliance_with_rolling(whisk, settings).d_x_mm / 50.0 - 1)
    assert 1 - no_slip(whisk, settings).d_x_mm / 50.0 > 0.5 * rolled
    assert left < 4 * rolled**2 + 0.5 * THETA**2


def test_of_an_object_of_unknown_radius_it_is_2():
    whisk = pushed(6.0, 50.0)
    settings = EstimatorSettings(0.0)
    assert compliance_with_rolling(whisk, settings).d_x_mm == no_slip(whisk, settings).d_x_mm
