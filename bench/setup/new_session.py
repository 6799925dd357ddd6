"""`whisker-bench new`: the folders of a session, and an annotated session.toml to fill in."""

import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

from bench.base.atomic import write_whole
from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.session.file_names import SESSION_TOML
from bench.session.manifest import BoardKeys
from bench.session.session import load_session
from bench.session.stated_board import missing_parts, stated_board
from bench.session.strict_toml import convert
from bench.setup.lab import Ask, Lab
from bench.setup.manifest_text import TO_FILL_IN, WHOLE_CAMERA, manifest_text
from bench.setup.questions import questions_of


def new_session(
    path: Path,
    name: str,
    lab: Lab,
    given: Mapping[str, float],
    ask: Ask | None = None,
    *,
    squares: tuple[int, int] = (8, 6),
    dictionary: str = "DICT_5X5_100",
) -> list[str]:
    """Make the folder of a session with its manifest; return lines on what comes next.

    lab: what there is. given: numbers by option's name. ask: answers a question, '' for not known; None
    asks nothing. squares (along x, along y), dictionary: of the board. Raises BadInput where there is a
    session already, a number is implausible, or no such board can be.
    """
    require_no_session(path)
    questions = tuple(questions_of(lab))
    for question in questions:
        if question.option in given:
            option = f"--{question.option.replace('_', '-')}"
            question.plausible_range.check(given[question.option], option, str(path))
    numbers = dict(given)
    for question in questions if ask else ():
        if question.option not in numbers:
            numbers |= question.ask(ask)
    text = manifest_text(name or path.resolve().name, numbers, lab, squares, dictionary)
    _check_board(text, path)
    for folder in _folders(lab):
        (path / folder).mkdir(parents=True, exist_ok=True)
    write_whole(path / SESSION_TOML, text)
    return list(_next_steps(path, lab))


def require_no_session(path: Path) -> None:
    """Raise BadInput where there is a session already."""
    if (path / SESSION_TOML).exists():
        raise BadInput(f"there is a {SESSION_TOML} already; nothing was written", file=path)


def _check_board(text: str, path: Path) -> None:
    """Raise BadInput where a manifest's text states a board whole that cannot be."""
    table = tomllib.loads(text).get("board")
    if table is None:
        return
    keys = convert(table, BoardKeys)
    if not any(missing_parts(keys.kind, table)):
        stated_board(keys, str(path))


def _folders(lab: Lab) -> Iterator[str]:
    """Yield the folders of a session for what a lab has."""
    yield "trials"
    if lab.has_cameras:
        yield "boards/rig"
    if lab.cameras == "mirror":
        yield f"boards/{WHOLE_CAMERA}"


def _missing(path: Path) -> int:
    """Return the number of lines that `check` misses in a new session's manifest."""
    problems = InputProblems(stop_at_first=False)
    with problems.guard():
        load_session(path, problems)
    return len(problems.refusals)


def _next_steps(path: Path, lab: Lab) -> Iterator[str]:
    """Yield lines on what to do next with a new session."""
    yield f"written: {path / SESSION_TOML}"
    missing = _missing(path)
    if missing:
        lines = "line is" if missing == 1 else "lines are"
        yield f"{missing} {lines} to be filled in: look for {TO_FILL_IN}"
    folders = "boards/ and trials/" if lab.has_cameras else "trials/"
    yield f"then record {folders} (comments in the file say how), and run: whisker-bench check {path}"
