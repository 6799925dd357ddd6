"""The verb `view`: a trial as an annotated film (bench/report/video.py)."""

import argparse
from pathlib import Path

from bench.base.exit_codes import DONE
from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_run, add_verb


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "view",
        run,
        "a trial of an evaluated run as an annotated film: frames with wire, bar and contact, and the curves",
        "whisker-bench view demo-out b60_4",
    )
    add_run(verb)
    verb.add_argument("trial", metavar="TRIAL", help="name of the trial")
    verb.add_argument(
        "--session", type=Path, metavar="SESSION", help="its session, where that was moved"
    )
    verb.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help=".webm (VP9) or .avi (default OUT/video/TRIAL.webm)",
    )
    verb.add_argument(
        "--rate-Hz",
        type=float,
        default=10.0,
        metavar="X",
        help="frames a second of the film (default 10)",
    )


def run(options: argparse.Namespace) -> int:
    """Write the film, print its path; return the exit code."""
    begin_step(f"reading {options.run_folder}")
    from bench.report.video import write_video

    path = write_video(
        options.run_folder, options.trial, options.out, options.session, options.rate_Hz
    )
    print(path)
    return DONE
