"""Check that bench, vision and estimator are ours: other distributions have packages of these names too.

It imports none of them, for `whisker_bench.py` runs this file before any of them is imported.
"""

import importlib.util
from pathlib import Path

PACKAGES = ("bench", "vision", "estimator")


def foreign_package() -> str:
    """Return a sentence on the first package of these names that is not this file's, with the cure.

    '' where all are.
    """
    home = Path(__file__).resolve().parents[2]
    for name in PACKAGES:
        spec = importlib.util.find_spec(name)
        found = Path(spec.origin).resolve().parent.parent if spec and spec.origin else None
        if found != home:
            return (
                f"the package {name!r} comes from {found}, not from whisker-bench in {home}; "
                "use an environment of its own: python -m venv .venv"
            )
    return ""
