"""What docs/formats.md names, and what a result holds."""

import re
from functools import cache
from pathlib import Path

from bench.base.tables import sigma_name

DOCUMENT = (Path(__file__).resolve().parents[2] / "docs" / "formats.md").read_text()


@cache
def documented(heading: str) -> list[str]:
    """Return the names in backticks that the items of the list below a heading begin with.

    '.b' after 'a.c' is 'a.b'; ± after a name stands for the name of its sigma.
    """
    (section,) = re.findall(
        rf"^### {re.escape(heading)}\n(.*?)(?=^#|\Z)", DOCUMENT, flags=re.DOTALL | re.MULTILINE
    )
    names = []
    for item in re.findall(r"^- (`.*?)(?:: |$)", section, flags=re.MULTILINE):
        for name, has_sigma in re.findall(r"`([^`]+)`(±?)", item):
            names.append(names[-1].rpartition(".")[0] + name if name.startswith(".") else name)
            if has_sigma:
                names.append(sigma_name(names[-1]))
    return names


def keys(value, path: str = "") -> set[str]:
    """Paths of all keys of a JSON value that hold no other table; 'a[].b' of a list of tables."""
    if isinstance(value, dict) and value:
        return {
            key
            for name, inner in value.items()
            for key in keys(inner, f"{path}.{name}".lstrip("."))
        }
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return {key for inner in value for key in keys(inner, f"{path}[]")}
    return {path}
