"""What the rig draws, the cameras' side reads: two programs that share no code agree on a vibrissa, a dark curved cone."""

import csv
import tomllib
from pathlib import Path

import numpy as np
import tomli_w

from bench.rig import protocol
from bench.rig.simulation import simulate
from bench.session.footage import read_frames
from bench.session.frame_times import frame_times
from bench.session.session import load_session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trial import Trial
from tests.scenes.recorded import exact_cameras
from vision.geometry.rods import Bar, Rods
from vision.pictures.files import read_picture
from vision.truth.observe import observe_trial
from vision.truth.trial_pictures import TrialPictures

SIZE_PX = [640, 360]  # about the hair: it is seen as large as by the protocol's cameras


def recorded(folder: Path):
    """Simulate seven frames of a push against a thin bar that leans, and return the session."""
    tables = tomllib.loads((protocol.FOLDER / "vibrissa.toml").read_text(encoding="utf-8"))
    for camera in tables["cameras"]:
        camera |= {"size_px": SIZE_PX, "centre_px": [0.5 * size for size in SIZE_PX]}
    tables["board"]["views"] = 1
    tables["pictures"] = {"step_deg": 1.0, "before_deg": 1.5, "after_deg": 4.5, "format": "png"}
    tables["trials"] = [{"beta_deg": 40.0, "psi_deg": 8.0, "d_x_mm": 20.0, "friction": 0.3}]
    (folder / "one.toml").write_text(tomli_w.dumps(tables), encoding="utf-8")
    simulate(folder / "session", protocol=folder / "one.toml", seed=3)
    return load_session(folder / "session")


def pictures_of(session, trial: Trial) -> tuple[TrialPictures, list]:
    """Return the pictures of a trial, and the frames of its whisks."""
    signals, times = read_signals(trial), frame_times(trial)
    frames = {
        name: read_frames(source, range(len(times)))
        for name, source in trial.camera_sources.items()
    }
    background = {
        name: read_picture(path).astype(float) for name, path in session.rig_pictures.items()
    }
    whisks = [times.frames_in(signals, stroke) for stroke in forward_strokes(signals)]
    motor_rad = signals.motor_at(times.time_s)
    return TrialPictures(frames, times.time_s, motor_rad, background), whisks


def test_a_vibrissa_on_a_leaning_thin_bar(tmp_path):
    """Everything within three sigma, d_x of 20 mm within 0.02 mm."""
    session = recorded(tmp_path)
    (trial,) = session.trials
    rods = Rods(session.whisker.wire, Bar(2.0))
    given = pictures_of(session, trial)
    (seen,) = observe_trial(*given, exact_cameras(session.path), rods).whisks
    truth = tomllib.loads((trial.folder / "truth.toml").read_text())
    found = {
        "d_x_mm": (seen.d_x_mm.value, seen.d_x_mm.sigma),
        "touch_deg": np.degrees([seen.touch_rad.value, seen.touch_rad.sigma]),
        "beta_deg": np.degrees([seen.beta_rad.value, seen.beta_rad.sigma]),
        "psi_deg": np.degrees([seen.psi_rad.value, seen.psi_rad.sigma]),
    }
    for name, (value, sigma) in found.items():
        assert abs(value - truth[name]) < 3 * sigma, name
    assert abs(seen.d_x_mm.value - truth["d_x_mm"]) < 0.02
    rows = csv.DictReader((trial.folder / "truth.csv").open())
    slip_mm = np.array([float(row["slip_mm"]) for row in rows])
    touching = seen.frames.touching
    assert touching.sum() == 5
    off_mm = (seen.frames.slip_mm.value - slip_mm)[touching]
    assert np.all(np.abs(off_mm) < 3 * seen.frames.slip_mm.sigma[touching])
