"""The array's own page: its verdict, and links to each whisker's report."""

from collections.abc import Sequence
from pathlib import Path

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

from bench.base.atomic import write_whole
from bench.report.page.write import REPORT
from bench.report.run_facts import RunRecord
from bench.report.summary.compose import Summary


def write_page(
    out: Path,
    session: str,
    summary: Summary,
    runs: Sequence[tuple[str, RunRecord]],
    figures: Sequence[str],
) -> None:
    """Write report.html of the array, whole.

    runs: name and record of each whisker. figures: names of pictures in `out`.
    """
    folders = [PackageLoader("bench.array", ""), PackageLoader("bench.report", "page")]
    loader = ChoiceLoader(folders)
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined)
    template = environment.get_template("array.html.j2")
    page = template.render(session=session, summary=summary, runs=runs, figures=figures)
    write_whole(out / REPORT, page + "\n")
