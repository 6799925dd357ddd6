"""Frames as files: films without loss, JPEG at its stated quality, 12 bits in 16."""

import cv2
import numpy as np
import pytest

from bench.rig.simulation import simulate
from tests.scenes.rig_sessions import TINY, protocol_file


def taken(folder, kind, bits):
    """Frames of the first camera of a trial, (n, rows, columns), and the session's folder."""
    text = TINY.split("[[trials]]")[0].replace(
        "[pictures]", f'[pictures]\nformat = "{kind}"\nbits = {bits}'
    )
    session = simulate(
        folder / "session",
        protocol=protocol_file(folder, text + "[[trials]]\nbeta_deg = 20\n"),
        seed=1,
    )
    (trial,) = (session / "trials").iterdir()
    if (trial / "left.mkv").exists():
        film = cv2.VideoCapture(str(trial / "left.mkv"))
        return np.array([film.read()[1][..., 0] for _ in range(13)]), session
    files = sorted((trial / "left").iterdir())
    return np.array([cv2.imread(str(f), cv2.IMREAD_UNCHANGED) for f in files]), session


@pytest.fixture(scope="module")
def lossless(tmp_path_factory):
    return taken(tmp_path_factory.mktemp("png"), "png", 8)[0]


def test_films_are_lossless(lossless, tmp_path):
    frames, session = taken(tmp_path, "mkv", 8)
    assert (frames == lossless).all()
    assert (session / "boards" / "left" / "00.png").exists()


def test_jpeg_is_of_quality_95(lossless, tmp_path):
    """Every frame is what OpenCV's encoder makes of the lossless one at 95."""
    frames, session = taken(tmp_path, "jpg", 8)
    assert {f.suffix for f in session.glob("trials/*/left/*")} == {".jpg"}
    for frame, exact in zip(frames, lossless):
        code = cv2.imencode(".jpg", exact, [cv2.IMWRITE_JPEG_QUALITY, 95])[1]
        assert (frame == cv2.imdecode(code, cv2.IMREAD_UNCHANGED)).all()


@pytest.mark.parametrize("kind", ["png", "jpg", "mkv"])
def test_12_bits_are_written_as_png(kind, lossless, tmp_path):
    """JPEG and film hold 8. The same picture in finer steps: half a step of 8 bits apart at most."""
    frames, session = taken(tmp_path, kind, 12)
    assert frames.dtype == np.uint16 and 255 < frames.max() < 4096
    assert {f.suffix for f in session.glob("trials/*/left/*")} == {".png"}
    assert np.abs(frames * (255 / 4095) - lossless).max() <= 0.5 * (1 + 255 / 4095) + 1e-9
