"""A rig and what is to be recorded on it, as a TOML file describes them."""

import hashlib
import itertools
from collections import Counter
from pathlib import Path
from typing import Annotated

import msgspec

from bench.base.errors import BadInput
from bench.base.toml_text import in_toml_words, read_toml, what_and_where
from bench.rig.built_in import FOLDER, protocol_names
from bench.rig.feasible import check_protocol
from bench.rig.protocol_tables import (
    BoardTable,
    CameraTable,
    ColumnTable,
    FrictionTable,
    GaugesTable,
    LightTable,
    LoadCellTable,
    MicrophoneTable,
    MotorTable,
    PicturesTable,
    Positive,
    ProtocolTable,
    TrialTable,
    WhiskerTable,
)

# Keys of session.toml that no protocol has.
_OF_SESSIONS = ("format", "rig")


class Protocol(ProtocolTable, kw_only=True):
    """A session to be simulated.

    load_cell, microphone: without them there are no channels of theirs. columns: of an array; without any there is
    one whisker at the origin.
    """

    name: str = "synthetic"
    whisker: WhiskerTable = WhiskerTable()
    bar_diameter_mm: Positive = 6.0
    board: BoardTable = BoardTable()
    cameras: list[CameraTable] = msgspec.field(default_factory=list)
    light: LightTable = LightTable()
    pictures: PicturesTable = PicturesTable()
    motor: MotorTable = MotorTable()
    friction: FrictionTable = FrictionTable()
    gauges: GaugesTable = GaugesTable()
    load_cell: LoadCellTable | msgspec.UnsetType = msgspec.UNSET
    microphone: MicrophoneTable | msgspec.UnsetType = msgspec.UNSET
    # The session's truth is a stage's: it states distance and slope as wanted, their scatter as sigma
    stage: bool | msgspec.UnsetType = msgspec.UNSET
    columns: list[ColumnTable] | msgspec.UnsetType = msgspec.UNSET
    trials: Annotated[list[TrialTable], msgspec.Meta(min_length=1)]

    def runs(self) -> list["ProtocolRun"]:
        """Return the trials one by one, their names numbered where several are alike."""
        runs = []
        for table in self.trials:
            runs += _table_runs(table, self)
        totals = Counter((run.name, run.rotation) for run in runs)
        counts = Counter()
        named = []
        for run in runs:
            alike = (run.name, run.rotation)
            counts[alike] += 1
            number = f"_{counts[alike]}" if totals[alike] > 1 else ""
            contact = run.name + number
            rotation = f"_r{run.rotation}" if run.table.rotations else ""
            named.append(msgspec.structs.replace(run, contact=contact, name=contact + rotation))
        return named

    def fingerprint(self) -> str:
        """Return a hash that changes with any value."""
        return hashlib.sha256(msgspec.json.encode(self)).hexdigest()


class ProtocolRun(msgspec.Struct, frozen=True):
    """One trial of a protocol. The motor goes from `before_deg` before touch to `after_deg` after it.

    rotation: its number among the rotations against one object. contact: the name that these share.
    plane_turn_deg: how far the plane of rotation is turned about the whisker, against which beta_deg is
    the object's slope.
    """

    name: str
    beta_deg: float
    psi_deg: float
    d_x_mm: float
    speed_deg_s: float
    before_deg: float
    after_deg: float
    table: TrialTable
    protocol: Protocol
    rotation: int = 1
    contact: str = ""
    plane_turn_deg: float = 0.0

    @property
    def goes_back(self) -> bool:
        """Return whether its recording holds back strokes."""
        return (
            self.table.whisks > 1
            or bool(self.table.both_ways)
            or self.protocol.motor.back_stroke
            or self.protocol.pictures.back_stroke
        )

    def turned(self, plane_turn_deg: float) -> "ProtocolRun":
        """Return the run with its plane of rotation turned about the whisker."""
        beta_deg = self.beta_deg - plane_turn_deg
        return msgspec.structs.replace(self, beta_deg=beta_deg, plane_turn_deg=plane_turn_deg)


def _table_runs(table, protocol) -> list[ProtocolRun]:
    """Return the trials of one table of a protocol."""
    motor = protocol.motor
    before_deg = table.before_deg or motor.before_deg
    after_deg = table.after_deg or motor.after_deg
    values = [table.speed_deg_s, table.beta_deg, table.psi_deg, table.d_x_mm]
    lists = [value if isinstance(value, list) else [value] for value in values]
    runs = []
    for speed, beta, psi, d_x, _ in itertools.product(*lists, range(table.repeats)):
        name = _run_name(table, speed, beta, psi)
        run = ProtocolRun(name, beta, psi, d_x, speed, before_deg, after_deg, table, protocol)
        rotations = range(1, (table.rotations or 1) + 1)
        runs += [msgspec.structs.replace(run, rotation=rotation) for rotation in rotations]
    return runs


def _run_name(table, speed_deg_s, beta_deg, psi_deg) -> str:
    """Return the name of a table's trial, by roll for the gauges, else by slope, tilt and speed."""
    if table.purpose == "gauge":
        return (table.name or "gauge") + f"_roll{table.follicle_roll_deg:g}"
    tilt = f"_psi{psi_deg:g}" if psi_deg else ""
    return (table.name or table.surface) + f"_b{beta_deg:02g}{tilt}_v{speed_deg_s:g}"


def load(protocol: str | Path) -> Protocol:
    """Load a protocol by its name ("quick", "paper") or from a file.

    Raises BadInput in one line where it is not one.
    """
    path = FOLDER / f"{protocol}.toml"
    if isinstance(protocol, Path) or not path.is_file():
        path = Path(protocol)
    if not path.exists():
        built_in = f"the built-in protocols are {protocol_names()}"
        raise BadInput(f"there is no such file; {built_in}", file=path)
    tables = read_toml(path, str(path))
    if tables.keys() & set(_OF_SESSIONS):
        raise BadInput(
            f"is a session's file, no protocol of a rig; the built-in ones are {protocol_names()}",
            file=path,
        )
    try:
        found = msgspec.convert(tables, Protocol)
    except msgspec.ValidationError as problem:
        what, place = what_and_where(str(problem))
        key = f"{place}: " if place else ""
        raise BadInput(key + in_toml_words(what), file=path) from None
    check_protocol(found, path)
    return found
