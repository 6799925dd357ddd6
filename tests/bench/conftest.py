"""Sessions whose truth is known without looking at their pictures, so that the bench is tested apart from vision."""

import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from bench.base.results import hash_of
from bench.base.settings import Settings
from bench.cameras.session_cameras import SessionCalibration
from bench.records.trial_result import SeenTrial, SeenWhisk
from bench.session.session import load_session
from bench.session.signals import forward_strokes
from bench.trials.seen import whisk_record
from bench.trials.seen_friction import with_seen_friction
from bench.workflows.session_evaluation import evaluate
from vision.truth.at_angle import Smooth
from vision.truth.records import FrameTruth, WhiskTruth
from vision.truth.value import FIELDS, Value

SIGMA_MM, SIGMA_RAD = 0.005, np.radians(0.05)


def read_csv(path: Path) -> dict[str, np.ndarray]:
    """Columns of a CSV file of numbers."""
    table = np.genfromtxt(path, delimiter=",", names=True)
    return {name: np.atleast_1d(table[name]) for name in table.dtype.names}


def exact_truth(folder: Path, number: int, rows: np.ndarray) -> WhiskTruth:
    """The truth of one whisk (the given rows of truth.csv) as vision would tell it, without error."""
    whole = tomllib.loads((folder / "truth.toml").read_text())
    at = {key: value[number] if isinstance(value, list) else value for key, value in whole.items()}
    table = {name: values[rows] for name, values in read_csv(folder / "truth.csv").items()}
    touch, d_x, beta = np.radians(at["touch_deg"]), at["d_x_mm"], np.radians(at["beta_deg"])
    touching = table["contact"] == 1
    theta = np.radians(table["motor_deg"]) - touch
    points = np.stack([table[k] for k in ("x_mm", "y_mm", "z_mm")], axis=1)
    contact = points @ np.array(
        [[np.cos(touch), -np.sin(touch), 0], [np.sin(touch), np.cos(touch), 0], [0, 0, 1]]
    )
    d_y, d_z = np.where(touching, d_x * np.tan(theta) - contact[:, 1], np.nan), contact[:, 2]
    phi = np.arctan2(d_z, d_y)
    values = {
        "slip": table["slip_mm"],
        "longitudinal_slip": table["arc_mm"] - d_x,
        "d_y": d_y,
        "d_z": d_z,
        "phi": phi,
        "alpha": abs(beta) - np.abs(phi),
    }
    beyond = contact[:, 0] - d_x
    in_hub = {
        "along": d_x / np.cos(theta) - d_y * np.sin(theta) + beyond * np.cos(theta),
        "across_y": d_y * np.cos(theta) + beyond * np.sin(theta),
    }
    first = d_x * np.array([np.cos(touch), np.sin(touch), 0.0])
    return WhiskTruth(
        number,
        _frames(table, theta, touching, points, values),
        Value(touch, SIGMA_RAD / 5),
        Value(first, np.full(3, SIGMA_MM)),
        Value(d_x, 2 * SIGMA_MM),
        Value(beta, 2 * SIGMA_RAD),
        Value(np.radians(at["psi_deg"]), SIGMA_RAD),
        2,
        len(theta),
        smooth=_smooth(theta, touching, values | in_hub, d_x),
    )


def _frames(table, theta, touching, points, values) -> FrameTruth:
    """Rows of truth.csv as vision's frames; values: by name, whose sigmas are empty where nothing touches."""
    sigmas = {name: SIGMA_RAD if FIELDS[name].endswith("_rad") else SIGMA_MM for name in values}
    columns = {
        FIELDS[k]: Value(column, np.where(touching, sigmas[k], np.nan))
        for k, column in values.items()
    }
    return FrameTruth(
        index=table["frame"].astype(int),
        time_s=table["time_s"],
        motor_rad=np.radians(table["motor_deg"]),
        theta_rad=Value(theta, np.full(len(theta), SIGMA_RAD)),
        touching=touching,
        point_mm=Value(points, np.full_like(points, SIGMA_MM)),
        arc_mm=table["arc_mm"],
        status=("",) * len(theta),
        **columns,
    )


