"""whisker-bench: the list of verbs, and what every verb's run may end with.

Each verb is a module of this folder, with functions `add(verbs)`, its parser, and `run`. Heavy modules are imported
inside the verbs' runs, so that --help takes 0.1 s.
"""

import argparse
import logging
import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module

from bench.base.errors import BadInput
from bench.base.exit_codes import BAD_INPUT, DONE, FAULT_OF_OURS, INTERRUPTED
from bench.base.progress import show_progress
from vision.geometry import Refused

# Names of the verbs and, with _ for -, of their modules, in the order of --help.
VERBS = (
    "plan",
    "design",
    "new",
    "board",
    "check",
    "calibrate",
    "evaluate",
    "report",
    "compare",
    "view",
    "score-traces",
    "tradeoff",
    "robot",
    "live",
    "figures",
    "simulate",
    "info",
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb. Return 0 done, 1 done with warnings, 2 bad input or usage, 70 a fault of ours, 130
    interrupted."""
    options = make_parser().parse_args(arguments)
    level = logging.INFO if options.verbose else logging.WARNING
    logging.basicConfig(level=level, format="%(message)s")
    show_progress()
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        return _run(options)
    except (BadInput, Refused) as bad:
        return _complain(str(bad), BAD_INPUT)
    except KeyboardInterrupt:
        return _complain("interrupted; what was finished is kept", INTERRUPTED)
    except BrokenPipeError:  # nobody reads on: end quietly
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        return DONE
    except OSError as problem:
        place = problem.filename or "file system"
        is_file = isinstance(problem, (FileExistsError, NotADirectoryError))
        what = "a file stands where a folder is wanted" if is_file else problem.strerror or problem
        return _complain(f"{place}: {what}", BAD_INPUT)
    except Exception as fault:
        logging.getLogger(__name__).info("", exc_info=fault)
        found = f"{type(fault).__name__}: {fault}"
        line = f"a fault of ours, please report it ({found}); -v shows where"
        return _complain(line, FAULT_OF_OURS)


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of all verbs; each sets `run`, which takes the parsed options and returns
    the exit code."""
    parser = argparse.ArgumentParser(
        prog="whisker-bench",
        description="How wrong is the distance that a robotic whisker feels? Recorded sessions in, truth, "
        "estimates and their errors out.",
        epilog="Exit codes: 0 done, 1 done with a warning, 2 bad input or usage, 130 interrupted.",
    )
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    for name in VERBS:
        import_module(f"bench.commands.{name.replace('-', '_')}").add(verbs)
    return parser


def _run(options: argparse.Namespace) -> int:
    """Run the verb where its results can be trusted, with one thread of linear algebra.

    Raise BadInput elsewhere. Several threads that share processors with others take many times as long, and
    sum in another order.
    """
    from bench.base.workers import single_thread

    single_thread()  # before NumPy is imported, which the check of the environment does first
    if options.needs_sound_environment:
        from bench.base.environment import check_environment

        check_environment()
    return options.run(options)


def _interrupt(*_) -> None:
    """Raise KeyboardInterrupt, so that a polite kill (SIGTERM) ends a run as Ctrl-C does.

    A second such signal finds the run ending, and is ignored.
    """
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt


def _complain(line: str, code: int) -> int:
    """Print one line on the error stream; return the exit code."""
    print(f"whisker-bench: {' '.join(line.split())}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
