"""Seeded mutations of what a lab brings: a stage's log, traces, boards, cameras, angles. Read in one process.

    python tests/faults/fuzz_brought.py FIRST_SEED COUNT

One session holds a file of each kind that is read: stage.csv, Kalibr's target, angles by pictures, traces of each tracker, and
cameras of each other program (`.h5` and `.slp` where h5py is installed). What is read is refused in a line of printable
text, or accepted with finite numbers; nothing else is raised, nothing takes longer than 5 s.
"""

import json
import pickle
import struct
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.io

from bench.base.input_problems import InputProblems, refused_as_bad_input
from bench.session.angles_file import read_angles
from bench.session.frame_times import frame_times
from bench.session.session import load_session
from bench.session.signals import forward_strokes, read_signals
from bench.session.trace_files import OBJECT, trace_files
from bench.session.traces import read_traces, read_traces_alone
from bench.trials.stated_truth import stated_whisk
from tests.faults.fuzz import FRAMES, TRIAL, small_base
from tests.faults.fuzz_stated import fuzz
from vision.calibration import WRITERS, import_cameras
from vision.geometry import Camera, Cameras

_TRACES = "traces"  # folders of a trial's traces, one a tracker
_LENSES = "lenses"  # folders of cameras, one a program
_JOINTS = ("j0", "j1", "bar_0", "bar_1")  # of a line in each frame, of wire and object
_POINTS = len(_JOINTS)
_TARGET = """target_type: 'aprilgrid'
tagCols: 6
tagRows: 5
tagSize: 0.011
tagSpacing: 0.3
"""
_TRUTH = """
[truth]
source = "stage"
origin_sigma_mm = 0.1
"""
_OBJECT = """
[object]
point_mm = [50.0, 8.0, 0.0]
point_sigma_mm = 0.05
"""


def brought_base(folder: Path) -> Path:
    """Make a session with a file of each kind that a lab may bring."""
    base = small_base(folder)
    _state(base)
    trial = base / "trials" / TRIAL
    (trial / "stage.csv").write_text(
        _table("time_s,x_mm,y_mm,z_mm,x_sigma_mm,y_sigma_mm,z_sigma_mm", _stage())
    )
    (trial / "angles_marker.csv").write_text(
        _table("time_s,motor_deg,motor_sigma_deg,share_sigma", _angles())
    )
    (base / "april.yaml").write_text(_TARGET)
    for program, write in WRITERS.items():
        target = base / _LENSES / program
        target.mkdir(parents=True)
        for name, content in write(_cameras(), "cameras").items():
            (target / name).write_bytes(content)
    for tracker, files in _traces().items():
        target = base / _TRACES / tracker
        target.mkdir(parents=True)
        for name, content in files.items():
            (target / name).write_bytes(content)
    _whiskerman(base / _TRACES / "whiskerman")
    _hdf5(base / _TRACES)
    anipose = base / _TRACES / "anipose" / "trace_3d.toml"
    anipose.write_bytes((base / _LENSES / "anipose" / "cameras.toml").read_bytes())
    return base


def _state(base: Path) -> None:
    """Write into the manifests that a stage is the truth, and that the board is Kalibr's."""
    manifest = base / "session.toml"
    text = manifest.read_text()
    before, _, rest = text.partition("[board]\n")
    _, _, after = rest.partition("\n[rig]")
    manifest.write_text(f'{before}[board]\nkalibr_target = "april.yaml"\n\n[rig]{after}{_TRUTH}')
    trial = base / "trials" / TRIAL / "trial.toml"
    trial.write_text(trial.read_text() + _OBJECT)


def _table(head: str, rows: list) -> str:
    """Return a CSV file."""
    return "\n".join([head, *(",".join(f"{cell:.9g}" for cell in row) for row in rows)]) + "\n"


def _stage() -> list:
    """Return the rows of a stage that moves a little."""
    return [(time_s, 0.1 * time_s, 0.0, 0.0, 0.01, 0.01, 0.01) for time_s in (-10.0, 0.0, 100.0)]


def _angles() -> list:
    """Return the angles of frames all over the recording."""
    return [(time_s, 10.0 * time_s, 0.02, 1e-4) for time_s in np.linspace(0.0, 5.0, 20)]


def _cameras() -> Cameras:
    """Return two cameras of pictures of 160 × 90 px."""
    matrix = [[250.0, 0.0, 80.0], [0.0, 250.0, 45.0], [0.0, 0.0, 1.0]]
    cameras = []
    for name, shift_mm in (("high", -60.0), ("low", -40.0)):
        pose = np.column_stack([np.eye(3), [shift_mm, 0.0, 350.0]])
        cameras.append(Camera(name, (160, 90), matrix, [-0.1, 0.1, 0.0, 0.0, 0.0], pose, 0.05))
    return Cameras(tuple(cameras))


