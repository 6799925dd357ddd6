"""Traces of other programs: each tracker's file as its program writes it, and what is wrong with one."""

import json
import pickle
import shutil
import struct
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from bench.base.errors import BadInput
from bench.session.session_check import checked_session
from bench.session.trace_files import trace_files
from bench.session.trace_readers import read_lines
from bench.session.traces_in_space import lines_in_space
from tests.scenes.refusals import refusal
from vision.geometry import Camera

BRING = Path(__file__).resolve().parents[3] / "fixtures" / "bring" / "traces"
# Two lines of three points in frames 4 and 5.
FRAMES = (4, 5)
PX = np.arange(24.0).reshape(2, 2, 3, 2) + 0.25  # (frames, lines, points, 2)


@pytest.fixture
def traced(tmp_path):
    """A copy of the worked example."""
    return shutil.copytree(BRING, tmp_path / "traces")


def points_of(lines):
    """The points by frame and line."""
    found = {}
    for frame, line in zip(lines.frame.tolist(), lines.line.tolist()):
        own = (lines.frame == frame) & (lines.line == line)
        found[frame, line] = lines.px[own]
    return found


def assert_both_lines(lines, px=PX):
    found = points_of(lines)
    for k, frame in enumerate(FRAMES):
        for line in range(2):
            np.testing.assert_allclose(found[frame, line], px[k, line], atol=1e-5)


def whiskers(px=PX):
    """A .whiskers file of whisk 1.1: header, segments, their number."""
    content = b"bwhiskbin1\0\0"
    for k, frame in enumerate(FRAMES):
        for number in range(2):
            own = px[k, number]
            content += struct.pack("<3i", number, frame, len(own))
            content += np.concatenate([own.T, np.ones((2, len(own)))]).astype("<f4").tobytes()
    return content + struct.pack("<i", 2 * len(FRAMES))


def measurements(identities):
    """A .measurements file (version 3) with two measures a row; identities by frame and number."""
    content = b"measv3\0\0" + struct.pack("<2i", len(identities), 2)
    for row, ((frame, number), identity) in enumerate(identities.items()):
        content += struct.pack("<10ic", row, frame, number, identity, 0, 0, 0, 0, 0, 2, b"x")
        content += struct.pack("<4d", 0, 0, 0, 0)
    return content


def test_the_table_of_ours_may_state_sigmas_and_lines(tmp_path):
    path = tmp_path / "trace_high.csv"
    path.write_text("frame,u_px,v_px,sigma_px,line\n3,10.5,20,0.3,1\n4,11,21,0.2,1\n")
    lines = read_lines(path, "x")
    assert lines.frame.tolist() == [3, 4] and lines.line.tolist() == [1, 1]
    assert lines.px.tolist() == [[10.5, 20.0], [11.0, 21.0]]
    assert lines.sigma_px.tolist() == [0.3, 0.2]


def test_whisk_without_classes_knows_no_line_again(tmp_path):
    path = tmp_path / "trace_high.whiskers"
    path.write_bytes(whiskers())
    lines = read_lines(path, "x")
    assert_both_lines(lines)
    assert not lines.has_identity


def test_whisk_takes_identities_from_its_measurements(tmp_path):
    (tmp_path / "trace_high.whiskers").write_bytes(whiskers())
    classes = {(4, 0): -1, (4, 1): -1, (5, 0): -1, (5, 1): 7}
    (tmp_path / "trace_high.measurements").write_bytes(measurements(classes))
    lines = read_lines(tmp_path / "trace_high.whiskers", "x")
    assert lines.has_identity
    np.testing.assert_allclose(points_of(lines)[5, 7], PX[1, 1])
    # segments that whisk gives no identity are each a line
    unknown = [points_of(lines)[4, line] for line in np.unique(lines.line[lines.frame == 4])]
    np.testing.assert_allclose(np.concatenate(unknown[::-1]), PX[0].reshape(-1, 2))


@pytest.mark.parametrize("kept", [13, 30, 200])
def test_a_whisk_file_cut_short_is_refused(tmp_path, kept):
    path = tmp_path / "trace_high.whiskers"
    path.write_bytes(whiskers()[:kept])
    with pytest.raises(BadInput, match=r"x: .*cut short"):
        read_lines(path, "x")


