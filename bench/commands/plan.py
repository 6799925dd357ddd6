"""The verb `plan`: what sigmas a bench would give before it is built (bench/plan)."""

import argparse
from pathlib import Path

from bench.base.errors import BadInput
from bench.base.exit_codes import DONE, WITH_WARNINGS
from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_follow_links, add_verb, add_workers

EXAMPLE = Path(__file__).resolve().parents[1] / "plan" / "example.toml"


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "plan",
        run,
        "what sigmas a bench would give before it is built, what limits them and which one change would halve them; "
        "of a recorded session, expected and stated sigmas",
        "whisker-bench plan --example > rig.toml && whisker-bench plan rig.toml --out plan-out",
    )
    verb.add_argument(
        "what",
        type=Path,
        nargs="?",
        metavar="RIG.toml|SESSION",
        help="a rig, as `simulate` reads it (a camera without position_mm is given a place), or a recorded session",
    )
    verb.add_argument(
        "--out", type=Path, metavar="OUT", help="folder for plan.txt, plan.csv, plan.json, plan.png"
    )
    verb.add_argument("--example", action="store_true", help="print a RIG.toml to begin with")
    verb.add_argument(
        "--theta-deg",
        type=float,
        default=3.0,
        metavar="X",
        help="pushing angle at which slip, φ and α are planned (default 3)",
    )
    verb.add_argument(
        "--no-changes",
        action="store_false",
        dest="changes",
        help="sigmas alone, without what one change of the bench would do; faster",
    )
    add_follow_links(verb)
    add_workers(verb)


def run(options: argparse.Namespace) -> int:
    """Write the plan, or print an example of a rig; return the exit code.

    Raise BadInput where RIG.toml, SESSION or --out is missing.
    """
    if options.example:
        print(EXAMPLE.read_text(encoding="utf-8").rstrip())
        return DONE
    begin_step(f"reading {options.what}")
    from bench.plan.run_plan import Options, plan

    if options.what is None or options.out is None:
        raise BadInput("plan needs RIG.toml or SESSION, and --out OUT; --example prints a RIG.toml")
    made = plan(
        options.what,
        options.out,
        Options(options.theta_deg, options.changes, options.follow_links),
        workers=options.workers,
    )
    return WITH_WARNINGS if made.lacks_truth else DONE
