"""Pictures in files: grey at full depth as the camera stored it, sizes by headers, names in order.

A picture that is damaged, cut short, or of a size that no camera has is None.
"""

import os
import re
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, UnidentifiedImageError

from vision.geometry.crop import Crop
from vision.geometry.refusals import Refused

PICTURE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm"})
VIDEO_SUFFIXES = frozenset({".mp4", ".avi", ".mkv"})
STACK_SUFFIXES = frozenset({".tif", ".tiff"})
FILM_SUFFIXES = VIDEO_SUFFIXES | STACK_SUFFIXES  # of one file that holds all frames

# Pillow warns of damaged headers, which is said in one line as well.
warnings.filterwarnings("ignore", category=UserWarning, module=r"PIL\.")

# Stored orientation and depth: a camera's pixels, not a viewer's idea of which side is up.
AS_STORED = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION

# What Pillow raises on headers that are damaged or absurd.
_NO_HEADER = (
    UnidentifiedImageError,
    Image.DecompressionBombError,
    OSError,
    ValueError,
    SyntaxError,
    struct.error,
)

# [pixels] No larger page of a TIFF stack is decoded: what Pillow takes for sound in a single
# picture. Stated.
MOST_PIXELS = 2 * Image.MAX_IMAGE_PIXELS
# [bytes] No larger file is read as a picture: a colour one of 16 bit with as many pixels as
# Pillow takes for sound. Stated.
_MOST_BYTES = 1 << 30

_JPEG_START = b"\xff\xd8"
_JPEG_END = b"\xff\xd9"
# [bytes] Cameras pad the file after the end marker. Stated.
_JPEG_TAIL_BYTES = 1024


@dataclass(frozen=True)
class PicturePart(os.PathLike):
    """A part of each picture in a file or folder, in place of its path."""

    path: Path
    crop: Crop

    def __fspath__(self) -> str:
        """Return the path of the whole pictures."""
        return str(self.path)

    @property
    def name(self) -> str:
        """Return the name of the file or folder."""
        return self.path.name

    def is_dir(self) -> bool:
        """Return whether it is a folder of pictures."""
        return self.path.is_dir()


def pictures_in(folder: Path | PicturePart) -> list[Path]:
    """Return the folder's pictures in natural order, without hidden files."""
    files = []
    for path in Path(folder).iterdir():
        if path.suffix.lower() in PICTURE_SUFFIXES and not path.name.startswith("."):
            files.append(path)
    return sorted(files, key=natural_order)


def natural_order(path: Path) -> list[tuple[int, int | str]]:
    """Return a sort key under which `img_2` comes before `img_10`."""
    key = []
    for part in re.findall(r"[0-9]+|[^0-9]+", path.name):
        key.append((0, int(part)) if part.isdigit() else (1, part))
    return key


def read_picture(path: Path | PicturePart) -> np.ndarray | None:
    """Read a picture as grey (height, width), uint8 or uint16.

    None where it is damaged or cut short, no regular file, or of a size that no camera has. Raises
    Refused where a picture of which a part is wanted has another size than the camera's.
    """
    if isinstance(path, PicturePart):
        whole = read_picture(path.path)
        if whole is None:
            return None
        require_size(whole, path.crop.whole_px, path.name)
        return path.crop.cut(whole)
    if not path.is_file() or not 0 < path.stat().st_size <= _MOST_BYTES:
        return None
    data = np.fromfile(path, dtype=np.uint8)
    if _is_cut_jpeg(data) or _is_too_large(data):
        return None
    try:
        with quiet_opencv():
            grey = cv2.imdecode(data, AS_STORED)
    except cv2.error:  # a header that OpenCV takes for absurd
        return None
    return grey if grey is not None and grey.dtype in (np.uint8, np.uint16) else None


def require_size(grey: np.ndarray, size_px: tuple[int, int], label: str) -> None:
    """Raise Refused, naming the picture by its label, where it has another size than (width, height)."""
    height, width = grey.shape[:2]
    if (width, height) != size_px:
        raise Refused(
            f"{label} is {width} x {height} px, the others are {size_px[0]} x {size_px[1]} px: one "
            "camera gives one size; pictures are never rescaled",
            code="picture_size_differs",
        )


def page_count(path: Path) -> int:
    """Return how many pictures a file holds; 0 where it is damaged or no TIFF."""
    return len(page_sizes(path))


def page_sizes(path: Path) -> list[tuple[int, int]]:
    """Return (width, height) of each page by its header; none where it is no regular TIFF file."""
    sizes = []
    try:
        if path.is_file():
            with Image.open(path, formats=["TIFF"]) as picture:
                for index in range(picture.n_frames):
                    picture.seek(index)
                    sizes.append(picture.size)
    except (*_NO_HEADER, EOFError, TypeError, KeyError):  # of a page without a size
        return []
    return sizes


def picture_size(path: Path) -> tuple[int, int] | None:
    """Return (width, height) from the header alone; None where it cannot be read, or is no
    camera's.
    """
    try:
        if not path.is_file():  # a pipe would be waited for
            return None
        with Image.open(path) as picture:
            return picture.size
    except _NO_HEADER:
        return None


def _is_too_large(data: np.ndarray) -> bool:
    """Return whether the header states more pixels than Pillow takes for sound.

    To decode them would fill the memory.
    """
    try:
        Image.open(BytesIO(data)).close()
    except Image.DecompressionBombError:
        return True
    except _NO_HEADER:
        return False  # OpenCV may know it
    return False


def _is_cut_jpeg(data: np.ndarray) -> bool:
    """Return whether data is a JPEG without its end marker.

    OpenCV decodes it and fills the lost part with grey.
    """
    tail = data[-_JPEG_TAIL_BYTES:].tobytes()
    return data[:2].tobytes() == _JPEG_START and _JPEG_END not in tail


@contextmanager
def quiet_opencv() -> Iterator[None]:
    """Run a block without OpenCV's warnings: one a frame says that it hands over the Y plane, as it
    should.
    """
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(level)
