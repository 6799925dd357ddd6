"""Where the command line starts: sees that bench, vision and estimator are ours before one of them is imported."""

import runpy
import sys
from pathlib import Path

_BAD_INPUT = 2


def main() -> int:
    """Run the command line. Returns its exit code, 2 where a package is another's."""
    packages = runpy.run_path(
        str(Path(__file__).resolve().parent / "bench" / "base" / "packages.py")
    )
    found = packages["foreign_package"]()
    if found:
        print(f"whisker-bench: {found}", file=sys.stderr)
        return _BAD_INPUT
    from bench.commands.cli import main as run

    return run()