def _smooth(theta, touching, values, d_x) -> Smooth:
    """What is told between frames."""
    # One parameter a value and frame: every number has the same sigma and no number shares another's error.
    n, kinds = int(touching.sum()), len(values)
    own = {name: np.eye(n * kinds)[k * n : (k + 1) * n] for k, name in enumerate(values)}
    return Smooth(
        theta[touching],
        np.zeros(n * kinds),
        {k: v[touching] for k, v in values.items()},
        own,
        SIGMA_MM**2 * np.eye(n * kinds),
        np.zeros((n * kinds, n * kinds)),
        np.zeros((n * kinds, 0)),
        d_x,
    )


def see_exactly(inputs, *_) -> SeenTrial:
    """In place of `see_trial`: what perfect pictures would show, from the truth files."""
    trial, signals = inputs.trial, inputs.signals
    strokes = forward_strokes(signals)
    time_s = read_csv(trial.folder / "truth.csv")["time_s"]
    whisks = []
    for number, stroke in enumerate(strokes):
        first, last = signals.time_s[stroke][[0, -1]]
        rows = np.flatnonzero((time_s >= first) & (time_s <= last))
        record = whisk_record(exact_truth(trial.folder, number, rows), inputs.settings)
        whisks.append(with_seen_friction(record, inputs.session.whisker))
    return SeenTrial(tuple(whisks), bar_radius_mm=3.0, wire_radius_mm=0.5)


@pytest.fixture
def exact_record():
    """A function (trial) that gives the record of its first whisk as perfect pictures would."""

    def record(trial) -> SeenWhisk:
        rows = np.arange(len(read_csv(trial.folder / "truth.csv")["frame"]))
        whisk = whisk_record(exact_truth(trial.folder, 0, rows), Settings())
        whisker = load_session(trial.folder.parents[1]).whisker
        return with_seen_friction(whisk, whisker)

    return record


@pytest.fixture
def steel_trial(steel_sample):
    """The trial of the sample session at 30°."""
    return load_session(steel_sample).trial("b30_3")


@pytest.fixture
def exact_vision(monkeypatch):
    """Evaluations (with workers=0) see exactly, and count how many trials they looked at."""
    return _see_exactly_in(monkeypatch)


@pytest.fixture(scope="session")
def exact_run(steel_signals, tmp_path_factory) -> Path:
    """A folder of results, seen exactly: of steel-signals, with a trial called `<script>`. Read only."""
    session = Path(shutil.copytree(steel_signals, tmp_path_factory.mktemp("signals") / "session"))
    (session / "trials" / "b30_3").rename(session / "trials" / "<script>")
    out = tmp_path_factory.mktemp("run")
    with pytest.MonkeyPatch.context() as monkeypatch:
        _see_exactly_in(monkeypatch)
        evaluate(session, out, Settings(), workers=0)
    return out


def _see_exactly_in(monkeypatch) -> list[str]:
    looks = []

    def see(inputs, *rest):
        looks.append(inputs.trial.name)
        return see_exactly(inputs, *rest)

    monkeypatch.setattr("bench.trials.truth_source.see_trial", see)
    nothing = SessionCalibration(None, {}, hash_of("exact"))
    monkeypatch.setattr("bench.trials.of_session.calibrate_session", lambda session, out: nothing)
    return looks


@pytest.fixture
def without_pictures(small_copy) -> Path:
    """The small session's signals, with gauges and distances as one would write them into the manifests."""
    for camera in ("high", "low"):
        for folder in [small_copy / "boards" / camera, *small_copy.glob(f"trials/*/{camera}")]:
            for picture in folder.iterdir():
                picture.unlink()
            folder.rmdir()
    for picture in (small_copy / "boards" / "rig").iterdir():
        picture.unlink()
    for trial, d_x_mm in (("b30_3", 55.0), ("b60_4", 65.0)):
        with (small_copy / "trials" / trial / "trial.toml").open("a") as file:
            file.write(f"\nd_x_mm = {d_x_mm}\n")
    with (small_copy / "session.toml").open("a") as file:
        file.write(
            "\n[gauges]\noffset_V = [0.0, 0.0]\nmatrix_Nmm_per_V = [[11.31159, 0.32265], [-0.24882, 10.53619]]\n"
        )
    return small_copy
