"""A session that is evaluated while it is recorded: copied in file by file between two looks."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.workflows.live_evaluation import watch
from bench.workflows.session_evaluation import evaluate

SETTINGS = Settings(figures=False)


def recorded(steps: Iterator) -> Callable[[float], None]:
    """In place of a pause: the next step of a recording, and Ctrl-C when it is over."""

    def pause(_: float) -> None:
        try:
            next(steps)
        except StopIteration:
            raise KeyboardInterrupt from None

    return pause


def watched(
    session: Path, out: Path, steps: Iterator, settings: Settings = SETTINGS
) -> tuple[int, list[str]]:
    said: list[str] = []
    told = {"every_s": 0.0, "workers": 0, "announce": said.append}
    return watch(session, out, settings, **told, pause=recorded(steps)), said


def copied_in(source: Path, session: Path, names) -> Iterator[None]:
    """The session's trials one after another: half of the signals first, then the other files, then two still looks."""
    for name in names:
        folder = session / "trials" / name
        folder.mkdir(parents=True)
        whole = (source / "trials" / name / "signals.csv").read_text()
        (folder / "signals.csv").write_text(whole[: len(whole) // 2])
        yield
        shutil.copytree(source / "trials" / name, folder, dirs_exist_ok=True)
        yield
        yield


def names_in(lines: list[str]) -> list[list[str]]:
    return [line.split(": ")[1].split(", ") for line in lines if "complete: " in line]


def test_each_trial_is_evaluated_when_it_is_complete(steel_signals, exact_vision, tmp_path):
    """Each is looked at once; in the end the tables are those of an evaluation of the whole session, which looks at
    nothing again where the other left its results."""
    session, out, names = tmp_path / "session", tmp_path / "out", ["gauge_roll0", "gauge_roll90"]
    for name in names:
        shutil.copytree(steel_signals / "trials" / name, session / "trials" / name)
    shutil.copyfile(steel_signals / "session.toml", session / "session.toml")
    _, said = watched(session, out, copied_in(steel_signals, session, ["b60_4"]))
    assert names_in(said) == [names, ["b60_4", *names]]
    waiting = f"waiting for trials in {session}; Ctrl-C ends"
    assert "(10)" in said[-2] and said[0] == said[-1] == waiting
    assert sorted(exact_vision) == ["b60_4", *names]
    watched(session, out, iter([None]))
    assert len(exact_vision) == 3
    evaluate(session, tmp_path / "afresh", SETTINGS, workers=0)
    for table in ("whisks", "estimates", "ledger"):
        assert (out / f"{table}.csv").read_bytes() == (
            tmp_path / "afresh" / f"{table}.csv"
        ).read_bytes()


def test_a_trial_without_all_its_frames_waits(small_copy, exact_vision, tmp_path):
    """Frames come in one by one: a row a frame is what it waits for, and says so once."""
    for name in ("b60_4", "gauge_roll90"):
        shutil.rmtree(small_copy / "trials" / name)
    late = sorted((small_copy / "trials" / "b30_3" / "low").iterdir())[-1]
    kept = late.read_bytes()
    late.unlink()

    def steps():
        yield
        yield
        yield
        late.write_bytes(kept)
        yield
        yield

    _, said = watched(small_copy, tmp_path / "out", steps())
    (waiting,) = (line for line in said if line.startswith("waiting for b30_3"))
    assert "there must be a row a frame" in waiting
    assert names_in(said) == [["gauge_roll0"], ["b30_3", "gauge_roll0"]]
    (hint,) = (
        place
        for place, line in enumerate(said)
        if line.startswith("cameras.toml is not brought along")
    )
    assert said[hint + 1].startswith("2 complete")  # where the first new trial makes it felt, once


@pytest.mark.parametrize("follow", [False, True])
def test_pictures_on_another_disk_are_waited_for_unless_links_are_followed(
    small_copy, exact_vision, tmp_path, follow
):
    for name in ("b60_4", "gauge_roll0", "gauge_roll90"):
        shutil.rmtree(small_copy / "trials" / name)
    pictures = small_copy / "trials" / "b30_3" / "low"
    shutil.move(pictures, tmp_path / "disk")
    pictures.symlink_to(tmp_path / "disk")
    settings = Settings(figures=False, follow_links=follow)
    _, said = watched(small_copy, tmp_path / "out", iter([None, None]), settings)
    assert names_in(said) == ([["b30_3"]] if follow else [])
    assert follow != any("waiting for b30_3" in line and "--follow-links" in line for line in said)


def test_a_trial_that_changes_is_evaluated_again(steel_signals, exact_vision, tmp_path):
    session = Path(shutil.copytree(steel_signals, tmp_path / "session"))
    for name in ("b00_2", "b60_4", "gauge_roll0", "gauge_roll90"):
        shutil.rmtree(session / "trials" / name)
    note = session / "trials" / "b30_3" / "notes.txt"

    def steps():
        yield
        note.write_text("the bar was moved")
        yield
        yield

    _, said = watched(session, tmp_path / "out", steps())
    assert len(names_in(said)) == 2 and exact_vision == ["b30_3", "b30_3"]


def test_nothing_to_evaluate_is_waited_for_and_no_folder_is_refused(tmp_path):
    def nothing():
        yield

    session = tmp_path / "session"
    with pytest.raises(BadInput, match="no such folder"):
        watched(session, tmp_path / "out", nothing())
    session.mkdir()
    waiting = f"waiting for trials in {session}; Ctrl-C ends"
    assert watched(session, tmp_path / "out", nothing()) == (0, [waiting])


def test_an_interruption_within_an_evaluation_goes_up(steel_signals, tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("bench.workflows.live_evaluation.evaluate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        watched(steel_signals, tmp_path / "out", iter([None, None]))
