"""Writing a camera's pictures: numbered files, or one lossless film."""

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np

JPEG_QUALITY = 95  # of 100


def write_picture(path: Path, picture: np.ndarray) -> None:
    """One file; the kind follows from its name. Raises OSError where it cannot be written."""
    settings = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY] if path.suffix == ".jpg" else []
    done, data = cv2.imencode(path.suffix, picture, settings)
    if not done:
        raise OSError(f"{path}: OpenCV cannot write this picture")
    path.write_bytes(data.tobytes())


def write_frames(folder: Path, camera: str, kind: str, pictures: Iterable[np.ndarray]) -> None:
    """Frames of a trial: `folder/camera/000000.jpg` …, or `folder/camera.mkv` (FFV1, 8 bit)."""
    if kind == "mkv":
        return _write_film(folder / f"{camera}.mkv", pictures)
    (folder / camera).mkdir()
    for i, picture in enumerate(pictures):
        write_picture(folder / camera / f"{i:06d}.{kind}", picture)
    return None


def _write_film(path, pictures):
    film = None
    for picture in pictures:
        if film is None:
            size = (picture.shape[1], picture.shape[0])
            code = cv2.VideoWriter_fourcc(*"FFV1")
            film = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, 20.0, size, isColor=False)
            if not film.isOpened():
                raise OSError(f"{path}: OpenCV cannot write FFV1 here")
        film.write(picture)
    film.release()
