"""Imports run one way: between the packages, and from each folder to those before it in its package."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# A folder may import those before it, none after; "" is what stands at the root of a package.
FOLDERS = {
    "vision": (
        "geometry",
        "pictures",
        "boards",
        "calibration",
        "wire",
        "touched",
        "fit",
        "truth",
        "live",
        "",
    ),
    "estimator": ("",),
    "bench": (
        "base",
        "session",
        "rig",
        "setup",
        "cameras",
        "records",
        "gauges",
        "trials",
        "analyses",
        "report",
        "array",
        "theory",
        "plan",
        "workflows",
        "",
        "commands",
    ),
}
MAY_IMPORT = {
    "vision": {"vision"},
    "estimator": {"estimator"},
    "bench": {"bench", "vision", "estimator"},
}
# The rig makes sessions: it needs nothing of what reads them, nor a line of vision and estimator.
NEEDS_BASE_ALONE = ("session", "rig")
MODULES = sorted(path for package in FOLDERS for path in (ROOT / package).rglob("*.py"))


def parts(module: str) -> tuple[str, str]:
    """Package and folder of a dotted name; the folder is "" where the module stands at the package's root."""
    package, *rest = module.split(".")
    return package, rest[0] if rest and rest[0] in FOLDERS[package] else ""


def imports(path: Path) -> list[tuple[str, str]]:
    """Packages of ours, with the folder, that a module imports, wherever in the module it does."""
    names = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: {node.lineno}: imports are absolute here"
            names += [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
    return [parts(name) for name in names if name.split(".")[0] in FOLDERS]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_run_one_way(path):
    package, folder = parts(".".join(path.relative_to(ROOT).with_suffix("").parts))
    order = FOLDERS[package]
    for other, room in imports(path):
        assert other in MAY_IMPORT[package], f"{package} may not import {other}"
        if other == package:
            assert order.index(room) <= order.index(folder), (
                f"{package}/{folder} may not import {package}/{room}"
            )
            assert folder not in NEEDS_BASE_ALONE or room in ("base", folder), (
                f"{folder} needs base alone, not {room}"
            )
        assert folder != "rig" or other == "bench", f"the rig may not import {other}"


def test_every_folder_is_named():
    for package, folders in FOLDERS.items():
        found = {
            path.parent.relative_to(ROOT / package).parts[:1]
            for path in (ROOT / package).rglob("*.py")
        }
        assert {name[0] for name in found if name} == {folder for folder in folders if folder}


@pytest.mark.parametrize("folder", [f"{p}/{f}" for p, fs in FOLDERS.items() for f in fs], ids=str)
def test_every_folder_says_what_lives_there(folder):
    assert ast.get_docstring(ast.parse((ROOT / folder / "__init__.py").read_text()))
