"""A DAQ's own file gives the signals and frame times of its clean twin."""

import shutil

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.session.frame_times import frame_times
from bench.session.session import load_session
from bench.session.signals import read_signals
from tests.scenes.daq_files import RATE, as_csv, as_hdf5, as_mat, as_mat_73, as_tdms, manifest, raw

TRIAL = "b60_4"


@pytest.fixture
def messy(small_copy):
    """A function that puts the trial's signals and frame times into a DAQ's file, and gives the session."""

    def made(writer):
        for trial in list((small_copy / "trials").iterdir()):
            if trial.name != TRIAL:
                shutil.rmtree(trial)
        folder = small_copy / "trials" / TRIAL
        file, prefix = writer(folder, raw(folder))
        (folder / "signals.csv").unlink()
        (folder / "frames.csv").unlink()
        with (small_copy / "session.toml").open("a") as text:
            text.write(manifest(prefix, file))
        return small_copy

    return made


@pytest.mark.parametrize("writer", [as_csv, as_mat, as_hdf5, as_mat_73, as_tdms])
def test_a_daq_file_gives_what_its_clean_twin_gives(messy, small_session, writer):
    clean, trial = (load_session(path).trial(TRIAL) for path in (small_session, messy(writer)))
    signals, twin = read_signals(clean), read_signals(trial)
    for name in ("time_s", "motor_rad", "y", "z"):
        np.testing.assert_allclose(getattr(twin, name), getattr(signals, name), atol=1e-7)
    assert twin.kind == "V"
    times = frame_times(trial)
    assert times.source == "edges of a DAQ channel"
    np.testing.assert_allclose(times.time_s, frame_times(clean).time_s, atol=0.5 / RATE + 1e-9)
    assert times.clock_sigma_s == 0.0


def refusal(session) -> str:
    with pytest.raises(BadInput) as bad:
        trial = load_session(session).trial(TRIAL)
        read_signals(trial)
        frame_times(trial)
    return str(bad.value)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            '"ai1"',
            '"ai7"',
            f"trials/{TRIAL}/daq.csv: has no channel ai7; it has enc, ai1, ai2, trigger",
        ),
        ("rate_Hz = 2000.0", "", r"[signals] has neither a time_s channel nor rate_Hz"),
        ("rate_Hz = 2000.0", 'time_s = { channel = "ai1" }', "column time_s: goes back"),
        ('file = "daq.csv"', 'file = "other.csv"', f"trials/{TRIAL}/other.csv: is not there"),
        ('"trigger"', '"ai1"', "must be an edge a frame"),
        ("scale = 0.001", "scale = 1.0", "millivolts"),
    ],
)
def test_what_is_wrong_is_said(messy, old, new, expected):
    session = messy(as_csv)
    text = (session / "session.toml").read_text()
    assert old in text
    (session / "session.toml").write_text(text.replace(old, new, 1))
    assert expected in refusal(session)


def test_a_damaged_matlab_file(messy):
    session = messy(as_mat)
    file = session / "trials" / TRIAL / "daq.mat"
    file.write_bytes(file.read_bytes()[:1000])
    assert "cannot be read as a MATLAB file" in refusal(session)


def test_an_extra_that_is_not_installed(messy, monkeypatch):
    session = messy(as_csv)
    (session / "trials" / TRIAL / "daq.csv").rename(session / "trials" / TRIAL / "daq.tdms")
    text = (session / "session.toml").read_text()
    (session / "session.toml").write_text(text.replace("daq.csv", "daq.tdms"))

    def absent(name):
        raise ImportError(name)

    monkeypatch.setattr("bench.session.daq.importlib.import_module", absent)
    assert "needs nptdms: pip install 'whisker-bench[tdms]'" in refusal(session)
