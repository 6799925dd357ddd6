"""A trial as a film: every frame of its whisks, with the contact where it was seen."""

import json
import shutil
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from bench.base.settings import Settings
from bench.commands.cli import main
from bench.records.trial_result import WhiskerFacts
from bench.report.video import _wire
from bench.trials.seen import whisk_record
from tests.scenes.planned import LINES, cameras_of, protocol_of, staged_of
from vision.truth.predicted_truth import predict_truth

SIZE = (320, 180)
CAMERA = {
    "name": "top",
    "size_px": list(SIZE),
    "matrix": [[400, 0, 160], [0, 400, 90], [0, 0, 1]],
    "distortion": [0.0] * 5,
    "T_camera_rig": [[1, 0, 0, -50], [0, -1, 0, 0], [0, 0, -1, 200]],  # straight above, 200 mm
    "rms_px": 0.1,
}


# A wire of no frame's fit, drawn beside the contact, which is looked for by its colour.
UNBENT = {"rest_mm": [[0.0, -60.0, 0.0, 0.0], [0.0] * 4], "index": [], "bend_rad": [], "arc_mm": []}


@pytest.fixture(scope="module")
def filmed(exact_run, steel_signals, tmp_path_factory):
    """A run with a camera, and its session with grey pictures of one trial."""
    folder = tmp_path_factory.mktemp("filmed")
    out, session = (
        shutil.copytree(exact_run, folder / "out"),
        shutil.copytree(steel_signals, folder / "session"),
    )
    record = json.loads((out / "run.json").read_text()) | {"cameras": [CAMERA]}
    (out / "run.json").write_text(json.dumps(record))
    path = out / "trials" / "b60_4.json"
    result = json.loads(path.read_text())
    for whisk in result["seen"]["whisks"]:
        whisk["truth"]["shape"] = UNBENT
    path.write_text(json.dumps(result))
    rows = (session / "trials" / "b60_4" / "frames.csv").read_text().splitlines()[1:]
    (session / "trials" / "b60_4" / "top").mkdir()
    grey = np.full(SIZE[::-1], 120, np.uint8)
    for k in range(len(rows)):
        cv2.imwrite(str(session / "trials" / "b60_4" / "top" / f"{k:03d}.png"), grey)
    return out, session


def read(path) -> list[np.ndarray]:
    video, found = cv2.VideoCapture(str(path)), []
    while (frame := video.read())[0]:
        found.append(frame[1])
    return found


@pytest.mark.parametrize("name", ["film.webm", "film.avi"])
def test_every_frame_is_there_with_its_contact(filmed, tmp_path, name, capfd):
    out, session = filmed
    command = ["view", str(out), "b60_4", "--session", str(session), "--out", str(tmp_path / name)]
    assert main(command) == 0
    said = capfd.readouterr()
    assert said.out.strip() == str(tmp_path / name) and not said.err
    frames = json.loads((out / "trials" / "b60_4.json").read_text())["seen"]["whisks"][0]["truth"][
        "frames"
    ]
    film = read(tmp_path / name)
    assert len(film) == len(frames["index"])
    k = max(k for k, touching in enumerate(frames["touching"]) if touching)
    x, y, z = frames["point_mm"][k]
    scale = film[k].shape[1] / SIZE[0]
    px = (
        scale * (np.array([400 * (x - 50) / (200 - z) + 160, 400 * -y / (200 - z) + 90]) + 0.5)
        - 0.5
    )
    around = film[k][int(px[1]) - 8 : int(px[1]) + 9, int(px[0]) - 8 : int(px[0]) + 9].astype(int)
    redness = around[..., 2] - around[..., 0]
    assert redness.max() > 60  # the ring about the contact; the picture itself is grey
    rows, columns = np.nonzero(redness > 0.5 * redness.max())
    assert abs(columns.mean() - 8) < 2 and abs(rows.mean() - 8) < 2


def test_what_cannot_be_shown_is_one_line(filmed, tmp_path, capsys):
    out, session = filmed
    bare = shutil.copytree(out, tmp_path / "bare")
    (bare / ".session").unlink()
    for arguments in (
        [out, "no_such_trial"],
        [out, "b60_4", "--out", tmp_path / "film.mp4"],
        [out, "b60_4", "--session", tmp_path / "nowhere"],
        [out, "b00_2", "--session", session],  # has no pictures
        [out, "b60_4", "--rate-Hz", "0"],
        [bare, "b60_4"],
        [tmp_path, "b60_4"],
    ):
        assert main(["view", *map(str, arguments)]) == 2, arguments
        said = capsys.readouterr().err
        assert said.startswith("whisker-bench: ") and said.count("\n") == 1
    assert not list(tmp_path.glob("*.mp4")) and not (out / "video").exists()


def test_the_wire_drawn_is_the_one_that_was_fitted(tmp_path):
    """Through the contact in a frame of the fit, unbent in one that is not in it."""
    protocol = protocol_of(tmp_path)
    staged, cameras = staged_of(protocol), cameras_of(protocol)
    truth = predict_truth(staged.known, cameras, dict.fromkeys(cameras.names, LINES)).truth
    whisk = whisk_record(truth, Settings())
    result = SimpleNamespace(whisker=WhiskerFacts("cylinder", 100.0, 1.0, 2945.0))
    last = len(whisk.frames.index) - 1
    contact = whisk.frames.point_mm.value[last]
    wire = _wire(result, whisk, last)
    # nodes are 2.5 mm apart, and the wire bows by less than 0.01 mm between two of them
    assert np.min(np.linalg.norm(_dense(wire) - contact, axis=1)) < 0.01
    earlier = replace(
        whisk,
        truth=replace(
            whisk.truth, shape=replace(whisk.truth.shape, index=whisk.truth.shape.index + 1000)
        ),
    )
    assert np.allclose(_wire(result, earlier, last)[-1, 2], 0.0, atol=1e-9)


def _dense(line):
    """Points (n, 3) on the straight pieces of a line."""
    return np.concatenate(
        [a + (b - a) * np.linspace(0.0, 1.0, 500)[:, None] for a, b in pairwise(line)]
    )