def deeplabcut(tmp_path, index=FRAMES):
    """Two individuals with three joints each; the last joint of the last frame is unlikely."""
    heads = [["scorer"], ["individuals"], ["bodyparts"], ["coords"]]
    for line in range(2):
        for joint in range(3):
            for coordinate in ("x", "y", "likelihood"):
                for head, name in zip(heads, ("net", f"w{line}", f"j{joint}", coordinate)):
                    head.append(name)
    rows = [",".join(head) for head in heads]
    for k, frame in enumerate(index):
        cells = []
        for line in range(2):
            for joint in range(3):
                likelihood = 0.1 if (k, line, joint) == (1, 1, 2) else 0.9
                cells += [*PX[k, line, joint], likelihood]
        rows.append(",".join(map(str, [frame, *cells])))
    path = tmp_path / "trace_high.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize(
    "index", [FRAMES, ("labeled-data/v/img004.png", "labeled-data/v/img005.png")]
)
def test_deeplabcut_gives_a_line_an_individual_without_unlikely_joints(tmp_path, index):
    found = points_of(read_lines(deeplabcut(tmp_path, index), "x"))
    np.testing.assert_allclose(found[4, 1], PX[0, 1])
    np.testing.assert_allclose(found[5, 1], PX[1, 1, :2])


def test_deeplabcut_tables_are_read_without_making_objects_of_their_names(tmp_path):
    h5py = pytest.importorskip("h5py")
    names = [
        ("net", f"w{line}", f"j{joint}", axis)
        for line in range(2)
        for joint in range(3)
        for axis in "xy"
    ]
    rows = np.array(
        [(frame, PX[k].ravel()) for k, frame in enumerate(FRAMES)],
        dtype=[("index", "<i8"), ("values_block_0", "<f8", (12,))],
    )
    path = tmp_path / "trace_high.h5"
    with h5py.File(path, "w") as file:
        table = file.create_dataset("df_with_missing/table", data=rows)
        table.attrs["values_block_0_kind"] = np.bytes_(pickle.dumps(names, 0))
    assert_both_lines(read_lines(path, "x"))
    with h5py.File(path, "a") as file:  # a name that would import a module
        file["df_with_missing/table"].attrs["values_block_0_kind"] = np.bytes_(b"cos\nsystem\n.")
    with pytest.raises(BadInput, match="names no columns as DeepLabCut does"):
        read_lines(path, "x")


@pytest.mark.parametrize(
    "text, message",
    [
        ("scorer,a,a\nbodyparts,p,p\ncoords,x,y\n", "no row of a frame"),
        ("scorer,a,a\nbodyparts,p\ncoords,x,y\n0,1,2\n", "name 3, 2, 3 columns"),
    ],
)
def test_a_deeplabcut_table_without_frames_or_names_is_one_line(tmp_path, text, message):
    path = tmp_path / "trace_high.csv"
    path.write_text(text)
    with pytest.raises(BadInput, match=message):
        read_lines(path, "x")


def test_sleap_gives_a_line_a_track(tmp_path):
    h5py = pytest.importorskip("h5py")
    tracks = np.full((2, 2, 3, 6), np.nan)
    tracks[:, :, :, list(FRAMES)] = np.transpose(PX, (1, 3, 2, 0))
    path = tmp_path / "trace_high.h5"
    with h5py.File(path, "w") as file:
        file["tracks"] = tracks
        file["node_names"] = np.array([b"a", b"barb", b"c"])
    assert_both_lines(read_lines(path, "x"))


def test_joints_named_for_the_object_are_no_points_of_the_wire(tmp_path):
    """Of SLEAP's analysis, and of its project with a skeleton that has the nodes in another order."""
    h5py = pytest.importorskip("h5py")
    analysis = tmp_path / "trace_high.h5"
    project = tmp_path / "trace_low.slp"
    with h5py.File(analysis, "w") as file:
        file["tracks"] = np.transpose(PX[:1], (1, 3, 2, 0))
        file["node_names"] = np.array([b"w1", b"Bar_top", b"object2"])
    with h5py.File(project, "w") as file:
        sleap_project(file, PX[0], names=["object2", "w1", "Bar_top"], order=[1, 2, 0])
    # instances that SLEAP does not track are each a line
    for path, numbers in ((analysis, [0, 1]), (project, [-1, -2])):
        lines = read_lines(path, "x")
        np.testing.assert_allclose(lines.of_wire.px, PX[0, :, 0])
        assert lines.of_wire.line.tolist() == numbers
        np.testing.assert_allclose(lines.of_object.px, PX[0, :, 1:].reshape(-1, 2))
        assert set(lines.of_object.line.tolist()) == {0}