def _px() -> np.ndarray:
    """Return points (frames, points, 2) of a line."""
    along = np.linspace(20.0, 120.0, _POINTS)
    across = 40.0 + np.arange(FRAMES)[:, None] + 0.1 * along
    return np.stack([np.broadcast_to(along, across.shape), across], axis=-1)


def _traces() -> dict[str, dict[str, bytes]]:
    """Return by tracker the files that need no library."""
    px = _px()
    rows = [(frame, *point, 0.3, 0) for frame in range(FRAMES) for point in px[frame]]
    own = _table("frame,u_px,v_px,sigma_px,line", rows).encode()
    heads = [["scorer"], ["bodyparts"], ["coords"]]
    for joint in _JOINTS:
        for axis in ("x", "y", "likelihood"):
            for head, name in zip(heads, ("net", joint, axis)):
                head.append(name)
    table = [",".join(head) for head in heads]
    for frame in range(FRAMES):
        table.append(",".join([str(frame), *(f"{u:.2f},{v:.2f},0.9" for u, v in px[frame])]))
    names = [f"{joint}_{axis}" for joint in _JOINTS for axis in "xyz"]
    names += [f"M_{i}{j}" for i in range(3) for j in range(3)] + [f"center_{i}" for i in range(3)]
    spots = [(20.0 * joint, 1.0, 0.0) for joint in range(_POINTS)]
    turned = [*np.ravel(spots), *np.eye(3).ravel(), 0.0, 0.0, 0.0]
    in_space = [(*turned, frame) for frame in range(FRAMES)]
    return {
        "ours": {"trace_high.csv": own, "object_high.csv": own, "object_low.csv": own},
        "deeplabcut": {"trace_low.csv": "\n".join(table).encode()},
        "whisk": {"trace_high.whiskers": _whiskers(px), "trace_high.measurements": _measurements()},
        "anipose": {"trace_3d.csv": _table(",".join([*names, "fnum"]), in_space).encode()},
        "whiskerman": {},
    }


def _whiskers(px: np.ndarray) -> bytes:
    """Return a .whiskers file with two lines a frame."""
    content = b"bwhiskbin1\0\0"
    for frame, own in enumerate(px):
        for number in range(2):
            content += struct.pack("<3i", number, frame, len(own))
            content += (
                np.concatenate([own.T + number, np.ones((2, len(own)))]).astype("<f4").tobytes()
            )
    return content + struct.pack("<i", 2 * len(px))


