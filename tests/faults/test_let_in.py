"""What is not let in: what would hang a reader, fill the memory, or lead out of the session. One line, exit code 2."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bench.base import environment
from bench.base.errors import BadInput
from bench.base.packages import PACKAGES
from bench.commands import cli
from bench.session.session_check import checked_session
from tests.scenes.faults import FAULTS, TRIAL
from vision.calibration.cameras_file import read_cameras
from vision.calibration.cameras_import import import_cameras
from vision.geometry.refusals import Refused
from vision.pictures.files import picture_size, read_picture

ROOT = Path(__file__).resolve().parents[2]


def refusal(session) -> str:
    with pytest.raises(BadInput) as bad:
        checked_session(session)
    return str(bad.value)


def test_a_pipe_in_place_of_a_picture(session):
    FAULTS["FIFO for a picture"](session)
    assert (
        refusal(session)
        == f"trials/{TRIAL}/low/000003.jpg: is no regular file (a pipe, socket or device)"
    )


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "0.png")
    assert read_picture(tmp_path / "0.png") is None
    assert picture_size(tmp_path / "0.png") is None


def test_a_link_out_of_the_session(session):
    FAULTS["folder is a link out"](session)
    assert refusal(session).startswith(
        f"trials/{TRIAL}/low: is a link that leads out of the session"
    )


def test_footage_elsewhere_is_followed_where_the_user_says_so(session, tmp_path):
    FAULTS["folder is a link out"](session)
    assert "give --follow-links where you know who made it" in refusal(session)
    one = session / "trials" / TRIAL / "high" / "000003.jpg"
    shutil.move(one, tmp_path / "one.jpg")
    one.symlink_to(tmp_path / "one.jpg")
    assert len(checked_session(session, follow_links=True).trials) == 4


@pytest.mark.parametrize("verb", ["check", "evaluate", "plan", "robot"])
def test_every_verb_that_sees_follows_where_the_user_says_so(session, tmp_path, capsys, verb):
    """A link out, and beside it a pipe, so that no verb goes on to look."""
    FAULTS["folder is a link out"](session)
    (session / "trials" / TRIAL / "high" / "000003.jpg").unlink()
    os.mkfifo(session / "trials" / TRIAL / "high" / "000003.jpg")
    options = [verb, str(session), *([] if verb == "check" else ["--out", str(tmp_path / "out")])]
    for follow in ([], ["--follow-links"]):
        assert cli.main([*options, *follow]) == 2
        shown = "".join(capsys.readouterr())
        assert "is no regular file" in shown
        assert ("leads out of the session" in shown) != bool(follow)


def test_nothing_but_footage_is_followed_out(session, tmp_path):
    (tmp_path / "deep").mkdir()
    for place in (f"trials/{TRIAL}/signals.csv", "trials/b30_3", f"trials/{TRIAL}/low/000003.jpg"):
        link = session / place
        shutil.move(link, tmp_path / link.name)
        link.symlink_to(tmp_path / link.name if "low" not in place else tmp_path / "deep")
    with pytest.raises(BadInput) as bad:
        checked_session(session, follow_links=True)
    assert str(bad.value).count("leads out of the session; put the files themselves there") == 3


def test_a_link_to_nowhere_and_one_in_a_circle(session):
    (session / "trials" / "a").symlink_to("nowhere")
    (session / "trials" / "b").symlink_to("b")
    (session / "trials" / "c").symlink_to(session / "trials")
    said = refusal(session)
    assert said.count("leads nowhere") == 2
    assert "trials/c: is a link to a folder that holds it" in said


def test_a_link_within_the_session_and_a_linked_session_are_taken(session, tmp_path):
    low = session / "trials" / TRIAL / "low"
    shutil.move(low, session / "pictures")
    low.symlink_to(session / "pictures")
    (tmp_path / "link").symlink_to(session)
    assert len(checked_session(tmp_path / "link").trials) == 4


@pytest.mark.parametrize(
    ("name", "fault"),
    [(b"b30\xff", "the name is not UTF-8"), (b"b30\n4", "the name holds a line break")],
)
def test_a_name_that_breaks_tables_is_one_clear_line(session, name, fault, tmp_path, capsys):
    os.mkdir(os.path.join(os.fsencode(session), b"trials", name))
    assert cli.main(["check", str(session)]) == 2
    bad = [line for line in capsys.readouterr().out.splitlines() if line.startswith("error: ")]
    assert len(bad) == 1
    assert fault in bad[0]
    assert bad[0].isascii()
    assert cli.main(["evaluate", str(session), "--out", str(tmp_path / "out")]) == 2
    assert fault in capsys.readouterr().err


@pytest.mark.parametrize("name", ["trial.toml", "frames.csv"])
def test_a_folder_in_place_of_a_file_is_no_absent_file(session, name):
    file = session / "trials" / TRIAL / name
    file.unlink(missing_ok=True)
    file.mkdir()
    with pytest.raises(BadInput, match=rf"trials/{TRIAL}/{name}: is a folder"):
        checked_session(session)


def test_a_picture_of_absurd_size_is_damaged(session):
    FAULTS["PNG of 60000 x 60000"](session)
    file = session / "trials" / TRIAL / "low" / "000003.png"
    assert read_picture(file) is None
    assert picture_size(file) is None
    checked_session(session)


def test_brackets_without_end_in_cameras(tmp_path):
    (tmp_path / "cameras.toml").write_text("x = " + "[" * 100000)
    for read in (read_cameras, import_cameras):
        with pytest.raises(Refused, match="is not TOML"):
            read(tmp_path / "cameras.toml")


@pytest.mark.parametrize("name", ["../cameras.npz", "..", "/etc/passwd", "", 3])
def test_the_covariance_is_beside_its_file(tmp_path, name):
    lens = "size_px = [9, 9]\nmatrix = [[9.0, 0, 4], [0, 9.0, 4], [0, 0, 1]]\ndistortion = [0, 0, 0, 0, 0]\n"
    pose = "T_camera_rig = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 9]]\nrms_px = 0.1\n"
    file = tmp_path / "cameras.toml"
    file.write_text(f"covariance = {name!r}\n[cameras.a]\n{lens}{pose}")
    with pytest.raises(Refused, match=r"a plain file name beside it|no such file beside it"):
        read_cameras(file)


@pytest.mark.parametrize("inside", ["out", "trials/out", "boards", "."])
def test_results_are_not_written_into_the_session(session, inside, capsys):
    before = sorted(session.rglob("*"))
    assert cli.main(["evaluate", str(session), "--out", str(session / inside)]) == 2
    assert "lies in the session, which is never written to" in capsys.readouterr().err
    assert sorted(session.rglob("*")) == before


def test_a_place_that_cannot_be_written_is_a_line(session, tmp_path, capsys):
    (tmp_path / "file").write_text("x")
    assert cli.main(["evaluate", str(session), "--out", str(tmp_path / "file" / "out")]) == 2
    said = capsys.readouterr().err
    assert (
        said.startswith("whisker-bench: ")
        and str(tmp_path / "file") in said
        and said.count("\n") == 1
    )


def test_no_forward_stroke_in_any_trial(session, tmp_path, capsys):
    for trial in list((session / "trials").iterdir()):
        if trial.name != TRIAL:
            shutil.rmtree(trial)
    FAULTS["encoder reversed"](session)
    assert cli.main(["evaluate", str(session), "--out", str(tmp_path / "out")]) == 2
    assert "there is no whisk: the motor goes forward in none of them" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


VERBS = ["check SESSION", "evaluate SESSION --out out", "calibrate cameras SESSION --out x", "info"]


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_tells_of_another_opencv(small_session, verb, monkeypatch, capsys):
    def broken():
        raise BadInput("cv2 is broken; cure: pip install")

    monkeypatch.setattr(environment, "_check_opencv", broken)
    assert cli.main(verb.replace("SESSION", str(small_session)).split()) == 2
    assert "cv2 is broken; cure: pip install" in capsys.readouterr().err


@pytest.mark.parametrize(
    "problem",
    [
        ImportError("libGL.so.1: cannot open shared object file"),
        AttributeError("no attribute 'DictValue'"),
    ],
)
def test_a_cv2_that_cannot_be_imported(monkeypatch, problem):
    """The second is what two OpenCVs in one place say."""

    def none(name):
        raise problem

    monkeypatch.setattr(environment.importlib, "import_module", none)
    with pytest.raises(BadInput, match=rf"cv2 cannot be imported \({problem}.*cure: "):
        environment.check_environment()


@pytest.mark.parametrize("name", PACKAGES)
def test_a_package_of_our_name_is_told_before_it_is_imported(tmp_path, name):
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").write_text("raise RuntimeError")
    path = [str(tmp_path), str(ROOT)]
    start = (
        f"import sys; sys.path[:0] = {path!r}; import whisker_bench; sys.exit(whisker_bench.main())"
    )
    done = subprocess.run([sys.executable, "-c", start, "info"], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith(
        f"whisker-bench: the package '{name}' comes from {tmp_path}, not from whisker-bench"
    )


def test_tables_and_manifests_of_absurd_size(session, monkeypatch):
    monkeypatch.setattr("bench.session.table._MOST_BYTES", 1000)
    assert "signals.csv: has more than" in refusal(session)
    monkeypatch.setattr("bench.base.toml_text._MOST_BYTES", 10)
    assert "session.toml: has more than" in refusal(session)


def test_a_number_of_thousands_of_digits(session):
    manifest = session / "session.toml"
    manifest.write_text(manifest.read_text().replace("100.0", "9" * 5000, 1))
    with pytest.raises(BadInput, match=r"session.toml: holds a number of thousands of digits"):
        checked_session(session)


def test_brackets_without_end(session):
    file = session / "session.toml"
    file.write_text(file.read_text() + "\nx = " + "[" * 100000 + "\n")
    assert "session.toml" in refusal(session)


def test_a_sound_picture_of_another_depth_is_still_read(tmp_path):
    import cv2

    grey = np.arange(12, dtype=np.uint16).reshape(3, 4) * 5000
    cv2.imwrite(str(tmp_path / "0.png"), grey)
    np.testing.assert_array_equal(read_picture(tmp_path / "0.png"), grey)
    assert picture_size(tmp_path / "0.png") == (4, 3)
