"""The verb `figures`: the paper's figures (bench/theory, bench/report/pooled.py) and maps of the
error of (10)."""

import argparse
from pathlib import Path

from bench.base.exit_codes import DONE
from bench.base.progress import begin_step
from bench.commands.options import Run, Verbs, add_out, add_verb, add_workers

_MAPS = {
    "tilt": "map of the error of (10) over slope and tilt of the bar, by exact mechanics, as PNG, SVG and CSV",
    "radius": "map of the error of (10) over distance and radius of the bar, by exact mechanics, as PNG, SVG and CSV",
}


def add(verbs: Verbs) -> None:
    """Add the verb with a figure or map each below it."""
    figures = verbs.add_parser(
        "figures", help="the paper's figures, and maps of the error that it left open"
    )
    what = figures.add_subparsers(title="what", metavar="WHAT", required=True)
    for number in (5, 6):
        summary = f"figure {number} of the paper, from its equations, as PNG, SVG and CSV"
        verb = _add_figure(what, str(number), _run_theory, summary)
        verb.set_defaults(number=number)
    _add_figure_8(what)
    for name, summary in _MAPS.items():
        verb = _add_figure(what, name, _run_map, summary)
        add_workers(verb)
        verb.set_defaults(name=name)


def _add_figure(what: Verbs, name: str, run: Run, summary: str) -> argparse.ArgumentParser:
    """Add a figure that needs no run; return its parser."""
    verb = add_verb(what, name, run, summary, f"whisker-bench figures {name} --out figures")
    add_out(verb, "DIR", "folder for the files")
    return verb


def _add_figure_8(what: Verbs) -> None:
    """Add `figures 8`, which pools evaluated runs."""
    verb = add_verb(
        what,
        "8",
        _run_figure_8,
        "figure 8 of the paper, from one or more evaluated runs, as PNG, SVG and CSV",
        "whisker-bench figures 8 monday-out tuesday-out --out figures",
    )
    verb.add_argument(
        "runs", type=Path, nargs="+", metavar="OUT", help="folder that `evaluate --out` wrote"
    )
    add_out(verb, "DIR", "folder for the files")


def _run_theory(options: argparse.Namespace) -> int:
    """Write figure 5 or 6, print the paths; return the exit code."""
    begin_step(f"drawing into {options.out}")
    from bench.theory.slope_limits import write_figure

    print(*write_figure(options.number, options.out), sep="\n")
    return DONE


def _run_figure_8(options: argparse.Namespace) -> int:
    """Write figure 8 of all runs, print what it says and the paths; return the exit code."""
    begin_step(f"drawing into {options.out}")
    from bench.report.pooled import write_figure_8

    paths, lines = write_figure_8(options.runs, options.out)
    print(*lines, *paths, sep="\n")
    return DONE


def _run_map(options: argparse.Namespace) -> int:
    """Write a map of the error of (10), print the paths; return the exit code."""
    from bench.theory.model_error_maps import write_map

    paths = write_map(options.name, options.out, workers=options.workers)
    print(*paths, sep="\n")
    return DONE
