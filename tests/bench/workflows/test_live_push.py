"""A push that is fed from memory, and one that is played from its recording."""

import shutil
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from bench import api
from bench.base.errors import BadInput
from bench.base.exit_codes import BAD_INPUT, DONE
from bench.commands.cli import main
from bench.workflows import live_push
from bench.workflows.live_film import FILM_HZ, LiveFilm
from bench.workflows.live_push import Played, ProcessorClock
from vision import WhiskTruth

SIZE = (720, 1280)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """A folder that keeps the cameras' calibration."""
    return tmp_path_factory.mktemp("live")


@pytest.fixture(scope="module")
def push(small_session, out):
    return api.live(small_session, out, "b30_3", (0.0, 6.0))


def test_what_the_session_knows_is_there_before_a_push(push):
    bench = push.whisk.bench
    assert set(bench.background) >= set(bench.cameras.names) == {"high", "low"}
    assert bench.rods.bar.radius_mm == 3.0 and bench.stroke_rad == (0.0, np.radians(6.0))


def test_a_picture_of_another_camera_or_size_is_one_line(push):
    with pytest.raises(BadInput, match="no camera 'side'; there are high, low"):
        push.add("side", 0, 0.0, 0.0, np.zeros(SIZE, np.uint8))
    with pytest.raises(BadInput, match="frame 4: 10 x 12 pixels, 720 x 1280 are"):
        push.add("low", 4, 0.0, 0.0, np.zeros((10, 12), np.uint8))


def test_a_recorded_push_is_played(small_session, out, capsys):
    arguments = ["live", str(small_session), "b30_3", "--out", str(out)]
    assert main(arguments) == DONE
    line = capsys.readouterr().out
    assert line.startswith("b30_3, whisk 0: d_x 55.2") and "s after the last frame" in line
    drawn = cv2.imread(str(out / "live" / "b30_3_0.png"))
    assert np.any(drawn[..., 0] != drawn[..., 2])  # lines in colour on grey pictures


def test_a_trial_that_is_not_there_is_one_line(small_session, out, capsys):
    assert main(["live", str(small_session), "b31", "--out", str(out)]) == BAD_INPUT
    assert "no trial 'b31'; there are b30_3, b60_4" in capsys.readouterr().err


def test_nothing_is_written_into_the_session(small_session, capsys):
    inside = small_session / "out"
    assert main(["live", str(small_session), "b30_3", "--out", str(inside)]) == BAD_INPUT
    assert "lies in the session" in capsys.readouterr().err and not inside.exists()


def test_a_film_lasts_as_long_as_the_push_and_its_answer_is_held():
    """Two pictures 0.1 s apart, the truth 0.1 s after the second, then 2 s: 25 frames a second."""
    dark = np.tile(np.arange(128, dtype=np.uint8), (72, 1))
    bright = dark[:, ::-1]
    shows = SimpleNamespace(lines_px=dict)
    film = LiveFilm()
    film.watch(5.0, SimpleNamespace(pictures={"a": dark, "b": dark}, whisk=shows))
    film.watch(5.1, SimpleNamespace(pictures={"a": bright, "b": dark}, whisk=shows))
    film.end(Played(WhiskTruth(0), 0.1, {"a": bright, "b": bright}, ProcessorClock(5.2)))
    assert len(film.pictures) == pytest.approx(2.2 * FILM_HZ, abs=1)
    assert all(picture.shape == (405, 1440, 3) for picture in film.pictures)
    changes = [np.any(one != next_) for one, next_ in zip(film.pictures, film.pictures[1:])]
    assert sum(changes) == 2


def test_another_kind_of_film_is_one_line(small_session, out, capsys):
    arguments = ["live", str(small_session), "b30_3", "--out", str(out), "--film", "push.mp4"]
    assert main(arguments) == BAD_INPUT
    assert "push.mp4: must end in .webm or .avi" in capsys.readouterr().err


def test_a_motor_angle_without_a_zero_is_one_line(small_session, out, monkeypatch):
    monkeypatch.setattr(live_push, "angle_source", lambda trial: SimpleNamespace(has_zero=False))
    with pytest.raises(BadInput, match=r"trial\.toml: the motor's angle has no zero"):
        api.live(small_session, out, "b30_3", (0.0, 6.0))


def test_an_object_that_gives_way_is_refused_in_one_line(small_session, tmp_path, capsys):
    session = tmp_path / "session"
    shutil.copytree(small_session, session)
    stated = session / "trials" / "b30_3" / "trial.toml"
    stated.write_text("object_gives_way = true\n" + stated.read_text())
    assert main(["live", str(session), "b30_3", "--out", str(tmp_path / "out")]) == BAD_INPUT
    assert "trials/b30_3/trial.toml: the object moves" in capsys.readouterr().err
