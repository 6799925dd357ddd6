"""The report: all of it in one file, every name escaped, every whisk found, and made again from results alone."""

import io
import json
import re
import shutil
import tomllib
from base64 import b64decode
from fnmatch import fnmatch
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from bench.analyses.estimator_accuracy import accuracies, truth_uncertainty
from bench.base.drawing import whisk_url
from bench.commands.cli import main
from bench.report.page import words
from bench.report.page.drawings import inside
from bench.report.page.thumbnails import MOST_BYTES, MOST_INSIDE, picture_source
from bench.report.page.write import BIBLIOGRAPHY, METHODS, REPORT, as_script
from bench.report.run_folder import read_results
from tests.scenes.results import table

WRITTEN = (REPORT, METHODS, BIBLIOGRAPHY)
EMPTY = {"meta", "link", "input", "img", "br"}


class Reader(HTMLParser):
    """What a page holds: elements with their attributes, and text outside scripts and styles."""

    def __init__(self):
        super().__init__()
        self.elements, self.open, self.text = [], [], []

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open):
            self.text.append(data)

    def all(self, tag: str, **attributes) -> list[dict]:
        """Attributes of the elements of that tag that have these."""
        return [
            a
            for t, a in self.elements
            if t == tag and all(a.get(k) == v for k, v in attributes.items())
        ]


@pytest.fixture(scope="module")
def html(exact_run) -> str:
    return (exact_run / REPORT).read_text()


@pytest.fixture(scope="module")
def reader(html) -> Reader:
    found = Reader()
    found.feed(html)
    assert not found.open
    return found


def test_nothing_is_loaded_from_elsewhere(html, reader):
    for _, attributes in reader.elements:
        for name in ("src", "href", "srcset", "action", "data"):
            assert (attributes.get(name) or "#").startswith(("#", "data:"))
    assert not re.search(r"@import|url\((?!#)", html)
    assert any("default-src 'none'" in a.get("content", "") for a in reader.all("meta"))


def test_links_lead_somewhere_and_ids_are_one_each(reader):
    ids = [a["id"] for _, a in reader.elements if "id" in a]
    assert len(ids) == len(set(ids))
    assert {a["href"][1:] for a in reader.all("a")} <= set(ids)


def test_a_trial_called_script_is_text(html, reader):
    assert len(reader.all("script")) == 2  # the rig's numbers, and the page's own
    assert "<script>" in "".join(reader.text)
    assert html.count("<script") == 2


def test_every_whisk_has_a_row_a_card_and_its_points(exact_run, reader):
    rows = table(exact_run / "whisks.csv")
    keys = [a["data-w"] for a in reader.all("tr") if "data-w" in a]
    assert len(keys) == len(rows) == len(reader.all("dialog"))
    for key, row in zip(keys, rows):
        assert reader.all("dialog", id=key)
        if row["trial"] in ("<script>", "b60_4"):
            assert len(reader.all("a", href=f"#{key}", **{"data-w": key})) >= 4


def test_every_drawing_and_picture_is_described(reader):
    for attributes in reader.all("svg"):
        assert attributes.get("aria-label") or attributes.get("aria-hidden") == "true"
    assert all(a.get("alt") for a in reader.all("img"))
    assert all(a.get("aria-label") for a in reader.all("canvas"))


def test_standing_is_that_of_the_tables(exact_run):
    errors: dict[str, list[float]] = {}
    for row in table(exact_run / "estimates.csv"):
        if row["trial"].startswith(("b", "<")) and row["error_percent"]:
            errors.setdefault(row["estimator"], []).append(float(row["error_percent"]))
    stood = {s.estimator: s for s in accuracies(read_results(exact_run))}
    for name in ("no_slip", "with_friction", "frictionless"):
        assert len(stood[name].judged) == len(errors[name])
        assert stood[name].rms_percent == pytest.approx(
            np.sqrt(np.mean(np.square(errors[name]))), rel=1e-6
        )
        assert abs(stood[name].worst_percent) == pytest.approx(
            np.max(np.abs(errors[name])), rel=1e-6
        )


