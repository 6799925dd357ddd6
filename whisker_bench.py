"""Where the command line starts: other distributions have packages named bench, vision or estimator too, so that these
are ours is looked at before one of them is imported."""

import importlib.util
import sys
from pathlib import Path

PACKAGES = ("bench", "vision", "estimator")
_BAD_INPUT = 2


def foreign_package() -> str:
    """A sentence on the first package of these names that is not the one beside this file, with the cure; '' where all
    are."""
    home = Path(__file__).resolve().parent
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        found = Path(spec.origin).resolve().parent.parent if spec and spec.origin else None
        if found != home:
            return (
                f"the package {name!r} comes from {found}, not from whisker-bench in {home}; "
                "use an environment of its own: python -m venv .venv"
            )
    return ""


def main() -> int:
    """Run the command line. Returns its exit code, 2 where a package is another's."""
    found = foreign_package()
    if found:
        print(f"whisker-bench: {found}", file=sys.stderr)
        return _BAD_INPUT
    from bench.cli import main as run

    return run()
