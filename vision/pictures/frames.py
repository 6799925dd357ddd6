"""Frames of one camera in order, from a folder of pictures, a video or a TIFF stack.

A frame that cannot be read stays in its place as None, so that a series is never shortened and its
times never shift. Grey is what the file holds at full depth; of a colour video it is the Y plane as
stored (16 to 235 for most codecs), because the other ways from H.264 to grey differ from it, and
from each other, by up to 16 levels.
"""

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from vision.geometry.crop import Crop
from vision.geometry.refusals import Refused
from vision.pictures.files import (
    AS_STORED,
    MOST_PIXELS,
    STACK_SUFFIXES,
    PicturePart,
    page_sizes,
    pictures_in,
    quiet_opencv,
    read_picture,
    require_size,
)

# FFmpeg would write about a truncated file to stderr; the caller says it in one line of its own.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

# Pixel formats whose first plane is the grey picture, as OpenCV names them if it
# does not convert.
_PLANAR_GREY = frozenset(
    {b"I420", b"Y800", b"GREY", b"NV12", b"NV21", b"Y42B", b"444P", b"Y1\x00\x10"}
)


class Frames(ABC):
    """The frames of one camera, from 0. Made by `Frames.open`.

    path: the folder or the file. count: how many frames there are (a video: how many its header
    declares). size_px: (width, height). times_s (count,): the container's times, or None for
    pictures. rate_Hz: frames a second as the header states it; 0 where it does not.
    """

    path: Path
    count: int
    size_px: tuple[int, int]
    times_s: np.ndarray | None = None
    rate_Hz: float = 0.0

    @staticmethod
    def open(path: Path | PicturePart | str) -> "Frames":
        """Open the frames in a folder of pictures, in a video file or in a TIFF stack.

        Raises Refused where there is no picture that can be read, or the file cannot be opened.
        """
        if isinstance(path, PicturePart):
            return CroppedFrames(Frames.open(path.path), path.crop)
        path = Path(path)
        if path.is_dir():
            return PictureFolder(path)
        return TiffStack(path) if path.suffix.lower() in STACK_SUFFIXES else Video(path)

    @property
    def decoded_count(self) -> int:
        """Return how many frames there really are."""
        return self.count

    @abstractmethod
    def _read(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray | None]]:
        """Yield (index, grey) of frames first to last − 1 as stored."""

    def read(
        self, first: int = 0, last: int | None = None
    ) -> Iterator[tuple[int, np.ndarray | None]]:
        """Yield (index, grey) of frames first to last − 1 in order; grey (height, width), uint8 or
        uint16.

        A damaged frame gives (index, None). Raises Refused where a frame has another size than
        `size_px`.
        """
        last = self.count if last is None else min(last, self.count)
        for index, grey in self._read(first, last):
            if grey is not None:
                self._check_size(index, grey)
            yield index, grey

    def pick(self, wanted: Iterable[int]) -> Iterator[tuple[int, np.ndarray | None]]:
        """Yield (index, grey) of these frames alone, in order.

        Of a video all frames up to the last of them are decoded.
        """
        indices = set(wanted)
        if not indices:
            return
        for index, grey in self.read(min(indices), max(indices) + 1):
            if index in indices:
                yield index, grey

    def _check_size(self, index: int, grey: np.ndarray) -> None:
        """Raise Refused where a frame has another size than `size_px`."""
        require_size(grey, self.size_px, f"frame {index} of {self.path.name}")


class CroppedFrames(Frames):
    """A part of each frame of a camera."""

    def __init__(self, whole: Frames, crop: Crop):
        self.path = whole.path
        self.count = whole.count
        self.size_px = crop.size_px
        self._whole = whole
        self._crop = crop

    @property
    def times_s(self) -> np.ndarray | None:
        """Return the container's times, s; None for pictures."""
        return self._whole.times_s

    @property
    def rate_Hz(self) -> float:
        """Return the frames a second as the header states it; 0 where it does not."""
        return self._whole.rate_Hz

    @property
    def decoded_count(self) -> int:
        """Return how many frames there really are."""
        return self._whole.decoded_count

    def _read(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray | None]]:
        yield from self._cut(self._whole.read(first, last))

    def pick(self, wanted: Iterable[int]) -> Iterator[tuple[int, np.ndarray | None]]:
        """Yield (index, grey) of these frames alone, in order."""
        yield from self._cut(self._whole.pick(wanted))

    def _cut(
        self, frames: Iterable[tuple[int, np.ndarray | None]]
    ) -> Iterator[tuple[int, np.ndarray | None]]:
        """Yield the part of each frame."""
        for index, grey in frames:
            if grey is not None:
                require_size(grey, self._crop.whole_px, f"frame {index} of {self.path.name}")
                grey = self._crop.cut(grey)
            yield index, grey


class _OneByOne(Frames):
    """Frames each of which is decoded by itself."""

    def pick(self, wanted: Iterable[int]) -> Iterator[tuple[int, np.ndarray | None]]:
        """Yield (index, grey) of these frames alone, in order; no other is decoded."""
        for index in sorted(set(wanted)):
            yield from self.read(index, index + 1)