def test_methods_tell_this_runs_numbers(exact_run):
    text, sure = (exact_run / METHODS).read_text(), truth_uncertainty(read_results(exact_run))
    assert (
        f"known for {sure.known} of {sure.measured} whisks" in text
        or "No pictures were recorded" in text
    )
    for s in accuracies(read_results(exact_run)):
        numbers = (words.number(v) for v in (s.bias_percent, s.rms_percent, s.worst_percent))
        assert f"| {s.label} | {len(s.judged)} of {s.with_truth} | {' | '.join(numbers)} |" in text
    assert "doi     = {10.1109/TRO.2008.2002562}" in (exact_run / BIBLIOGRAPHY).read_text()


def test_the_gauges_stand_with_their_residuals_and_the_whisks_that_calibrated(exact_run, reader):
    gauges = json.loads((exact_run / "run.json").read_text())["gauges"]
    rows = table(exact_run / "whisks.csv")
    keys = {f"w{n}" for n, row in enumerate(rows) if row["trial"].startswith("gauge")}
    trials = {row["trial"] for row in rows if row["trial"].startswith("gauge")}
    assert {p["trial"] for p in gauges["points"]} == trials and len(trials) == 2
    html = (exact_run / REPORT).read_text()
    drawing = html.split('<section id="gauges">')[1].split("</section>")[0]
    marks = re.findall(r'class="mark" data-w="(w\d+)"', drawing)
    assert set(marks) == keys
    assert len(marks) == 2 * sum(len(p["moments_Nmm"]) for p in gauges["points"])
    said = "".join(reader.text)
    sigma = np.array(gauges["matrix_sigma_Nmm_per_V"])
    for value, one in zip(np.ravel(gauges["matrix_Nmm_per_V"]), np.ravel(sigma)):
        assert f"{words.number(value, 4)} ± {1.96 * one:.4f}" in said
    assert (
        all(line.strip() in said for line in gauges["certificate"]) and "seen in pictures" in said
    )


def test_gauges_brought_along_have_no_residuals_here(exact_run, tmp_path):
    out = shutil.copytree(exact_run, tmp_path / "out")
    record = json.loads((out / "run.json").read_text())
    record["gauges"] |= {
        "certificate": [],
        "points": [],
        "matrix_sigma_Nmm_per_V": [[0, 0], [0, 0]],
    }
    (out / "run.json").write_text(json.dumps(record))
    assert main(["report", str(out)]) == 0
    part = (out / REPORT).read_text().split('<section id="gauges">')[1].split("</section>")[0]
    assert "They were brought along" in part and "<svg" not in part and "U95" not in part


def test_parts_come_in_the_order_in_which_they_are_read(reader):
    ids = [a["id"] for tag, a in reader.elements if tag == "section"]
    assert ids[0] == "verdict" and ids[-5:] == ["sure", "gauges", "cameras", "run", "cite"]


def test_made_again_from_results_alone_it_is_the_same(exact_run, tmp_path, capsys):
    out = shutil.copytree(exact_run, tmp_path / "out")
    before = {name: (out / name).read_bytes() for name in WRITTEN}
    for name in WRITTEN:
        (out / name).unlink()
    assert main(["report", str(out)]) == 0
    assert {name: (out / name).read_bytes() for name in WRITTEN} == before
    assert capsys.readouterr().out.split() == [str(out / name) for name in WRITTEN]


def test_figures_for_a_paper_hold_their_fonts_and_are_as_wide_as_columns(exact_run, tmp_path):
    out = shutil.copytree(exact_run, tmp_path / "out")
    assert main(["report", str(out), "--figure-format", "pdf"]) == 0
    pages = {path.stem: path.read_bytes() for path in (out / "figures").glob("*.pdf")}
    assert set(pages) == {
        "fig8",
        "error_against_slope",
        "error_against_friction",
        "explained",
        "error_map",
        "against_theta",
    }
    for page in pages.values():
        width = float(re.search(rb"/MediaBox \[ ?0 0 ([\d.]+)", page)[1])
        assert width == pytest.approx(72 * 3.5, abs=0.1) or width == pytest.approx(
            72 * 7.16, abs=0.1
        )
        assert b"/FontFile2" in page and b"/Type3" not in page


