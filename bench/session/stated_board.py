"""The board that session.toml states: of which kind, by its own keys or by Kalibr's target file."""

from collections.abc import Collection, Iterator
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any

from bench.base.errors import BadInput
from bench.base.input_problems import refused_as_bad_input
from bench.session import manifest
from bench.session.file_names import SESSION_TOML
from bench.session.strict_toml import values
from vision.boards import AprilGrid, AsymmetricCircles, Body, CharucoBoard, Checkerboard, CircleGrid
from vision.calibration import read_kalibr_target
from vision.geometry import Board

KINDS: dict[str, type[Board]] = {
    of_kind.kind: of_kind
    for of_kind in (CharucoBoard, Checkerboard, CircleGrid, AsymmetricCircles, AprilGrid, Body)
}
# Keys of [board] that are not a board's own.
_OF_THE_TABLE = ("kind", "kalibr_target", "marker_sigma_mm", "exact")


def with_kalibr_target(tables: dict[str, Any], session: Path) -> dict[str, Any]:
    """Return a session's tables with the keys of [board] that its file of Kalibr states.

    Raises BadInput where there is no such file, or both state a key.
    """
    table = tables.get("board")
    name = table.get("kalibr_target") if isinstance(table, dict) else None
    if not isinstance(name, str):
        return tables
    path = session / name
    if Path(name).name != name or not path.is_file():
        found = f"[board] kalibr_target = {name!r}: there is no such file beside {SESSION_TOML}"
        raise BadInput(found, file=SESSION_TOML)
    with refused_as_bad_input(SESSION_TOML):
        stated = read_kalibr_target(path)
    if both := sorted(stated.keys() & table.keys()):
        raise BadInput(
            f"[board] {', '.join(both)} and {name} state the same: keep one", file=SESSION_TOML
        )
    return tables | {"board": table | stated}


def stated_board(keys: manifest.BoardKeys, label: str) -> Board:
    """Return the board of [board].

    Raises BadInput for a key that its kind needs or does not have, and for an impossible board.
    """
    kind = KINDS[keys.kind]
    parts = {part.name: part for part in fields(kind) if part.init}
    given = {}
    for name, value in values(keys, leave_out=_OF_THE_TABLE).items():
        if value is not None and value is not False:
            given[name] = value
    for line in missing_parts(keys.kind, given):
        raise BadInput(line, file=label)
    for name in given:
        if name not in parts:
            allowed = ", ".join(part for part in parts if "sigma" not in part)
            found = f'[board] {name} is none of kind = "{keys.kind}"'
            raise BadInput(f"{found}; allowed are {allowed}", file=label)
    with refused_as_bad_input(label):
        return kind(**given)


def missing_parts(kind: object, given: Collection[str]) -> Iterator[str]:
    """Yield a line for each key that a kind of board needs and that is not given; none for a kind
    that is not known.
    """
    of_kind = KINDS.get(kind) if isinstance(kind, str) else None
    for part in fields(of_kind) if of_kind else ():
        if _is_needed(part) and part.name not in given:
            yield f"[board] {part.name} is missing"


def marker_is_part(kind: str) -> bool:
    """Return whether boards of a kind have marker_mm."""
    return any(part.name == "marker_mm" for part in fields(KINDS[kind]))


def _is_needed(part: Field) -> bool:
    """Return whether a board cannot be without this part."""
    return part.init and part.default is MISSING
