"""The motor's way: constant speed between its turns, whatever comes before and after."""

import numpy as np
import pytest

from bench.rig.stroke import Stroke


@pytest.mark.parametrize("ramp_s", [0.0, 0.05])
def test_every_whisk_of_a_recording_goes_forth_and_back_at_its_speed(ramp_s):
    stroke = Stroke.plan(0.01, 0.11, 0.2, whisks=3, ramp_s=ramp_s, back=True)
    assert len(stroke.forward) == 3
    for start, end in stroke.forward:
        time = np.linspace(start, end, 50)[1:-1]
        assert np.allclose(np.diff(stroke.angle_rad(time)) / np.diff(time), 0.2)
        assert stroke.angle_rad(start) == pytest.approx(0.01) and stroke.angle_rad(
            end - 1e-12
        ) == pytest.approx(0.11)
    steps = np.diff(stroke.angle_rad(np.linspace(0, stroke.end_s, 5001)))
    # never faster than its speed: no jump between whisks
    assert np.max(np.abs(steps)) <= 0.2 * stroke.end_s / 5000 * 1.001
