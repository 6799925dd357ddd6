"""`bench` sees through the doors of vision alone, and they offer nothing that it does not use."""

import ast
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOORS = (
    "vision",
    "vision.geometry",
    "vision.pictures",
    "vision.boards",
    "vision.calibration",
    "vision.live",
)
# [names] Of the main door: what a reader can keep in mind. Chosen.
MOST_NAMES = 42


def imported_names() -> set[tuple[str, str, str]]:
    """Return (file, module of vision, name) of each import in bench."""
    found = set()
    for path in sorted((ROOT / "bench").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == "vision":
                found |= {(str(path.relative_to(ROOT)), node.module, a.name) for a in node.names}
            elif isinstance(node, ast.Import):
                assert not any(a.name.split(".")[0] == "vision" for a in node.names), path
    return found


IMPORTED = imported_names()


def offered(door: str) -> set[str]:
    """Return the names that a door offers."""
    return {name for names in import_module(door).NAMES.values() for name in names}


def test_bench_imports_from_the_doors_alone():
    behind = [(file, f"{module}.{name}") for file, module, name in IMPORTED if module not in DOORS]
    assert behind == []


@pytest.mark.parametrize("door", DOORS)
def test_a_door_offers_what_bench_uses_and_nothing_else(door):
    used = {name for _, module, name in IMPORTED if module == door}
    assert offered(door) == used


@pytest.mark.parametrize("door", DOORS)
def test_what_is_offered_is_there(door):
    package = import_module(door)
    assert all(getattr(package, name) is not None for name in offered(door))
    with pytest.raises(AttributeError, match="offers no nothing"):
        package.nothing  # noqa: B018


def test_the_main_door_can_be_kept_in_mind():
    assert len(offered("vision")) <= MOST_NAMES
