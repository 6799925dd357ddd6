"""Several wires in one picture: the nearer over the farther, each where its base has it."""

from itertools import permutations

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.rig import build
from bench.rig.light import Light, Material
from bench.rig.parts import Job
from bench.rig.protocol import load
from bench.rig.simulation import simulate
from bench.rig.tube import Tube, draw_tubes
from bench.rig.window import Window
from tests.scenes.rig_sessions import TINY, contents, protocol_file

ARRAY = (
    TINY.split("[[trials]]")[0]
    + """
[[columns]]
name = "a"
heights_mm = [0, 10]
[[columns]]
name = "b"
base_mm = [0, -16, 5]
heights_mm = [0]
[[trials]]
beta_deg = 10
"""
)
EVEN = Light(np.array([0.0, 0.0, 1.0]), 0.0, 1.0)


@pytest.fixture(scope="module")
def camera(tmp_path_factory):
    return build.cameras(load(protocol_file(tmp_path_factory.mktemp("rig"), ARRAY)))[0]


def on(window: Window, ground: float, tubes) -> np.ndarray:
    radiance = np.full(window.shape, ground, np.float32)
    draw_tubes(tubes, window, radiance, EVEN)
    return radiance


def test_the_nearer_wire_hides_the_farther_in_whatever_order_they_come(camera):
    """A third one leans, so that it is nearest on one side and farthest on the other: no order of wires would do."""
    window = Window.whole(camera, 3, 0.2)
    towards = camera.centre_mm / np.linalg.norm(camera.centre_mm)
    ends = {
        0.2: ([20, -30, 0], [80, 30, 0]),
        0.5: (12 * towards + [20, 30, 0], 12 * towards + [80, -30, 0]),
        0.9: (-20 * towards + [10, 0, 0], 30 * towards + [90, 0, 0]),
    }
    tubes = [Tube.straight(*end, 1.5, Material(tone)) for tone, end in ends.items()]
    drawn = [on(window, 0.0, order) for order in permutations(tubes)]
    assert all(np.array_equal(one, drawn[0]) for one in drawn)
    for pair in ((tubes[0], tubes[1]), (tubes[1], tubes[2]), (tubes[0], tubes[2])):
        dark, bright = ([on(window, ground, [tube]) for tube in pair] for ground in (0.0, 1.0))
        crossing = np.logical_and(
            *(np.abs(a - b) < 1e-6 for a, b in zip(dark, bright))
        )  # both cover all of it
        gaps = [np.abs(on(window, 0.0, pair) - one)[crossing].max() for one in dark]
        assert crossing.sum() > 20 and min(gaps) < 1e-6 < max(gaps)


def test_one_wire_is_drawn_as_ever(camera):
    window, tube = (
        Window.whole(camera, 3, 0.2),
        Tube.straight([20, -30, 0], [80, 30, 0], 1.5, Material(0.4)),
    )
    alone = np.full(window.shape, 0.3, np.float32)
    tube.draw(window, alone, EVEN)
    np.testing.assert_array_equal(alone, on(window, 0.3, [tube]))


def test_an_array_is_recorded_with_pictures_and_goes_on_where_it_stopped(tmp_path):
    file = protocol_file(tmp_path, ARRAY)
    session = simulate(tmp_path / "session", protocol=file, seed=1)
    before = contents(session)
    names = {name.split("/")[-1] for name in before if name.startswith("trials/")}
    assert {"truth@a1.csv", "truth@a2.toml", "truth@b1.csv", "frames.csv"} <= names
    (trial,) = (session / "trials").iterdir()
    frames = (trial / "frames.csv").read_text().splitlines()[1:]
    assert (
        len(list((trial / "left").iterdir()))
        == len(list((trial / "right").iterdir()))
        == len(frames)
    )
    assert (
        "[object]" not in (trial / "trial.toml").read_text()
    )  # people who take pictures need not say where it is
    (session / "boards" / "left" / "00.jpg").unlink()
    for file_ in trial.rglob("*.jpg"):
        file_.unlink()
    for folder in (trial / "left", trial / "right"):
        folder.rmdir()
    for file_ in trial.iterdir():
        file_.unlink()
    trial.rmdir()
    simulate(session, protocol=file, seed=1)
    again = contents(session)
    assert {name: again[name] for name in again} == {name: before[name] for name in again}


def test_a_hub_a_column(tmp_path):
    job = Job(tmp_path, load(protocol_file(tmp_path, ARRAY)), 0, False)
    stands = job.studios[0].scene.stands
    np.testing.assert_allclose([stand.pose[:, 3] for stand in stands], [[0, 0, 0], [0, -16, 5]])
    low, high = stands[0].low_mm[2], stands[0].high_mm[2]
    assert low < 0.0 and high > 10.0 and stands[1].high_mm[2] < 10.0
    hub = stands[0].hub(0.3)
    np.testing.assert_allclose(hub.axes[:, 0], [np.cos(0.3), np.sin(0.3), 0.0], atol=1e-12)


def test_a_soft_bar_is_refused_with_pictures(tmp_path):
    with pytest.raises(BadInput, match=r"before a soft bar.*signals-only"):
        simulate(
            tmp_path / "session", protocol=protocol_file(tmp_path, ARRAY + "stiffness_N_mm = 0.5\n")
        )
