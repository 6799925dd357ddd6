"""Frames of one camera in order, from a folder of pictures, a video or a TIFF stack; read forward, every index kept.

A frame that cannot be read stays in its place as None, so that a series is never shortened and its times
never shift. Grey is what the file holds at full depth; of a colour video it is the Y plane as stored (16 to
235 for most codecs), because the other ways from H.264 to grey differ from it, and from each other, by up to
16 levels.
"""

import os
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from vision.geometry.refusals import Refused
from vision.pictures.files import (
    AS_STORED,
    MOST_PIXELS,
    STACK_SUFFIXES,
    page_sizes,
    pictures_in,
    quiet_opencv,
    read_picture,
)

# FFmpeg would write about a truncated file to stderr; the caller says it in one line of its own.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")

# Pixel formats whose first plane is the grey picture, as OpenCV names them when asked not to convert.
_PLANAR_GREY = frozenset(
    {b"I420", b"Y800", b"GREY", b"NV12", b"NV21", b"Y42B", b"444P", b"Y1\x00\x10"}
)


class Frames(ABC):
    """The frames of one camera, from 0. Made by `Frames.open`.

    path: the folder or the file. count: how many frames there are (a video: how many its header declares).
    size_px: (width, height). times_s: the container's times, shape (count,), or None for pictures.
    rate_Hz: frames a second as the header states it; 0 where it does not.
    """

    path: Path
    count: int
    size_px: tuple[int, int]
    times_s: np.ndarray | None = None
    rate_Hz: float = 0.0

    @staticmethod
    def open(path: Path | str) -> "Frames":
        """The frames in a folder of pictures, in a video file or in a TIFF stack.

        Raises Refused where there is no picture that can be read, or the file cannot be opened.
        """
        path = Path(path)
        if path.is_dir():
            return PictureFolder(path)
        return TiffStack(path) if path.suffix.lower() in STACK_SUFFIXES else Video(path)

    @property
    def decoded_count(self) -> int:
        """How many frames there really are."""
        return self.count

    @abstractmethod
    def _read(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray | None]]:
        """Frames first to last − 1 as stored."""

    def read(
        self, first: int = 0, last: int | None = None
    ) -> Iterator[tuple[int, np.ndarray | None]]:
        """(index, grey) for frames first to last − 1 in order; grey is (height, width), uint8 or uint16.

        A damaged frame gives (index, None). Raises Refused where a frame has another size than `size_px`.
        """
        for index, grey in self._read(first, self.count if last is None else min(last, self.count)):
            if grey is not None:
                self._check_size(index, grey)
            yield index, grey

    def pick(self, wanted: Iterable[int]) -> Iterator[tuple[int, np.ndarray | None]]:
        """The same of these frames alone, in order. Of a video all up to the last are decoded."""
        chosen = set(wanted)
        span = self.read(min(chosen), max(chosen) + 1) if chosen else ()
        yield from ((index, grey) for index, grey in span if index in chosen)

    def _check_size(self, index: int, grey: np.ndarray) -> None:
        size = (grey.shape[1], grey.shape[0])
        if size != self.size_px:
            raise Refused(
                f"frame {index} of {self.path.name} is {_size(size)}, the others are {_size(self.size_px)}: "
                "one camera gives one size; pictures are never rescaled",
                code="picture_size_differs",
            )


class _OneByOne(Frames):
    """Frames each of which is decoded by itself."""

    def pick(self, wanted: Iterable[int]) -> Iterator[tuple[int, np.ndarray | None]]:
        """These frames alone, and no other is decoded."""
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
        self.count, self.size_px = len(self._sizes), self._sizes[0]

    def _read(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray | None]]:
        for index in range(first, last):
            yield index, self._page(index)

    def _page(self, index: int) -> np.ndarray | None:
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

    Frames that the header declares and the stream does not hold (a truncated file) are damaged frames.
    """

    def __init__(self, path: Path):
        self.path = path
        with self._opened() as capture:
            self.size_px = (
                _whole(capture, cv2.CAP_PROP_FRAME_WIDTH),
                _whole(capture, cv2.CAP_PROP_FRAME_HEIGHT),
            )
            self.count = max(0, _whole(capture, cv2.CAP_PROP_FRAME_COUNT))

    @contextmanager
    def _opened(self) -> Iterator[cv2.VideoCapture]:
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
        """Frames a second as the header states it; 0 where it does not."""
        with self._opened() as capture:
            return max(0.0, float(capture.get(cv2.CAP_PROP_FPS)))

    @cached_property
    def times_s(self) -> np.ndarray:
        """The container's times of the frames that decode, s; as many as `decoded_count`."""
        times_ms = []
        with self._opened() as capture:
            while capture.grab():
                times_ms.append(capture.get(cv2.CAP_PROP_POS_MSEC))
        return np.array(times_ms) / 1000.0

    @property
    def decoded_count(self) -> int:
        """How many frames the stream really holds: decodes it whole, once."""
        return len(self.times_s)

    def _read(self, first: int, last: int) -> Iterator[tuple[int, np.ndarray | None]]:
        with self._opened() as capture:
            to_grey = _grey_reader(capture)
            whole = all(capture.grab() for _ in range(first))
            for index in range(first, last):
                whole = whole and capture.grab()
                yield index, to_grey(capture) if whole else None


def _grey_reader(capture: cv2.VideoCapture):
    """How to fetch the grabbed frame as grey: its first plane where that is grey, else from colour."""
    pixel_format = _whole(capture, cv2.CAP_PROP_CODEC_PIXEL_FORMAT).to_bytes(
        4, "little", signed=True
    )
    planar = pixel_format in _PLANAR_GREY
    capture.set(cv2.CAP_PROP_CONVERT_RGB, 0 if planar else 1)
    return _retrieve if planar else _retrieve_colour


def _retrieve(capture: cv2.VideoCapture) -> np.ndarray | None:
    decoded, frame = capture.retrieve()
    return frame if decoded else None


def _retrieve_colour(capture: cv2.VideoCapture) -> np.ndarray | None:
    frame = _retrieve(capture)
    return frame if frame is None or frame.ndim == 2 else cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)


def _whole(capture: cv2.VideoCapture, prop: int) -> int:
    return int(round(capture.get(prop)))


def _size(size_px: tuple[int, int]) -> str:
    return f"{size_px[0]} x {size_px[1]} px"
