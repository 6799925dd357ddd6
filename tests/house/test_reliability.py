"""Each fault of docs/reliability.md names a test that there is."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "reliability.md").read_text()


def rows() -> list[list[str]]:
    table = TEXT.split("## Faults")[1].split("\n## ")[0]
    lines = [line.strip("|").split("|") for line in table.splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line] for line in lines[1:]]


def test_every_fault_names_a_test_that_there_is():
    assert len(rows()) > 40
    for fault, _, _, named in rows():
        path, name = re.fullmatch(r"`(tests/[\w/]+\.py)::(test_\w+)`", named).groups()
        assert re.search(rf"^def {name}\(", (ROOT / path).read_text(), flags=re.MULTILINE), (
            fault,
            named,
        )


def test_every_fault_says_what_the_run_does():
    assert all(len(row) == 4 and all(row) for row in rows())
    assert len({fault for fault, *_ in rows()}) == len(rows())
