"""The verb `info`: versions of all that results depend on."""

import argparse

from bench.base.exit_codes import DONE
from bench.commands.options import Verbs, add_verb


def add(verbs: Verbs) -> None:
    """Add the verb."""
    add_verb(
        verbs,
        "info",
        run,
        "versions of what results depend on, and whether they fit",
        "whisker-bench info",
        needs_sound_environment=False,
    )


def run(_: argparse.Namespace) -> int:
    """Print the versions, and only then check them. Raise BadInput where one does not fit."""
    from bench.base.environment import check_environment, versions

    for name, version in versions().items():
        print(f"{name} {version}")
    check_environment()
    return DONE
