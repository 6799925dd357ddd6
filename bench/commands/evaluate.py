"""The verb `evaluate`: the main job (bench/workflows/session_evaluation.py), or with --watch again and again."""

import argparse
import os
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from bench.base.errors import BadInput
from bench.base.progress import begin_step
from bench.commands.options import (
    Verbs,
    add_alpha_est,
    add_figure_format,
    add_out,
    add_recorded,
    add_trials,
    add_verb,
    add_workers,
)

if TYPE_CHECKING:
    from bench.base.settings import Seeing, Settings


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "evaluate",
        run,
        "true distance and slip of every whisk, the estimates, and their errors",
        "whisker-bench evaluate fixtures/small-session --out demo-out --workers 2",
    )
    add_recorded(verb)
    add_out(verb, "OUT", "folder for tables, figures and the summary")
    _add_numbers(verb)
    _add_seeing(verb)
    verb.add_argument(
        "--watch",
        type=float,
        nargs="?",
        const=2.0,
        metavar="S",
        help="while the session is recorded: evaluate each trial once it is complete, checked every S seconds (2), until "
        "Ctrl-C",
    )
    verb.add_argument(
        "--gauges-from-all",
        action="store_true",
        help="calibrate the gauges by every trial with volts and a truth, not by gauge trials alone; each trial is "
        "judged by gauges fitted without it",
    )
    verb.add_argument(
        "--estimator",
        action="append",
        default=[],
        dest="estimators",
        metavar="MODULE:FUNCTION",
        help="an estimator of your own, importable from the working folder; may be given several times",
    )
    verb.add_argument(
        "--one-camera",
        metavar="NAME",
        help="distance, force and stiffness by the shape that this camera alone sees, too, without gauges: "
        "one_camera.csv (from pictures of the same trial, so it is not compared with estimators)",
    )
    add_trials(verb, ", e.g. 'b3*'")
    verb.add_argument(
        "--no-figures",
        action="store_false",
        dest="figures",
        help="tables, report and summary alone",
    )
    add_figure_format(verb)
    verb.add_argument(
        "--nwb",
        type=Path,
        metavar="FILE",
        help="signals, tables and tracks as Neurodata Without Borders too, for archives (extra `nwb`)",
    )
    processes = verb.add_mutually_exclusive_group()
    add_workers(processes)
    processes.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="send trials to a Dask cluster that runs, by its scheduler's address; its workers must see SESSION and "
        "OUT under the same paths (extra `cluster`)",
    )


def _add_numbers(verb: argparse.ArgumentParser) -> None:
    """Add the numbers that the estimators assume."""
    verb.add_argument(
        "--theta-deg",
        type=float,
        default=3.0,
        metavar="X",
        help="pushing angle of the estimates (default 3)",
    )
    add_alpha_est(verb)
    verb.add_argument(
        "--alpha-est-sigma-deg",
        type=float,
        metavar="X",
        help="one sigma of that friction angle (default: by the spread of the session's surfaces, 5 without any)",
    )
    verb.add_argument(
        "--cutoff-Hz",
        type=float,
        metavar="X",
        help="cut-off of the low-pass ahead of your own estimators (default: 0.5 Hz for each deg/s of the motor)",
    )
    verb.add_argument(
        "--clock-sigma-s",
        type=float,
        metavar="X",
        help="how well frames' and signals' clocks agree (default: exactly where frame times were recorded, "
        "else to half a frame)",
    )


def _add_seeing(verb: argparse.ArgumentParser) -> None:
    """Add the options by which pictures are evaluated less thoroughly, or more."""
    group = verb.add_mutually_exclusive_group()
    group.add_argument(
        "--preset",
        metavar="NAME",
        help="how thoroughly pictures are evaluated: draft or standard (default); `tradeoff` measures what each costs",
    )
    group.add_argument(
        "--accuracy-mm",
        type=float,
        metavar="X",
        help="evaluate each whisk by draft, then by standard, until d_x's stated sigma is X or less",
    )
    group.add_argument(
        "--settings",
        type=Path,
        metavar="FILE",
        help="a file in place of a preset, as `tradeoff` writes it",
    )


def run(options: argparse.Namespace) -> int:
    """Evaluate the session, once or while it is recorded; return the exit code.

    Raise BadInput for a time of --watch that is out of range.
    """
    begin_step(f"reading {options.session}")
    from bench.report.nwb import check_nwb, write_nwb
    from bench.workflows.live_evaluation import watch
    from bench.workflows.session_evaluation import evaluate

    if options.nwb is not None:
        check_nwb(options.nwb, options.session)
    # where --estimator is looked for; last, so that it hides nothing of ours
    sys.path.append(os.getcwd())
    settings = _settings(options)
    if options.watch is None:
        job = evaluate
    elif 0 < options.watch <= 3600:
        job = partial(watch, every_s=options.watch)
    else:
        raise BadInput(f"--watch {options.watch:g}: must be above 0 and at most 3600 s")
    code = job(
        options.session,
        options.out,
        settings,
        workers=options.workers,
        dask=options.dask,
        figure_formats=options.figure_format,
        announce=partial(print, flush=True),
    )
    if options.nwb is not None and options.watch is None:
        write_nwb(options.nwb, options.out, options.session)
    return code


def _settings(options: argparse.Namespace) -> "Settings":
    """Return the settings of the run. Raise BadInput where one is out of range."""
    from bench.base.settings import Settings

    return Settings(
        theta_deg=options.theta_deg,
        alpha_est_deg=options.alpha_est_deg,
        cutoff_Hz=options.cutoff_Hz,
        estimators=tuple(options.estimators),
        clock_sigma_s=options.clock_sigma_s,
        alpha_est_sigma_deg=options.alpha_est_sigma_deg,
        gauges_from_all=options.gauges_from_all,
        trials=options.trials,
        figures=options.figures,
        seeing=_seeing(options),
        accuracy_mm=options.accuracy_mm,
        follow_links=options.follow_links,
        one_camera=options.one_camera,
    )


def _seeing(options: argparse.Namespace) -> "Seeing":
    """Return the settings of --preset or --settings."""
    from bench.trials.seeing import STANDARD, by_preset, from_file

    if options.settings:
        return from_file(options.settings)
    return by_preset(options.preset or STANDARD)
