"""The lowest versions that are tried are those that pyproject.toml allows."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def number(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split("."))


def test_lowest_versions_are_those_allowed():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    allowed = dict(re.match(r"([\w-]+)>=([\d.]+)", one).groups() for one in project["dependencies"])
    tried = dict(
        line.split("==") for line in (ROOT / "constraints-lowest.txt").read_text().splitlines()
    )
    assert {name.replace("_", "-") for name in tried} == set(allowed)
    for name, version in tried.items():
        lowest = number(allowed[name.replace("_", "-")])
        assert number(version)[: len(lowest)] == lowest, name
