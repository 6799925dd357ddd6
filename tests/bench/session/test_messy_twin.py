"""A session as a lab has it gives what its clean twin gives: a DAQ's own file, edges for frame times, a TIFF stack,
colour pictures by the camera's own names, and one [trial] for all."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.io import savemat

from bench.base.settings import Settings
from bench.trials.seeing import by_preset
from bench.workflows.session_evaluation import evaluate
from tests.scenes.results import table

LAMP = Path(__file__).resolve().parents[3] / "fixtures" / "scenes" / "lamp"
RATE_HZ, HIGH_V = 2000.0, 5.0
SIGNALS = """
[signals]
file = "daq.mat"
rate_Hz = 2000.0
motor_deg = {channel = "daq/enc", scale = -0.036, offset = 12.5}
m_y_Nmm = {channel = "daq/my", scale = 0.001}
m_z_Nmm = {channel = "daq/mz", scale = 0.001}
frame_V = {channel = "daq/trigger"}

[trial]
"""


def trigger(times_s: np.ndarray, count: int) -> np.ndarray:
    """A level that rises through its middle at these times, as a filtered pulse does between two samples."""
    level, middle = np.zeros(count), 0.5 * HIGH_V
    for time_s in times_s:
        last, share = divmod(time_s * RATE_HZ, 1.0)
        below, above = middle * np.array([share, 1.0 - share]) / max(share, 1.0 - share)
        level[int(last)], level[int(last) + 1] = middle - below, middle + above
        level[int(last) + 2 : int(last) + 5] = HIGH_V
    return level


def made_messy(session: Path) -> None:
    trial = session / "trials" / "w"
    rows, frames = (
        np.genfromtxt(trial / name, delimiter=",", names=True)
        for name in ("signals.csv", "frames.csv")
    )
    channels = {
        "enc": (rows["motor_deg"] - 12.5) / -0.036,
        "my": 1e3 * rows["m_y_Nmm"],
        "mz": 1e3 * rows["m_z_Nmm"],
        "trigger": trigger(frames["time_s"], len(rows)),
    }
    savemat(trial / "daq.mat", {"daq": channels})
    manifest = session / "session.toml"
    manifest.write_text(manifest.read_text() + SIGNALS + (trial / "trial.toml").read_text())
    for name in ("signals.csv", "frames.csv", "trial.toml"):
        (trial / name).unlink()
    greys = {
        name: [
            cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) for file in sorted((trial / name).iterdir())
        ]
        for name in ("cam0", "cam1")
    }
    for name in greys:
        shutil.rmtree(trial / name)
    assert cv2.imwritemulti(str(trial / "cam0.tif"), greys["cam0"])
    (trial / "cam1").mkdir()
    for k, grey in enumerate(greys["cam1"]):
        assert cv2.imwrite(str(trial / "cam1" / f"acA1300_{k + 7}.png"), cv2.merge([grey] * 3))


def columns(out: Path, name: str) -> list[dict[str, str]]:
    evaluated = table(out / name)
    assert evaluated
    return evaluated


@pytest.mark.slow
def test_a_messy_session_gives_what_its_clean_twin_gives(tmp_path):
    clean, messy = (Path(shutil.copytree(LAMP, tmp_path / name)) for name in ("clean", "messy"))
    made_messy(messy)
    settings = Settings(seeing=by_preset("draft"), figures=False)
    for session in (clean, messy):
        assert evaluate(session, session.with_suffix(".out"), settings, workers=0) in (0, 1)
    for name in ("whisks.csv", "estimates.csv"):
        (wanted,), (found,) = (
            [
                row
                for row in columns(session.with_suffix(".out"), name)
                if row.get("estimator", "with_friction") == "with_friction"
            ]
            for session in (clean, messy)
        )
        for key, text in wanted.items():
            if text and text.replace(".", "").replace("-", "").replace("e", "").isdigit():
                assert float(found[key]) == pytest.approx(float(text), rel=1e-4, abs=1e-6), key
        assert found["d_x_mm" if name == "whisks.csv" else "d_x_est_mm"]
