"""Which files of a trial's folder hold lines that another program has traced in its pictures."""

from pathlib import Path

from bench.base.errors import BadInput
from bench.session.footage import visible

IN_SPACE = "trace_3d.csv"
# By tracker: a table of ours or DeepLabCut's; DeepLabCut's or SLEAP's; SLEAP's; whisk's; WhiskerMan's.
SUFFIXES = (".csv", ".h5", ".hdf5", ".slp", ".whiskers", ".tr4", ".tr4_2d")
_PREFIX = "trace_"
_BESIDE = (".measurements", ".toml")  # they go with another one


def trace_files(folder: Path, label: str) -> dict[str, Path]:
    """Return the files of traces in a folder by camera; Anipose's under IN_SPACE.

    Raises BadInput where a camera has two, or one is of no kind that is read.
    """
    found: dict[str, Path] = {}
    for path in visible(folder):
        suffix = path.suffix.lower()
        if not path.name.startswith(_PREFIX) or suffix in _BESIDE:
            continue
        if path.is_dir():
            if suffix in SUFFIXES:
                raise BadInput("is a folder; a file is expected there", file=f"{label}/{path.name}")
            continue  # pictures of a camera of such a name
        name = IN_SPACE if path.name == IN_SPACE else path.stem.removeprefix(_PREFIX)
        if suffix not in SUFFIXES:
            known = ", ".join(SUFFIXES)
            raise BadInput(f"is of no kind that is read ({known})", file=f"{label}/{path.name}")
        if name in found:
            both = f"{found[name].name} and {path.name}"
            raise BadInput(f"camera {name} has {both}; keep one", file=label)
        found[name] = path
    return found
