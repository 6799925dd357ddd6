"""whisker-bench: parsing only. Heavy modules are imported inside the commands, so that --help takes 0.1 s."""

import argparse
import logging
import os
import signal
import sys
from collections.abc import Sequence

from bench.base.errors import BadInput
from bench.commands.cli_design import add_design
from bench.commands.cli_evaluate import add_calibrate, add_check, add_evaluate
from bench.commands.cli_plan import add_plan
from bench.commands.cli_results import add_compare, add_report, add_view
from bench.commands.cli_robot import add_robot
from bench.commands.cli_seeing import add_tradeoff
from bench.commands.cli_setup import add_board, add_new
from bench.commands.cli_theory import add_figures, add_simulate
from bench.commands.options import BAD_INPUT, DONE, FAULT_OF_OURS, INTERRUPTED, Verbs, add_verb
from vision.geometry.refusals import Refused


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command. Returns 0 done, 1 done but doubtful, 2 bad input or usage, 130 interrupted."""
    options = make_parser().parse_args(arguments)
    logging.basicConfig(
        level=logging.INFO if options.verbose else logging.WARNING, format="%(message)s"
    )
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        return _in_sound_environment(options)
    except (BadInput, Refused) as bad:
        return _complain(str(bad), BAD_INPUT)
    except KeyboardInterrupt:
        return _complain("interrupted; what was finished is kept", INTERRUPTED)
    except BrokenPipeError:
        os.dup2(
            os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno()
        )  # nobody reads on: end quietly
        return DONE
    except OSError as problem:
        return _complain(
            f"{problem.filename or 'file system'}: {problem.strerror or problem}", BAD_INPUT
        )
    except Exception as fault:
        logging.getLogger(__name__).info("", exc_info=fault)
        found = f"{type(fault).__name__}: {fault}"
        return _complain(
            f"a fault of ours, please report it ({found}); -v shows where", FAULT_OF_OURS
        )


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
    first = (add_plan, add_design, add_new, add_board, add_check, add_calibrate, add_evaluate)
    looking = (add_report, add_compare, add_view)
    for add in (*first, *looking, add_tradeoff, add_robot, add_figures, add_simulate, _add_info):
        add(verbs)
    return parser


def _add_info(verbs: Verbs) -> None:
    add_verb(
        verbs,
        "info",
        _info,
        "versions of what results depend on, and whether they fit",
        "whisker-bench info",
    )


def _info(_: argparse.Namespace) -> int:
    from bench.base.environment import versions

    for name, version in versions().items():
        print(f"{name} {version}")
    return DONE


if __name__ == "__main__":
    sys.exit(main())
