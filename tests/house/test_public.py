"""What a public function takes and gives stands at its head: annotations, and a docstring that names the
errors it raises itself."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("vision", "bench", "estimator")
FOLDERS = sorted({path.parent for package in PACKAGES for path in (ROOT / package).rglob("*.py")})


def public(body: list[ast.stmt], of: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    """Functions and methods whose names, and whose classes' names, have no underscore before them."""
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from public(node.body, f"{node.name}.")
        elif isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            yield of + node.name, node


def lacks(function: ast.FunctionDef) -> Iterator[str]:
    """What is not said of a function."""
    given = function.args
    named = [
        *given.posonlyargs,
        *given.args,
        *given.kwonlyargs,
        *filter(None, (given.vararg, given.kwarg)),
    ]
    yield from (
        one.arg for one in named if one.annotation is None and one.arg not in ("self", "cls")
    )
    if function.returns is None:
        yield "->"
    text = ast.get_docstring(function) or ""
    if not text:
        yield "docstring"
    raises = (
        node for node in ast.walk(function) if isinstance(node, ast.Raise) and node.exc is not None
    )
    if any(raises) and not re.search("[Rr]aise|[Rr]efuse", text):
        yield "what it raises"


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(ROOT)))
def test_public_functions_say_what_they_take_and_give(folder):
    missing = {
        f"{path.name}: {name}": found
        for path in sorted(folder.glob("*.py"))
        for name, function in public(ast.parse(path.read_text()).body)
        if (found := list(lacks(function)))
    }
    assert not missing
