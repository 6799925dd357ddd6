"""A record in a JSON file of its own, for people to read, too."""

import json
from pathlib import Path

from bench.base.atomic import write_whole
from bench.base.errors import BadInput
from bench.records.plain import Record, from_plain, to_plain

# What to do about a file that is damaged or of an older version.
AGAIN = "evaluate the session again into this folder"


def write_record_file(path: Path, record: object) -> None:
    """Write a record to a file, whole."""
    text = json.dumps(to_plain(record), sort_keys=True, ensure_ascii=False, indent=1)
    write_whole(path, text + "\n")


def read_record_file(kind: type[Record], path: Path) -> Record:
    """Read a record of a kind from a file that is there. Raises BadInput where it is damaged or of another version."""
    try:
        return from_plain(kind, json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, KeyError, BadInput):
        raise BadInput(f"is damaged or of an older version; {AGAIN}", file=path) from None
