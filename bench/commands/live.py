"""The verb `live`: a recorded push, evaluated as if it were being recorded (bench/workflows/live_push.py)."""

import argparse
from pathlib import Path

from bench.base.exit_codes import DONE, WITH_WARNINGS
from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_out, add_recorded, add_verb


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "live",
        run,
        "play a recorded trial at its own speed, and print distance, touch and slip right after its last frame",
        "whisker-bench live fixtures/small-session b30_3 --out live-out",
    )
    add_recorded(verb)
    verb.add_argument("trial", metavar="TRIAL", help="name of the trial")
    add_out(verb, "OUT", "folder for OUT/live/TRIAL_WHISK.png, the last frame with its lines")
    verb.add_argument(
        "--film",
        type=Path,
        metavar="FILE",
        help=".webm (VP9) or .avi: the push at its own speed, with what is known at each moment by one core",
    )


def run(options: argparse.Namespace) -> int:
    """Play the trial, print a line a whisk; return the exit code."""
    begin_step(f"reading {options.session}")
    from bench.workflows.live_push import play_trial

    has_status = False
    for line, status in play_trial(
        options.session,
        options.out,
        options.trial,
        film=options.film,
        follow_links=options.follow_links,
    ):
        print(line)
        has_status = has_status or bool(status)
    return WITH_WARNINGS if has_status else DONE
