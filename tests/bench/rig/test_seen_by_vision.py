"""What the rig draws, the cameras' side reads: two programs that share no code agree on where bar and wire are."""

import csv
import tomllib

import numpy as np
import pytest

from bench.rig.simulation import simulate
from bench.session.footage import read_frames
from bench.session.frame_times import frame_times
from bench.session.session import load_session
from bench.session.signals import forward_strokes, read_signals
from tests.scenes.recorded import exact_cameras
from vision.geometry.rods import Bar, Rods, Wire
from vision.pictures.files import read_picture
from vision.truth.observe import observe_trial
from vision.truth.trial_pictures import TrialPictures

PROTOCOL = """
name = "one"
[whisker]
sag_mm = 0.2
set_y_mm = 0.8
set_z_mm = -0.6
[light]
wire_matt = 0.03
wire_shiny = 0.05
[[cameras]]
name = "a"
position_mm = [20.0, -220.0, 300.0]
[[cameras]]
name = "b"
position_mm = [130.0, -330.0, 90.0]
[board]
views = 4
[[trials]]
beta_deg = 35
psi_deg = 8.0
d_x_mm = 70.0
friction = 0.185339
bar_diameter_mm = 4.0
"""


@pytest.mark.slow
def test_a_dark_set_wire_on_a_tilted_thin_bar(tmp_path):
    (tmp_path / "one.toml").write_text(PROTOCOL)
    simulate(tmp_path / "session", protocol=tmp_path / "one.toml", seed=3)
    session = load_session(tmp_path / "session")
    (trial,) = session.trials
    truth = tomllib.loads((trial.folder / "truth.toml").read_text())
    signals, times = read_signals(trial), frame_times(trial)
    frames = {
        name: read_frames(source, range(len(times)))
        for name, source in trial.camera_sources.items()
    }
    background = {
        name: read_picture(path).astype(float) for name, path in session.rig_pictures.items()
    }
    whisks = [times.frames_in(signals, stroke) for stroke in forward_strokes(signals)]
    pictures = TrialPictures(frames, times.time_s, signals.motor_at(times.time_s), background)
    rods = Rods(Wire("cylinder", 100.0, 1.0), Bar(4.0))
    (seen,) = observe_trial(pictures, whisks, exact_cameras(session.path), rods).whisks
    assert seen.d_x_mm.value == pytest.approx(truth["d_x_mm"], abs=0.10)
    assert abs(seen.d_x_mm.value - truth["d_x_mm"]) < 3 * seen.d_x_mm.sigma
    assert np.degrees(seen.beta_rad.value) == pytest.approx(truth["beta_deg"], abs=0.3)
    slip = np.array(
        [float(row["slip_mm"]) for row in csv.DictReader((trial.folder / "truth.csv").open())]
    )
    touching = seen.frames.touching
    assert np.sqrt(np.mean((seen.frames.slip_mm.value - slip)[touching] ** 2)) < 0.08
