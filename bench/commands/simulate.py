"""The verb `simulate`: a session with known truth (bench/rig/simulation.py)."""

import argparse
from functools import partial

from bench.base.exit_codes import DONE
from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_session, add_verb, add_workers
from bench.rig.built_in import protocol_names


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "simulate",
        run,
        "record a session with known truth on a synthetic rig",
        "whisker-bench simulate my-session --protocol quick --seed 1 --workers 2",
    )
    add_session(verb)
    verb.add_argument(
        "--protocol",
        default="quick",
        metavar="NAME|FILE",
        help=f"{protocol_names()} or a TOML file (default quick)",
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


def run(options: argparse.Namespace) -> int:
    """Simulate the session; return the exit code."""
    begin_step(f"building the rig of {options.protocol}")
    from bench.rig.simulation import simulate

    simulate(
        options.session,
        protocol=options.protocol,
        signals_only=options.signals_only,
        seed=options.seed,
        workers=options.workers,
        announce=partial(print, flush=True),
    )
    print(f"then run: whisker-bench check {options.session}")
    return DONE
