"""Where each camera's frames are in a session: a folder named after the camera, or a video or stack of that name."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from vision.geometry.refusals import Refused
from vision.pictures.files import (
    FILM_SUFFIXES,
    PICTURE_SUFFIXES,
    natural_order,
    pictures_in,
    read_picture,
)
from vision.pictures.frames import Frames


def camera_sources(folder: Path, shown: str) -> dict[str, Path]:
    """Camera name to its folder of pictures or its video, of what is in `folder`; empty where nothing is.

    Folders without pictures are no cameras. Raises BadInput where one camera has a folder and a video, or two
    videos.
    """
    sources: dict[str, Path] = {}
    for entry in visible(folder):
        if not _holds_frames(entry):
            continue
        name = entry.name if entry.is_dir() else entry.stem
        if name in sources:
            raise BadInput(
                f"camera {name} has {sources[name].name} and {entry.name}; keep one", file=shown
            )
        sources[name] = entry
    return sources


def single_pictures(folder: Path, shown: str) -> dict[str, Path]:
    """Camera name to its one picture in `folder` (boards/rig). Raises BadInput where a camera has two."""
    pictures: dict[str, Path] = {}
    for entry in visible(folder):
        if entry.suffix.lower() not in PICTURE_SUFFIXES:
            continue
        if entry.stem in pictures:
            raise BadInput(f"camera {entry.stem} has two pictures here; keep one", file=shown)
        pictures[entry.stem] = entry
    return pictures


def rig_picture(path: Path) -> np.ndarray:
    """One of `Session.rig_pictures`, grey (h, w). Raises BadInput where it cannot be read."""
    grey = read_picture(path)
    if grey is None:
        raise BadInput("cannot be read as a picture", file=f"boards/rig/{path.name}")
    return grey


def frame_count(source: Path) -> int:
    """How many frames a source declares; 0 for a video that cannot be opened."""
    if source.is_dir():
        return len(pictures_in(source))
    try:
        return Frames.open(source).count
    except Refused:
        return 0


def decoded_count(source: Path) -> int:
    """How many frames a source really holds; of a video, by decoding it."""
    return len(pictures_in(source)) if source.is_dir() else Frames.open(source).decoded_count


def declared_rate_Hz(source: Path) -> float:
    """Frames a second as a video's header states it; 0 where it does not, or cannot be opened."""
    try:
        return Frames.open(source).rate_Hz
    except Refused:
        return 0.0


def visible(folder: Path) -> list[Path]:
    """What lies in a folder, in natural order, without hidden files; nothing where there is no folder."""
    if not folder.is_dir():
        return []
    return sorted((e for e in folder.iterdir() if not e.name.startswith(".")), key=natural_order)


def _holds_frames(entry: Path) -> bool:
    if entry.is_dir():
        return bool(pictures_in(entry))
    return entry.suffix.lower() in FILM_SUFFIXES


def read_frames(source: Path, indices: Iterable[int]) -> dict[int, np.ndarray | None]:
    """The pictures of one camera with these indices; None where it is damaged or the video does not open.

    Raises Refused where a picture has another size than the first.
    """
    wanted = set(indices)
    try:
        frames = Frames.open(source)
    except Refused:
        return dict.fromkeys(wanted)
    return dict.fromkeys(wanted) | dict(frames.pick(wanted))
