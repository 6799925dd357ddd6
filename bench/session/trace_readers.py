"""Files in which trackers leave their lines: one reader a kind, all to the same points.

Pixel centres are integers, the first picture is frame 0, u to the right, v down. Files are read by
their published layout; a pickled part of a DeepLabCut table is read as names alone, no object of
it is made.
"""

import csv
import io
import json
import pickle
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.base.errors import BadInput
from bench.base.input_problems import refused_as_bad_input
from bench.base.text_files import check_size, read_text
from bench.session.daq import NOT_HDF5, optional_library
from bench.session.table import read_table, require_columns
from bench.session.trace_files import KINDS
from vision.calibration import load_matlab

# [bytes] No larger file is read at once.
_MOST_BYTES = 1 << 31
# [1] A joint of DeepLabCut that is less likely counts as not seen: its own default (pcutoff).
_LEAST_LIKELIHOOD = 0.6
_DEEPLABCUT_AXES = ("x", "y", "likelihood")  # names of a joint's columns
# [points] Along a curve of WhiskerMan, given by three or four control points. Stated.
_CURVE_POINTS = 60
# Errors of Python's reader of pickles on a damaged one.
_NOT_PICKLED = (
    pickle.UnpicklingError,
    AttributeError,
    EOFError,
    IndexError,
    KeyError,
    MemoryError,
    OverflowError,
    TypeError,
    ValueError,
)
# [1] Numbers of lines are whole, and no tracker knows as many again. Stated.
_MOST_LINES = 1e6
# [px] SLEAP before format 1.1 counts from the corner of the first pixel. Stated by SLEAP.
_SLEAP_CORNER_PX = 0.5
# [version] Of SLEAP's files, from which it counts from the centre. Stated by SLEAP.
_SLEAP_CENTRED = 1.1
# Names of joints that are on the touched object and not on the wire: bar_top, object_2, bar1.
_ON_OBJECT = re.compile(r"(bar|object)([_\d]|$)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class DrawnLines:
    """Points of a tracker's lines in one camera's pictures.

    frame (n,): as the file numbers pictures. px (n, 2). line (n,): number of the line that a point
    is of; has_identity: it is the same in all frames. sigma_px (n,): NaN where not stated. on_object (n,)
    bool: which are joints of the touched object by their names; None where joints have no names.
    """

    frame: np.ndarray
    px: np.ndarray
    line: np.ndarray
    sigma_px: np.ndarray
    has_identity: bool = True
    on_object: np.ndarray | None = None

    @classmethod
    def of_joints(cls, frame: np.ndarray, px: np.ndarray, names: Sequence[str]) -> "DrawnLines":
        """Return the lines of joints (frames, lines, joints, 2) that a file gives by frame (frames,).

        Joints that are not seen are NaN. names: of the joints. Those of the object are one line.
        """
        frames, lines, joints, _ = px.shape
        in_frame = np.repeat(frame, lines * joints)
        line = np.tile(np.repeat(np.arange(lines), joints), frames)
        on_object = np.tile(named_for_object(names), frames * lines)
        line[on_object] = 0
        flat_px = px.reshape(-1, 2)
        is_seen = np.all(np.isfinite(flat_px), axis=1)
        unknown = np.full(int(is_seen.sum()), np.nan)
        return cls(
            in_frame[is_seen],
            flat_px[is_seen],
            line[is_seen],
            unknown,
            on_object=on_object[is_seen],
        )

    @property
    def of_wire(self) -> "DrawnLines":
        """Return the points that are not of the object."""
        return self if self.on_object is None else self._only(~self.on_object)

    @property
    def of_object(self) -> "DrawnLines":
        """Return the joints that are named for the object."""
        nothing = np.zeros(len(self.frame), dtype=bool)
        return self._only(nothing if self.on_object is None else self.on_object)

    def _only(self, kept: np.ndarray) -> "DrawnLines":
        """Return some of the points, kept (n,) bool."""
        frame = self.frame[kept]
        return DrawnLines(
            frame, self.px[kept], self.line[kept], self.sigma_px[kept], self.has_identity
        )


def named_for_object(names: Sequence[str]) -> np.ndarray:
    """Return which joints (n,) bool are of the touched object by their names."""
    return np.array([_ON_OBJECT.match(name) is not None for name in names], dtype=bool)


def read_lines(path: Path, label: str) -> DrawnLines:
    """Read a tracker's file by its suffix. Raises BadInput where it cannot be read."""
    check_size(path, _MOST_BYTES, "track in several trials", label)
    return _READERS[KINDS[path.suffix.lower()]](path, label)


def _own_or_deeplabcut(path: Path, label: str) -> DrawnLines:
    """Read frame,u_px,v_px with sigma_px and line where they are there, or DeepLabCut's table."""
    with path.open("rb") as file:
        is_deeplabcut = file.readline(64).lstrip(b"\xef\xbb\xbf").startswith(b"scorer")
    if is_deeplabcut:
        return _deeplabcut_text(path, label)
    names = ("frame", "u_px", "v_px")
    table = read_table(path, label)
    require_columns(table, names, label)
    extra = set(table.columns) - {*names, "sigma_px", "line"}
    if extra:
        found = f"column {min(extra)!r} is none of frame,u_px,v_px,sigma_px,line"
        raise BadInput(found, file=label, row=1)
    unknown = np.full(len(table), np.nan)
    sigma_px = table.columns.get("sigma_px", unknown)
    _check_sigmas(sigma_px, table.row, label)
    line = table.columns.get("line", np.zeros(len(table)))
    _check_lines(line, table.row, label)
    px = np.stack([table["u_px"], table["v_px"]], axis=1)
    return DrawnLines(table["frame"], px, line.astype(int), sigma_px)


def _check_sigmas(sigma_px: np.ndarray, row: np.ndarray, label: str) -> None:
    """Raise BadInput for the first standard deviation (n,) that is not positive, naming its row."""
    bad = np.flatnonzero(sigma_px <= 0.0)
    if len(bad):
        found = f"{sigma_px[bad[0]]:g} is no standard deviation; leave the column out if unknown"
        raise BadInput(found, file=label, row=int(row[bad[0]]), column="sigma_px")


def _check_lines(line: np.ndarray, row: np.ndarray, label: str) -> None:
    """Raise BadInput for the first number of a line (n,) that is none, naming its row."""
    bad = np.flatnonzero((line != np.round(line)) | (np.abs(line) > _MOST_LINES))
    if len(bad):
        found = f"{line[bad[0]]:g} is no number of a line: a whole number, the same in all frames"
        raise BadInput(found, file=label, row=int(row[bad[0]]), column="line")


def _deeplabcut_text(path: Path, label: str) -> DrawnLines:
    """Read DeepLabCut's CSV: rows of names above each column, then a row a frame."""
    rows = list(csv.reader(io.StringIO(read_text(path, "export it as CSV, UTF-8", label))))
    heads = _pop_heads(rows, label)
    first = next((k for k, name in enumerate(heads["coords"]) if name in ("x", "y")), 1)
    names = _deeplabcut_names(heads, first)
    frames = []
    values = []
    for row, cells in enumerate(rows, start=len(heads) + 1):
        if not any(cells):
            continue
        values.append(numbers_with_gaps(cells[first:], len(names), row, label))
        try:
            frames.append(_picture_number(cells[first - 1]))
        except ValueError:
            raise BadInput("names no frame", file=label, row=row) from None
    if not frames:
        raise BadInput("has rows of names and no row of a frame", file=label)
    return _joints_by_name(np.array(frames), np.array(values), names, label)


def _pop_heads(rows: list[list[str]], label: str) -> dict[str, list[str]]:
    """Take the rows of names off the table; return them by their first cell. Raises BadInput where they lack."""
    heads: dict[str, list[str]] = {}
    while rows and rows[0] and rows[0][0] in ("scorer", "individuals", "bodyparts", "coords"):
        head = rows.pop(0)
        heads[head[0]] = head
    if "bodyparts" not in heads or "coords" not in heads:
        raise BadInput("has no rows bodyparts and coords, as DeepLabCut writes them", file=label)
    lengths = [len(head) for head in heads.values()]
    if len(set(lengths)) > 1:
        found = f"rows {', '.join(heads)} name {', '.join(map(str, lengths))} columns"
        raise BadInput(f"{found}; each names all", file=label)
    return heads


def _deeplabcut_names(heads: Mapping[str, Sequence[str]], first: int) -> list[tuple[str, str, str]]:
    """Return individual, joint and coordinate of each column from `first` on."""
    names = []
    for k in range(first, len(heads["coords"])):
        individual = heads["individuals"][k] if "individuals" in heads else ""
        names.append((individual, heads["bodyparts"][k], heads["coords"][k]))
    return names


def numbers_with_gaps(cells: Sequence[str], count: int, row: int, label: str) -> list[float]:
    """Return the numbers of a row, NaN where a cell is empty. Raise BadInput where it has others."""
    if len(cells) != count:
        found = f"has {len(cells)} numbers, the header names {count}"
        raise BadInput(found, file=label, row=row)
    try:
        numbers = [float(cell) if cell.strip() else np.nan for cell in cells]
    except ValueError:
        raise BadInput("holds a cell that is no number", file=label, row=row) from None
    if np.any(np.isinf(numbers)):
        raise BadInput("holds a number without end", file=label, row=row)
    return numbers


def _picture_number(index: str | bytes | float) -> float:
    """Return the frame of an index: a number, or a picture's name such as img0012.png.

    Raises ValueError where it has no digits.
    """
    if isinstance(index, bytes):
        index = index.decode()
    if not isinstance(index, str):
        return float(index)
    try:
        return float(index)
    except ValueError:
        stem = index.replace("\\", "/").rpartition("/")[2].rpartition(".")[0]
        return float("".join(letter for letter in stem if letter.isdigit()))


def _joints_by_name(
    frame: np.ndarray, values: np.ndarray, names: Sequence[tuple[str, str, str]], label: str
) -> DrawnLines:
    """Return the lines of DeepLabCut's columns (frames, columns), an individual a line.

    names: individual, joint and coordinate of each column. Unlikely joints are not seen.
    """
    column = {name: k for k, name in enumerate(names)}
    lines = list(dict.fromkeys(name[0] for name in names))
    joints = list(dict.fromkeys(name[1] for name in names))
    px = np.full((len(frame), len(lines), len(joints), 2), np.nan)
    for i, line in enumerate(lines):
        for j, joint in enumerate(joints):
            of_joint = [column.get((line, joint, axis)) for axis in _DEEPLABCUT_AXES]
            if None not in of_joint[:2]:
                px[:, i, j] = _probable_px(values, *of_joint)
    if not np.any(np.isfinite(px)):
        raise BadInput(f"holds no joint with a likelihood of {_LEAST_LIKELIHOOD:g}", file=label)
    return DrawnLines.of_joints(frame, px, joints)


def _probable_px(values: np.ndarray, u: int, v: int, likelihood: int | None) -> np.ndarray:
    """Return a joint's points (frames, 2), px, by the numbers of its columns; NaN where it is unlikely."""
    px = values[:, [u, v]]
    if likelihood is not None:
        px[values[:, likelihood] < _LEAST_LIKELIHOOD] = np.nan
    return px


def _hdf5(path: Path, label: str) -> DrawnLines:
    """Read DeepLabCut's or SLEAP's HDF5 file."""
    h5py = optional_library("h5py", "hdf5", label)
    try:
        with h5py.File(path, "r") as file:
            if "tracks" in file and "node_names" in file:
                return _sleap_analysis(file)
            if "pred_points" in file and "instances" in file:
                return _sleap_labels(file)
            groups = [group for group in file.values() if isinstance(group, h5py.Group)]
            tables = [group["table"] for group in groups if "table" in group]
            if len(tables) == 1 and "values_block_0" in (tables[0].dtype.names or ()):
                return _deeplabcut_table(tables[0], label)
    except NOT_HDF5 as problem:
        raise BadInput(f"cannot be read ({problem})", file=label) from None
    raise BadInput("is neither a table of DeepLabCut nor an analysis of SLEAP", file=label)


def _sleap_analysis(file: Mapping) -> DrawnLines:
    """Read SLEAP's analysis file: tracks (tracks, 2, nodes, frames)."""
    tracks = file["tracks"][()]
    names = file["node_names"].asstr()[()].tolist()
    px = np.transpose(tracks, (3, 0, 2, 1))
    return DrawnLines.of_joints(np.arange(tracks.shape[3]), px, names)


def _sleap_labels(file: Mapping) -> DrawnLines:
    """Read SLEAP's project file: of each instance its frame, track and points."""
    points_px = {0: _sleap_px(file, "points"), 1: _sleap_px(file, "pred_points")}
    skeletons = [named_for_object(names) for names in _sleap_joints(file)]
    frame = []
    line = []
    px = []
    on_object = []
    instances = file["instances"][()]
    for instance, (in_frame, track) in zip(instances, _frames_and_tracks(file, instances)):
        joints_px = _joints_px(instance, points_px)
        is_seen = np.isfinite(joints_px[:, 0])
        is_of_object = skeletons[int(instance["skeleton"])][is_seen]
        frame += [in_frame] * len(is_of_object)
        line += np.where(is_of_object, 0, track).tolist()
        px += joints_px[is_seen].tolist()
        on_object += is_of_object.tolist()
    return DrawnLines(
        np.array(frame),
        np.array(px),
        np.array(line),
        np.full(len(frame), np.nan),
        on_object=np.array(on_object, dtype=bool),
    )


def _sleap_px(file: Mapping, table: str) -> np.ndarray:
    """Return the points (n, 2) in a table of SLEAP's project, px; NaN where they are not seen."""
    points = file[table][()]
    px = np.column_stack([points["x"], points["y"]]) - _sleap_corner_px(file)
    px[~points["visible"]] = np.nan
    return px


def _frames_and_tracks(file: Mapping, instances: Iterable[np.void]) -> Iterator[tuple[int, int]]:
    """Yield the frame and the track of each instance of SLEAP's project.

    Those that are on no track have −1, −2, … in their frame: each is a line of its own.
    """
    number_of = {int(row["frame_id"]): int(row["frame_idx"]) for row in file["frames"][()]}
    untracked: Counter[int] = Counter()
    for instance in instances:
        frame = number_of[int(instance["frame_id"])]
        track = int(instance["track"])
        if track < 0:
            untracked[frame] += 1
            track = -untracked[frame]
        yield frame, track


def _sleap_joints(file: Mapping) -> list[list[str]]:
    """Return of each skeleton of SLEAP's project the names of its joints, in the order of its points."""
    stated = json.loads(file["metadata"].attrs["json"])
    names = [node["name"] for node in stated["nodes"]]
    joints = []
    for skeleton in stated["skeletons"]:
        joints.append([names[node["id"]] for node in skeleton["nodes"]])
    return joints


def _joints_px(instance: np.void, points_px: Mapping[int, np.ndarray]) -> np.ndarray:
    """Return the joints (n, 2) of an instance of SLEAP's project, px. points_px: by the instance's type."""
    own = slice(int(instance["point_id_start"]), int(instance["point_id_end"]))
    return points_px[int(instance["instance_type"])][own]


def _sleap_corner_px(file: Mapping) -> float:
    """Return how far the centre of the first pixel is from where SLEAP's file counts from."""
    version = float(file["metadata"].attrs.get("format_id", 1.0))
    return _SLEAP_CORNER_PX if version < _SLEAP_CENTRED else 0.0


class _NamesAlone(pickle.Unpickler):
    """An unpickler of lists and tuples of texts, which makes no object of any other class."""

    def find_class(self, module: str, name: str) -> Any:
        """Raise UnpicklingError: names need no class."""
        raise pickle.UnpicklingError(f"{module}.{name} in a table of names")


def _deeplabcut_table(table: Any, label: str) -> DrawnLines:
    """Read DeepLabCut's HDF5 table, whose columns are named in an attribute."""
    try:
        pickled = io.BytesIO(bytes(table.attrs["values_block_0_kind"]))
        columns = [tuple(map(str, name)) for name in _NamesAlone(pickled).load()]
    except _NOT_PICKLED as problem:
        raise BadInput(f"names no columns as DeepLabCut does ({problem})", file=label) from None
    rows = table[()]
    frame = np.array([_picture_number(index) for index in rows["index"].tolist()])
    names = [(name[1] if len(name) > 3 else "", name[-2], name[-1]) for name in columns]
    return _joints_by_name(frame, rows["values_block_0"], names, label)


def _whisk(path: Path, label: str) -> DrawnLines:
    """Read whisk's .whiskers, with the identities of .measurements where that is in the same folder."""
    content = path.read_bytes()
    header = b"bwhiskbin1\0\0"
    if not content.startswith(header):
        raise BadInput("is no binary .whiskers file (convert it by whisker_convert)", file=label)
    segments = list(_whisk_segments(content, len(header), label))
    identities = _whisk_identities(path.with_suffix(".measurements"), label)
    frame = []
    line = []
    px = []
    for in_frame, number, points in segments:
        identity = number if identities is None else identities.get((in_frame, number), -1)
        if identity < 0:  # whisk knows it for no whisker: a line of its own
            identity = -1 - number
        frame.append(np.full(len(points), in_frame))
        line.append(np.full(len(points), identity))
        px.append(points)
    if not px:
        raise BadInput("holds no segment", file=label)
    joined = np.concatenate(px)
    return DrawnLines(
        np.concatenate(frame),
        joined,
        np.concatenate(line),
        np.full(len(joined), np.nan),
        has_identity=identities is not None,
    )


def _whisk_segments(
    content: bytes, start: int, label: str
) -> Iterator[tuple[int, int, np.ndarray]]:
    """Yield frame, number and points (n, 2) of each segment: three integers, then x, y, thickness
    and score of its points, little-endian; how many there are stands at the end.
    """
    count = int(np.frombuffer(content[-4:], "<i4")[0])
    for _ in range(count):
        head = content[start : start + 12]
        if len(head) < 12:
            raise BadInput(f"is cut short: it declares {count} segments", file=label)
        number, frame, length = np.frombuffer(head, "<i4").tolist()
        stop = start + 12 + 16 * length
        if length < 0 or stop > len(content) - 4:
            raise BadInput(f"is cut short: it declares {count} segments", file=label)
        columns = np.frombuffer(content[start + 12 : stop], "<f4").reshape(4, length)
        yield frame, number, columns[:2].T.astype(float)
        start = stop


def _whisk_identities(path: Path, label: str) -> dict[tuple[int, int], int] | None:
    """Return the identity of each segment by frame and number, as `classify` left it; None where
    there is no such file, or it was not classified.
    """
    if not path.is_file():
        return None
    found = read_measurements(path, label)
    is_classified = any(identity >= 0 for identity in found.values())
    return found if is_classified and len(set(found.values())) > 1 else None


def read_measurements(path: Path, label: str) -> dict[tuple[int, int], int]:
    """Read the identity of each segment by frame and number from Whisk's measurements. Raises BadInput."""
    content = path.read_bytes()
    row_bytes = {b"measv3\0\0": 41, b"measV1\0\0": 40}.get(content[:8])
    if row_bytes is None or len(content) < 16:
        raise BadInput(f"{path.name} beside it is no file of measurements", file=label)
    rows, measures = np.frombuffer(content[8:16], "<i4").tolist()
    stride = row_bytes + 16 * measures
    if min(rows, measures) < 0 or len(content) < 16 + rows * stride:
        raise BadInput(f"{path.name} beside it is cut short", file=label)
    found = {}
    for row in range(rows):
        start = 16 + row * stride
        _, frame, number, identity = np.frombuffer(content[start : start + 16], "<i4").tolist()
        found[frame, number] = identity
    return found


def _whiskerman(path: Path, label: str) -> DrawnLines:
    """Read WhiskerMan's .tr4: control points of a Bezier curve in each frame, of its view h.

    They count from 1 within its region of interest.
    """
    try:
        with refused_as_bad_input(label):
            content = load_matlab(path)
    except NotImplementedError:
        raise BadInput("is of MATLAB's version 7.3; save it with -v7", file=label) from None
    whiskers = content.get("whisker")
    if isinstance(whiskers, dict):
        whiskers = [whiskers]
    try:
        corner_px = np.array(content["roi"]["h"], dtype=float)[[0, 2]] - 2.0
        lines = [_bezier_curves(whisker, k) for k, whisker in enumerate(whiskers)]
    except (KeyError, TypeError, IndexError, ValueError):
        found = "has no whisker(k).r3all, whisker(k).tracked and roi.h, as WhiskerMan writes them"
        raise BadInput(found, file=label) from None
    frame = np.concatenate([frames for frames, _, _ in lines])
    px = np.concatenate([points for _, points, _ in lines]) + corner_px
    line = np.concatenate([numbers for _, _, numbers in lines])
    return DrawnLines(frame, px, line, np.full(len(frame), np.nan))


def _bezier_curves(whisker: Mapping, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return frames (n,), points (n, 2) and the number (n,) of the curves of one whisker."""
    from scipy.special import comb

    control = np.asarray(whisker["r3all"], dtype=float)[:, :2]  # (frames, 2, points)
    is_tracked = np.atleast_1d(whisker["tracked"])[: len(control)]
    frames = np.flatnonzero(is_tracked)
    order = control.shape[2] - 1
    k = np.arange(order + 1)[:, None]
    t = np.linspace(0.0, 1.0, _CURVE_POINTS)
    bernstein = comb(order, k) * t**k * (1.0 - t) ** (order - k)  # (points, samples)
    curves = np.swapaxes(control[frames] @ bernstein, 1, 2)  # (tracked frames, samples, 2)
    px = curves.reshape(-1, 2)
    return np.repeat(frames, len(t)), px, np.full(len(px), number)


_READERS: dict[str, Callable[[Path, str], DrawnLines]] = {
    "csv": _own_or_deeplabcut,
    "hdf5": _hdf5,
    "whisk": _whisk,
    "whiskerman": _whiskerman,
}
