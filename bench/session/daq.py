"""Channels of a DAQ's own file, as [signals] of session.toml names them: CSV, MATLAB, HDF5 and TDMS.

A channel is named as its reader names it: a CSV file's column, a MATLAB variable (`a/b` within a
structure), an HDF5 data set's path, and `group/channel` of TDMS. Values are scale · raw + offset.
"""

import importlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.base.errors import BadInput
from bench.base.input_problems import refused_as_bad_input
from bench.base.numbers import first_names
from bench.base.text_files import check_size
from bench.session import manifest
from bench.session.file_names import SESSION_TOML
from bench.session.manifest import ChannelKeys
from bench.session.strict_toml import values
from bench.session.table import NumberTable, column_names, read_table
from vision.calibration import load_matlab

_TIME = "time_s"
_FRAME = "frame_V"
# [bytes] No larger file is read at once.
_MOST_BYTES = 1 << 31
# [names] Most in one line.
_MOST_LISTED = 8
# Errors of h5py on a damaged file.
NOT_HDF5 = (OSError, KeyError, TypeError, ValueError, IndexError, RuntimeError, MemoryError)
# Errors of npTDMS on a damaged file.
_NOT_TDMS = (ValueError, OSError, KeyError, EOFError, IndexError)


@dataclass(frozen=True)
class DaqFile:
    """The file that a DAQ leaves in each trial's folder.

    file: its name. rate_Hz: where it holds no times. channels: by column of signals.csv.
    """

    file: str
    rate_Hz: float | None
    channels: dict[str, ChannelKeys]


def daq_file(keys: manifest.SignalKeys | None) -> DaqFile | None:
    """Return the file of [signals] of session.toml; None without that table.

    Raises BadInput for a file that is not in the trial's folder, or of no known kind.
    """
    if keys is None:
        return None
    name = Path(keys.file)
    if name.name != keys.file or keys.file in ("", ".", ".."):
        fix = "must be the name of a file in each trial's folder"
        raise BadInput(f"[signals] file {keys.file!r} {fix}", file=SESSION_TOML)
    if name.suffix.lower() not in _READERS:
        known = f"is of no kind that is read; these are: {', '.join(_READERS)}"
        raise BadInput(f"[signals] file {keys.file!r} {known}", file=SESSION_TOML)
    channels = {}
    for column, channel in values(keys, leave_out=("file", "rate_Hz")).items():
        if channel is not None:
            channels[column] = channel
    return DaqFile(keys.file, keys.rate_Hz, channels)


def read_daq(path: Path, daq: DaqFile, label: str) -> NumberTable:
    """Read the columns of [signals], and time_s; frame_V is left to `frame_edges`.

    Raises BadInput where a channel is not there, is no series of finite numbers, or lengths differ.
    """
    channels = {name: one for name, one in daq.channels.items() if name != _FRAME}
    columns = dict(zip(channels, _read(path, list(channels.values()), label)))
    lengths = {len(column) for column in columns.values()}
    if len(lengths) != 1:
        found = ", ".join(f"{name} {len(column)}" for name, column in columns.items()) or "none"
        raise BadInput(f"channels must have one length; found {found}", file=label)
    count = lengths.pop()
    if _TIME not in columns:
        if daq.rate_Hz is None:
            found = "[signals] has neither a time_s channel nor rate_Hz"
            raise BadInput(found, file=SESSION_TOML)
        columns = {_TIME: np.arange(count) / daq.rate_Hz} | columns
    return NumberTable(columns, np.arange(1, count + 1))


def frame_edges(path: Path, daq: DaqFile, time_s: np.ndarray, label: str) -> np.ndarray:
    """Return the times (n,) at which the camera's channel rises through the middle of its range.

    Times are interpolated between samples. Raises BadInput where the channel has other samples than
    the rest.
    """
    channel = daq.channels[_FRAME]
    (level,) = _read(path, [channel], label)
    if len(level) != len(time_s):
        found = f"channel {channel.channel} has {len(level)} samples, the others {len(time_s)}"
        raise BadInput(found, file=label)
    middle = 0.5 * (level.min() + level.max())
    k = np.flatnonzero((level[:-1] < middle) & (level[1:] >= middle))
    share = (middle - level[k]) / (level[k + 1] - level[k])
    return time_s[k] + share * (time_s[k + 1] - time_s[k])


