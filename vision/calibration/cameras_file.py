"""cameras.toml, and its covariance in cameras.npz, as the session format has them."""

import hashlib
import tomllib
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

import numpy as np
import tomli_w

from vision.boards.sufficiency import check_lens
from vision.geometry.camera import PARAMETERS, Camera, Cameras
from vision.geometry.crop import Crop
from vision.geometry.refusals import Refused

_KEYS = ("size_px", "matrix", "distortion", "T_camera_rig", "rms_px")
_KEYS_OF_PART = ("crop", "mirrored")


def cameras_as_files(
    cameras: Cameras, companion: str, crops: Mapping[str, Crop]
) -> tuple[bytes, bytes]:
    """Return the contents of cameras.toml and of its companion file of that name.

    crops: of cameras that are parts of a picture. The companion holds the joint covariance with the parameters'
    names, and the part of it that is the rig frame's, where that is known.
    """
    packed = _pack_covariance(cameras)
    tables = {}
    for camera in cameras:
        tables[camera.name] = {
            "size_px": list(camera.size_px),
            "matrix": camera.matrix.tolist(),
            "distortion": camera.distortion.tolist(),
            "T_camera_rig": camera.T_camera_rig.tolist(),
            "rms_px": float(camera.rms_px),
        }
        if camera.name in crops:
            tables[camera.name] |= _part(crops[camera.name])
    document = {
        "covariance": companion,
        "covariance_sha256": hashlib.sha256(packed).hexdigest(),
        "cameras": tables,
    }
    return tomli_w.dumps(document).encode(), packed


def _part(crop: Crop) -> dict[str, list[int] | bool]:
    """Return the keys of a camera that is a part of a picture."""
    crop_px = [crop.left, crop.top, crop.width, crop.height]
    return dict(zip(_KEYS_OF_PART, (crop_px, crop.mirrored)))


def check_crops(path: Path, crops: Mapping[str, Crop]) -> None:
    """Raise Refused where a camera of `path` is a part of a picture, and `crops` states another part, or none."""
    for name, table in parse_toml(path, "is not TOML")["cameras"].items():
        made = {key: table[key] for key in _KEYS_OF_PART if key in table}
        stated = _part(crops[name]) if name in crops else {}
        if made and made != stated:
            found = f"was made with camera {name} as {_named(made)} of a picture"
            raise Refused(f"{found}, session.toml has it as {_named(stated)}: calibrate again")


def _named(part: Mapping[str, list[int] | bool]) -> str:
    """Return how messages name a part of a picture."""
    if not part:
        return "a whole one"
    return f"{'mirrored ' if part.get('mirrored') else ''}part {part.get('crop')!r}"


def _pack_covariance(cameras: Cameras) -> bytes:
    """Return the covariance as a NumPy archive."""
    arrays = {
        "covariance": cameras.covariance,
        "cameras": np.array(cameras.names),
        "parameters": np.array(PARAMETERS),
    }
    if cameras.placement is not None:
        arrays["placement"] = cameras.placement
    buffer = BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def read_cameras(path: Path | str, pixel_aspects: Mapping[str, float] | None = None) -> Cameras:
    """Read the cameras of `path`; without a covariance in it they are taken as exact.

    pixel_aspects: fx/fy by camera, where stated.
    Raises Refused where the file is no TOML, misses a key, or its covariance is not the one it was
    written with.
    """
    path = Path(path)
    document = parse_toml(path, "is not TOML")
    tables = document.get("cameras")
    if not isinstance(tables, dict) or not tables:
        raise Refused("no [cameras.<name>] table found")
    cameras = tuple(_camera(name, table) for name, table in tables.items())
    for camera in cameras:
        check_lens(camera, pixel_aspect=(pixel_aspects or {}).get(camera.name))
    covariance, placement = _read_covariance(path, document, cameras)
    return Cameras(cameras, covariance, placement)


def parse_toml(path: Path, complaint: str) -> dict:
    """Parse a TOML file; raise Refused with the complaint and the parser's own where it is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:  # of TOML, of text, of a number's length
        raise Refused(f"{complaint}: {error}") from error


def _camera(name: str, table: dict) -> Camera:
    """Return the camera of one table; raise Refused where its keys or values are not a camera's."""
    if not isinstance(table, dict):
        raise Refused(f"cameras.{name} must be a table with {', '.join(_KEYS)}")
    if "translation" in table:
        raise Refused(
            f"cameras.{name} is as caliscope and aniposelib write it, in a world of its own: place it in the rig with "
            "`whisker-bench calibrate cameras SESSION --lenses FILE --out cameras.toml`"
        )
    missing = sorted(set(_KEYS) - set(table))
    if missing:
        raise Refused(f"cameras.{name}: {', '.join(missing)} missing")
    unknown = sorted(set(table) - set(_KEYS) - {"covariance", *_KEYS_OF_PART})
    if unknown:
        raise Refused(
            f"cameras.{name}: unknown key {', '.join(unknown)}; allowed are {', '.join(_KEYS)}"
        )
    try:
        return Camera(name, **{key: table[key] for key in _KEYS})
    except Refused:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        raise Refused(f"cameras.{name}: {error}") from error


def _read_covariance(
    path: Path, document: dict, cameras: tuple[Camera, ...]
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the joint covariance and the placement's part of it; None for what the files do not
    hold.

    Raises Refused where the covariance's file is missing, another one, or not of these cameras.
    """
    name = document.get("covariance")
    if name is None:
        return None, None
    if not isinstance(name, str) or Path(name).name != name or not name:
        raise Refused(f"names {name!r} for its covariance; a plain file name beside it is allowed")
    companion = path.parent / name
    if not companion.is_file():
        raise Refused(
            f"names {name} for its covariance, but there is no such file beside it: copy both"
        )
    packed = companion.read_bytes()
    if hashlib.sha256(packed).hexdigest() != document.get("covariance_sha256"):
        raise Refused(
            f"{name} is not the covariance this file was written with: copy both, or calibrate again"
        )
    try:
        with np.load(BytesIO(packed), allow_pickle=False) as stored:
            return _in_order(stored, cameras), stored.get("placement")
    except Refused:
        raise
    except (ValueError, KeyError, EOFError, OSError, IndexError, zipfile.BadZipFile) as error:
        raise Refused(f"{name} is no covariance of these cameras: {error}") from None


def _in_order(stored: "np.lib.npyio.NpzFile", cameras: tuple[Camera, ...]) -> np.ndarray:
    """Return the stored covariance in the TOML's order of cameras and in this version's order of
    parameters.
    """
    names = stored["cameras"].tolist()
    parameters = stored["parameters"].tolist()
    wanted = [camera.name for camera in cameras]
    if sorted(names) != sorted(wanted) or sorted(parameters) != sorted(PARAMETERS):
        raise Refused("covariance is of other cameras or other parameters than the ones listed")
    places = [parameters.index(name) for name in PARAMETERS]
    firsts = [len(parameters) * names.index(name) for name in wanted]
    rows = np.add.outer(firsts, places).ravel()
    return stored["covariance"][np.ix_(rows, rows)]
