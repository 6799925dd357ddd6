"""Writing a camera's pictures: numbered files, or one lossless film."""

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np

JPEG_QUALITY = 95  # of 100
_FILM_RATE_HZ = 20.0  # a film must state one; frame times stand in frames.csv


def write_picture(path: Path, picture: np.ndarray) -> None:
    """Write one picture in the format that its name says. Raises OSError where OpenCV cannot."""
    settings = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY] if path.suffix == ".jpg" else []
    is_encoded, data = cv2.imencode(path.suffix, picture, settings)
    if not is_encoded:
        raise OSError(f"{path}: OpenCV cannot write this picture")
    path.write_bytes(data.tobytes())


def write_frames(folder: Path, camera: str, kind: str, pictures: Iterable[np.ndarray]) -> None:
    """Write a trial's frames to `folder/camera/000000.jpg` …, or `folder/camera.mkv` (FFV1, 8 bit).

    kind: a picture's suffix without its dot, or "mkv". Raises OSError where OpenCV cannot write it.
    """
    if kind == "mkv":
        _write_film(folder / f"{camera}.mkv", pictures)
        return
    (folder / camera).mkdir()
    for i, picture in enumerate(pictures):
        write_picture(folder / camera / f"{i:06d}.{kind}", picture)


def _write_film(path, pictures):
    """Write pictures as one film. Raises OSError where OpenCV has no FFV1."""
    film = None
    for picture in pictures:
        if film is None:
            rows, columns = picture.shape
            code = cv2.VideoWriter_fourcc(*"FFV1")
            film = cv2.VideoWriter(
                str(path), cv2.CAP_FFMPEG, code, _FILM_RATE_HZ, (columns, rows), isColor=False
            )
            if not film.isOpened():
                raise OSError(f"{path}: OpenCV cannot write FFV1 here")
        film.write(picture)
    film.release()
