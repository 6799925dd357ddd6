"""whisker-bench: parsing only. Heavy modules are imported inside the commands, so that --help takes 0.1 s."""

import argparse
import logging
import os
import signal
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from bench.base.errors import BadInput
from bench.cli_results import add_compare, add_report, add_view
from bench.cli_seeing import add_seeing, add_tradeoff, seeing_of
from bench.cli_setup import add_board, add_new
from bench.options import BAD_INPUT, DONE, DOUBTFUL, FAULT_OF_OURS, INTERRUPTED, add_figure_format
from bench.options import add_out as _add_out
from bench.options import add_recorded as _add_recorded
from bench.options import add_session as _add_session
from bench.options import add_verb as _add
from bench.options import add_workers as _add_workers
from vision.geometry.errors import Refused


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Returns 0 done, 1 done but doubtful, 2 bad input or usage, 130 interrupted."""
    options = make_parser().parse_args(arguments)
    logging.basicConfig(level=logging.INFO if options.verbose else logging.WARNING, format="%(message)s")
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        return _in_sound_environment(options)
    except (BadInput, Refused) as bad:
        return _complain(str(bad), BAD_INPUT)
    except KeyboardInterrupt:
        return _complain("interrupted; what was finished is kept", INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nobody reads on: end quietly
        return DONE
    except OSError as problem:
        return _complain(f"{problem.filename or 'file system'}: {problem.strerror or problem}", BAD_INPUT)
    except Exception as fault:
        logging.getLogger(__name__).info("", exc_info=fault)
        found = f"{type(fault).__name__}: {fault}"
        return _complain(f"a fault of ours, please report it ({found}); -v shows where", FAULT_OF_OURS)


def _in_sound_environment(options: argparse.Namespace) -> int:
    """Run the verb where results can be trusted. `info` tells its versions first. Raises BadInput elsewhere."""
    from bench.base.environment import check_environment

    if options.run is _info:
        _info(options)
        check_environment()
        return DONE
    check_environment()
    return options.run(options)


def _interrupt(*_) -> None:
    """A polite kill (SIGTERM) ends a run as Ctrl-C does; a second one finds it ending."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt


def _complain(line: str, code: int) -> int:
    print(f"whisker-bench: {' '.join(line.split())}", file=sys.stderr)
    return code


