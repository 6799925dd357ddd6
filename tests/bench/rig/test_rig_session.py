"""Whole sessions: what is written, the same bytes for any workers, resuming, and one clear line for what is wrong."""

import csv
import json
import math
import os
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.rig.protocol import FOLDER, load
from bench.rig.recording import Recording
from bench.rig.simulate import simulate
from bench.session.frame_times import frame_times
from bench.session.session import load_session
from bench.session.signals import forward_strokes, read_signals

TINY = """
name = "tiny"
[[cameras]]
name = "left"
position_mm = [30.0, -150.0, 250.0]
size_px = [320, 180]
focal_px = 420.0
[[cameras]]
name = "right"
position_mm = [100.0, -300.0, 90.0]
size_px = [320, 180]
focal_px = 480.0
[board]
views = 2
[pictures]
clock_offset_s = 0.003
[[trials]]
beta_deg = [20, 50]
[[trials]]
purpose = "gauge"
d_x_mm = 50.0
follicle_roll_deg = 90.0
[[trials]]
surface = "rough"
beta_deg = 60
friction = 0.2
static_friction = 0.3
whisks = 3
speed_deg_s = 90.0
"""


def protocol_file(folder: Path, text: str) -> Path:
    path = folder / "protocol.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tiny")
    return simulate(folder / "session", protocol=protocol_file(folder, TINY), seed=5, workers=1)


