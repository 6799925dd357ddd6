"""Every number at the top of a module of bench that decides something says its unit and where it comes from."""

import pytest

from docs.list_thresholds import ROOT, numbers_of

# How reports, films and theory's figures look is taste; vision's numbers have a table (docs/thresholds.md).
FOLDERS = ("base", "session", "cameras", "gauges", "trials", "friction", "rig")
# Windows of what is plausible say what they are by their names and units.
SELF_EXPLAINING = {"session/plausible.py"}


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_number_has_a_comment(folder):
    paths = sorted((ROOT / "bench" / folder).glob("*.py"))
    chosen = [path for path in paths if f"{folder}/{path.name}" not in SELF_EXPLAINING]
    found = [number for path in chosen for number in numbers_of(path, ROOT / "bench")]
    assert found
    assert not [f"{number.place}: {number.name}" for number in found if not number.comment]
