"""Write the table of all thresholds, as Markdown, from the comments beside them in the code.

    python docs/thresholds.py > thresholds.md

A threshold is a number at the top of a module. The comment above it says its unit in square
brackets, what it decides and where it comes from: *derived* by a calculation, *stated* by the
things on the bench, or measured by a study whose file it names.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("vision", "estimator", "bench")
HEAD = """# Thresholds

Every number at the top of a module. This page is made from the code by `docs/thresholds.py`.
"""


@dataclass(frozen=True)
class Threshold:
    """A constant of a module, with the comment that stands above or behind it.

    place: folder/module.py. value: the expression as it stands there.
    """

    place: str
    name: str
    value: str
    comment: str

    @property
    def unit(self) -> str:
        """Return what stands in square brackets at the beginning of the comment, or nothing."""
        found = re.match(r"\[([^\]]+)\]", self.comment)
        return found[1] if found else ""

    @property
    def has_origin(self) -> bool:
        """Return whether the comment says where the number comes from."""
        origins = r"[Dd]erived|[Ss]tated|[Cc]hosen|Study: |layout|formula"
        return re.search(origins, self.comment) is not None

    @property
    def row(self) -> str:
        """Return the row of the table."""
        text = self.comment.removeprefix(f"[{self.unit}]").strip()
        return f"| `{self.place}` | `{self.name}` | `{self.value}` | {self.unit} | {text} |"


def thresholds_of(path: Path, package: Path) -> Iterator[Threshold]:
    """Yield the constants of one module whose value has a number in it."""
    text = path.read_text()
    lines = text.splitlines()
    for node in ast.parse(text).body:
        if not isinstance(node, ast.Assign):
            continue
        name = ast.unparse(node.targets[0])
        value = ast.unparse(node.value)
        if name.isupper() and _has_a_number(node.value) and not _is_no_threshold(value):
            place = path.relative_to(package).as_posix()
            yield Threshold(place, name, value, _comment(lines, node))


def _has_a_number(expression: ast.expr) -> bool:
    """Return whether an expression has an int or a float in it."""
    constants = [node.value for node in ast.walk(expression) if isinstance(node, ast.Constant)]
    return any(type(value) in (int, float) for value in constants)


def _is_no_threshold(value: str) -> bool:
    """Return whether a value is a table of texts, a path, or an array to be filled."""
    return bool(re.search(r"[\"']|__file__|\brange\(|zeros\(|full\(", value))


def _comment(lines: list[str], node: ast.Assign) -> str:
    """Return what stands behind the constant or, without a gap, above it."""
    _, _, behind = lines[node.end_lineno - 1].partition("  # ")
    above = []
    row = node.lineno - 2
    while row >= 0 and lines[row].startswith("# "):
        above.insert(0, lines[row][2:])
        row -= 1
    return " ".join([*above, behind]).strip()


def page() -> str:
    """Return the whole page."""
    lines = [HEAD]
    for package in PACKAGES:
        lines += [f"## {package}", "", "| module | name | value | unit | decides, and comes from |"]
        lines.append("|---|---|---|---|---|")
        for path in sorted((ROOT / package).rglob("*.py")):
            lines += [threshold.row for threshold in thresholds_of(path, ROOT / package)]
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    print(page())
