"""A DAQ's own file gives the signals and frame times of its clean twin."""

import shutil

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.session.frame_times import frame_times
from bench.session.session import load_session
from bench.session.signals import read_signals

TRIAL, RATE = "b60_4", 2000.0
SCALE, OFFSET = -0.036, 12.5  # degrees a count, as an encoder card has it


def raw(folder):
    """Channels of the trial as a DAQ would record them: counts, millivolts, and the cameras' trigger."""
    rows = np.genfromtxt(folder / "signals.csv", delimiter=",", names=True)
    frames = np.genfromtxt(folder / "frames.csv", delimiter=",", names=True)["time_s"]
    trigger = np.zeros(len(rows))
    for time_s in frames:
        first = int(np.ceil(time_s * RATE))
        trigger[first : first + 8] = 5.0
    return {
        "enc": (rows["motor_deg"] - OFFSET) / SCALE,
        "ai1": 1e3 * rows["y_V"],
        "ai2": 1e3 * rows["z_V"],
        "trigger": trigger,
    }


def manifest(prefix: str, file: str) -> str:
    lines = ["", "[signals]", f'file = "{file}"', f"rate_Hz = {RATE}"]
    lines += [f'motor_deg = {{ channel = "{prefix}enc", scale = {SCALE}, offset = {OFFSET} }}']
    gauges = ("y_V", "ai1"), ("z_V", "ai2")
    lines += [f'{name} = {{ channel = "{prefix}{channel}", scale = 0.001 }}' for name, channel in gauges]
    return "\n".join([*lines, f'frame_V = {{ channel = "{prefix}trigger" }}', ""])


def as_csv(folder, channels):
    rows = zip(*channels.values())
    lines = [",".join(channels), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    (folder / "daq.csv").write_text("\n".join(lines))
    return "daq.csv", ""


def as_mat(folder, channels):
    from scipy.io import savemat

    savemat(folder / "daq.mat", {"daq": {"in": channels}})
    return "daq.mat", "daq/in/"


def as_hdf5(folder, channels, name="daq.h5"):
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / name, "w") as file:
        for channel, series in channels.items():
            file[f"in/{channel}"] = series.reshape(1, -1)  # as MATLAB writes a row
    return name, "in/"


def as_mat_73(folder, channels):
    """Version 7.3: HDF5 behind 512 bytes of MATLAB's own."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "daq.mat", "w", userblock_size=512) as file:
        for channel, series in channels.items():
            file[channel] = series.reshape(-1, 1)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with (folder / "daq.mat").open("r+b") as file:
        file.write(head)
    return "daq.mat", ""


def as_tdms(folder, channels):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(folder / "daq.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("Main", name, series) for name, series in channels.items()])
    return "daq.tdms", "Main/"


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
        ('"ai1"', '"ai7"', f"trials/{TRIAL}/daq.csv: has no channel ai7; it has enc, ai1, ai2, trigger"),
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
