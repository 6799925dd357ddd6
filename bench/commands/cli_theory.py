"""Verbs of the command line that need no recording: `figures`, `simulate`. Parsing only."""

import argparse
import sys
from functools import partial
from pathlib import Path

from bench.commands.options import DONE, Verbs, add_out, add_session, add_verb, add_workers

_MAPS = {
    "tilt": "map of the error of (10) over slope and tilt of the bar, by exact mechanics, as PNG, SVG and CSV",
    "radius": "map of the error of (10) over distance and radius of the bar, by exact mechanics, as PNG, SVG and CSV",
}


def add_figures(verbs: Verbs) -> None:
    """`figures`."""
    figures = verbs.add_parser(
        "figures", help="the paper's figures, and maps of the error that it left open"
    )
    what = figures.add_subparsers(title="what", metavar="WHAT", required=True)
    for number in (5, 6):
        figure = add_verb(
            what,
            str(number),
            _theory_figure,
            f"figure {number} of the paper, from its equations, as PNG, SVG and CSV",
            f"whisker-bench figures {number} --out figures",
        )
        add_out(figure, "DIR", "folder for the files")
        figure.set_defaults(number=number)
    pooled = add_verb(
        what,
        "8",
        _figure_8,
        "figure 8 of the paper, from one or more evaluated runs, as PNG, SVG and CSV",
        "whisker-bench figures 8 monday-out tuesday-out --out figures",
    )
    pooled.add_argument(
        "runs", type=Path, nargs="+", metavar="OUT", help="folder that `evaluate --out` wrote"
    )
    add_out(pooled, "DIR", "folder for the files")
    for name, summary in _MAPS.items():
        drawn = add_verb(
            what, name, _error_map, summary, f"whisker-bench figures {name} --out figures"
        )
        add_out(drawn, "DIR", "folder for the files")
        add_workers(drawn)
        drawn.set_defaults(name=name)


def _theory_figure(options: argparse.Namespace) -> int:
    from bench.theory.slope_limits import write_figure

    for path in write_figure(options.number, options.out):
        print(path)
    return DONE


def _figure_8(options: argparse.Namespace) -> int:
    from bench.report.pooled import write_figure_8

    paths, lines = write_figure_8(options.runs, options.out)
    print(*lines, *paths, sep="\n")
    return DONE


def _error_map(options: argparse.Namespace) -> int:
    from bench.theory.model_error_maps import write_map

    for path in write_map(
        options.name, options.out, workers=options.workers, progress=sys.stderr.isatty()
    ):
        print(path)
    return DONE


def add_simulate(verbs: Verbs) -> None:
    """`simulate`."""
    verb = add_verb(
        verbs,
        "simulate",
        _simulate,
        "record a session with known truth on a synthetic rig",
        "whisker-bench simulate my-session --protocol quick --seed 1 --workers 2",
    )
    add_session(verb)
    verb.add_argument(
        "--protocol", default="quick", metavar="NAME|FILE", help="quick, paper or a TOML file"
    )
    verb.add_argument(
        "--signals-only",
        action="store_true",
        help="no pictures; times, signals and truth all the same",
    )
    verb.add_argument(
        "--seed",
        type=int,
        default=0,
        metavar="N",
        help="the same seed gives the same bytes (default 0)",
    )
    add_workers(verb)


def _simulate(options: argparse.Namespace) -> int:
    from bench.rig.simulate import simulate

    simulate(
        options.session,
        protocol=options.protocol,
        signals_only=options.signals_only,
        seed=options.seed,
        workers=options.workers,
        progress=sys.stderr.isatty(),
        announce=partial(print, flush=True),
    )
    return DONE