def _measurements() -> bytes:
    """Return a .measurements file that knows both lines again."""
    content = b"measv3\0\0" + struct.pack("<2i", 2 * FRAMES, 2)
    for row in range(2 * FRAMES):
        number = row % 2
        content += struct.pack("<10ic", row, row // 2, number, number, 0, 0, 0, 0, 0, 2, b"x")
        content += struct.pack("<4d", 0, 0, 0, 0)
    return content


def _whiskerman(folder: Path) -> None:
    """Write WhiskerMan's file."""
    control = np.zeros((FRAMES, 3, 3))
    control[:, :2] = np.swapaxes(_px()[:, :3], 1, 2)
    whisker = {"r3all": control, "tracked": np.ones(FRAMES)}
    content = {"whisker": whisker, "roi": {"h": [1, 160, 1, 90]}}
    scipy.io.savemat(folder / "trace_high.tr4", content, appendmat=False)


def _hdf5(folder: Path) -> None:
    """Write DeepLabCut's and SLEAP's HDF5 files, where that can be read."""
    try:
        import h5py
    except ImportError:
        return
    px = _px()
    for name in ("deeplabcut-h5", "sleap"):
        (folder / name).mkdir()
    names = [("net", joint, axis) for joint in _JOINTS for axis in "xy"]
    rows = np.array(
        [(frame, px[frame].ravel()) for frame in range(FRAMES)],
        dtype=[("index", "<i8"), ("values_block_0", "<f8", (2 * _POINTS,))],
    )
    with h5py.File(folder / "deeplabcut-h5" / "trace_low.h5", "w") as file:
        table = file.create_dataset("df_with_missing/table", data=rows)
        table.attrs["values_block_0_kind"] = np.bytes_(pickle.dumps(names, 0))
    with h5py.File(folder / "sleap" / "trace_low.h5", "w") as file:
        file["tracks"] = np.transpose(px, (2, 1, 0))[None]
        file["node_names"] = np.array([joint.encode() for joint in _JOINTS])
    with h5py.File(folder / "sleap" / "trace_high.slp", "w") as file:
        _sleap_labels(file, px)


def _sleap_labels(file, px: np.ndarray) -> None:
    """Write SLEAP's project: a predicted instance a frame."""
    point = [("x", "f8"), ("y", "f8"), ("visible", "?"), ("complete", "?"), ("score", "f8")]
    instance = [
        ("instance_id", "i8"),
        ("instance_type", "u1"),
        ("frame_id", "u8"),
        ("skeleton", "u4"),
    ]
    instance += [("track", "i4"), ("from_predicted", "i8"), ("score", "f4")]
    instance += [("point_id_start", "u8"), ("point_id_end", "u8")]
    file["pred_points"] = np.array([(*p, True, True, 1.0) for own in px for p in own], dtype=point)
    file["points"] = np.zeros(0, dtype=point)
    file["frames"] = np.array(
        [(k, 0, k) for k in range(FRAMES)],
        dtype=[(n, "u8") for n in ("frame_id", "video", "frame_idx")],
    )
    rows = [(k, 1, k, 0, 0, -1, 1.0, _POINTS * k, _POINTS * (k + 1)) for k in range(FRAMES)]
    file["instances"] = np.array(rows, dtype=instance)
    group = file.create_group("metadata")
    group.attrs["format_id"] = 1.2
    nodes = [{"name": joint} for joint in _JOINTS]
    skeleton = {"nodes": [{"id": k} for k in range(_POINTS)]}
    group.attrs["json"] = json.dumps({"nodes": nodes, "skeletons": [skeleton]})


def brought_files(session: Path) -> list[Path]:
    """Return the files that are changed: all but pictures, signals and what `fuzz_stated` changes."""
    trial = session / "trials" / TRIAL
    own = [trial / "stage.csv", trial / "angles_marker.csv", session / "april.yaml"]
    brought = [*(session / _TRACES).glob("*/*"), *(session / _LENSES).glob("*/*")]
    return sorted([*own, *brought])


class Reader:
    """Reads what differs in a session from how it was made."""

    def __init__(self, session: Path):
        """Keep the session's files as they are, and its trial."""
        self.sound = {path: path.read_bytes() for path in brought_files(session)}
        self.trial = replace(load_session(session).trials[0], angle_from="marker")
        self.picture = frame_times(self.trial).picture

    def read(self, session: Path) -> tuple[str, str]:
        """Return how it ended ('refused', 'accepted', or what is wrong) and a line on it."""
        changed = [path for path, content in self.sound.items() if path.read_bytes() != content]
        problems = InputProblems(stop_at_first=False)
        found = []
        for place in dict.fromkeys(self._read_with(session, path) for path in changed):
            with problems.guard():
                found.extend(self._numbers(place, problems))
        for line in (*problems.refusals, *problems.warnings):
            if not str(line).isprintable():
                return "unprintable line", repr(line)
        for name, value in found:
            if not np.all(np.isfinite(value)):
                return "not finite", f"{name}: {value}"
        return ("refused", problems.refusals[0]) if problems.refusals else ("accepted", "")

    def _read_with(self, session: Path, path: Path) -> Path:
        """Return what a file is read with: the session, its folder of traces or cameras, or the file."""
        if path.parent.parent.name in (_TRACES, _LENSES):
            return path.parent
        return path if path.name.startswith("angles") else session

    def _numbers(self, place: Path, problems: InputProblems) -> Iterator[tuple[str, np.ndarray]]:
        """Yield the numbers that are read with a place, and their name."""
        if place.parent.name == _TRACES:
            yield from self._traced(place)
        elif place.parent.name == _LENSES:
            with refused_as_bad_input(place.name):
                for camera in import_cameras(place):
                    yield place.name, camera.matrix
                    yield place.name, camera.T_camera_rig
        elif place.is_file():
            angles = read_angles(self.trial)
            yield place.name, angles.motor_deg
            yield place.name, angles.sigma_deg
        else:
            yield from _stated(load_session(place, problems))

    def _traced(self, folder: Path) -> Iterator[tuple[str, np.ndarray]]:
        """Yield the numbers of a tracker's lines, beside pictures and alone with points of the object."""
        files = trace_files(folder, folder.name)
        objects = trace_files(folder, folder.name, OBJECT)
        beside = read_traces(files, self.trial.camera_sources, self.picture, folder.name)
        trial = replace(self.trial, folder=folder, trace_files=files, object_files=objects)
        alone = read_traces_alone(trial, FRAMES, {"high": (160, 90), "low": (160, 90)}, {})
        for traced in (*beside.values(), *alone.wire.values(), *alone.object_points.values()):
            yield folder.name, traced.trace.px
            yield folder.name, traced.trace.frame


def _stated(session) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the numbers of the stage's truth, where it states one."""
    for trial in session.trials:
        signals = read_signals(trial)
        for stroke in forward_strokes(signals):
            truth = stated_whisk(session, trial, signals, stroke).truth
            if not truth.status:
                yield "stage", np.array([truth.d_x_mm.value, truth.d_x_mm.sigma])


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        base = brought_base(Path(place))
        ended, wrong = fuzz(
            int(sys.argv[1]), int(sys.argv[2]), [base], brought_files, Reader(base).read
        )
    print(*wrong, dict(ended), sep="\n")
    sys.exit(bool(wrong))
