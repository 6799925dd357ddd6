"""docs/thresholds.md has every number at the top of a module of these folders, with its value, and no other."""

import pytest

from docs.list_thresholds import DOCUMENT, documented, not_said, numbers

FOLDERS = ("geometry", "pictures", "boards", "calibration", "lines", "bar", "fit", "truth")


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_number_is_in_the_table_with_its_value(folder):
    assert not [number.row for number in not_said([folder])]


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_row_is_of_a_number_that_is_there(folder):
    there = {(number.place, number.name) for number in numbers([folder])}
    assert there and {key for key in documented() if key[0].startswith(f"{folder}/")} == there


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_row_says_unit_origin_and_measure(folder):
    lines = (line for line in DOCUMENT.read_text().splitlines() if line.startswith(f"| `{folder}/"))
    rows = [line.strip("|").split(" | ") for line in lines]
    assert rows and not [row for row in rows if len(row) != 6 or not all(cell.strip() for cell in row)]
