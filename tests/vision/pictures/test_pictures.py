"""Frames against pictures written here: order, depth, damage, and nothing ever shortened or shifted."""

import cv2
import numpy as np
import pytest

from vision.geometry.crop import Crop
from vision.geometry.refusals import Refused
from vision.pictures.files import PicturePart, natural_order, read_picture
from vision.pictures.frames import Frames

WIDTH, HEIGHT = 322, 242  # not square, not a multiple of 16


def ramp(k: int, dtype=np.uint8) -> np.ndarray:
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    return ((0.5 * x + 0.2 * y + 5 * k) % 256 * (1 if dtype == np.uint8 else 200)).astype(dtype)


def write_folder(folder, suffix: str, count=4, dtype=np.uint8):
    folder.mkdir(exist_ok=True)
    for k in range(count):
        assert cv2.imwrite(str(folder / f"img_{k}{suffix}"), ramp(k, dtype))
    return folder


def write_video(path, fourcc: str, count=12, depth=cv2.CV_8U):
    settings = [cv2.VIDEOWRITER_PROP_DEPTH, depth, cv2.VIDEOWRITER_PROP_IS_COLOR, 0]
    code = cv2.VideoWriter_fourcc(*fourcc)
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, 30.0, (WIDTH, HEIGHT), settings)
    assert writer.isOpened()
    for k in range(count):
        writer.write(ramp(k, np.uint8 if depth == cv2.CV_8U else np.uint16))
    writer.release()
    return path


def cut(path, share: float):
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    return path


@pytest.mark.parametrize("suffix", [".png", ".tiff", ".bmp", ".pgm"])
def test_a_folder_is_read_exactly(tmp_path, suffix):
    frames = Frames.open(write_folder(tmp_path / "high", suffix))
    assert (frames.count, frames.size_px, frames.times_s) == (4, (WIDTH, HEIGHT), None)
    for index, grey in frames.read():
        np.testing.assert_array_equal(grey, ramp(index))


@pytest.mark.parametrize("suffix", [".png", ".tiff", ".pgm"])
def test_sixteen_bits_stay_sixteen(tmp_path, suffix):
    frames = Frames.open(write_folder(tmp_path / "high", suffix, dtype=np.uint16))
    grey = dict(frames.read())[1]
    assert grey.dtype == np.uint16
    np.testing.assert_array_equal(grey, ramp(1, np.uint16))


