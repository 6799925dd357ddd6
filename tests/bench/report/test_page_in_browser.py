"""What the report does in a real browser. `make test-browser`; skipped where no Chromium is installed."""

import json
import shutil

import numpy as np
import pytest
from PIL import Image

from bench.commands.cli import main
from bench.report.page.write import REPORT
from tests.scenes.chromium import Page, chromium

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason="no chromium (apt install chromium)"),
]
WIDTHS = (400, 1280)


@pytest.fixture(scope="module")
def report(exact_run, tmp_path_factory):
    """The report of a run with an overlay and two cameras."""
    out = shutil.copytree(exact_run, tmp_path_factory.mktemp("browser") / "out")
    trial = json.loads((out / "trials" / "b60_4.json").read_text())
    trial["seen"]["whisks"][0]["overlay"] = {"touch": {"frame": 0, "cameras": {}}}
    (out / "trials" / "b60_4.json").write_text(json.dumps(trial))
    (out / "overlays").mkdir()
    Image.fromarray(np.tile(np.arange(256, dtype=np.uint8), (144, 1))).save(
        out / "overlays" / "b60_4_0.png"
    )
    record = json.loads((out / "run.json").read_text())
    lens = {
        "size_px": [1280, 720],
        "matrix": [[2000, 0, 640], [0, 2000, 360], [0, 0, 1]],
        "distortion": [0] * 5,
    }
    poses = {
        "high": [[1, 0, 0, -50], [0, -1, 0, 0], [0, 0, -1, 400]],
        "low": [[1, 0, 0, -50], [0, 0, -1, 0], [0, 1, 0, 400]],
    }
    record["cameras"] = [
        {"name": n, "T_camera_rig": T, "rms_px": 0.05} | lens for n, T in poses.items()
    ]
    (out / "run.json").write_text(json.dumps(record))
    assert main(["report", str(out)]) == 0
    return out / REPORT


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_overflows_and_nothing_complains(report, width, dark):
    with Page(report, width, dark=dark) as page:
        assert page.run("document.documentElement.scrollWidth") <= width
        table = "document.getElementById('table').parentElement"
        assert width == 400 or page.run(f"{table}.scrollWidth <= {table}.clientWidth")
        page.run("document.querySelector('#table a[href=\"#w1\"]').click()")
        assert page.run("document.querySelector('dialog[open]').scrollWidth") <= width
        background = page.run("getComputedStyle(document.body).backgroundColor")
        assert (background == "rgb(255, 255, 255)") != dark
        assert page.messages == []


def test_the_table_sorts_and_filters_and_so_do_the_points(report):
    with Page(report) as page:
        first = "document.querySelector('#table tbody tr:not([hidden])').innerText.split('\\t')[0].split(' ')[0]"
        column = "[...document.querySelectorAll('#table thead th')].findIndex(h => h.innerText.startsWith('d_x'))"
        numbers = f"[...document.querySelectorAll('#table tbody tr')].map(r => Number(r.cells[{column}].dataset.v))"
        for order in (1, -1):
            page.run(f"document.querySelectorAll('#table thead button')[{column}].click()")
            found = page.run(numbers)
            assert found == sorted(found, reverse=order < 0) and len(set(found)) > 3
        page.run("document.getElementById('search').value = 'B60'")
        page.run("document.getElementById('search').dispatchEvent(new Event('input'))")
        assert page.run(first) == "b60_4"
        assert page.run("document.getElementById('count').innerText").startswith("1 of 5")
        off = page.run(
            "[...document.querySelectorAll('.mark.off')].map(mark => mark.querySelector('title').textContent)"
        )
        assert "<script>" in off and "b60_4" not in off


def test_cards_open_from_points_and_go_by_keyboard(report):
    shown = "(document.querySelector('dialog[open]') || {id: ''}).id"
    with Page(report) as page:
        marks = "[...document.querySelectorAll('#figures .mark')]"
        is_b60 = "mark => mark.querySelector('title').textContent.includes('b60_4')"
        key = page.run(f"{marks}.find({is_b60}).dataset.w")
        click = "dispatchEvent(new MouseEvent('click', {bubbles: true}))"
        page.run(f"document.querySelector('#figures .mark[data-w={key}]').{click}")
        assert page.run(shown) == key
        page.key("ArrowLeft")
        assert page.run(shown) not in (key, "")
        page.key("Escape")
        assert page.run(shown) == ""


def test_every_picture_is_there(report):
    with Page(report) as page:
        loaded = "Promise.all([...document.images].map(i => (i.loading = 'eager', i.decode().then(() => i.naturalWidth))))"
        widths_px = page.run(loaded)
    assert widths_px and min(widths_px) > 0


def test_the_rig_turns_by_mouse_and_keyboard(report):
    look = "document.getElementById('rig-view').dataset.look"
    drawn = "new Set(document.getElementById('rig-view').getContext('2d').getImageData(0, 0, 800, 500).data).size"
    with Page(report) as page:
        page.run(
            "document.getElementById('rig-view').scrollIntoView({behavior: 'instant', block: 'center'})"
        )
        first = page.run(look)
        assert page.run(drawn) > 20
        page.run("document.getElementById('rig-view').focus()")
        page.key("ArrowLeft")
        turned = page.run(look)
        assert turned != first
        page.drag(600, 450, 80, 30)
        assert page.run(look) != turned
        page.key("Home")
        assert page.run(look) == first


def test_paper_unfolds_what_is_folded(report):
    folded = "document.querySelectorAll('details:not([open])').length"
    with Page(report) as page:
        before = page.run(folded)
        page.run("dispatchEvent(new Event('beforeprint'))")
        assert before > 0 and page.run(folded) == 0
        page.run("dispatchEvent(new Event('afterprint'))")
        assert page.run(folded) == before


def test_it_prints(report, tmp_path):
    with Page(report) as page:
        page.print(tmp_path / "report.pdf")
        text = (tmp_path / "report.pdf").read_bytes()
    pages = [box for box in (b"594.95996 841.91998", b"595", b"594") if box in text]
    assert text.startswith(b"%PDF") and pages


def test_a_link_to_a_part_of_the_page_leads_there_and_opens_no_card(report):
    with Page(report) as page:
        page.run("document.documentElement.style.scrollBehavior = 'auto'")
        page.run("document.querySelector('nav a[href=\"#whisks\"]').click()")
        assert page.run("location.hash") == "#whisks"
        top_px = page.run("document.getElementById('whisks').getBoundingClientRect().top")
        assert abs(top_px) < 2
        assert page.run("document.querySelector('dialog[open]')") is None


def test_what_is_wider_than_a_phone_says_that_it_scrolls(report):
    wider = "[...document.querySelectorAll('.scroll, pre')].filter(one => one.scrollWidth > one.clientWidth + 1)"
    with Page(report, 400) as page:
        assert page.run(f"{wider}.length") > 0
        assert page.run(f"{wider}.every(one => one.classList.contains('scrolls'))")
        said = "getComputedStyle(document.querySelector('.scrolls'), '::before').content"
        assert "scroll sideways" in page.run(said)
