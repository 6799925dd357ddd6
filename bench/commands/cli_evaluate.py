"""Verbs of the command line that read a recorded session: `evaluate`, `check`, `calibrate`. Parsing only."""

import argparse
import os
import sys
from pathlib import Path

from bench.commands.cli_seeing import add_seeing, add_watch, seeing_of, watch
from bench.commands.options import (
    DONE,
    DOUBTFUL,
    Verbs,
    add_figure_format,
    add_out,
    add_recorded,
    add_verb,
    add_workers,
)


def add_evaluate(verbs: Verbs) -> None:
    """`evaluate`."""
    verb = add_verb(
        verbs,
        "evaluate",
        _evaluate,
        "true distance and slip of every whisk, the estimates beside them, and their errors",
        "whisker-bench evaluate fixtures/small-session --out demo-out --workers 2",
    )
    add_recorded(verb)
    add_out(verb, "OUT", "folder for tables, figures and the summary")
    _add_numbers(verb)
    add_seeing(verb)
    add_watch(verb)
    verb.add_argument(
        "--gauges-from-all",
        action="store_true",
        help="calibrate the gauges by every trial with volts and a truth, not by gauge trials alone; each trial is "
        "judged by gauges fitted without it",
    )
    verb.add_argument(
        "--estimator",
        action="append",
        dest="estimators",
        metavar="MODULE:FUNCTION",
        help="one of your own, importable from here; may be given several times",
    )
    verb.add_argument(
        "--one-camera",
        metavar="NAME",
        help="distance, force and stiffness by the shape that this camera alone sees, too, without gauges: "
        "one_camera.csv (it sees its own trial, and has a line of its own)",
    )
    verb.add_argument(
        "--trials", metavar="PATTERN", help="only trials of such names, e.g. 'b3*' (default: all)"
    )
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
    by = verb.add_mutually_exclusive_group()
    add_workers(by)
    by.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="send trials to a Dask cluster that runs, by its scheduler's address; its workers must see SESSION and "
        "OUT under the same paths (extra `cluster`)",
    )


def _add_numbers(verb: argparse.ArgumentParser) -> None:
    """What the estimators assume."""
    verb.add_argument(
        "--theta-deg", type=float, metavar="X", help="pushing angle of the estimates (default 3)"
    )
    verb.add_argument(
        "--alpha-est-deg",
        type=float,
        metavar="X",
        help="friction angle that (10) assumes (default 10)",
    )
    verb.add_argument(
        "--alpha-est-sigma-deg",
        type=float,
        metavar="X",
        help="how far that may be off, one sigma (default: by the spread of the session's surfaces, 5 without any)",
    )
    verb.add_argument(
        "--cutoff-Hz",
        type=float,
        metavar="X",
        help="of the low-pass ahead of one's own estimators (0.5 a deg/s)",
    )
    verb.add_argument(
        "--clock-sigma-s",
        type=float,
        metavar="X",
        help="how well frames' and signals' clocks agree (default: exactly where frame times were recorded, "
        "else to half a frame)",
    )


def _evaluate(options: argparse.Namespace) -> int:
    from bench.base.workers import single_thread

    single_thread()
    from bench.api import evaluate_with
    from bench.base.settings import Settings
    from bench.report.nwb import check_nwb, write_nwb

    if options.nwb is not None:
        check_nwb(options.nwb, options.session)
    sys.path.append(
        os.getcwd()
    )  # where --estimator is looked for; last, so that it hides nothing of ours
    numbers = (
        "theta_deg",
        "alpha_est_deg",
        "alpha_est_sigma_deg",
        "cutoff_Hz",
        "clock_sigma_s",
        "accuracy_mm",
    )
    names = (
        *numbers,
        "estimators",
        "gauges_from_all",
        "trials",
        "figures",
        "follow_links",
        "one_camera",
    )
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    given["seeing"] = seeing_of(options)
    if "estimators" in given:
        given["estimators"] = tuple(given["estimators"])
    if options.watch is not None:
        return watch(options, Settings(**given))
    shown = {"progress": sys.stderr.isatty(), "announce": print, "dask": options.dask}
    formats = options.figure_format
    run = evaluate_with(
        options.session, options.out, Settings(**given), options.workers, formats, **shown
    )
    if options.nwb is not None:
        write_nwb(options.nwb, run.out, options.session)
    return DOUBTFUL if run.doubtful else DONE


def add_check(verbs: Verbs) -> None:
    """`check`."""
    verb = add_verb(
        verbs,
        "check",
        _check,
        "list everything that is wrong or doubtful in a session, without evaluating it",
        "whisker-bench check fixtures/small-session",
    )
    add_recorded(verb)


def _check(options: argparse.Namespace) -> int:
    from bench.commands.check import check

    return check(options.session, progress=sys.stderr.isatty(), follow_links=options.follow_links)


def add_calibrate(verbs: Verbs) -> None:
    """`calibrate`."""
    calibrate = verbs.add_parser(
        "calibrate", help="cameras from their board views, gauges from the deflection seen"
    )
    what = calibrate.add_subparsers(title="what", metavar="WHAT", required=True)
    cameras = add_verb(
        what,
        "cameras",
        _calibrate_cameras,
        "calibrate the cameras from boards/ and place them in the rig, with their uncertainty",
        "whisker-bench calibrate cameras fixtures/small-session --out cameras.toml",
    )
    add_recorded(cameras)
    add_out(cameras, "FILE", "cameras.toml to write; its covariance goes beside it as .npz")
    cameras.add_argument(
        "--lenses",
        type=Path,
        metavar="FILE",
        help="camera TOML of caliscope or aniposelib: its lenses are taken as exact and only placed in the rig",
    )
    gauges = add_verb(
        what,
        "gauges",
        _calibrate_gauges,
        "calibrate the gauges against the deflection seen, with a certificate",
        "whisker-bench calibrate gauges fixtures/small-session --out gauges.toml",
    )
    add_recorded(gauges)
    add_out(gauges, "FILE", "gauges.toml to write; the certificate goes beside it as .pdf")
    gauges.add_argument(
        "--all", action="store_true", help='all trials, not only those marked purpose = "gauge"'
    )
    add_workers(gauges)


def _calibrate_gauges(options: argparse.Namespace) -> int:
    from bench.commands.calibrate_gauges import calibrate_gauges_command

    return calibrate_gauges_command(
        options.session,
        options.out,
        every_trial=options.all,
        workers=options.workers,
        progress=sys.stderr.isatty(),
        follow_links=options.follow_links,
    )


def _calibrate_cameras(options: argparse.Namespace) -> int:
    from bench.cameras.calibrate_session import calibrate_cameras_command

    links = options.follow_links
    return calibrate_cameras_command(
        options.session, options.out, options.lenses, follow_links=links
    )