def make_parser() -> argparse.ArgumentParser:
    """All verbs; each sets `run`, a function of the parsed options that returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="whisker-bench",
        description="How wrong is the distance that a robotic whisker feels? Recorded sessions in, truth, "
        "estimates and their errors out.",
        epilog="Exit codes: 0 done, 1 done with something doubtful, 2 bad input or usage, 130 interrupted.",
    )
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    first = (add_new, add_board, _add_check, _add_calibrate, _add_evaluate)
    looking = (add_report, add_compare, add_view)
    for add_verb in (*first, *looking, add_tradeoff, _add_figures, _add_simulate, _add_info):
        add_verb(verbs)
    return parser


def _add_evaluate(verbs) -> None:
    verb = _add(
        verbs,
        "evaluate",
        _evaluate,
        "true distance and slip of every whisk, the estimates beside them, and their errors",
        "whisker-bench evaluate fixtures/small-session --out demo-out --workers 2",
    )
    _add_recorded(verb)
    _add_out(verb, "OUT", "folder for tables, figures and the summary")
    verb.add_argument("--theta-deg", type=float, metavar="X", help="pushing angle of the estimates (default 3)")
    verb.add_argument("--alpha-est-deg", type=float, metavar="X", help="friction angle that (10) assumes (default 10)")
    verb.add_argument(
        "--alpha-est-sigma-deg",
        type=float,
        metavar="X",
        help="how far that may be off, one sigma (default: by the spread of the session's surfaces, 5 without any)",
    )
    verb.add_argument(
        "--cutoff-Hz", type=float, metavar="X", help="of the low-pass ahead of one's own estimators (0.5 a deg/s)"
    )
    verb.add_argument(
        "--clock-sigma-s",
        type=float,
        metavar="X",
        help="how well frames' and signals' clocks agree (default: exactly where frame times were recorded, "
        "else to half a frame)",
    )
    add_seeing(verb)
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
    verb.add_argument("--trials", metavar="PATTERN", help="only trials of such names, e.g. 'b3*' (default: all)")
    verb.add_argument("--no-figures", action="store_false", dest="figures", help="tables, report and summary alone")
    add_figure_format(verb)
    verb.add_argument(
        "--nwb",
        type=Path,
        metavar="FILE",
        help="signals, tables and tracks as Neurodata Without Borders too, for archives (extra `nwb`)",
    )
    _add_workers(verb)


def _evaluate(options: argparse.Namespace) -> int:
    from bench.base.workers import single_thread

    single_thread()
    from bench.api import evaluate_with
    from bench.base.settings import Settings
    from bench.report.nwb import check_nwb, write_nwb

    if options.nwb is not None:
        check_nwb(options.nwb, options.session)
    sys.path.append(os.getcwd())  # where --estimator is looked for; last, so that it hides nothing of ours
    numbers = ("theta_deg", "alpha_est_deg", "alpha_est_sigma_deg", "cutoff_Hz", "clock_sigma_s", "accuracy_mm")
    names = (*numbers, "estimators", "gauges_from_all", "trials", "figures", "follow_links")
    given = {name: getattr(options, name) for name in names if getattr(options, name) is not None}
    given["seeing"] = seeing_of(options)
    if "estimators" in given:
        given["estimators"] = tuple(given["estimators"])
    told = {"progress": sys.stderr.isatty(), "announce": print}
    formats = options.figure_format
    run = evaluate_with(options.session, options.out, Settings(**given), options.workers, formats, **told)
    if options.nwb is not None:
        write_nwb(options.nwb, run.out, options.session)
    return DOUBTFUL if run.doubtful else DONE


def _add_calibrate(verbs) -> None:
    calibrate = verbs.add_parser("calibrate", help="cameras from their board views, gauges from the deflection seen")
    what = calibrate.add_subparsers(title="what", metavar="WHAT", required=True)
    cameras = _add(
        what,
        "cameras",
        _calibrate_cameras,
        "calibrate the cameras from boards/ and place them in the rig, with their uncertainty",
        "whisker-bench calibrate cameras fixtures/small-session --out cameras.toml",
    )
    _add_recorded(cameras)
    _add_out(cameras, "FILE", "cameras.toml to write; its covariance goes beside it as .npz")
    cameras.add_argument(
        "--lenses",
        type=Path,
        metavar="FILE",
        help="camera TOML of caliscope or aniposelib: its lenses are taken as exact and only placed in the rig",
    )
    gauges = _add(
        what,
        "gauges",
        _calibrate_gauges,
        "calibrate the gauges against the deflection seen, with a certificate",
        "whisker-bench calibrate gauges fixtures/small-session --out gauges.toml",
    )
    _add_recorded(gauges)
    _add_out(gauges, "FILE", "gauges.toml to write; the certificate goes beside it as .pdf")
    gauges.add_argument("--all", action="store_true", help='all trials, not only those marked purpose = "gauge"')
    _add_workers(gauges)


def _calibrate_gauges(options: argparse.Namespace) -> int:
    from bench.calibrate_gauges import calibrate_gauges_command

    return calibrate_gauges_command(
        options.session,
        options.out,
        every_trial=options.all,
        workers=options.workers,
        progress=sys.stderr.isatty(),
        follow_links=options.follow_links,
    )


def _calibrate_cameras(options: argparse.Namespace) -> int:
    from bench.cameras.calibrate import calibrate_cameras_command

    links = options.follow_links
    return calibrate_cameras_command(options.session, options.out, options.lenses, follow_links=links)


def _add_check(verbs) -> None:
    verb = _add(
        verbs,
        "check",
        _check,
        "list everything that is wrong or doubtful in a session, without evaluating it",
        "whisker-bench check fixtures/small-session",
    )
    _add_recorded(verb)


def _check(options: argparse.Namespace) -> int:
    from bench.check import check

    return check(options.session, progress=sys.stderr.isatty(), follow_links=options.follow_links)


_MAPS = {
    "tilt": "map of the error of (10) over slope and tilt of the bar, by exact mechanics, as PNG, SVG and CSV",
    "radius": "map of the error of (10) over distance and radius of the bar, by exact mechanics, as PNG, SVG and CSV",
}


def _add_figures(verbs) -> None:
    figures = verbs.add_parser("figures", help="the paper's figures, and maps of the error that it left open")
    what = figures.add_subparsers(title="what", metavar="WHAT", required=True)
    for number in (5, 6):
        figure = _add(
            what,
            str(number),
            _theory_figure,
            f"figure {number} of the paper, from its equations, as PNG, SVG and CSV",
            f"whisker-bench figures {number} --out figures",
        )
        _add_out(figure, "DIR", "folder for the files")
        figure.set_defaults(number=number)
    pooled = _add(
        what,
        "8",
        _figure_8,
        "figure 8 of the paper, from one or more evaluated runs, as PNG, SVG and CSV",
        "whisker-bench figures 8 monday-out tuesday-out --out figures",
    )
    pooled.add_argument("runs", type=Path, nargs="+", metavar="OUT", help="folder that `evaluate --out` wrote")
    _add_out(pooled, "DIR", "folder for the files")
    for name, summary in _MAPS.items():
        drawn = _add(what, name, _error_map, summary, f"whisker-bench figures {name} --out figures")
        _add_out(drawn, "DIR", "folder for the files")
        _add_workers(drawn)
        drawn.set_defaults(name=name)


def _theory_figure(options: argparse.Namespace) -> int:
    from bench.theory.figures import write_figure

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

    for path in write_map(options.name, options.out, workers=options.workers, progress=sys.stderr.isatty()):
        print(path)
    return DONE


def _add_simulate(verbs) -> None:
    verb = _add(
        verbs,
        "simulate",
        _simulate,
        "record a session with known truth on a synthetic rig",
        "whisker-bench simulate my-session --protocol quick --seed 1 --workers 2",
    )
    _add_session(verb)
    verb.add_argument("--protocol", default="quick", metavar="NAME|FILE", help="quick, paper or a TOML file")
    verb.add_argument("--signals-only", action="store_true", help="no pictures; times, signals and truth all the same")
    verb.add_argument("--seed", type=int, default=0, metavar="N", help="the same seed gives the same bytes (default 0)")
    _add_workers(verb)


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


def _add_info(verbs) -> None:
    _add(verbs, "info", _info, "versions of what results depend on, and whether they fit", "whisker-bench info")


def _info(_: argparse.Namespace) -> int:
    from bench.base.environment import versions

    for name, version in versions().items():
        print(f"{name} {version}")
    return DONE


if __name__ == "__main__":
    sys.exit(main())
