"""The frames of each camera in a session: a folder of its name, or a video or stack of that name."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from bench.base.errors import BadInput
from bench.base.input_problems import refused_as_bad_input
from vision.geometry import Refused
from vision.pictures import (
    FILM_SUFFIXES,
    PICTURE_SUFFIXES,
    Frames,
    PicturePart,
    natural_order,
    picture_size,
    pictures_in,
    read_picture,
)


def camera_sources(folder: Path, label: str) -> dict[str, Path]:
    """Return the folder of pictures or the video of each camera in `folder`, by the camera's name.

    Folders without pictures are no cameras. Raises BadInput where one camera has a folder and a
    video, or two videos.
    """
    sources: dict[str, Path] = {}
    for entry in visible(folder):
        if not _holds_frames(entry):
            continue
        name = entry.name if entry.is_dir() else entry.stem
        if name in sources:
            found = f"camera {name} has {sources[name].name} and {entry.name}"
            raise BadInput(f"{found}; keep one", file=label)
        sources[name] = entry
    return sources


def single_pictures(folder: Path, label: str, prefix: str = "") -> dict[str, Path]:
    """Return the one picture of each camera in `folder` (boards/rig), by the camera's name.

    prefix: of the files' names, before the camera's. Raises BadInput where a camera has two.
    """
    pictures: dict[str, Path] = {}
    for entry in visible(folder):
        is_picture = entry.suffix.lower() in PICTURE_SUFFIXES and not entry.is_dir()
        if not is_picture or not entry.name.startswith(prefix):
            continue
        camera = entry.stem.removeprefix(prefix)
        if camera in pictures:
            raise BadInput(f"camera {camera} has two pictures here; keep one", file=label)
        pictures[camera] = entry
    return pictures


def rig_picture(path: Path | PicturePart) -> np.ndarray:
    """Read one of `Session.rig_pictures`, as `read_still`."""
    return read_still(path, f"boards/rig/{path.name}")


def read_still(path: Path | PicturePart, label: str) -> np.ndarray:
    """Read one picture, grey (h, w). Raises BadInput where it cannot be read or has another size."""
    with refused_as_bad_input(label):
        grey = read_picture(path)
    if grey is None:
        raise BadInput("cannot be read as a picture", file=label)
    return grey


def size_px(source: Path) -> tuple[int, int]:
    """Return (width, height) of a folder of pictures, a video, or a picture, of which the header alone is read.

    Raises Refused where it cannot be read.
    """
    if source.is_dir() or source.suffix.lower() not in PICTURE_SUFFIXES:
        return Frames.open(source).size_px
    size = picture_size(source)
    if size is None:
        raise Refused("cannot be read as a picture")
    return size


def frame_count(source: Path | PicturePart) -> int:
    """Return how many frames a source declares; 0 for a video that cannot be opened."""
    if source.is_dir():
        return len(pictures_in(source))
    try:
        return Frames.open(source).count
    except Refused:
        return 0


def decoded_count(source: Path | PicturePart) -> int:
    """Count the frames that a source really holds; of a video, by decoding it."""
    return len(pictures_in(source)) if source.is_dir() else Frames.open(source).decoded_count


def declared_rate_Hz(source: Path | PicturePart) -> float:
    """Return the frame rate that a video's header states; 0 where it does not, or cannot be opened."""
    try:
        return Frames.open(source).rate_Hz
    except Refused:
        return 0.0


def visible(folder: Path) -> list[Path]:
    """List a folder in natural order, without hidden files; nothing where there is no folder."""
    return sorted(folder.glob("[!.]*"), key=natural_order)


def _holds_frames(entry: Path) -> bool:
    """Return whether an entry is a folder of pictures or a video."""
    if entry.is_dir():
        return bool(pictures_in(entry))
    return entry.suffix.lower() in FILM_SUFFIXES


def read_frames(source: Path | PicturePart, indices: Iterable[int]) -> dict[int, np.ndarray | None]:
    """Read the pictures of one camera with these indices.

    None stands for a picture that is damaged, or of a video that does not open.

    Raises Refused where a picture has another size than the first.
    """
    wanted = set(indices)
    try:
        frames = Frames.open(source)
    except Refused:
        return dict.fromkeys(wanted)
    return dict.fromkeys(wanted) | dict(frames.pick(wanted))
