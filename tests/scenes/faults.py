"""Faults of a lab, each made on a copy of a session: what `docs/reliability.md` lists and tests and studies make.

A fault is a function of the session's folder; those of a recording spoil its trial TRIAL alone.
"""

import csv
import json
import os
import shutil
import struct
import tomllib
import zlib
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from vision.boards import CharucoBoard, find_corners

TRIAL = "b60_4"
# The board of the small session.
BOARD = CharucoBoard((8, 6), square_mm=15.0, marker_mm=11.0, dictionary="DICT_5X5_100")
Fault = Callable[[Path], None]


def copy_of(session: Path, target: Path) -> Path:
    """A session to spoil."""
    return Path(shutil.copytree(session, target, copy_function=shutil.copyfile))


def alone(session: Path, target: Path, brought: Iterable[Path]) -> Path:
    """A copy with TRIAL alone, cameras and gauges brought along: a fifth of the whole session's time.

    brought: cameras.toml and cameras.npz, left out where cameras are calibrated, and gauges.toml.
    """
    copy_of(session, target)
    for trial in (target / "trials").iterdir():
        if trial.name != TRIAL:
            shutil.rmtree(trial)
    for file in brought:
        shutil.copyfile(file, target / file.name)
    return target


def _trial(session: Path) -> Path:
    return session / "trials" / TRIAL


