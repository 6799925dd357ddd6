"""Channels of a DAQ's own file, as [signals] of session.toml names them: CSV, MATLAB, HDF5 and TDMS.

A channel is named as its reader names it: a CSV file's column, a MATLAB variable (`a/b` within a structure), an HDF5
data set's path, and `group/channel` of TDMS. Values are scale · raw + offset.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.session import manifest
from bench.session.strict_toml import values
from bench.session.table import NumberTable, column_names, read_table

_TIME, _FRAME = "time_s", "frame_V"
_MOST_BYTES = 1 << 31  # bytes: no larger file is read at once
_MOST_LISTED = 8  # names in one line


@dataclass(frozen=True)
class Channel:
    """A channel of the file, and how its raw values become those of a column."""

    channel: str
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class DaqFile:
    """Name of the file in each trial's folder, its rate where it holds no times, and its channels by column."""

    file: str
    rate_Hz: float | None
    channels: dict[str, Channel]


def daq_file(keys: manifest.SignalKeys | None, shown: str) -> DaqFile | None:
    """[signals] of session.toml. Raises BadInput for a file that is not in the trial's folder, or of no known kind."""
    if keys is None:
        return None
    if Path(keys.file).name != keys.file or keys.file in ("", ".", ".."):
        raise BadInput(
            f"[signals] file {keys.file!r} must be the name of a file in each trial's folder",
            file=shown,
        )
    if Path(keys.file).suffix.lower() not in _READERS:
        known = ", ".join(_READERS)
        raise BadInput(
            f"[signals] file {keys.file!r} is of no kind that is read; these are: {known}",
            file=shown,
        )
    named = values(keys, leave_out=("file", "rate_Hz"))
    channels = {name: Channel(**values(one)) for name, one in named.items() if one is not None}
    return DaqFile(keys.file, keys.rate_Hz, channels)


def read_daq(path: Path, daq: DaqFile, shown: str) -> NumberTable:
    """Columns of the file by their names in [signals], and time_s; frame_V is left to `frame_edges`.

    Raises BadInput where a channel is not there, is no series of finite numbers, or lengths differ.
    """
    names = [name for name in daq.channels if name != _FRAME]
    raw = _read(path, [daq.channels[name].channel for name in names], shown)
    columns = {name: _scaled(series, daq.channels[name], shown) for name, series in zip(names, raw)}
    lengths = {len(column) for column in columns.values()}
    if len(lengths) != 1:
        found = ", ".join(f"{name} {len(column)}" for name, column in columns.items()) or "none"
        raise BadInput(f"channels must have one length; found {found}", file=shown)
    count = lengths.pop()
    if _TIME not in columns:
        if daq.rate_Hz is None:
            raise BadInput(
                "[signals] has neither a time_s channel nor rate_Hz", file="session.toml"
            )
        columns = {_TIME: np.arange(count) / daq.rate_Hz} | columns
    return NumberTable(columns, np.arange(1, count + 1))


def frame_edges(path: Path, daq: DaqFile, time_s: np.ndarray, shown: str) -> np.ndarray:
    """Times at which the camera's channel rises through the middle of its range, (n,), between samples. Raises BadInput
    where it has other samples than the rest."""
    channel = daq.channels[_FRAME]
    level = _scaled(_read(path, [channel.channel], shown)[0], channel, shown)
    if len(level) != len(time_s):
        raise BadInput(
            f"channel {channel.channel} has {len(level)} samples, the others {len(time_s)}",
            file=shown,
        )
    middle = 0.5 * (level.min() + level.max())
    k = np.flatnonzero((level[:-1] < middle) & (level[1:] >= middle))
    share = (middle - level[k]) / (level[k + 1] - level[k])
    return time_s[k] + share * (time_s[k + 1] - time_s[k])


def _scaled(series, channel: Channel, shown: str) -> np.ndarray:
    try:
        raw = np.asarray(series, dtype=float)
    except (TypeError, ValueError):
        raise BadInput(f"channel {channel.channel} holds no numbers", file=shown) from None
    raw = np.squeeze(raw)
    if raw.ndim != 1 or len(raw) < 2:
        raise BadInput(
            f"channel {channel.channel} is no series: its shape is {raw.shape}", file=shown
        )
    bad = np.flatnonzero(~np.isfinite(raw))
    if len(bad):
        raise BadInput(
            f"channel {channel.channel} is not a finite number", file=shown, row=int(bad[0]) + 1
        )
    return channel.scale * raw + channel.offset


def _read(path: Path, names: list[str], shown: str) -> list:
    """Raw series by the file's own names."""
    if path.stat().st_size > _MOST_BYTES:
        raise BadInput(
            f"has more than {_MOST_BYTES >> 20} MB; record in several trials", file=shown
        )
    return _READERS[path.suffix.lower()](path, names, shown)


def _missing(name: str, there, shown: str) -> BadInput:
    listed = list(there)
    more = ", …" if len(listed) > _MOST_LISTED else ""
    return BadInput(
        f"has no channel {name}; it has {', '.join(listed[:_MOST_LISTED]) or 'none'}{more}",
        file=shown,
    )


def _csv(path: Path, names: list[str], shown: str) -> list:
    there = column_names(path, shown)
    for name in names:
        if name not in there:
            raise _missing(name, there, shown)
    table = read_table(path, shown, only=names)
    return [table[name] for name in names]


def _mat(path: Path, names: list[str], shown: str) -> list:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:  # version 7.3 is HDF5
        return _hdf5(path, names, shown)
    except (
        MatReadError,
        ValueError,
        TypeError,
        KeyError,
        OSError,
        EOFError,
        OverflowError,
        MemoryError,
    ) as problem:
        raise BadInput(f"cannot be read as a MATLAB file ({problem})", file=shown) from None
    return [_within(content, name, shown) for name in names]


def _within(content: dict, name: str, shown: str):
    found = content
    for part in name.split("/"):
        if not isinstance(found, dict) or part not in found:
            there = (
                [key for key in found if not key.startswith("__")]
                if isinstance(found, dict)
                else []
            )
            raise _missing(name, there, shown)
        found = found[part]
    return found


def _hdf5(path: Path, names: list[str], shown: str) -> list:
    h5py = _extra("h5py", "hdf5", shown)
    try:
        with h5py.File(path, "r") as file:
            for name in names:
                if not isinstance(file.get(name), h5py.Dataset):
                    raise _missing(name, file, shown)
            return [file[name][()] for name in names]
    except OSError as problem:
        raise BadInput(f"cannot be read as HDF5 ({problem})", file=shown) from None


def _tdms(path: Path, names: list[str], shown: str) -> list:
    nptdms = _extra("nptdms", "tdms", shown)
    try:
        file = nptdms.TdmsFile.read(path)
    except (ValueError, OSError, KeyError, EOFError, IndexError) as problem:
        raise BadInput(f"cannot be read as TDMS ({problem})", file=shown) from None
    there = {
        f"{group.name}/{channel.name}": channel
        for group in file.groups()
        for channel in group.channels()
    }
    for name in names:
        if name not in there:
            raise _missing(name, there, shown)
    return [there[name][:] for name in names]


def _extra(module: str, extra: str, shown: str):
    try:
        return importlib.import_module(module)
    except ImportError:
        raise BadInput(
            f"needs {module}: pip install 'whisker-bench[{extra}]'", file=shown
        ) from None


_READERS: dict[str, Callable[[Path, list[str], str], list]] = {
    ".csv": _csv,
    ".mat": _mat,
    ".h5": _hdf5,
    ".hdf5": _hdf5,
    ".tdms": _tdms,
}