def contents(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def rows(path):
    return list(csv.DictReader(path.read_text().splitlines()))


def test_the_bench_reads_what_the_rig_writes(tiny):
    session = load_session(tiny)
    assert sorted(t.name for t in session.trials) == ["gauge_roll90", "rough_b60_v90", "steel_b20_v10", "steel_b50_v10"]
    for trial in session.trials:
        signals = read_signals(trial)
        assert len(forward_strokes(signals)) == (3 if trial.name.startswith("rough") else 1)
        assert len(frame_times(trial)) == (39 if trial.name.startswith("rough") else 13)


def test_frames_stand_from_before_touch_to_after_it(tiny):
    for folder in sorted((tiny / "trials").iterdir()):
        truth = tomllib.loads((folder / "truth.toml").read_text())
        touch = truth["touch_deg"][0] if isinstance(truth["touch_deg"], list) else truth["touch_deg"]
        angles = [float(r["motor_deg"]) - touch for r in rows(folder / "truth.csv")][:13]
        assert angles == pytest.approx(np.arange(-1.6, 4.5, 0.5), abs=1e-5)
        assert [r["contact"] for r in rows(folder / "truth.csv")][:13] == ["0"] * 4 + ["1"] * 9
        assert len(list((folder / "left").iterdir())) == len(rows(folder / "truth.csv"))


def test_truth_agrees_with_itself(tiny):
    """Slip is the point's way from P0 along the bar that β and ψ name; at 3° it lies between its neighbours'."""
    folder = tiny / "trials" / "steel_b50_v10"
    truth = tomllib.loads((folder / "truth.toml").read_text())
    axis, p0, _ = bar_of(truth, both_radii_mm=3.5)
    slips = []
    for row in rows(folder / "truth.csv")[4:]:
        point = np.array([float(row[k]) for k in ("x_mm", "y_mm", "z_mm")])
        slips.append(float(row["slip_mm"]))
        assert (point - p0) @ axis == pytest.approx(slips[-1], abs=5e-6)
    assert truth["slip_at_3deg_mm"] == pytest.approx(np.interp(3, [2.9, 3.4], slips[5:7]), rel=1e-3)


def test_truth_has_the_form_of_steel_samples(tiny, steel_sample):
    mine, other = (json.loads((s / "truth.json").read_text()) for s in (tiny, steel_sample))
    assert set(other) <= set(mine)
    assert set(other["cameras"]["high"]) == set(mine["cameras"]["left"])
    mine, other = tiny / "trials" / "steel_b20_v10", steel_sample / "trials" / "b30_3"
    assert [*tomllib.loads((other / "truth.toml").read_text())] == [*tomllib.loads((mine / "truth.toml").read_text())]
    for name in ("truth.csv", "signals.csv", "frames.csv"):
        assert (mine / name).read_text().startswith((other / name).read_text().split("\n")[0])


def test_camera_clock_is_off_by_what_the_protocol_says(tiny):
    folder = tiny / "trials" / "steel_b20_v10"
    stated, true = ([float(r["time_s"]) for r in rows(folder / f"{n}.csv")] for n in ("frames", "truth"))
    assert np.subtract(true, stated) == pytest.approx(0.003, abs=2e-6)


def test_signals_carry_the_truths_moments(tiny):
    """Through the gauge matrix, within noise, mains, and the filter's delay (0.5 ms: 0.02 N·mm)."""
    exact = json.loads((tiny / "truth.json").read_text())
    matrix, offset = np.array(exact["gauge_matrix_Nmm_per_V"]), np.array(exact["gauge_offset_V"])
    folder = tiny / "trials" / "steel_b50_v10"
    signals = np.genfromtxt(folder / "signals.csv", delimiter=",", names=True)
    moments = (np.column_stack([signals["y_V"], signals["z_V"]]) - offset) @ matrix.T
    for row in rows(folder / "truth.csv"):
        near = np.abs(signals["time_s"] - float(row["time_s"])) < 0.004
        if near.sum() > 14:
            expected = [float(row["m_y_Nmm"]), float(row["m_z_Nmm"])]
            assert moments[near].mean(0) == pytest.approx(expected, abs=0.13)


EVENLY_LIT = """
name = "even"
[[cameras]]
name = "left"
position_mm = [30.0, -150.0, 320.0]
focal_px = 2010.0
[[cameras]]
name = "right"
position_mm = [100.0, -300.0, 90.0]
focal_px = 1932.0
[board]
views = 1
[pictures]
read_noise = 0
shot_noise = 0
grain = 0
vignetting = 0
format = "png"
[light]
lamp = 0
soft = 1
paper = 0.02
ink = 0.02
floor = 0.02
wall = 0.02
wire_matt = 0.6
wire_shiny = 0
wire_rim = 0
bar_matt = 0.3
bar_shiny = 0
bar_rim = 0
[[trials]]
beta_deg = 30
psi_deg = 6
"""


def test_the_painted_bar_and_whisker_are_where_truth_says(tmp_path):
    """End to end, from truth's numbers alone: both edges of the bar to 0.15 px, and the whisker's tone at the
    contact.
    """
    session = simulate(tmp_path / "s", protocol=protocol_file(tmp_path, EVENLY_LIT), seed=2)
    (folder,) = (session / "trials").iterdir()
    contact = np.array([float(rows(folder / "truth.csv")[-1][k]) for k in ("x_mm", "y_mm", "z_mm")])
    axis, _, foot = bar_of(tomllib.loads((folder / "truth.toml").read_text()), both_radii_mm=3.5)
    for name, camera in json.loads((session / "truth.json").read_text())["cameras"].items():
        picture = cv2.imread(str(folder / name / "000012.png"), cv2.IMREAD_UNCHANGED).astype(np.float32)
        eye = -np.array(camera["R"]).T @ np.array(camera["t"])
        for up in (-14.0, 14.0):
            edges = [project(camera, e) for e in silhouette(foot + up * axis, axis, 3.0, eye)]
            assert half_heights(picture, *edges) == pytest.approx([0.0, 0.0], abs=0.15)
        column, row = np.round(project(camera, contact)).astype(int)
        assert picture[row, column] > 120  # the whisker's tone is 0.6 of 255, the bar's 0.3


def bar_of(truth, both_radii_mm):
    """Axis, P0 and the axis' point next to it, from truth.toml's keys as the conventions define them."""
    beta, psi, touch = (math.radians(truth[k]) for k in ("beta_deg", "psi_deg", "touch_deg"))
    c, s = math.cos(touch), math.sin(touch)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    axis = turn @ [math.sin(psi), math.cos(psi) * math.sin(beta), math.cos(psi) * math.cos(beta)]
    p0 = turn @ [truth["d_x_mm"], 0, 0]
    return axis, p0, p0 + turn @ [0, both_radii_mm * math.cos(beta), -both_radii_mm * math.sin(beta)]


def project(camera, point):
    lens = np.array(camera["K"]), np.array(camera["dist"])
    turn, points = cv2.Rodrigues(np.array(camera["R"]))[0], np.asarray(point, float).reshape(1, 1, 3)
    return cv2.projectPoints(points, turn, np.array(camera["t"]), *lens)[0].ravel()


def silhouette(point, axis, radius, eye):
    """Points of a cylinder where the view grazes it, at the height of a point of its axis."""
    towards = eye - point - ((eye - point) @ axis) * axis
    near = np.linalg.norm(towards)
    facing, aside = towards / near, np.cross(axis, towards / near)
    cos = radius / near
    return [point + radius * (cos * facing + way * math.sqrt(1 - cos**2) * aside) for way in (-1, 1)]


def half_heights(picture, first, second):
    """How far from each of two edges the picture rises through half its step, along the line through both."""
    across = (second - first) / np.linalg.norm(second - first)
    steps, found = np.arange(-5, 5.01, 0.05), []
    for edge, way in ((first, 1), (second, -1)):
        x, y = (edge + steps[:, None] * way * across).T.astype(np.float32)[:, :, None]
        line = cv2.remap(picture, x, y, cv2.INTER_CUBIC).ravel()
        found.append(float(np.interp(0.5 * (line[:20].mean() + line[-20:].mean()), line, steps)))
    return found


def test_same_seed_same_bytes_for_any_workers(tiny, tmp_path):
    twin = simulate(tmp_path / "twin", protocol=protocol_file(tmp_path, TINY), seed=5, workers=2)
    assert contents(twin) == contents(tiny)


def test_another_seed_is_another_session(tiny, tmp_path):
    other = simulate(tmp_path / "other", protocol=protocol_file(tmp_path, TINY), seed=6, signals_only=True)
    ours, theirs = contents(tiny), contents(other)
    assert all(ours[name] != data for name, data in theirs.items() if name.endswith(("signals.csv", "truth.toml")))


def test_signals_only_differs_by_the_pictures_alone(tiny, tmp_path):
    bare = contents(simulate(tmp_path / "bare", protocol=protocol_file(tmp_path, TINY), seed=5, signals_only=True))
    assert bare == {k: v for k, v in contents(tiny).items() if not k.endswith((".jpg", ".png"))}


def test_goes_on_where_it_stopped(tiny, tmp_path):
    path = protocol_file(tmp_path, TINY)
    session = simulate(tmp_path / "s", protocol=path, seed=5, signals_only=True)
    whole = contents(session)
    removed = session / "trials" / "steel_b20_v10"
    for file in removed.iterdir():
        file.unlink()
    removed.rename(removed.with_name(".steel_b20_v10.unfinished"))
    untouched = session / "trials" / "steel_b50_v10" / "signals.csv"
    before = untouched.stat().st_mtime_ns
    simulate(session, protocol=path, seed=5, signals_only=True)
    assert contents(session) == whole and untouched.stat().st_mtime_ns == before


def test_a_folder_of_something_else_is_left_alone(tiny, tmp_path):
    path = protocol_file(tmp_path, TINY)
    with pytest.raises(BadInput, match="another protocol or seed"):
        simulate(tiny, protocol=path, seed=8)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("keep")
    with pytest.raises(BadInput, match="not empty"):
        simulate(tmp_path / "mine", protocol=path, seed=5)
    assert contents(tmp_path / "mine") == {"notes.txt": b"keep"}


def taken(folder, kind, bits):
    """Frames of the first camera of a trial, (n, rows, columns), and the session's folder."""
    text = TINY.split("[[trials]]")[0].replace("[pictures]", f'[pictures]\nformat = "{kind}"\nbits = {bits}')
    session = simulate(
        folder / "session", protocol=protocol_file(folder, text + "[[trials]]\nbeta_deg = 20\n"), seed=1
    )
    (trial,) = (session / "trials").iterdir()
    if (trial / "left.mkv").exists():
        film = cv2.VideoCapture(str(trial / "left.mkv"))
        return np.array([film.read()[1][..., 0] for _ in range(13)]), session
    files = sorted((trial / "left").iterdir())
    return np.array([cv2.imread(str(f), cv2.IMREAD_UNCHANGED) for f in files]), session


@pytest.fixture(scope="module")
def lossless(tmp_path_factory):
    return taken(tmp_path_factory.mktemp("png"), "png", 8)[0]


def test_films_are_lossless(lossless, tmp_path):
    frames, session = taken(tmp_path, "mkv", 8)
    assert (frames == lossless).all()
    assert (session / "boards" / "left" / "00.png").exists()


def test_jpeg_is_of_quality_95(lossless, tmp_path):
    """Every frame is what OpenCV's encoder makes of the lossless one at 95."""
    frames, session = taken(tmp_path, "jpg", 8)
    assert {f.suffix for f in session.glob("trials/*/left/*")} == {".jpg"}
    for frame, exact in zip(frames, lossless):
        code = cv2.imencode(".jpg", exact, [cv2.IMWRITE_JPEG_QUALITY, 95])[1]
        assert (frame == cv2.imdecode(code, cv2.IMREAD_UNCHANGED)).all()


@pytest.mark.parametrize("kind", ["png", "jpg", "mkv"])
def test_12_bits_are_written_as_png(kind, lossless, tmp_path):
    """JPEG and film hold 8. The same picture in finer steps: half a step of 8 bits apart at most."""
    frames, session = taken(tmp_path, kind, 12)
    assert frames.dtype == np.uint16 and 255 < frames.max() < 4096
    assert {f.suffix for f in session.glob("trials/*/left/*")} == {".png"}
    assert np.abs(frames * (255 / 4095) - lossless).max() <= 0.5 * (1 + 255 / 4095) + 1e-9


@pytest.mark.parametrize("change, message", [
    (("name = \"tiny\"", "nome = \"tiny\""), "unknown field `nome`"),
    (("beta_deg = [20, 50]", "beta_deg = [20, 95]"), "±80"),
    (("beta_deg = [20, 50]", "beta_deg = \"steep\""), "beta_deg"),
    (("friction = 0.2\n", "friction = -0.2\n"), "friction"),
    (("static_friction = 0.3", "static_friction = 0.1"), "below friction"),
    (("d_x_mm = 50.0", "d_x_mm = 0.05"), "d_x_mm"),
    (("speed_deg_s = 90.0", "speed_deg_s = 0.0"), "speed_deg_s"),
    (("views = 2", "views = 2\nmarker_mm = 20.0"), "marker"),
    (("views = 2", "views = 2\ndictionary = \"DICT_9X9\""), "no ArUco dictionary"),
    (("position_mm = [30.0, -150.0, 250.0]", "position_mm = [55.0, 0.0, 250.0]"), "straight up or down"),
    (("name = \"right\"", "name = \"left\""), "names of their own"),
    (("clock_offset_s = 0.003", "after_deg = 9.0"), "at most the motor's"),
    (("[[trials]]\nbeta_deg = [20, 50]", "[[trials]\nbeta_deg = [20, 50]"), "is not TOML"),
])
def test_a_bad_protocol_is_refused_in_one_line(tmp_path, change, message):
    assert change[0] in TINY
    path = protocol_file(tmp_path, TINY.replace(*change))
    with pytest.raises(BadInput, match=r"protocol\.toml") as found:
        simulate(tmp_path / "session", protocol=path)
    assert message in str(found.value) and "\n" not in str(found.value)
    assert not (tmp_path / "session").exists()


def test_a_missing_protocol_names_the_built_in_ones(tmp_path):
    with pytest.raises(BadInput, match=r"no\.toml.*paper, quick"):
        simulate(tmp_path / "session", protocol=tmp_path / "no.toml")


def test_a_whisker_that_cannot_go_on_is_refused_by_its_trial(tmp_path):
    text = """
[motor]
after_deg = 25.0
[whisker]
shape = "cone"
[[trials]]
d_x_mm = 97.0
beta_deg = 60
friction = 0.0
"""
    with pytest.raises(BadInput, match="trial steel_b60_v10: the whisker slips off"):
        simulate(tmp_path / "session", protocol=protocol_file(tmp_path, text), signals_only=True)
    assert not list((tmp_path / "session" / "trials").iterdir())


@pytest.mark.parametrize("name", sorted(p.stem for p in FOLDER.glob("*.toml")))
def test_built_in_protocols_load(name):
    assert load(name).runs()


def test_the_papers_protocol_is_section_v():
    """16 slopes × 2 surfaces × 2 speeds × 10 whisks, and both gauge trials."""
    runs = load("paper").runs()
    measured = [r for r in runs if r.table.purpose == "measure"]
    assert sum(r.table.whisks for r in measured) == 640
    assert {(r.table.surface, r.speed_deg_s) for r in measured} == {
        ("steel", 10), ("steel", 90), ("sandpaper", 10), ("sandpaper", 90)}
    assert sorted({r.beta_deg for r in measured}) == list(range(0, 80, 5))
    assert {r.table.follicle_roll_deg for r in runs if r.table.purpose == "gauge"} == {0, 90}
    assert {(r.before_deg, r.after_deg) for r in measured} == {(3, 12), (15, 20)}


def test_quick_is_a_dozen_whisks_half_with_one_coefficient():
    measured = [r for r in load("quick").runs() if r.table.purpose == "measure"]
    assert len(measured) == 12 and all(r.table.whisks == 1 for r in measured)
    assert sum(r.table.static_friction is None for r in measured) == 6


WAYS = """
[whisker]
length_mm = 100.0
[pictures]
step_deg = 0.05
back_stroke = true
[[trials]]
name = "teeth"
beta_deg = 60
beta_scatter_deg = 0
friction = 0.18
static_friction = 0.25
[[trials]]
name = "smooth"
beta_deg = 60
beta_scatter_deg = 0
friction = 0.18
"""


@pytest.fixture(scope="module")
def ways(tmp_path_factory):
    """Rows of truth.csv of both trials, a frame each 0.05° there and back; no pictures are taken."""
    folder = tmp_path_factory.mktemp("ways")
    session = simulate(folder / "session", protocol=protocol_file(folder, WAYS), seed=3, signals_only=True)
    return {f.name.split("_")[0]: rows(f / "truth.csv") for f in (session / "trials").iterdir()}


def column(table, name):
    return np.array([float(row[name]) for row in table])


def test_truth_goes_there_and_back(ways):
    for table in ways.values():
        motor, contact = column(table, "motor_deg"), column(table, "contact")
        assert len(table) == 2 * 125 - 1
        assert (np.diff(column(table, "time_s")) > 0).all()
        assert motor == pytest.approx(motor[::-1], abs=2e-6)
        assert (contact == contact[::-1]).all()
        assert {row["status"] for row, c in zip(table, contact) if not c} == {"free"}


def test_friction_holds_slip_and_moment_back_on_both_ways(ways):
    """Pushed in, friction points against the slip; on the way back the other way, so that more slip is left at the
    same angle, and φ is larger by twice the friction angle where it slides.
    """
    table = [r for r in ways["smooth"] if r["contact"] == "1"]
    half = len(table) // 2
    slip, phi = column(table, "slip_mm"), np.degrees(np.arctan2(column(table, "m_y_Nmm"), column(table, "m_z_Nmm")))
    up, down = slip[:half], slip[:half:-1]
    assert (down[10:] > up[10:] + 1e-4).all()
    alpha_deg = math.degrees(math.atan(0.18))
    assert phi[half // 2] == pytest.approx(60 - alpha_deg, abs=0.5)
    assert phi[-10] == pytest.approx(60 + alpha_deg, abs=2.0)


@pytest.mark.parametrize("back", [False, True])
def test_the_whisker_that_is_painted_touches_where_truth_says(back, tmp_path):
    """On both ways its centreline runs through the contact point, at frames and between them."""
    protocol = load(protocol_file(tmp_path, WAYS))
    recording = Recording.make(protocol, protocol.runs()[0], np.random.default_rng(2))
    whisk, way = recording.whisks[0], recording.whisks[0].way(back)
    frames = [motor for _, motor, _, b in recording.frames if b == back and way.state_at(motor) is not None]
    assert len(frames) > 80
    for motor in frames[::5]:
        state = way.state_at(motor)
        assert way.state_between(motor) is state or way.state_between(motor).force_hub_N == pytest.approx(
            state.force_hub_N, rel=1e-9
        )
        (point,) = whisk.centreline_mm(motor, way.state_between(motor), [state.arc_mm])
        assert point == pytest.approx(state.point_mm, abs=1e-8)
        between = motor + 1e-4
        if (aside := way.state_between(between)) is not None:
            (near,) = whisk.centreline_mm(between, aside, [aside.arc_mm])
            assert near == pytest.approx(point, abs=0.1)


def test_stick_slip_is_a_saw_tooth_in_truth(ways):
    """Held, the slip grows by no more than the contact rolls along the whisker, then jumps. Without static friction
    beyond the kinetic, each frame slips by much the same.
    """
    half = len(ways["teeth"]) // 2
    teeth, smooth = ([r for r in ways[n][:half] if r["contact"] == "1"] for n in ("teeth", "smooth"))
    steps, even = np.diff(column(teeth, "slip_mm"))[10:], np.diff(column(smooth, "slip_mm"))[10:]
    assert steps.sum() == pytest.approx(even.sum(), rel=0.1)
    assert even.max() < 1.3 * even.min()
    assert (steps < 0.1 * even.mean()).sum() > 20 and (steps > 1.5 * even.mean()).sum() > 20
    assert {"held", "sliding"} == {row["status"] for row in teeth}
    friction = np.array([60 - math.degrees(math.atan2(float(r["m_y_Nmm"]), float(r["m_z_Nmm"]))) for r in teeth])[10:]
    cones = [math.degrees(math.atan(mu)) for mu in (0.18, 0.25)]
    assert cones[0] - 0.5 < friction.min() < cones[0] + 1 and cones[1] - 1 < friction.max() < cones[1] + 0.5


def test_tip_contact_and_letting_go_are_statuses(tmp_path):
    """At 99.9 mm of 100 the contact reaches the tip while pushed, and slides off; then nothing is felt."""
    text = """
[motor]
after_deg = 20.0
[pictures]
after_deg = 20.0
[[trials]]
beta_deg = 75
d_x_mm = 99.9
d_x_scatter_mm = 0
friction = 0.2
"""
    session = simulate(tmp_path / "s", protocol=protocol_file(tmp_path, text), signals_only=True)
    (folder,) = (session / "trials").iterdir()
    table = rows(folder / "truth.csv")
    statuses = [row["status"] for row in table]
    first, last = statuses.index("tip"), len(statuses) - 1 - statuses[::-1].index("tip")
    assert {"held", "sliding"} & set(statuses[:first]) and set(statuses[first : last + 1]) == {"tip"}
    assert set(statuses[last + 1 :]) == {"free"} and last + 1 < len(statuses)
    assert {row["arc_mm"] for row in table[first : last + 1]} == {"100.000000"}
    assert {(row["contact"], row["m_y_Nmm"], row["x_mm"]) for row in table[last + 1 :]} == {("0", "0.000000", "nan")}


_RUN = """
import sys
from bench.rig.simulate import simulate
if __name__ == "__main__":
    simulate(sys.argv[1], protocol=sys.argv[2], seed=5, workers=2)
"""


def test_goes_on_after_a_kill(tiny, tmp_path):
    """Killed in the middle of its parts; what was whole stays untouched, the rest is made, and all is as ever."""
    script, session = tmp_path / "run.py", tmp_path / "session"
    script.write_text(_RUN)
    path = protocol_file(tmp_path, TINY)
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).resolve().parents[3])}
    run = subprocess.Popen([sys.executable, script, session, path], env=environment)
    deadline = time.time() + 60
    while time.time() < deadline and not whole_parts(session) and run.poll() is None:
        time.sleep(0.01)
    run.kill()
    run.wait(20)
    kept = whole_parts(session)
    assert kept
    times = {p: p.stat().st_mtime_ns for p in kept}
    time.sleep(1.5)  # its workers see that it is gone
    simulate(session, protocol=path, seed=5)
    assert contents(session) == contents(tiny)
    assert {p: p.stat().st_mtime_ns for p in kept} == times