def _read(path: Path, channels: list[ChannelKeys], label: str) -> list[np.ndarray]:
    """Read the values (n,) of channels."""
    check_size(path, _MOST_BYTES, "record in several trials", label)
    reader = _READERS[path.suffix.lower()]
    raw = reader(path, [channel.channel for channel in channels], label)
    return [_scaled(series, channel, label) for series, channel in zip(raw, channels)]


def _scaled(series: Any, channel: ChannelKeys, label: str) -> np.ndarray:
    """Return the values (n,) of a raw series. Raise BadInput where it is none of finite numbers."""
    name = f"channel {channel.channel}"
    try:
        raw = np.squeeze(np.asarray(series, dtype=float))
    except (TypeError, ValueError):
        raise BadInput(f"{name} holds no numbers", file=label) from None
    if raw.ndim != 1 or len(raw) < 2:
        raise BadInput(f"{name} is no series: its shape is {raw.shape}", file=label)
    bad = np.flatnonzero(~np.isfinite(raw))
    if len(bad):
        raise BadInput(f"{name} is not a finite number", file=label, row=int(bad[0]) + 1)
    return channel.scale * raw + channel.offset


def _no_channel(name: str, names: Iterable[str], label: str) -> BadInput:
    """Return the error of a channel that is not among the names of a file."""
    found = f"has no channel {name}; it has {first_names(names, _MOST_LISTED)}"
    return BadInput(found, file=label)


def _csv(path: Path, names: list[str], label: str) -> list:
    """Read raw series of a CSV file."""
    columns = column_names(path, label)
    for name in names:
        if name not in columns:
            raise _no_channel(name, columns, label)
    table = read_table(path, label, only=names)
    return [table[name] for name in names]


def _mat(path: Path, names: list[str], label: str) -> list:
    """Read raw series of a MATLAB file."""
    try:
        with refused_as_bad_input(label):
            content = load_matlab(path)
    except NotImplementedError:  # version 7.3 is HDF5
        return _hdf5(path, names, label)
    return [_variable(content, name, label) for name in names]


def _variable(content: dict, name: str, label: str) -> Any:
    """Return the variable `a/b` of a MATLAB file. Raise BadInput where there is none."""
    found = content
    for part in name.split("/"):
        fields = found if isinstance(found, dict) else {}
        if part not in fields:
            named = [field for field in fields if not field.startswith("__")]
            raise _no_channel(name, named, label)
        found = fields[part]
    return found


def _hdf5(path: Path, names: list[str], label: str) -> list:
    """Read raw series of an HDF5 file."""
    h5py = optional_library("h5py", "hdf5", label)
    try:
        with h5py.File(path, "r") as file:
            for name in names:
                if not isinstance(file.get(name), h5py.Dataset):
                    raise _no_channel(name, file, label)
            return [file[name][()] for name in names]
    except NOT_HDF5 as problem:
        raise BadInput(f"cannot be read as HDF5 ({problem})", file=label) from None


def _tdms(path: Path, names: list[str], label: str) -> list:
    """Read raw series of a TDMS file."""
    nptdms = optional_library("nptdms", "tdms", label)
    try:
        file = nptdms.TdmsFile.read(path)
    except _NOT_TDMS as problem:
        raise BadInput(f"cannot be read as TDMS ({problem})", file=label) from None
    channels = {}
    for group in file.groups():
        for channel in group.channels():
            channels[f"{group.name}/{channel.name}"] = channel
    for name in names:
        if name not in channels:
            raise _no_channel(name, channels, label)
    return [channels[name][:] for name in names]


def optional_library(module: str, extra: str, label: str) -> Any:
    """Import a library that not everybody needs. Raise BadInput where it is not installed."""
    try:
        return importlib.import_module(module)
    except ImportError:
        fix = f"needs {module}: pip install 'whisker-bench[{extra}]'"
        raise BadInput(fix, file=label) from None


_READERS: dict[str, Callable[[Path, list[str], str], list]] = {
    ".csv": _csv,
    ".mat": _mat,
    ".h5": _hdf5,
    ".hdf5": _hdf5,
    ".tdms": _tdms,
}