def change_table(
    path: Path, change: Callable[[dict[str, np.ndarray]], None], digits: int = 5
) -> None:
    """Columns of a CSV file, by name, changed in place."""
    with path.open(newline="") as file:
        names, *rows = csv.reader(file)
    columns = dict(zip(names, np.array(rows, dtype=float).T))
    change(columns)
    rows = zip(*columns.values())
    lines = [",".join(columns), *(",".join(f"{value:.{digits}f}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")


def _signals(change: Callable[[dict[str, np.ndarray]], None]) -> Fault:
    return lambda session: change_table(_trial(session) / "signals.csv", change)


def _times(change: Callable[[dict[str, np.ndarray]], None]) -> Fault:
    return lambda session: change_table(_trial(session) / "frames.csv", change)


def _manifest(old: str, new: str) -> Fault:
    def spoil(session: Path) -> None:
        file = session / "session.toml"
        text = file.read_text()
        assert old in text
        file.write_text(text.replace(old, new))

    return spoil


def scaled(name: str, factor: float) -> Callable[[dict[str, np.ndarray]], None]:
    """A change of one column by a factor."""

    def change(columns: dict[str, np.ndarray]) -> None:
        columns[name] = columns[name] * factor

    return change


def shifted(name: str, by: float) -> Callable[[dict[str, np.ndarray]], None]:
    """A change of one column by a constant."""

    def change(columns: dict[str, np.ndarray]) -> None:
        columns[name] = columns[name] + by

    return change


def _exchanged(columns) -> None:
    columns["y_V"], columns["z_V"] = columns["z_V"], columns["y_V"]


def _encoder_jump(columns) -> None:
    late = columns["time_s"] > np.mean(columns["time_s"][[0, -1]])
    columns["motor_deg"] = columns["motor_deg"] + 0.4 * late


def _encoder_reversed(columns) -> None:
    columns["motor_deg"] = columns["motor_deg"][::-1].copy()


def _drift_at_touch(columns) -> None:
    columns["y_V"] = columns["y_V"] + 0.17 * np.maximum(columns["time_s"] - 0.1, 0.0)


def _saturated(columns) -> None:
    for name in ("y_V", "z_V"):
        columns[name] = np.clip(columns[name], -0.1, 0.1)


def _dead(columns) -> None:
    columns["z_V"] = np.zeros_like(columns["z_V"])


def _another_trials_signals(session: Path) -> None:
    other = (
        Path(__file__).resolve().parents[2]
        / "fixtures"
        / "small-session"
        / "trials"
        / "b30_3"
        / "signals.csv"
    )
    shutil.copyfile(other, _trial(session) / "signals.csv")


def _moments(factor: float) -> Fault:
    """Signals as moments in N·mm by the sound gauges beside the session, times a factor."""

    def spoil(session: Path) -> None:
        found = tomllib.loads((session / "gauges.toml").read_text())
        matrix = np.array(found["matrix_Nmm_per_V"])
        file = _trial(session) / "signals.csv"

        def change(columns) -> None:
            volts = np.stack([columns["y_V"], columns["z_V"]])
            columns["y_V"], columns["z_V"] = factor * matrix @ volts

        change_table(file, change, digits=8)
        _renamed(file)

    return spoil


def _renamed(signals: Path) -> None:
    """Name the two channels as if they were moments in N·mm."""
    text = signals.read_text()
    assert text.startswith("time_s,motor_deg,y_V,z_V\n")
    signals.write_text(text.replace("y_V,z_V", "m_y_Nmm,m_z_Nmm", 1))


def _volts_named_Nmm(session: Path) -> None:
    _renamed(_trial(session) / "signals.csv")


def _millivolts(columns) -> None:
    for name in ("y_V", "z_V"):
        columns[name] = 1e3 * columns[name]


def _camera_late(session: Path) -> None:
    """Every picture of a camera in the place of the next; the first is there twice."""
    files = pictures(session, "low")
    kept = [file.read_bytes() for file in files]
    for file, content in zip(files[1:], kept):
        file.unlink()
        file.write_bytes(content)


def _pictures_exchanged(session: Path) -> None:
    """The two measured trials have each other's pictures and frame times."""
    mine = _trial(session)
    other = mine.with_name("b30_3")
    for name in ("low", "high", "frames.csv"):
        (mine / name).rename(mine / "aside")
        (other / name).rename(mine / name)
        (mine / "aside").rename(other / name)


def pictures(session: Path, camera: str) -> list[Path]:
    """One camera's pictures of the trial, in order."""
    return sorted((_trial(session) / camera).iterdir())


def change_picture(path: Path, change: Callable[[np.ndarray], np.ndarray]) -> None:
    """A grey picture replaced by a changed one, as fine as it was (JPEG 97)."""
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    path.unlink()
    assert cv2.imwrite(
        str(path), np.ascontiguousarray(change(grey)), [cv2.IMWRITE_JPEG_QUALITY, 97]
    )


def _camera(
    change: Callable[[np.ndarray], np.ndarray], camera: str = "low", first: int = 0
) -> Fault:
    def spoil(session: Path) -> None:
        for path in pictures(session, camera)[first:]:
            change_picture(path, change)

    return spoil


def _knocked(grey: np.ndarray) -> np.ndarray:
    return np.roll(grey, (4, 6), axis=(0, 1))


def brighter(factor: float) -> Callable[[np.ndarray], np.ndarray]:
    """A change of exposure; what is too bright is clipped."""
    return lambda grey: np.clip(np.rint(factor * grey), 0, 255).astype(np.uint8)


def _exchanged_cameras(session: Path) -> None:
    low, high = (_trial(session) / camera for camera in ("low", "high"))
    low.rename(low.with_name("aside"))
    high.rename(low)
    low.with_name("aside").rename(high)


def _frame_twice(session: Path) -> None:
    for camera in ("low", "high"):
        files = pictures(session, camera)
        files[5].unlink()
        shutil.copyfile(files[4], files[5])


def _lost_silently(session: Path) -> None:
    """A frame dropped at touch, pictures numbered on, the row of the last one gone: times do not tell."""
    for camera in ("low", "high"):
        pictures(session, camera)[4].unlink()
    file = _trial(session) / "frames.csv"
    file.write_text("\n".join(file.read_text().splitlines()[:-1]) + "\n")


def _dropped(session: Path) -> None:
    """A frame dropped at touch, its row too."""
    for camera in ("low", "high"):
        pictures(session, camera)[4].unlink()
    file = _trial(session) / "frames.csv"
    lines = file.read_text().splitlines()
    kept = [line.split(",")[1] for line in lines[1:5] + lines[6:]]
    file.write_text(
        "\n".join(["frame,time_s", *(f"{k},{time}" for k, time in enumerate(kept))]) + "\n"
    )


def _damaged(session: Path) -> None:
    """Every picture of a camera cut short."""
    for path in pictures(session, "low"):
        path.write_bytes(path.read_bytes()[:100])


def _unsaid(fault: Fault) -> Fault:
    """Make a fault in a session that says of no given that it is exact, as a lab's does."""

    def spoil(session: Path) -> None:
        file = session / "session.toml"
        file.write_text(file.read_text().replace("exact = true\n", ""))
        fault(session)

    return spoil


def square_off(share: float) -> Fault:
    """A fault: the board's square and marker are stated too large by a share."""
    sizes = f"square_mm = {15.0 * (1.0 + share):g}\nmarker_mm = {11.0 * (1.0 + share):g}"
    return _unsaid(_manifest("square_mm = 15.0\nmarker_mm = 11.0", sizes))


def _trial_named(name: bytes) -> Fault:
    """A fault: the trial's folder has another name."""

    def spoil(session: Path) -> None:
        trial = os.fsencode(_trial(session))
        os.rename(trial, os.path.join(os.path.dirname(trial), name))

    return spoil


def _manifest_is_a_folder(session: Path) -> None:
    file = _trial(session) / "trial.toml"
    file.unlink()
    file.mkdir()


def _board_views_exchanged(session: Path) -> None:
    """Two cameras have each other's pictures of the board for their lenses."""
    low, high = (session / "boards" / camera for camera in ("low", "high"))
    low.rename(low.with_name("aside"))
    high.rename(low)
    low.with_name("aside").rename(high)


# [grey] A picture of a trial that differs by less from the empty rig's shows the rig there: noise and JPEG.
_STILL_GREY = 12


def print_stretched(share: float) -> Fault:
    """A fault: the board is longer along its x by a share, in every picture of it."""

    def spoil(session: Path) -> None:
        cameras = json.loads((session / "truth.json").read_text())["cameras"]
        for name, camera in cameras.items():
            K = np.array(camera["K"])
            distortion = np.array(camera["dist"])
            stretch = partial(stretched_board, share=share, K=K, distortion=distortion)
            for path in (session / "boards" / name).iterdir():
                change_picture(path, stretch)
            on_rig = session / "boards" / "rig" / f"{name}.png"
            before = cv2.imread(str(on_rig), cv2.IMREAD_GRAYSCALE)
            change_picture(on_rig, stretch)
            after = cv2.imread(str(on_rig), cv2.IMREAD_GRAYSCALE)
            for path in session.glob(f"trials/*/{name}/*"):
                change_picture(path, partial(_before_other_rig, before=before, after=after))

    return spoil


def _before_other_rig(grey: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return a trial's picture with another empty rig behind what moves in it."""
    is_still = np.abs(grey.astype(int) - before) < _STILL_GREY
    change = after.astype(int) - before
    return np.clip(grey + np.where(is_still, change, 0), 0, 255).astype(np.uint8)


def stretched_board(
    grey: np.ndarray, share: float, K: np.ndarray, distortion: np.ndarray
) -> np.ndarray:
    """Return a picture as it would be of a board longer along x, about its middle, by a share.

    K (3, 3), distortion (5,): the camera's true lens.
    """
    corners = find_corners(grey, BOARD)
    if not len(corners.ids):
        return grey
    flat = cv2.undistortPoints(corners.px.reshape(-1, 1, 2), K, distortion)
    on_board_mm = BOARD.corners_mm[corners.ids, :2]
    to_picture, _ = cv2.findHomography(on_board_mm, flat.reshape(-1, 2))
    rows, columns = np.indices(grey.shape, dtype=float)
    px = np.stack([columns.ravel(), rows.ravel()], axis=1)  # (pixels, 2)
    seen = cv2.undistortPoints(px.reshape(-1, 1, 2), K, distortion)
    place_mm = cv2.perspectiveTransform(seen, np.linalg.inv(to_picture))[:, 0]
    middle_mm = on_board_mm.mean(axis=0)
    place_mm[:, 0] = middle_mm[0] + (place_mm[:, 0] - middle_mm[0]) / (1.0 + share)
    source = cv2.perspectiveTransform(place_mm.reshape(-1, 1, 2), to_picture)
    rays = cv2.convertPointsToHomogeneous(source)
    from_px, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), K, distortion)
    from_px = from_px.reshape(*grey.shape, 2).astype(np.float32)
    return cv2.remap(grey, from_px[..., 0], from_px[..., 1], cv2.INTER_LANCZOS4)


def _some_damaged(session: Path) -> None:
    """Two pictures of a camera, after the touch, cut short."""
    for path in pictures(session, "low")[7:9]:
        data = path.read_bytes()
        path.write_bytes(data[: len(data) // 3])


def _rig_board_hidden(session: Path) -> None:
    change_picture(session / "boards" / "rig" / "low.png", lambda grey: np.full_like(grey, 90))


def _huge_png(session: Path) -> None:
    """A PNG whose header tells of 60000 × 60000 pixels."""
    path = pictures(session, "low")[3]
    path.unlink()

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", 60000, 60000, 8, 0, 0, 0, 0)
    body = zlib.compress(bytes(60001))
    packed = (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b"")
    )
    path.with_suffix(".png").write_bytes(packed)


def _fifo(session: Path) -> None:
    path = pictures(session, "low")[3]
    path.unlink()
    os.mkfifo(path)


def _link_out(session: Path) -> None:
    """A camera's folder that is a link to pictures elsewhere."""
    folder = _trial(session) / "low"
    outside = session.parent / "elsewhere"
    shutil.move(folder, outside)
    folder.symlink_to(outside)


def _covariance_elsewhere(session: Path) -> None:
    file = session / "cameras.toml"
    text = file.read_text()
    (session.parent / "cameras.npz").write_bytes((session / "cameras.npz").read_bytes())
    file.write_text(text.replace('"cameras.npz"', '"../cameras.npz"'))


def _covariance_is_a_folder(session: Path) -> None:
    file = session / "cameras.toml"
    file.write_text(file.read_text().replace('"cameras.npz"', '".."'))


FAULTS: dict[str, Fault] = {
    "sound": lambda session: None,
    "channels exchanged": _signals(_exchanged),
    "y reversed": _signals(scaled("y_V", -1.0)),
    "encoder scale 1.1": _signals(scaled("motor_deg", 1.1)),
    "encoder offset 1": _signals(shifted("motor_deg", 1.0)),
    "encoder jump 0.4": _signals(_encoder_jump),
    "encoder reversed": _signals(_encoder_reversed),
    "another trial's signals": _another_trials_signals,
    "drift begins near touch": _signals(_drift_at_touch),
    "saturated gauges": _signals(_saturated),
    "dead gauge": _signals(_dead),
    "frame times 1.1": _times(scaled("time_s", 1.1)),
    "frame times +20 ms": _times(shifted("time_s", 0.02)),
    "frame twice": _frame_twice,
    "frame lost silently": _lost_silently,
    "frame dropped": _dropped,
    "frame times 1.01": _times(scaled("time_s", 1.01)),
    "encoder scale 1.01": _signals(scaled("motor_deg", 1.01)),
    "moments in N m": _moments(1e-3),
    "moments in N mm": _moments(1.0),
    "moments in N um": _moments(1e3),
    "volts named Nmm": _volts_named_Nmm,
    "millivolts": _signals(_millivolts),
    "a camera late by a frame": _camera_late,
    "pictures of two trials exchanged": _pictures_exchanged,
    "exposure 1.3 from frame 6": _camera(brighter(1.3), first=6),
    "bar 6.6 mm for 6": _manifest("diameter_mm = 6.0", "diameter_mm = 6.6"),
    "bar 6.8 mm for 6": _manifest("diameter_mm = 6.0", "diameter_mm = 6.8"),
    "bar 5.2 mm for 6": _manifest("diameter_mm = 6.0", "diameter_mm = 5.2"),
    "bar 4 mm for 6": _manifest("diameter_mm = 6.0", "diameter_mm = 4.0"),
    "wire 1.5 mm for 1": _manifest("diameter_mm = 1.0", "diameter_mm = 1.5"),
    "board 10 % too large": _manifest(
        "square_mm = 15.0\nmarker_mm = 11.0", "square_mm = 16.5\nmarker_mm = 12.1"
    ),
    "board 2 % too large": _manifest(
        "square_mm = 15.0\nmarker_mm = 11.0", "square_mm = 15.3\nmarker_mm = 11.22"
    ),
    "board 3 mm higher": _manifest("-44.3509729]", "-41.3509729]"),
    "board 0.3 mm aside, unsaid": _unsaid(_manifest("4.24180287]", "4.54180287]")),
    "square 0.3 % too large, unsaid": square_off(3e-3),
    "square 0.5 % too large, unsaid": square_off(5e-3),
    "square 1 % too large, unsaid": square_off(1e-2),
    "square 2 % too large, unsaid": square_off(2e-2),
    "board 3 mm higher, unsaid": _unsaid(_manifest("-44.3509729]", "-41.3509729]")),
    "bar 6.6 mm for 6, unsaid": _unsaid(_manifest("diameter_mm = 6.0", "diameter_mm = 6.6")),
    "print stretched 0.3 %, unsaid": _unsaid(print_stretched(3e-3)),
    "lens boards exchanged, unsaid": _unsaid(_board_views_exchanged),
    "trial's name not UTF-8": _trial_named(b"b60_\xff"),
    "trial's name of two lines": _trial_named(b"b60\n4"),
    "trial.toml is a folder": _manifest_is_a_folder,
    "wrong dictionary": _manifest("DICT_5X5_100", "DICT_4X4_100"),
    "wrong squares": _manifest("squares = [8, 6]", "squares = [7, 5]"),
    "whisker 90 mm for 100": _manifest("length_mm = 100.0", "length_mm = 90.0"),
    "whisker 150 mm for 100": _manifest("length_mm = 100.0", "length_mm = 150.0"),
    "exposure 1.5 from frame 6": _camera(brighter(1.5), first=6),
    "exposure 1.1 from frame 6": _camera(brighter(1.1), first=6),
    "exposure 1.02 from frame 6": _camera(brighter(1.02), first=6),
    "exposure 0.8 from frame 6": _camera(brighter(0.8), first=6),
    "camera knocked 6,4 px": _camera(_knocked),
    "camera mirrored": _camera(lambda grey: grey[:, ::-1]),
    "cameras exchanged": _exchanged_cameras,
    "camera black": _camera(np.zeros_like),
    "camera white": _camera(lambda grey: np.full_like(grey, 255)),
    "camera damaged": _damaged,
    "two frames damaged": _some_damaged,
    "rig board hidden": _rig_board_hidden,
    "PNG of 60000 x 60000": _huge_png,
    "FIFO for a picture": _fifo,
    "folder is a link out": _link_out,
    "covariance elsewhere": _covariance_elsewhere,
    "covariance is a folder": _covariance_is_a_folder,
}
# These need the board views: they are made on the whole session, without cameras brought along.
WHOLE = (
    "board 10 % too large",
    "board 2 % too large",
    "bar 6.6 mm for 6",
    "board 3 mm higher",
    "pictures of two trials exchanged",
    "rig board hidden",
    "wrong dictionary",
    "wrong squares",
)
# These need the board views, and no other trial: cameras are calibrated, gauges brought along.
WITH_BOARDS = (
    "board 0.3 mm aside, unsaid",
    "board 3 mm higher, unsaid",
    "square 0.3 % too large, unsaid",
    "square 0.5 % too large, unsaid",
    "square 1 % too large, unsaid",
    "square 2 % too large, unsaid",
    "bar 6.6 mm for 6, unsaid",
    "print stretched 0.3 %, unsaid",
    "lens boards exchanged, unsaid",
)
# What a lab enters wrongly or overlooks: each must be refused, named, or within the stated sigmas.
ENTERED_WRONGLY = (
    "board 0.3 mm aside, unsaid",
    "square 0.3 % too large, unsaid",
    "square 0.5 % too large, unsaid",
    "square 1 % too large, unsaid",
    "square 2 % too large, unsaid",
    "print stretched 0.3 %, unsaid",
    "lens boards exchanged, unsaid",
    "board 3 mm higher, unsaid",
    "bar 6.6 mm for 6, unsaid",
    "moments in N m",
    "volts named Nmm",
    "frame times 1.01",
    "exposure 1.3 from frame 6",
    "a camera late by a frame",
    "trial's name not UTF-8",
    "trial's name of two lines",
    "trial.toml is a folder",
    "two frames damaged",
)
