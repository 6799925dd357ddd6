"""Every number at the top of a module that decides something says its unit and where it comes from."""

import pytest

from docs.thresholds import ROOT, thresholds_of

# How reports, films and figures of theory look is taste.
BENCH_FOLDERS = ("base", "session", "cameras", "gauges", "trials", "analyses", "rig")
# Windows of what is plausible say what they are by their names and units.
SELF_EXPLAINING = {"plausible.py"}
VISION_FOLDERS = sorted(
    f"vision/{path.name}"
    for path in (ROOT / "vision").iterdir()
    if path.is_dir() and path.name != "__pycache__"
)


@pytest.mark.parametrize("folder", ["estimator", *VISION_FOLDERS])
def test_every_number_of_vision_and_estimator_says_its_unit_and_where_it_is_from(folder):
    found = [
        number
        for path in sorted((ROOT / folder).glob("*.py"))
        for number in thresholds_of(path, ROOT)
    ]
    assert found
    without = [number for number in found if not (number.unit and number.has_origin)]
    assert not [f"{number.place}: {number.name}" for number in without]


@pytest.mark.parametrize("folder", BENCH_FOLDERS)
def test_every_number_of_bench_has_a_comment(folder):
    paths = [
        path
        for path in sorted((ROOT / "bench" / folder).glob("*.py"))
        if path.name not in SELF_EXPLAINING
    ]
    found = [number for path in paths for number in thresholds_of(path, ROOT / "bench")]
    assert found
    assert not [f"{number.place}: {number.name}" for number in found if not number.comment]
