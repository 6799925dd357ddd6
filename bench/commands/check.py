"""The verb `check`: all that is wrong in a session, and all warnings (bench/workflows/preflight.py)."""

import argparse

from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_recorded, add_verb


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "check",
        run,
        "list all errors and warnings of a session, without evaluating it",
        "whisker-bench check fixtures/small-session",
    )
    add_recorded(verb)


def run(options: argparse.Namespace) -> int:
    """Check the session; return the exit code."""
    begin_step(f"reading {options.session}")
    from bench.workflows.preflight import check

    return check(options.session, follow_links=options.follow_links)
