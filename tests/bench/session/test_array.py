"""A session of several whiskers: a view a whisker, and what is refused in a line."""

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.session.array_view import load_views
from bench.session.session import load_session
from bench.session.session_check import checked_views
from bench.session.signals import read_signals

HEAD = 'format = 1\nname = "two"\n[bar]\ndiameter_mm = 6.0\n'
WHISKER = "length_mm = 100.0\ndiameter_mm = 1.0\nyoungs_modulus_GPa = 60.0\n"
GAUGES = "[whiskers.gauges]\noffset_V = [0.1, 0.2]\nmatrix_Nmm_per_V = [[10.0, 0.0], [0.0, 11.0]]\n"
COLUMNS = ("y_V@a", "z_V@a", "y_V@b", "z_V@b")


def whisker(name: str, base_mm=(0.0, 0.0, 0.0), more: str = "") -> str:
    return f'[[whiskers]]\nname = "{name}"\nbase_mm = {list(base_mm)}\n{WHISKER}{more}'


TWO = (
    whisker("a")
    + GAUGES
    + whisker("b", (1.0, 2.0, 12.0), "base_deg = [0.0, 0.0, 30.0]\nbase_sigma_mm = 0.05\n")
)


def session(folder, text: str = TWO, head: str = HEAD, columns=COLUMNS, signals: str = ""):
    trial = folder / "trials" / "t"
    trial.mkdir(parents=True)
    (folder / "session.toml").write_text(head + text)
    time, motor = np.arange(200) / 200.0, np.linspace(-2.0, 6.0, 200)
    volts = [0.01 * k + 0.001 * time for k in range(len(columns))]
    rows = np.column_stack([time, motor, *volts])
    names = ",".join(("time_s", "motor_deg", *columns))
    (trial / "signals.csv").write_text(
        "\n".join([names, *(",".join(f"{v:.6f}" for v in row) for row in rows)]) + "\n"
    )
    return folder


def refusal(folder, *args, **given) -> str:
    with pytest.raises(BadInput) as refused:
        load_views(session(folder, *args, **given))
    return str(refused.value)


def test_a_view_is_a_session_of_that_whisker_alone(tmp_path):
    a, b = checked_views(session(tmp_path))
    assert (a.name, a.whole_name, a.base.name, b.base.name) == ("two, whisker a", "two", "a", "b")
    assert a.gauges.offset_V.tolist() == [0.1, 0.2] and b.gauges is None
    assert b.whisker.length_mm == 100.0 and b.base.sigma_mm == 0.05
    cos, sin = np.cos(np.pi / 6), np.sin(np.pi / 6)
    np.testing.assert_allclose(
        b.base.T_rig_base, [[cos, -sin, 0, 1], [sin, cos, 0, 2], [0, 0, 1, 12]], atol=1e-12
    )
    for view, first in ((a, 0.0), (b, 0.02)):
        signals = read_signals(view.trial("t"))
        assert (signals.kind, signals.y[0], signals.z[0]) == ("V", first, first + 0.01)


def test_turns_are_about_x_then_y_then_z(tmp_path):
    """Of a base turned by 90° about x and 90° about z the axis, z, goes to −y and on to x."""
    (view,) = load_views(session(tmp_path, whisker("a", more="base_deg = [90.0, 0.0, 90.0]\n")))
    np.testing.assert_allclose(view.base.T_rig_base[:, 2], [1.0, 0.0, 0.0], atol=1e-12)


def test_channels_may_have_any_name(tmp_path):
    named = 'channels = { y_V = "s1", z_V = "s2", motor_deg = "left" }\n'
    (view,) = load_views(session(tmp_path, whisker("a", more=named), columns=("s1", "s2", "left")))
    signals = read_signals(view.trial("t"))
    assert (
        signals.y[0] == 0.0
        and signals.z[0] == 0.01
        and np.degrees(signals.motor_rad[0]) == pytest.approx(0.02)
    )


