"""What documents name is there: folders, files, links."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
STUDIES = ROOT / "tests" / "studies" / "README.md"
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), STUDIES])
# Pages that `make docs` writes.
MADE_FROM_CODE = {"thresholds.md"}
OF_OURS = ("bench/", "vision/", "estimator/", "tests/", "docs/", "fixtures/")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_files_and_links_are_there(document):
    text = document.read_text()
    if document.name == "CHANGELOG.md":  # it names what was
        return
    named = [name for name in re.findall(r"`([\w/.-]+)`", text) if name.startswith(OF_OURS)]
    run = re.findall(r"python ((?:tests|docs|fixtures)/[\w/.]+\.py)", text)
    links = re.findall(r"\]\(([^)#:\s]+)(?:#[\w-]*)?\)", text)
    assert not [name for name in (*named, *run) if not (ROOT / name).exists()]
    assert not [link for link in links if not (document.parent / link).exists()]


def test_every_document_is_on_the_site():
    nav = (ROOT / "mkdocs.yml").read_text().split("\nnav:")[1]
    named = re.findall(r"([\w-]+\.md)$", nav, flags=re.MULTILINE)
    written = {path.name for path in (ROOT / "docs").glob("*.md")}
    assert set(named) == written | MADE_FROM_CODE


def test_every_folder_is_on_the_map():
    text = (ROOT / "docs" / "design.md").read_text()
    drawing = text.split("## The folders and their arrows")[1].split("###")[0]
    folders = [
        p.parent.name
        for package in ("vision", "bench")
        for p in (ROOT / package).glob("*/__init__.py")
    ]
    assert not [name for name in folders if not re.search(rf"\b{name}\b", drawing)]


def test_rooms_and_their_modules_are_there():
    """Each line of "Where is …?": a folder, and modules that stand in it (or are named with their own)."""
    text = (ROOT / "docs" / "design.md").read_text()
    section = text.split("### Where is …?")[1].split("\n###")[0]
    lines = re.findall(r"^- [^`]+: `([\w/]+)`: (.*)$", section, flags=re.MULTILINE)
    assert len(lines) == section.count("\n- ") > 10
    for room, there in lines:
        for module in re.findall(r"`([\w/]+\.py)`", there):
            assert (ROOT / module).exists() if "/" in module else (ROOT / room / module).exists(), (
                room,
                module,
            )