class PictureFolder(_OneByOne):
    """Pictures in the natural order of their names (2 before 10)."""

    def __init__(self, path: Path):
        self.path = path
        self.files = pictures_in(path)
        self.count = len(self.files)
        self.size_px = self._first_size()

    def _first_size(self) -> tuple[int, int]:
        """Return (width, height) of the first picture that can be read."""
        for file in self.files:
            grey = read_picture(file)
            if grey is not None:
                return grey.shape[1], grey.shape[0]
        raise Refused(f"no picture in {self.path.name} can be read ({self.count} found)")

    def _read(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray | None]]:
        for index in range(first, last):
            yield index, read_picture(self.files[index])


class TiffStack(_OneByOne):
    """The pages of one TIFF file, in their order."""

    def __init__(self, path: Path):
        self.path = path
        self._sizes = page_sizes(path)
        if not self._sizes:
            raise Refused(f"{path.name} cannot be opened as a TIFF stack: truncated, or no TIFF")
        self.count = len(self._sizes)
        self.size_px = self._sizes[0]

    def _read(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray | None]]:
        for index in range(first, last):
            yield index, self._page(index)

    def _page(self, index: int) -> np.ndarray | None:
        """Read one page as grey; None where it is damaged or of a size that no camera has."""
        width, height = self._sizes[index]
        if width * height > MOST_PIXELS:
            return None
        try:
            with quiet_opencv():
                _, pages = cv2.imreadmulti(str(self.path), index, 1, flags=AS_STORED)
        except cv2.error:
            return None
        return pages[0] if pages and pages[0].dtype in (np.uint8, np.uint16) else None


class Video(Frames):
    """A video, decoded forward: seeking by frame number is wrong on clips with dropped frames.

    Frames that the header declares and the stream does not hold (a truncated file) are damaged
    frames.
    """

    def __init__(self, path: Path):
        self.path = path
        with self._open_capture() as capture:
            width = _read_property(capture, cv2.CAP_PROP_FRAME_WIDTH)
            height = _read_property(capture, cv2.CAP_PROP_FRAME_HEIGHT)
            self.size_px = (width, height)
            self.count = max(0, _read_property(capture, cv2.CAP_PROP_FRAME_COUNT))

    @contextmanager
    def _open_capture(self) -> Iterator[cv2.VideoCapture]:
        """Open the stream at its first frame; release it at the end of the block."""
        if not self.path.is_file():
            raise Refused(f"{self.path.name} is no regular file")
        with quiet_opencv():
            capture = cv2.VideoCapture(str(self.path), cv2.CAP_FFMPEG)
            try:
                if not capture.isOpened():
                    raise Refused(
                        f"{self.path.name} cannot be opened as a video: truncated, or not a video"
                    )
                yield capture
            finally:
                capture.release()

    @cached_property
    def rate_Hz(self) -> float:
        """Return the frames a second as the header states it; 0 where it does not."""
        with self._open_capture() as capture:
            return max(0.0, float(capture.get(cv2.CAP_PROP_FPS)))

    @cached_property
    def times_s(self) -> np.ndarray:
        """Return the container's times of the frames that decode, s (decoded_count,)."""
        times_ms = []
        with self._open_capture() as capture:
            while capture.grab():
                times_ms.append(capture.get(cv2.CAP_PROP_POS_MSEC))
        return np.array(times_ms) / 1000.0

    @property
    def decoded_count(self) -> int:
        """Return how many frames the stream really holds: decodes it whole, once."""
        return len(self.times_s)

    def _read(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray | None]]:
        with self._open_capture() as capture:
            read_grey = _grey_reader(capture)
            is_whole = all(capture.grab() for _ in range(first))
            for index in range(first, last):
                is_whole = is_whole and capture.grab()
                yield index, read_grey(capture) if is_whole else None


def _grey_reader(
    capture: cv2.VideoCapture,
) -> Callable[[cv2.VideoCapture], np.ndarray | None]:
    """Return the function that reads the grabbed frame as grey.

    It takes the stream's first plane where that is grey, else it converts from colour.
    """
    code = _read_property(capture, cv2.CAP_PROP_CODEC_PIXEL_FORMAT)
    is_planar = code.to_bytes(4, "little", signed=True) in _PLANAR_GREY
    capture.set(cv2.CAP_PROP_CONVERT_RGB, 0 if is_planar else 1)
    return _retrieve if is_planar else _retrieve_colour


def _retrieve(capture: cv2.VideoCapture) -> np.ndarray | None:
    """Return the grabbed frame as the stream has it; None where it does not decode."""
    decoded, frame = capture.retrieve()
    return frame if decoded else None


def _retrieve_colour(capture: cv2.VideoCapture) -> np.ndarray | None:
    """Convert the grabbed frame from colour to grey; None where it does not decode."""
    frame = _retrieve(capture)
    if frame is None or frame.ndim == 2:
        return frame
    return cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)


def _read_property(capture: cv2.VideoCapture, name: int) -> int:
    """Return a property of the stream as a whole number."""
    return round(capture.get(name))
