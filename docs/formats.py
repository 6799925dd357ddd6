"""Write what the code declares into formats.md: columns of tables, and keys of TOML files.

    python docs/formats.py

A part stands between two comments, of which the first names what it is made from:

    <!-- made from bench.report.whisk_tables.WHISKS -->
    <!-- end -->

That is a `bench.base.tables.Table`, whose columns have their meanings; or the analyses of a run,
with the tables of each; or a `Keys` of a TOML file, whose keys are explained by the comment above
them, which holds down to the next comment. All else in the page is written by hand, and stays.
"""

import ast
import importlib
import inspect
import re
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.base.tables import Column, Table, sigma_name
from bench.session.givens import GivenKeys, assumptions, unit_of
from bench.session.strict_toml import Keys, key_names

PAGE = Path(__file__).with_suffix(".md")
PART = re.compile(r"<!-- made from ([\w.]+) -->\n.*?<!-- end -->", re.DOTALL)


def page(text: str) -> str:
    """Return the page with each part made anew from what its comment names.

    A column that means what it means in the last table before that has it is listed without a word.
    """
    known: dict[str, str] = {}  # by a column's name what it meant last
    return PART.sub(lambda match: _part(match, known), text)


def named_parts(text: str) -> list[Table | type[Keys]]:
    """Return the tables and keys that the parts of a page are made from, in their order."""
    found = []
    for name in PART.findall(text):
        found += _declared(name)
    return found


def explained_keys(keys: type[Keys]) -> Iterator[tuple[str, str]]:
    """Yield the keys of a table of a TOML file, each with its meaning; first those of its bases,
    which are explained where the bases are. `exact`, of all tables, stands above them by hand.
    """
    for base in reversed(keys.__mro__):
        if issubclass(base, Keys) and base not in (Keys, GivenKeys):
            own = list(_own_keys(base))
            assumed = _assumed_of(base, own)
            for name, meaning in own:
                yield name, meaning + assumed.get(meaning, "") if base is keys else "see there"


def _assumed_of(keys: type[Keys], explained: Sequence[tuple[str, str]]) -> dict[str, str]:
    """Return what is assumed of sigmas that are not stated, by the meaning of their keys."""
    found = {}
    declared = assumptions(keys)
    for name, meaning in explained:
        if name in declared:
            found[meaning] = f"; unsaid: {declared[name].text(unit_of(name))}"
    return found


def _own_keys(keys: type[Keys]) -> Iterator[tuple[str, str]]:
    """Yield the keys that a class itself declares, each with the comment above it."""
    source = textwrap.dedent(inspect.getsource(keys))
    lines = source.splitlines()
    meaning = ""
    for node in ast.parse(source).body[0].body:
        if isinstance(node, ast.AnnAssign) and node.target.id in key_names(keys):
            meaning = _comment_above(lines, node) or meaning
            yield node.target.id, meaning


def _comment_above(lines: list[str], node: ast.AnnAssign) -> str:
    """Return the comment that ends on the line before a key, or nothing."""
    above = []
    row = node.lineno - 2
    while lines[row].strip().startswith("# "):
        above.insert(0, lines[row].strip().removeprefix("# "))
        row -= 1
    return " ".join(above)


def _part(match: re.Match, known: dict[str, str]) -> str:
    """Return a part of the page, with its two comments; known: see `page`."""
    sections = [_section(declared, known) for declared in _declared(match[1])]
    return "\n\n".join([f"<!-- made from {match[1]} -->", *sections, "<!-- end -->"])


def _section(declared: Table | type[Keys], known: dict[str, str]) -> str:
    """Return the text on a table, or on the keys of a table of a TOML file; known: see `page`."""
    if not isinstance(declared, Table):
        return "\n".join(_as_markdown(explained_keys(declared)))
    lines = [f"### `{declared.file}`", "", *textwrap.wrap(declared.rows, 120), ""]
    return "\n".join([*lines, *_as_markdown(_explained_columns(declared, known))])


def _explained_columns(table: Table, known: dict[str, str]) -> Iterator[tuple[str, str]]:
    """Yield the columns of a table, each with its meaning, or '' where that is known.

    A sigma is explained as its value is.
    """
    value: Column | None = None
    for column in table.columns:
        if value is None or column.name != sigma_name(value.name):
            value = column
            is_known = known.get(column.name) == column.meaning
            known[column.name] = column.meaning
        yield column.name, "" if is_known else column.meaning


def _declared(name: str) -> list[Table | type[Keys]]:
    """Return what a name of a module declares, such as package.module.NAME.

    Of analyses that is every table of theirs.
    """
    module, _, attribute = name.rpartition(".")
    declared = getattr(importlib.import_module(module), attribute)
    if isinstance(declared, tuple):
        return [table for analysis in declared for table in analysis.tables]
    return [declared]


def _as_markdown(explained: Iterable[tuple[str, str]]) -> list[str]:
    """Return the items of a list: one for each run of names that one meaning explains."""
    items = []
    for meaning, run in groupby(explained, key=lambda pair: pair[1]):
        names = with_sigmas([name for name, _ in run])
        items.append(f"- {names}: {meaning}" if meaning else f"- {names}")
    return items


def with_sigmas(names: Sequence[str]) -> str:
    """Return names in backticks; one before its sigma has ± in place of that."""
    shown = []
    for name in names:
        if shown and name == sigma_name(shown[-1].strip("`")):
            shown[-1] += "±"
        else:
            shown.append(f"`{name}`")
    return ", ".join(shown)


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text()))