def whole_parts(session):
    folders = [*session.glob("boards/*"), *session.glob("trials/*")]
    return [p for p in folders if not p.name.startswith(".")]


def test_size_and_time_are_said_before_and_progress_after(tmp_path, capsys):
    said, path = [], protocol_file(tmp_path, TINY)
    session = simulate(tmp_path / "s", protocol=path, signals_only=True, progress=True, announce=said.append)
    (line,) = said
    assert "4 trials, 6 whisks, 0 pictures" in line and "MB" in line and "minutes" in line
    bar = capsys.readouterr().err
    assert "parts" in bar and "/4 [" in bar
    size = sum(len(data) for name, data in contents(session).items() if name.endswith("signals.csv")) / 1e6
    assert float(line.split("about ")[1].split(" MB")[0]) == pytest.approx(size, abs=0.6)


def test_the_documents_example_loads(tmp_path):
    """And it names each table."""
    document = (Path(__file__).resolve().parents[3] / "docs" / "rig.md").read_text()
    text = document.split("```toml\n")[1].split("```")[0]
    protocol = load(protocol_file(tmp_path, text))
    assert len(protocol.runs()) == 7
    tables = {"whisker", "board", "cameras", "light", "pictures", "motor", "friction", "gauges", "trials"}
    assert tables < set(tomllib.loads(text))