def sleap_project(file, px, names, order):
    """Write SLEAP's project of one frame: predicted instances without a track, with points px (instances, joints, 2)."""
    point = [("x", "f8"), ("y", "f8"), ("visible", "?")]
    instance = ("instance_type", "frame_id", "skeleton", "track", "point_id_start", "point_id_end")
    joints = len(names)
    rows = [(1, 0, 0, -1, joints * k, joints * (k + 1)) for k in range(len(px))]
    file["pred_points"] = np.array([(*p, True) for own in px for p in own], dtype=point)
    file["points"] = np.zeros(0, dtype=point)
    file["frames"] = np.array([(0, 4)], dtype=[("frame_id", "u8"), ("frame_idx", "u8")])
    file["instances"] = np.array(rows, dtype=[(name, "i8") for name in instance])
    stated = {"nodes": [{"name": name} for name in names]}
    stated["skeletons"] = [{"nodes": [{"id": k} for k in order]}]
    group = file.create_group("metadata")
    group.attrs["format_id"] = 1.2
    group.attrs["json"] = json.dumps(stated)


def test_another_hdf5_file_is_refused(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "trace_high.h5"
    with h5py.File(path, "w") as file:
        file["other"] = [1.0]
    with pytest.raises(BadInput, match="is neither a table of DeepLabCut nor an analysis of SLEAP"):
        read_lines(path, "x")


def test_whiskerman_curves_are_in_its_region_and_count_from_one(tmp_path):
    """A quadratic Bezier curve with its middle control point half-way is a straight line."""
    control = np.zeros((6, 3, 3))
    control[4, 0] = [1.0, 6.0, 11.0]
    control[4, 1] = [2.0, 2.0, 2.0]
    tracked = np.array([0, 0, 0, 0, 1, 0])
    content = {
        "whisker": {"r3all": control, "tracked": tracked},
        "roi": {"h": [101, 200, 51, 90], "v": [1, 2, 1, 2]},
    }
    path = tmp_path / "trace_high.tr4"
    scipy.io.savemat(path, content, appendmat=False)
    lines = read_lines(path, "x")
    assert set(lines.frame.tolist()) == {4}
    np.testing.assert_allclose(lines.px[[0, -1]], [[100.0, 51.0], [110.0, 51.0]])


CALIBRATION = """
[cam_0]
name = "high"
size = [640, 480]
matrix = [[800.0, 0.0, 320.0], [0.0, 800.0, 240.0], [0.0, 0.0, 1.0]]
distortions = [0.0, 0.0, 0.0, 0.0, 0.0]
rotation = [0.0, 0.0, 0.0]
translation = [0.0, 0.0, 500.0]
"""


SIZE_PX = (640, 480)  # of Anipose's camera


def anipose(folder):
    """Points in space of two joints, aligned to axes turned by 90° about z; the second is lost once."""
    points = np.array([[[10.0, 5.0, 0.0], [20.0, 6.0, 3.0]], [[11.0, 5.0, 0.0], [21.0, 6.0, 3.0]]])
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    centre = np.array([1.0, -2.0, 4.0])
    aligned = points @ turn.T - centre
    head = [f"j{k}_{axis}" for k in range(2) for axis in ("x", "y", "z", "error")]
    head += [f"M_{i}{j}" for i in range(3) for j in range(3)] + [f"center_{i}" for i in range(3)]
    rows = [",".join([*head, "fnum"])]
    for frame, joints in enumerate(aligned):
        cells = [str(v) for joint in joints for v in (*joint, 0.5)]
        if frame == 1:
            cells[4:7] = ["", "", ""]
        cells += [str(v) for v in (*turn.ravel(), *centre, frame)]
        rows.append(",".join(cells))
    (folder / "trace_3d.csv").write_text("\n".join(rows) + "\n")
    (folder / "trace_3d.toml").write_text(CALIBRATION)
    return points


def test_anipose_points_are_seen_by_its_own_cameras(tmp_path):
    points = anipose(tmp_path)
    lines = lines_in_space(tmp_path / "trace_3d.csv", {"high": SIZE_PX}, "trials/w/trace_3d.csv")[
        "high"
    ]
    matrix = [[800.0, 0.0, 320.0], [0.0, 800.0, 240.0], [0.0, 0.0, 1.0]]
    pose = np.column_stack([np.eye(3), [0.0, 0.0, 500.0]])
    camera = Camera("high", SIZE_PX, matrix, np.zeros(5), pose)
    expected = camera.project(np.array([points[0, 0], points[0, 1], points[1, 0]]))
    np.testing.assert_allclose(lines.px, expected, atol=1e-9)
    assert lines.frame.tolist() == [0, 0, 1]
    table = tmp_path / "trace_3d.csv"
    table.write_text(table.read_text().replace("j1_", "bar_low_"))
    lines = lines_in_space(table, {"high": SIZE_PX}, "trials/w/trace_3d.csv")["high"]
    np.testing.assert_allclose(lines.of_object.px, expected[[1]], atol=1e-9)


def test_anipose_points_need_its_cameras(tmp_path):
    anipose(tmp_path)
    (tmp_path / "trace_3d.toml").unlink()
    with pytest.raises(BadInput, match=r"calibration.toml as trace_3d.toml"):
        lines_in_space(tmp_path / "trace_3d.csv", {"high": SIZE_PX}, "trials/w/trace_3d.csv")
    anipose(tmp_path)
    with pytest.raises(BadInput, match="has no camera low; it has high"):
        lines_in_space(tmp_path / "trace_3d.csv", {"low": SIZE_PX}, "trials/w/trace_3d.csv")
    other = {"high": (640, 240)}  # a part of its pictures, where the whole ones were calibrated
    with pytest.raises(
        BadInput, match="high with pictures of 640 x 480 px; here they are 640 x 240"
    ):
        lines_in_space(tmp_path / "trace_3d.csv", other, "trials/w/trace_3d.csv")


def test_a_camera_has_one_trace(tmp_path):
    (tmp_path / "trace_high.csv").write_text("")
    (tmp_path / "trace_high.h5").write_text("")
    with pytest.raises(BadInput, match=r"camera high has trace_high\.csv and trace_high\.h5"):
        trace_files(tmp_path, "trials/w")


def test_the_worked_example_is_taken(traced):
    assert checked_session(traced).trials[0].trace_files.keys() == {"high", "low"}


def rows_of(path):
    return np.loadtxt(path, delimiter=",", skiprows=1)


def write(path, rows, head="frame,u_px,v_px"):
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.6g")


def seconds(rows):
    rows[:, 0] *= 0.05


def later(rows):
    rows[:, 0] += 40


def exchanged(rows):
    rows[:, 1:] = rows[:, :0:-1]


def beside(rows):
    rows[:, 1] += 900


def in_metres(rows):
    rows[:, 1:] /= 1000.0


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (seconds, "frame 0.05 is no whole number; pictures are counted from 0; are these times in"),
        (
            later,
            "frame 40 is not there; camera high has 13 pictures, counted from 0; is it of anot",
        ),
        (exchanged, "are u and v exchanged?"),
        (in_metres, "all of its points are within 0.24 px; are u_px and v_px in pixels"),
        (beside, "100% of its points are outside the picture of camera high"),
    ],
)
def test_a_trace_of_other_pictures_is_refused_in_a_line(traced, spoil, said):
    path = next((traced / "trials").iterdir()) / "trace_high.csv"
    rows = rows_of(path)
    if spoil is exchanged:
        rows = rows[rows[:, 1] > 400.0]  # beyond the picture's height of 360
    spoil(rows)
    write(path, rows)
    line = refusal(traced)
    assert said in line and "trace_high.csv" in line


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("frame,x,y", "column u_px is missing"),
        ("time_s,u_px,v_px", "column frame is missing"),
        ("frame,u_px,v_px,score", "column 'score' is none of frame,u_px,v_px,sigma_px,line"),
    ],
)
def test_wrong_columns_are_named(traced, head, said):
    path = next((traced / "trials").iterdir()) / "trace_high.csv"
    rows = rows_of(path)
    if head.count(",") == 3:
        rows = np.column_stack([rows, np.ones(len(rows))])
    write(path, rows, head)
    assert said in refusal(traced)


def test_a_folder_in_the_place_of_a_trace_is_refused(traced):
    path = next((traced / "trials").iterdir()) / "trace_high.csv"
    path.unlink()
    path.mkdir()
    assert "trace_high.csv: is a folder; a file is expected there" in refusal(traced)


def test_a_trace_of_no_camera_or_no_kind_is_refused(traced):
    folder = next((traced / "trials").iterdir())
    shutil.copy(folder / "trace_high.csv", folder / "trace_hihg.csv")
    assert "no pictures of camera hihg; there are those of high, low" in refusal(traced)
    (folder / "trace_hihg.csv").rename(folder / "trace_hihg.txt")
    assert "trace_hihg.txt: is of no kind that is read" in refusal(traced)
