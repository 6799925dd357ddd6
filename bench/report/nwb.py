"""`evaluate --nwb FILE`: an evaluated run as Neurodata Without Borders, for archives: signals, tables, tracks.

NWB has one clock for a file, a recording here one a trial: times of each trial are its own, and every series and table
says so. Its start is the time at which the first signals were stored, for no manifest states another.
"""

import json
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from bench.base.atomic import whole_file
from bench.base.errors import BadInput
from bench.base.results import hash_of
from bench.base.tables import Table
from bench.records.plain import to_plain
from bench.report.record import read_record
from bench.report.run_facts import RunRecord
from bench.report.whisk_tables import ESTIMATES, TRACK, WHISKS
from bench.session.inside import check_outside
from bench.session.session import Session, load_session
from bench.session.signals import read_signals

_TABLES = {
    WHISKS: "a row a whisk: truth by the cameras and moments by the gauges",
    ESTIMATES: "a row a whisk and estimator: distance and error",
}
_OWN_CLOCK = "times are those of the trial's own clock"
_UNITS = {"deg": "degrees", "mm": "mm", "Nmm": "N mm", "s": "s", "percent": "%"}


def check_nwb(path: Path, session: Path) -> None:
    """Before anything is evaluated. Raises BadInput where such a file cannot be written."""
    if path.suffix != ".nwb":
        raise BadInput(f"--nwb {path} must end in .nwb")
    check_outside(path, session, "--nwb")
    load_session(session, lenses_known=True, follow_links=True)
    try:
        import pynwb
    except ImportError:
        raise BadInput("--nwb needs pynwb: pip install 'whisker-bench[nwb]'") from None
    assert pynwb


def write_nwb(path: Path, out: Path, session: Path) -> None:
    """The run in `out` with its session's signals, whole. Raises BadInput where one of them is not there."""
    from pynwb import NWBHDF5IO

    record = read_record(out)
    recorded = load_session(session, lenses_known=True, follow_links=record.settings.follow_links)
    file = _file(record, recorded, out)
    with whole_file(path) as temporary, NWBHDF5IO(str(temporary), "w") as io:
        io.write(file)


def _file(record: RunRecord, session: Session, out: Path):
    from pynwb import NWBFile

    first = min(
        (session.trial(name).signals_path.stat().st_mtime for name in record.recordings),
        default=0.0,
    )
    file = NWBFile(
        session_description=f"{record.session}: {' '.join(record.verdict)}",
        identifier=hash_of(record.results),
        session_start_time=datetime.fromtimestamp(first, UTC),
        experiment_description=(out / "methods.md").read_text(encoding="utf-8"),
        notes=json.dumps(
            {"settings": to_plain(record.settings), "versions": record.versions}, sort_keys=True
        ),
        keywords=["whisker", "contact distance", "ground truth"],
    )
    for name in record.recordings:
        for series in _series(session, name):
            file.add_acquisition(series)
    module = file.create_processing_module(
        "whisker_bench", "truth, estimates and tracks of every whisk"
    )
    for table, what in _TABLES.items():
        module.add(_table(table.name, what, table, out / table.file))
    for name in record.recordings:
        module.add(
            _table(
                f"track_{name}",
                f"a row a frame of {name}; {_OWN_CLOCK}",
                TRACK,
                out / "track" / f"{name}.csv",
            )
        )
    return file


def _series(session: Session, name: str) -> Iterator:
    from pynwb import TimeSeries

    signals = read_signals(session.trial(name))
    unit, columns = ("volts", "y_V, z_V") if signals.kind == "V" else ("N mm", "m_y_Nmm, m_z_Nmm")
    motor = TimeSeries(
        name=f"{name}_motor",
        data=np.degrees(signals.motor_rad),
        unit="degrees",
        timestamps=signals.time_s,
        description=f"angle of the motor; {_OWN_CLOCK}",
    )
    yield motor
    yield TimeSeries(
        name=f"{name}_gauges",
        data=np.column_stack([signals.y, signals.z]),
        unit=unit,
        timestamps=motor,
        description=f"{columns}; {_OWN_CLOCK}",
    )


def _table(name: str, what: str, table: Table, path: Path):
    """Return a CSV file of the run as a table; missing numbers are NaN, missing words empty."""
    from hdmf.common import DynamicTable, VectorData

    rows = table.read_file(path)
    columns = [
        VectorData(name=column, description=_said(column), data=rows[column].tolist())
        for column in rows.dtype.names
    ]
    return DynamicTable(name=name, description=what, columns=columns)


def _said(column: str) -> str:
    unit = _UNITS.get(column.rpartition("_")[2])
    return f"{column}, see docs/formats.md" + (f"; in {unit}" if unit else "")