@pytest.mark.parametrize("suffix", [".png", ".tiff", ".bmp", ".jpg"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_colour_is_taken_as_its_luma(tmp_path, suffix, dtype):
    """ITU-R 601: 0.299 R + 0.587 G + 0.114 B, at full depth; BMP and JPEG have 8 bits, and JPEG rounds."""
    if dtype == np.uint16 and suffix in (".bmp", ".jpg"):
        pytest.skip("these hold 8 bits")
    b, g, r = (ramp(k, dtype) // 2 for k in (3, 1, 2))
    blocks = np.kron(np.stack([b, g, r], axis=2)[::8, ::8], np.ones((8, 8, 1), dtype)).astype(dtype)
    assert cv2.imwrite(str(tmp_path / f"a{suffix}"), blocks, [cv2.IMWRITE_JPEG_QUALITY, 100])
    luma = blocks.astype(float) @ [0.114, 0.587, 0.299]
    found = read_picture(tmp_path / f"a{suffix}")
    assert found.dtype == dtype
    assert np.abs(found - luma).max() <= (3.0 if suffix == ".jpg" else 1.0)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_pages_of_a_tiff_stack_are_frames(tmp_path, dtype):
    pages = [ramp(k, dtype) for k in range(5)]
    assert cv2.imwritemulti(str(tmp_path / "high.tif"), pages)
    frames = Frames.open(tmp_path / "high.tif")
    assert (frames.count, frames.decoded_count, frames.size_px) == (5, 5, (WIDTH, HEIGHT))
    assert (frames.times_s, frames.rate_Hz) == (None, 0.0)
    assert [index for index, _ in frames.read(2, 9)] == [2, 3, 4]
    for index, grey in frames.read():
        np.testing.assert_array_equal(grey, pages[index])
    with pytest.raises(Refused, match="cannot be opened as a TIFF stack"):
        Frames.open(cut(tmp_path / "high.tif", 0.3))


def test_natural_order(tmp_path):
    names = ["f10.png", "f9.png", "f1.png", "g2.png", "f010b.png"]
    in_order = sorted((tmp_path / name for name in names), key=natural_order)
    assert [path.name for path in in_order] == [
        "f1.png",
        "f9.png",
        "f10.png",
        "f010b.png",
        "g2.png",
    ]


def test_what_is_no_picture_is_no_frame(tmp_path):
    folder = write_folder(tmp_path / "high", ".png")
    for name in ("._img_0.png", "Thumbs.db", "notes.txt"):
        (folder / name).write_bytes(b"x")
    assert Frames.open(folder).count == 4


def test_first_and_last(tmp_path):
    frames = Frames.open(write_folder(tmp_path / "high", ".png"))
    assert [index for index, _ in frames.read(1, 3)] == [1, 2]
    assert [index for index, _ in frames.read(2, 99)] == [2, 3]
    assert list(frames.read(4)) == []


def test_pictures_that_are_not_picked_are_not_decoded(tmp_path):
    """One of them is of another size, which is refused where it is read."""
    folder = write_folder(tmp_path / "high", ".png")
    assert cv2.imwrite(str(folder / "img_1.png"), ramp(1)[:20])
    frames = Frames.open(folder)
    assert [index for index, _ in frames.pick([2, 0])] == [0, 2]
    with pytest.raises(Refused, match="the others are"):
        list(frames.pick([1]))


def test_orientation_tags_do_not_turn_a_picture(tmp_path):
    from PIL import Image

    exif = Image.Exif()
    exif[0x0112] = 6  # "turn by 90 degrees"
    Image.fromarray(ramp(0)).save(tmp_path / "a.jpg", exif=exif, quality=100)
    assert read_picture(tmp_path / "a.jpg").shape == (HEIGHT, WIDTH)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tiff", ".bmp", ".pgm"])
@pytest.mark.parametrize("share", [0.0, 0.6])
def test_a_picture_cut_short_is_none_in_its_place(tmp_path, suffix, share):
    folder = write_folder(tmp_path / "high", suffix)
    cut(folder / f"img_0{suffix}", share)
    frames = Frames.open(folder)
    assert [grey is None for _, grey in frames.read()] == [True, False, False, False]
    assert frames.size_px == (WIDTH, HEIGHT)


def test_another_size_is_refused(tmp_path):
    folder = write_folder(tmp_path / "high", ".png")
    cv2.imwrite(str(folder / "img_2.png"), np.zeros((50, 60), np.uint8))
    with pytest.raises(
        Refused, match=r"frame 2 of high is 60 x 50 px, the others are 322 x 242 px"
    ):
        list(Frames.open(folder).read())


def test_a_picture_of_another_size_has_no_such_part(tmp_path):
    """A part of one half as large would be of another place, or empty."""
    crop = Crop("high", (WIDTH, HEIGHT), 0, 100, WIDTH, 142, mirrored=True)
    folder = write_folder(tmp_path / "high", ".png", count=1)
    assert read_picture(PicturePart(folder / "img_0.png", crop)).shape == (142, WIDTH)
    cv2.imwrite(str(folder / "img_0.png"), ramp(0)[:121, :161])
    said = "is 161 x 121 px, the others are 322 x 242 px"
    with pytest.raises(Refused, match=f"img_0.png {said}"):
        read_picture(PicturePart(folder / "img_0.png", crop))
    with pytest.raises(Refused, match=f"frame 0 of high {said}"):
        list(Frames.open(PicturePart(folder, crop)).read())


def test_a_folder_without_a_readable_picture_is_refused(tmp_path):
    folder = write_folder(tmp_path / "high", ".png", count=1)
    cut(folder / "img_0.png", 0.1)
    with pytest.raises(Refused, match="no picture in high can be read"):
        Frames.open(folder)


def test_lossless_video_is_read_exactly(tmp_path):
    frames = Frames.open(write_video(tmp_path / "high.mkv", "FFV1"))
    assert (frames.count, frames.decoded_count, frames.size_px) == (12, 12, (WIDTH, HEIGHT))
    for index, grey in frames.read():
        np.testing.assert_array_equal(grey, ramp(index))
    np.testing.assert_allclose(
        frames.times_s, np.arange(12) / 30, atol=5.1e-4
    )  # the container rounds to 1 ms


def test_sixteen_bit_video_stays_sixteen(tmp_path):
    frames = Frames.open(write_video(tmp_path / "high.mkv", "FFV1", depth=cv2.CV_16U))
    np.testing.assert_array_equal(dict(frames.read())[3], ramp(3, np.uint16))


@pytest.mark.parametrize(
    ("name", "codec", "first", "last"),
    [("high.avi", "MJPG", 0, 255), ("high.mkv", "MJPG", 0, 255), ("high.mp4", "mp4v", 16, 235)],
)
def test_lossy_video_is_its_luma_as_stored(tmp_path, name, codec, first, last):
    frames = Frames.open(write_video(tmp_path / name, codec))
    assert (frames.count, frames.size_px) == (12, (WIDTH, HEIGHT))
    for index, grey in frames.read(5, 7):
        off = grey - (first + (last - first) / 255.0 * ramp(index))
        assert (
            np.abs(np.median(off)) < 1.0 and np.quantile(np.abs(off), 0.9) <= 3.0
        )  # compression, no other range


def test_reading_from_the_middle_of_a_video(tmp_path):
    frames = Frames.open(write_video(tmp_path / "high.mkv", "FFV1"))
    read = dict(frames.read(7, 9))
    assert list(read) == [7, 8]
    np.testing.assert_array_equal(read[7], ramp(7))


def test_a_truncated_video_is_not_shortened(tmp_path):
    frames = Frames.open(cut(write_video(tmp_path / "high.avi", "MJPG"), 0.6))
    read = dict(frames.read())
    assert list(read) == list(range(12))
    lost = [index for index, grey in read.items() if grey is None]
    assert frames.decoded_count == lost[0] < 12
    assert lost == list(range(lost[0], 12))


def test_a_video_that_does_not_open_is_refused(tmp_path):
    path = cut(write_video(tmp_path / "high.mp4", "mp4v"), 0.6)
    with pytest.raises(Refused, match=r"high.mp4 cannot be opened as a video"):
        Frames.open(path)


def test_real_h264_video(real):
    frames = Frames.open(real / "calibration" / "single" / "cam_0.mp4")
    assert (frames.count, frames.size_px) == (48, (1280, 720))
    index, grey = next(frames.read(10))
    assert (index, grey.shape, grey.dtype) == (10, (720, 1280), np.uint8)


def test_reading_says_nothing_on_its_own(tmp_path, capfd):
    list(Frames.open(write_video(tmp_path / "high.avi", "MJPG")).read())
    capfd.readouterr()  # what the writer said
    list(Frames.open(tmp_path / "high.avi").read())
    assert capfd.readouterr() == ("", "")
