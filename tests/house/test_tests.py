"""Tests stand where the code stands that they test, and take nothing from one another."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("vision", "bench")
TESTS = sorted((ROOT / "tests").rglob("test_*.py"))


@pytest.mark.parametrize("package", PACKAGES)
def test_folders_are_those_of_the_code(package):
    ours, theirs = (
        {
            path.relative_to(folder).parts[0]
            for path in folder.rglob(pattern)
            if path.parent != folder
        }
        for folder, pattern in ((ROOT / "tests" / package, "test_*.py"), (ROOT / package, "*.py"))
    )
    assert ours == theirs


def imported(path: Path) -> list[str]:
    """Dotted names of what a module imports from."""
    return [
        node.module or ""
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom)
    ]


@pytest.mark.parametrize("path", TESTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_test_module_is_imported(path):
    """What two need stands in tests/scenes or beside a study, so that a test may be moved or removed."""
    assert not [name for name in imported(path) if name.startswith("tests.") and ".test_" in name]