@pytest.mark.parametrize(
    "text, said",
    [
        (whisker("a") + whisker("A", (0, 0, 9)), "name 'A' is used twice"),
        (whisker("../a"), "letters, digits"),
        (
            whisker("a") + whisker("b", (0, 0.6, 0.7)),
            "the bases of a and b touch: 0.922 mm apart, radii 1 mm",
        ),
        (
            whisker("a") + whisker("b", (0, 0, 9), 'channels = { y_V = "y_V@a" }\n'),
            "a and b share the channel 'y_V@a'",
        ),
        (whisker("a", more='channels = { z_V = "y_V@a" }\n'), "a has the channel 'y_V@a' twice"),
        (
            whisker("a") + whisker("b", (0, 0, 9), "base_deg = [0, 5, 0]\n"),
            "on one motor (motor_deg), their axes 5° a",
        ),
        (whisker("a", more="rigidity = 3\n"), "[[whiskers]] rigidity is not a key"),
        ("[whisker]\n" + WHISKER + whisker("a"), "has [whisker] and [[whiskers]]"),
        (GAUGES.replace("whiskers.", "") + whisker("a"), "give each of [[whiskers]] its own"),
        ('[[whiskers]]\nname = "a"\n' + WHISKER, "[[whiskers]] base_mm is missing"),
        (
            whisker("a", more="tip_diameter_mm = 0.5\n"),
            "[[whiskers]] a: tip_diameter_mm belongs to",
        ),
    ],
)
def test_what_cannot_be_an_array_is_refused(tmp_path, text, said):
    assert said in refusal(tmp_path, text)


def test_a_whisker_without_columns_is_named(tmp_path):
    with pytest.raises(
        BadInput, match=r"signals.csv \(whisker b\): has no channel y_V@b; it has .*y_V@a"
    ):
        checked_views(session(tmp_path, columns=COLUMNS[:2]))


def test_verbs_of_one_whisker_say_that_there_are_several(tmp_path):
    with pytest.raises(BadInput, match="several whiskers"):
        load_session(session(tmp_path))


@pytest.mark.parametrize(
    "text, said",
    [
        ('shape = "ring"\npoint_mm = [0, 0, 0]', 'ring_diameter_mm belongs to shape = "ring"'),
        ("point_mm = [0, 0, 0]\naxis = [0, 0, 0]", "axis is a direction, not zero"),
        ('shape = "cone"\npoint_mm = [0, 0, 0]', 'half_angle_deg belongs to shape = "cone"'),
        (
            'shape = "cone"\npoint_mm = [0, 0, 60]\nhalf_angle_deg = -10',
            "half_angle_deg is -10; from 0.1 to 85",
        ),
        (
            'shape = "cone"\npoint_mm = [50, 0, -20]\nhalf_angle_deg = 10',
            "the cone's tip, point_mm, lies before every",
        ),
        ('shape = "cube"\npoint_mm = [0, 0, 0]', "[object] shape"),
        ('shape = "sphere"\naxis = [0, 0, 1]', "point_mm is missing"),
        ("point_sigma_mm = 0.1", "point_mm is missing"),
    ],
)
def test_an_object_that_cannot_be_is_refused(tmp_path, text, said):
    folder = session(tmp_path)
    (folder / "trials" / "t" / "trial.toml").write_text(f"[object]\n{text}\n")
    with pytest.raises(BadInput) as refused:
        load_views(folder)
    assert said in str(refused.value)


def test_a_ring_is_wider_than_its_bar_is_thick(tmp_path):
    folder = session(tmp_path)
    text = '[object]\nshape = "ring"\nring_diameter_mm = 5.5\n'
    (folder / "trials" / "t" / "trial.toml").write_text(text)
    with pytest.raises(BadInput, match=r"ring_diameter_mm is 5\.5, of a bar of 6 mm"):
        load_views(folder)


def test_an_object_may_be_told_by_its_shape_alone(tmp_path):
    folder = session(tmp_path)
    (folder / "trials" / "t" / "trial.toml").write_text(
        '[object]\nshape = "cone"\nhalf_angle_deg = 20\n'
    )
    stated = load_views(folder)[0].trials[0].object
    assert (stated.shape, stated.half_angle_deg, stated.point_mm, stated.axis) == (
        "cone",
        20,
        None,
        None,
    )
