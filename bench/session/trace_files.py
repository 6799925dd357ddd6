"""Which files of a trial's folder hold what another program has traced in its pictures: lines of the
wire, and points of the object.
"""

from pathlib import Path

from bench.base.errors import BadInput
from bench.session.footage import visible

# Of a file's suffix the kind, which `bench.session.trace_readers` has a reader of: a table of ours or DeepLabCut's;
# DeepLabCut's or SLEAP's; whisk's; WhiskerMan's.
KINDS = {
    ".csv": "csv",
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".slp": "hdf5",
    ".whiskers": "whisk",
    ".tr4": "whiskerman",
    ".tr4_2d": "whiskerman",
}
WIRE = "trace_"
OBJECT = "object_"
IN_SPACE = "3d"  # in place of a camera's name, of points in space
_BESIDE = (".measurements", ".toml")  # they go with another one


def trace_files(folder: Path, label: str, prefix: str = WIRE) -> dict[str, Path]:
    """Return the files of traces in a folder by camera; Anipose's under IN_SPACE.

    prefix: of their names, WIRE or OBJECT. Raises BadInput where a camera has two, or one is of no kind that is read.
    """
    found: dict[str, Path] = {}
    for path in visible(folder):
        suffix = path.suffix.lower()
        if not path.name.startswith(prefix) or suffix in _BESIDE:
            continue
        if path.is_dir():
            if suffix in KINDS:
                raise BadInput("is a folder; a file is expected there", file=f"{label}/{path.name}")
            continue  # pictures of a camera of such a name
        name = path.stem.removeprefix(prefix)
        if suffix not in KINDS:
            known = ", ".join(KINDS)
            raise BadInput(f"is of no kind that is read ({known})", file=f"{label}/{path.name}")
        if name in found:
            both = f"{found[name].name} and {path.name}"
            raise BadInput(f"camera {name} has {both}; keep one", file=label)
        found[name] = path
    return found
