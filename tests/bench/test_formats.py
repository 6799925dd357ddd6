"""docs/formats.md names every key and column that there is, and none that there is not."""

import dataclasses
import json
import re
import tomllib
from pathlib import Path

import pytest

from bench.analyses import (
    against_theta,
    curved,
    error_map,
    explained,
    figure_8,
    gave,
    ledger,
    soft,
    tilted,
)
from bench.analyses import back_strokes as both_ways
from bench.analyses import friction_tables as tables
from bench.analyses import moving_objects as moving
from bench.analyses import single_camera as one_camera
from bench.analyses import table_i_sensors as sensors
from bench.array import shape_verdict as contacts
from bench.array import size
from bench.base.settings import Settings
from bench.commands import robot_trade, tradeoff
from bench.commands.evaluate import evaluate
from bench.gauges.gauges_file import FileKeys
from bench.plan import written
from bench.report import assembly
from bench.report import compare_runs as compare
from bench.report.run_facts import BoardFacts, CameraFacts
from bench.rig.simulate import simulate
from bench.session import manifest
from bench.theory import model_error_maps
from bench.trials import seeing
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
    "[seeing]": seeing.SeeingKeys,
}
CSV = {
    "whisks.csv": assembly.WHISK_COLUMNS,
    "estimates.csv": assembly.ESTIMATE_COLUMNS,
    "surface.csv": contacts.COLUMNS,
    "size.csv": size.COLUMNS,
    "track/<trial>.csv": assembly.TRACK_COLUMNS,
    "budget.csv": assembly.BUDGET_COLUMNS,
    "beam.csv": assembly.BEAM_COLUMNS,
    "friction.csv": tables.WHISK_COLUMNS,
    "phases.csv": tables.PHASE_COLUMNS,
    "surfaces.csv": tables.SURFACE_COLUMNS,
    "explained.csv": explained.COLUMNS,
    "error_map.csv": error_map.COLUMNS,
    "compliance.csv": (*soft.COLUMNS, *soft.SEEN_COLUMNS),
    "gives_way.csv": gave.COLUMNS,
    "curvature.csv": curved.COLUMNS,
    "tilts.csv": tilted.COLUMNS,
    "against_theta.csv": against_theta.COLUMNS,
    "ledger.csv": ledger.COLUMNS,
    "sensors.csv": sensors.COLUMNS,
    "moving.csv": moving.COLUMNS,
    "both_ways.csv": both_ways.COLUMNS,
    "one_camera.csv": one_camera.COLUMNS,
    "comparison": compare.COLUMNS,
    "figure_8.csv": figure_8.COLUMNS,
    "tradeoff.csv": tradeoff.COLUMNS,
    "robot_trade.csv": robot_trade.COLUMNS,
    "plan.csv": written.COLUMNS,
    "changes.csv": written.CHANGES,
    "error_by_tilt.csv, error_by_radius.csv": model_error_maps.COLUMNS,
}


@pytest.mark.parametrize("heading", TOML)
def test_keys_of_toml(heading):
    assert sorted(documented(heading)) == sorted(TOML[heading].__struct_fields__)


@pytest.mark.parametrize("heading", CSV)
def test_columns_of_tables(heading):
    assert sorted(documented(heading)) == sorted(CSV[heading])


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
