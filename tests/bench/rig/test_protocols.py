"""Protocols: what is built in, and one clear line for what is wrong."""

import tomllib
from pathlib import Path

import pytest

from bench.base.errors import BadInput
from bench.rig.protocol import FOLDER, load
from bench.rig.simulation import simulate
from tests.scenes.rig_sessions import TINY, protocol_file


@pytest.mark.parametrize(
    "change, message",
    [
        (('name = "tiny"', 'nome = "tiny"'), "there is no key `nome`"),
        (("[[trials]]", "[[trails]]"), "there is no key `trails`"),
        (('name = "tiny"', "format = 1"), "is a session's file, no protocol of a rig"),
        (("views = 2", 'views = "two"'), "board.views: expected a whole number, found text"),
        (("beta_deg = [20, 50]", "beta_deg = [20, 95]"), "±89"),
        (
            ("beta_deg = [20, 50]", 'beta_deg = "steep"'),
            "trials[0].beta_deg: expected a number or a list, found text",
        ),
        (
            ("static_friction = 0.3", 'static_friction = "high"'),
            "trials[2].static_friction: expected a number, found text",
        ),
        (("friction = 0.2\n", "friction = -0.2\n"), "friction"),
        (("static_friction = 0.3", "static_friction = 0.1"), "below friction"),
        (("d_x_mm = 50.0", "d_x_mm = 0.05"), "d_x_mm"),
        (("speed_deg_s = 90.0", "speed_deg_s = 0.0"), "speed_deg_s"),
        (("views = 2", "views = 2\nmarker_mm = 20.0"), "marker"),
        (("views = 2", 'views = 2\ndictionary = "DICT_9X9"'), "no ArUco dictionary"),
        (
            ("position_mm = [30.0, -150.0, 250.0]", "position_mm = [55.0, 0.0, 250.0]"),
            "straight up or down",
        ),
        (('name = "right"', 'name = "left"'), "names of their own"),
        (("clock_offset_s = 0.003", "after_deg = 9.0"), "at most the motor's"),
        (("[[trials]]\nbeta_deg = [20, 50]", "[[trials]\nbeta_deg = [20, 50]"), "is not TOML"),
    ],
)
def test_a_bad_protocol_is_refused_in_one_line(tmp_path, change, message):
    assert change[0] in TINY
    path = protocol_file(tmp_path, TINY.replace(*change))
    with pytest.raises(BadInput, match=r"protocol\.toml") as found:
        simulate(tmp_path / "session", protocol=path)
    assert message in str(found.value) and "\n" not in str(found.value)
    assert not (tmp_path / "session").exists()


def test_a_missing_protocol_names_the_built_in_ones(tmp_path):
    with pytest.raises(BadInput, match=r"no\.toml.*nitinol, paper, .*vibrissa"):
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
        ("steel", 10),
        ("steel", 90),
        ("sandpaper", 10),
        ("sandpaper", 90),
    }
    assert sorted({r.beta_deg for r in measured}) == list(range(0, 80, 5))
    assert {r.table.follicle_roll_deg for r in runs if r.table.purpose == "gauge"} == {0, 90}
    assert {(r.before_deg, r.after_deg) for r in measured} == {(3, 12), (15, 20)}


def test_quick_is_a_dozen_whisks_half_with_one_coefficient():
    measured = [r for r in load("quick").runs() if r.table.purpose == "measure"]
    assert len(measured) == 12 and all(r.table.whisks == 1 for r in measured)
    assert sum(r.table.static_friction is None for r in measured) == 6


def test_the_documents_example_loads(tmp_path):
    """And it names each table."""
    document = (Path(__file__).resolve().parents[3] / "docs" / "rig.md").read_text()
    text = document.split("```toml\n")[1].split("```")[0]
    protocol = load(protocol_file(tmp_path, text))
    assert len(protocol.runs()) == 7
    tables = {
        "whisker",
        "board",
        "cameras",
        "light",
        "pictures",
        "motor",
        "friction",
        "gauges",
        "trials",
    }
    assert tables < set(tomllib.loads(text))