def test_figures_for_a_paper_hold_no_links(exact_run, tmp_path):
    out = shutil.copytree(exact_run, tmp_path / "out")
    assert main(["report", str(out), "--figure-format", "svg"]) == 0
    drawings = [path.read_text() for path in (out / "figures").glob("*.svg")]
    assert len(drawings) == 6
    assert not any("whisk:" in drawing for drawing in drawings)


def test_a_run_without_figures_has_a_page_without_drawings(exact_run, tmp_path):
    out = shutil.copytree(exact_run, tmp_path / "out")
    record = json.loads((out / "run.json").read_text())
    record["settings"]["figures"] = False
    (out / "run.json").write_text(json.dumps(record))
    assert main(["report", str(out)]) == 0
    assert "<svg" not in (out / REPORT).read_text()


def _nothing(out):
    shutil.rmtree(out)


def _no_record(out):
    (out / "run.json").unlink()


def _cut_short(out):
    (out / "run.json").write_text((out / "run.json").read_text()[:200])


def _no_result(out):
    (out / "trials" / "b60_4.json").unlink()


@pytest.mark.parametrize("spoil", [_nothing, _no_record, _cut_short, _no_result])
def test_what_is_no_run_is_one_line(exact_run, tmp_path, capsys, spoil):
    out = shutil.copytree(exact_run, tmp_path / "out")
    spoil(out)
    assert main(["report", str(out)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("whisker-bench: ") and said.count("\n") == 1 and "evaluate" in said


def test_json_in_a_script_cannot_end_it():
    assert as_script({"name": "</script><!--"}) == '{"name":"\\u003c/script>\\u003c!--"}'


def test_pictures_are_small_and_many_stay_beside(tmp_path, rng):
    noise = rng.integers(0, 255, (900, 1600, 3)).astype(np.uint8)
    Image.fromarray(noise).save(tmp_path / "a b.png")
    inside = picture_source(tmp_path, "a b.png", MOST_INSIDE)
    assert inside.startswith("data:image/webp;base64,") and len(inside) < 1.4 * MOST_BYTES
    assert picture_source(tmp_path, "a b.png", MOST_INSIDE + 1) == "a%20b.png"
    assert picture_source(tmp_path, "none.png", 1) == ""


def test_a_small_picture_keeps_its_size(tmp_path):
    Image.new("RGB", (40, 30)).save(tmp_path / "p.png")
    data = picture_source(tmp_path, "p.png", 1).split(",")[1]
    assert Image.open(io.BytesIO(b64decode(data))).size == (40, 30)


def test_what_is_no_code_is_package_data():
    """What an installed program needs of these folders is named in pyproject.toml."""
    root = Path(__file__).resolve().parents[3]
    patterns = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"][
        "package-data"
    ]["*"]
    for package in ("bench", "vision", "estimator"):
        for path in (root / package).rglob("*"):
            if path.is_file() and path.suffix not in (".py", ".pyc"):
                below = {path.name, f"{path.parent.name}/{path.name}"}
                assert any(fnmatch(name, pattern) for name in below for pattern in patterns), path


def test_a_whisk_of_a_drawing_that_the_run_has_not_is_named_without_a_link():
    """Gauge trials are drawn where `--trials` leaves them out."""
    figure = Figure()
    figure.add_subplot().text(0.5, 0.5, "x", url=whisk_url("gauge a", 0))
    drawing = str(inside(figure, "gauges", "residuals", []))
    assert "<a><title>gauge a</title>" in drawing and "whisk:" not in drawing
