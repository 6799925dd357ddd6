"""Numbers at the top of vision's modules that docs/thresholds.md does not have, or has with another value.

    python docs/list_thresholds.py [FOLDER ...]        # such as: boards lines

Prints a row to copy for each, with the comment that stands beside it in the code. Nothing is printed where all is said.
"""

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCUMENT = ROOT / "docs" / "thresholds.md"


@dataclass(frozen=True)
class Number:
    """A constant of a module: `place` is folder/module.py, `value` the expression as it stands there."""

    place: str
    name: str
    value: str
    comment: str

    @property
    def row(self) -> str:
        """A row of the table, to be completed."""
        return f"| `{self.place}` | `{self.name}` | `{self.value}` |  | {self.comment} |  |"


def numbers(folders: list[str] | None = None) -> Iterator[Number]:
    """Constants whose value has a number in it, module by module."""
    for path in sorted((ROOT / "vision").glob("*/*.py")):
        if folders is None or path.parent.name in folders:
            yield from numbers_of(path, ROOT / "vision")


def numbers_of(path: Path, package: Path) -> Iterator[Number]:
    """Constants of one module whose value has a number in it."""
    text = path.read_text()
    lines = text.splitlines()
    for node in ast.parse(text).body:
        if not isinstance(node, ast.Assign) or not isinstance(node.targets[0], ast.Name | ast.Tuple):
            continue
        value = ast.unparse(node.value)
        is_number = [isinstance(n, ast.Constant) and type(n.value) in (int, float) for n in ast.walk(node.value)]
        named = ast.unparse(node.targets[0])
        if any(is_number) and named.isupper() and not re.search(r"[\"']|__file__|\brange\(|zeros\(|full\(", value):
            place = path.relative_to(package).as_posix()
            yield Number(place, named, value, _comment(lines, node))


def _comment(lines: list[str], node: ast.Assign) -> str:
    """What stands behind the number or, without a gap, above it."""
    _, _, behind = lines[node.end_lineno - 1].partition("  # ")
    above, row = [], node.lineno - 2
    while row >= 0 and lines[row].startswith("# "):
        above.insert(0, lines[row][2:])
        row -= 1
    return " ".join([*above, behind]).strip()


def documented() -> dict[tuple[str, str], str]:
    """Value by (place, name) in docs/thresholds.md."""
    rows = re.findall(r"^\| `([^`]+)` \| `([^`]+)` \| `([^`]+)` \|", DOCUMENT.read_text(), flags=re.MULTILINE)
    return {(place, name): value for place, name, value in rows}


def not_said(folders: list[str] | None = None) -> list[Number]:
    """Numbers that the document lacks or has with another value."""
    known = documented()
    return [number for number in numbers(folders) if known.get((number.place, number.name)) != number.value]


if __name__ == "__main__":
    print(*(number.row for number in not_said(sys.argv[1:] or None)), sep="\n")
