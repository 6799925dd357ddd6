"""docs/formats.md names every key and column that there is, and none that there is not."""

import dataclasses
import importlib
import json
import re
import tomllib
from pathlib import Path

import pytest

from bench.base.settings import Settings
from bench.base.tables import Table
from bench.gauges.gauges_file import FileKeys
from bench.report.run_facts import BoardFacts, CameraFacts
from bench.rig.simulation import simulate
from bench.session import manifest
from bench.session.givens import GivenKeys
from bench.session.rig_file import RigFileKeys
from bench.session.strict_toml import key_names
from bench.trials import seeing
from bench.workflows.session_evaluation import evaluate
from docs import formats
from tests.scenes.formats import DOCUMENT, documented, keys
from tests.scenes.rig_sessions import protocol_file

ROOT = Path(__file__).resolve().parents[2]
TOML = {
    "[session.toml] top": manifest.SessionKeys,
    "[whisker]": manifest.WhiskerKeys,
    "[[whiskers]]": manifest.ArrayWhiskerKeys,
    "[whiskers.channels]": manifest.ChannelNames,
    "[object]": manifest.ObjectKeys,
    "[bar]": manifest.BarKeys,
    "[board]": manifest.BoardKeys,
    "[rig]": manifest.RigKeys,
    "[[cameras]]": manifest.CameraKeys,
    "[gauges]": manifest.GaugeKeys,
    "[signals]": manifest.SignalKeys,
    "[trial]": manifest.TrialKeys,
    "gauges.toml": FileKeys,
    "rig.toml": RigFileKeys,
    "[seeing]": seeing.SeeingKeys,
}


def tables_of_the_code() -> list[Table]:
    """Return all tables that any module of bench declares."""
    modules = [
        importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
        for path in sorted((ROOT / "bench").rglob("*.py"))
    ]
    return [each for module in modules for each in vars(module).values() if isinstance(each, Table)]


def test_the_page_is_what_the_script_writes():
    assert formats.page(DOCUMENT) == DOCUMENT, "run python docs/formats.py"


def test_every_table_is_on_the_page():
    """A table that is another with columns before it, or without its last, has that one's section."""
    on_page = {each.name for each in formats.named_parts(DOCUMENT) if isinstance(each, Table)}
    assert on_page == {table.name for table in tables_of_the_code()}


def test_every_column_has_a_name_of_its_own_and_a_meaning():
    for table in tables_of_the_code():
        assert len(set(table.names)) == len(table.names), table.name
        assert all(column.meaning for column in table.columns), table.name


@pytest.mark.parametrize("heading", TOML)
def test_keys_of_toml(heading):
    in_any = set() if TOML[heading] is manifest.SessionKeys else set(key_names(GivenKeys))
    assert sorted(documented(heading)) == sorted(set(key_names(TOML[heading])) - in_any)


def test_every_key_is_explained():
    for part in formats.named_parts(DOCUMENT):
        if not isinstance(part, Table):
            assert all(meaning for _, meaning in formats.explained_keys(part)), part


def test_keys_of_results(steel_signals, exact_vision, tmp_path):
    """Without a picture; what pictures add is looked at where the small session is evaluated (test_end_to_end.py)."""
    evaluate(steel_signals, tmp_path, Settings(), workers=0)
    written = keys(json.loads((tmp_path / "trials" / "b60_4.json").read_text()))
    named = set(documented("trials/<trial>.json"))
    assert {path for path in named if not path.startswith("seen.")} == {
        p for p in written if not p.startswith("seen.")
    }


def test_keys_of_the_run(exact_run):
    record = json.loads((exact_run / "run.json").read_text())
    named = set(documented("run.json"))
    written = {
        re.sub(r"^(recordings|results|versions)\.(.*)$", _by_name, key) for key in keys(record)
    }
    absent = {"board", "cameras"}  # without pictures
    assert {n for n in named if n.split(".")[0].rstrip("[]") not in absent} == written - absent
    fields = {f"cameras[].{f.name}" for f in dataclasses.fields(CameraFacts)}
    fields |= {f"board.{f.name}" for f in dataclasses.fields(BoardFacts)}
    assert {n for n in named if n.split(".")[0].rstrip("[]") in absent} == fields


def _by_name(match: re.Match) -> str:
    return f"{match[1]}.<{'distribution' if match[1] == 'versions' else 'trial'}>"


def test_truth_of_a_simulated_session(tmp_path):
    protocol = protocol_file(
        tmp_path, "[[trials]]\nbeta_deg = 20\nstiffness_N_mm = 1\nobject = 'sphere'\n"
    )
    session = simulate(tmp_path / "session", protocol=protocol, seed=1, signals_only=True)
    (folder,) = (session / "trials").iterdir()
    written = {
        "truth.json": json.loads((session / "truth.json").read_text()),
        "truth.toml": tomllib.loads((folder / "truth.toml").read_text()),
        "truth.csv": (folder / "truth.csv").read_text().split("\n")[0].split(","),
    }
    for heading, names in written.items():
        assert sorted(documented(heading)) == sorted(names)


def test_every_file_is_named():
    """Names of files that a run writes stand as such in the code, or are made of a stem that does."""
    whole = "\n".join(
        path.read_text()
        for path in [*(ROOT / "bench").rglob("*.py"), *(ROOT / "vision").rglob("*.py")]
    )
    section = DOCUMENT.split("## OUT\n")[1].split("###")[0]
    for name in re.findall(r"`([^`]+)`", section):
        stem = re.sub(r"\.(csv|png|json|toml|npz|txt)$", "", name)
        assert all(part in whole for part in re.split(r"/|<\w+>_?", stem)), name
