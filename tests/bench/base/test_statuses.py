"""Every status has its kind in one table, and nothing in bench decides on what a status says."""

import ast
import pickle
from collections.abc import Iterator
from pathlib import Path

import pytest

from bench.base.statuses import (
    NOTE,
    REFUSAL,
    STATUSES,
    WARNING,
    cure_of,
    has_only_notes,
    reason,
    status_of_code,
)
from bench.records.plain import from_plain, to_plain
from bench.records.trial_result import EstimateRow
from estimator.onset import NO_RISE
from estimator.reasons import NamedReason
from vision.geometry.reasons import NO_REASON, UNNAMED, Reason, as_reason, joined
from vision.geometry.refusals import Misled, Refused
from vision.truth.value import UNKNOWN

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ("vision", "estimator", "bench")
# Calls that make a status, and where their code stands: by position, or by its name.
MAKERS = {"Reason": 0, "NamedReason": 0, "reason": 0, "Refused": 1}


def _modules(*packages: str) -> Iterator[tuple[Path, ast.Module]]:
    """Yield every module of these packages with its syntax tree."""
    for package in packages:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield path, ast.parse(path.read_text())


def _name(node: ast.expr) -> str:
    """Return the last name of a dotted one; empty where the node is no name."""
    return getattr(node, "attr", getattr(node, "id", ""))


def _codes(tree: ast.Module) -> Iterator[str]:
    """Yield the codes that a module gives to statuses."""
    for call in ast.walk(tree):
        if not isinstance(call, ast.Call):
            continue
        given = [word.value for word in call.keywords if word.arg == "code"]
        place = MAKERS.get(_name(call.func))
        if place is not None:
            given += call.args[place : place + 1]
        for node in given:
            chosen = [node.body, node.orelse] if isinstance(node, ast.IfExp) else [node]
            yield from (one.value for one in chosen if isinstance(one, ast.Constant))


def _raised() -> set[str]:
    """Return every code that is raised anywhere."""
    return {code for _, tree in _modules(*PACKAGES) for code in _codes(tree) if code}


def test_every_code_that_is_raised_is_in_the_table():
    raised = _raised()
    assert {"no_bar_seen", "no_rise", "slope_unlike_stated", "camera_lines_scatter"} < raised
    assert raised <= set(STATUSES)


def test_every_kind_in_the_table_is_raised_and_has_a_cure():
    elsewhere = {
        UNNAMED,
        "refused",
        "gauge_fault",
        "shape_not_felt",
    }  # named without a literal call
    assert set(STATUSES) - _raised() <= elsewhere
    for status in STATUSES.values():
        assert status.severity in {NOTE, WARNING, REFUSAL}
        assert status.cure


def test_the_table_has_the_sentences_that_reason_fills_in_and_no_other():
    filled_in = set()
    for _, tree in _modules("bench"):
        for call in ast.walk(tree):
            if isinstance(call, ast.Call) and _name(call.func) == "reason":
                filled_in.add(call.args[0].value)
    assert filled_in == {code for code, status in STATUSES.items() if status.sentence}


def _decisions_on_text(tree: ast.Module) -> Iterator[int]:
    """Yield the lines where the text of a status is split, searched or compared."""
    texts = {"status", "warning"}
    methods = {"split", "startswith", "endswith", "find", "index", "partition"}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            of_status = _name(node.func.value) in texts and node.func.attr in methods
            matched = node.func.attr in {"search", "match", "fullmatch", "findall"} and any(
                _name(argument) in texts for argument in node.args
            )
            if of_status or matched:
                yield node.lineno
        if isinstance(node, ast.Compare):
            sides = [_name(side) for side in (node.left, *node.comparators)]
            within = isinstance(node.ops[0], (ast.In, ast.NotIn))
            equal = isinstance(node.ops[0], (ast.Eq, ast.NotEq))
            if (within and texts.intersection(sides)) or (equal and "status" in sides):
                yield node.lineno


def test_no_module_of_bench_decides_on_the_text_of_a_status():
    simulated = (
        ROOT / "bench" / "rig"
    )  # there a status is that of a simulated contact: held, sliding, tip
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path, tree in _modules("bench")
        if simulated not in path.parents
        for line in _decisions_on_text(tree)
    ]
    assert not found


def test_decisions_on_text_are_found():
    for code in (
        'status.split("; ")',
        'row.status == "no gauges"',
        '"sigma" in felt.status',
        "re.search(p, warning)",
    ):
        assert list(_decisions_on_text(ast.parse(code)))


@pytest.mark.parametrize(
    ("code", "cure"),
    [
        ("never_touches", "let the motor turn farther"),
        ("no_rise", "let the motor turn farther"),
        ("starts_touching", "begin the recording"),
        ("slope_vague", "second camera"),
        ("camera_moved", "fasten the camera"),
        ("gauge_fault", "check that"),
        ("no_gauges", "record gauge trials"),
        ("frames_damaged", "record again"),
        ("a_code_of_another_version", "docs/truth.md"),
    ],
)
def test_what_is_known_to_go_wrong_has_its_cure(code, cure):
    assert cure in cure_of([code])


def test_the_first_kind_of_the_table_has_the_cure_of_a_line():
    assert cure_of(["no_pictures", "never_touches", "no_gauges"]) == cure_of(["never_touches"])
    assert cure_of([]) == status_of_code(UNNAMED).cure


def test_notes_alone_are_no_warning():
    short = Reason("pushed_short", "pushed to 1 deg only")
    assert has_only_notes(NO_REASON) and has_only_notes(joined(reason("no_pictures"), short))
    assert not has_only_notes(joined(short, NO_RISE))
    assert not has_only_notes("a sentence without a code")


def test_a_status_keeps_its_codes_wherever_it_goes():
    status = joined(Reason("pushed_short", "pushed; not far"), NO_RISE, "", "own words").about(
        "b30_3"
    )
    assert status == f"b30_3: pushed; not far; {NO_RISE}; own words"
    assert status.codes == ("pushed_short", "no_rise", UNNAMED)
    for copy in (pickle.loads(pickle.dumps(status)), as_reason(status)):
        assert copy == status and copy.parts == status.parts
    named = pickle.loads(pickle.dumps(NamedReason("tip_contact", "{:.1f} mm").format(2.0)))
    assert (named, named.code) == ("2.0 mm", "tip_contact")


def test_a_record_keeps_the_codes_of_its_status():
    row = EstimateRow("with_friction", UNKNOWN, status=joined(NO_RISE, reason("no_gauges")))
    written = to_plain(row)
    assert written["status"] == str(row.status) and type(written["status"]) is str
    read = from_plain(EstimateRow, written)
    assert read.status == row.status and read.status.codes == ("no_rise", "no_gauges")


def test_a_refusal_carries_its_code():
    refused = Refused("the whisker never touches", code="never_touches")
    assert refused.reason == str(refused) and refused.reason.codes == ("never_touches",)
    misled = Misled("high", "its lines scatter")
    assert misled.reason.codes == ("camera_lines_scatter",)
    assert misled.reason == "camera high was left out: its lines scatter"
