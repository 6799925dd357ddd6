"""A trial's signals and frame trigger as a DAQ's own software writes them. Each writer returns the file's name and what
stands before a channel's name in it."""

from pathlib import Path

import numpy as np
import pytest

RATE = 2000.0
SCALE, OFFSET = -0.036, 12.5  # degrees a count, as an encoder card has it
Written = tuple[str, str]


def raw(folder: Path) -> dict[str, np.ndarray]:
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
    """[signals] of session.toml for these channels."""
    lines = ["", "[signals]", f'file = "{file}"', f"rate_Hz = {RATE}"]
    lines += [f'motor_deg = {{ channel = "{prefix}enc", scale = {SCALE}, offset = {OFFSET} }}']
    gauges = ("y_V", "ai1"), ("z_V", "ai2")
    lines += [
        f'{name} = {{ channel = "{prefix}{channel}", scale = 0.001 }}' for name, channel in gauges
    ]
    return "\n".join([*lines, f'frame_V = {{ channel = "{prefix}trigger" }}', ""])


def as_csv(folder, channels) -> Written:
    """A text file with a header."""
    rows = zip(*channels.values())
    lines = [",".join(channels), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    (folder / "daq.csv").write_text("\n".join(lines))
    return "daq.csv", ""


def as_mat(folder, channels) -> Written:
    """Variables within a MATLAB structure."""
    from scipy.io import savemat

    savemat(folder / "daq.mat", {"daq": {"in": channels}})
    return "daq.mat", "daq/in/"


def as_hdf5(folder, channels, name="daq.h5") -> Written:
    """Datasets within a group."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / name, "w") as file:
        for channel, series in channels.items():
            file[f"in/{channel}"] = series.reshape(1, -1)  # as MATLAB writes a row
    return name, "in/"


def as_mat_73(folder, channels) -> Written:
    """Version 7.3: HDF5 behind 512 bytes of MATLAB's own."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "daq.mat", "w", userblock_size=512) as file:
        for channel, series in channels.items():
            file[channel] = series.reshape(-1, 1)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    with (folder / "daq.mat").open("r+b") as file:
        file.write(head)
    return "daq.mat", ""


def as_tdms(folder, channels) -> Written:
    """Channels of a group of LabVIEW's."""
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(folder / "daq.tdms") as writer:
        writer.write_segment(
            [nptdms.ChannelObject("Main", name, series) for name, series in channels.items()]
        )
    return "daq.tdms", "Main/"
