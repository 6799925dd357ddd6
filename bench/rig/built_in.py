"""The protocols that come with the rig. The command line names them at each start, so this imports nothing large."""

from pathlib import Path

FOLDER = Path(__file__).with_name("protocols")


def protocol_names() -> str:
    """Return the names of the protocols, in alphabetical order, as messages list them."""
    return ", ".join(sorted(path.stem for path in FOLDER.glob("*.toml")))
