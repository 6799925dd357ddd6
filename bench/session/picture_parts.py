"""Cameras of session.toml that are parts of another camera's picture: what a mirror or a split view shows."""

from collections.abc import Iterable, Mapping
from itertools import combinations, product
from pathlib import Path
from typing import Any

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems, refused_as_bad_input
from bench.session.file_names import SESSION_TOML
from bench.session.footage import size_px
from bench.session.manifest import CameraKeys
from vision.geometry import Crop
from vision.pictures import PicturePart

_NEEDED_OF_PART = {
    "of": "the camera in whose picture this part is",
    "crop": "[left, top, width, height] of the part, px",
}


def stated_crops(cameras: Iterable[CameraKeys], sources: Mapping[str, Path]) -> dict[str, Crop]:
    """Return the part of a picture of each camera that is one, by the camera's name.

    sources: a folder, film or picture of each camera that has pictures. A picture of which mirrors alone are stated is a
    camera of its own, too, by the largest rectangle outside them. Raises BadInput for a part that cannot be.
    """
    of_picture: dict[str, dict[str, Crop]] = {}
    for keys in cameras:
        if keys.of is not None and keys.crop is not None:
            _check_of(keys, sources)
            with refused_as_bad_input(f"pictures of camera {keys.of}"):
                whole_px = size_px(sources[keys.of])
            crop = _crop(keys, whole_px)
            of_picture.setdefault(keys.of, {})[keys.name] = crop
    found: dict[str, Crop] = {}
    for of, crops in of_picture.items():
        _check_apart(crops)
        rest = _rest(list(crops.values()))
        if rest is not None and all(crop.mirrored for crop in crops.values()):
            found[of] = rest
        found |= crops
    return found


def check_camera_tables(cameras: Any, problems: InputProblems) -> None:
    """Report each table of [[cameras]] whose name an earlier one has, or with a part's keys of which `of` or
    `crop` is missing.

    cameras: as the file has them. Raises BadInput at the first one, where `problems` does not collect.
    """
    taken = []
    for table in cameras if isinstance(cameras, list) else ():
        if not isinstance(table, dict):
            continue
        name = table.get("name")
        with problems.guard():
            if name is not None and name in taken:
                found = "the name is used twice; one table a camera, under the name of its folder"
                raise _bad(name, found)
        taken.append(name)
        if not table.keys() & {"of", "crop", "mirrored"}:
            continue
        for key, what in _NEEDED_OF_PART.items():
            with problems.guard():
                if key not in table:
                    raise _bad(table.get("name", "?"), f"{key} is missing: {what}")


def in_parts(
    sources: Mapping[str, Path], crops: Mapping[str, Crop]
) -> dict[str, Path | PicturePart]:
    """Return the pictures of each camera by the pictures in files, and the parts that cameras are of them."""
    whole = {crop.of for crop in crops.values()}
    found: dict[str, Path | PicturePart] = {}
    for name, source in sources.items():
        if name not in whole:
            found[name] = source
        for part, crop in crops.items():
            if crop.of == name:
                found[part] = PicturePart(source, crop)
    return found


def _check_of(keys: CameraKeys, sources: Mapping[str, Path]) -> None:
    """Raise BadInput where `of` is no camera with pictures of its own, or the part has some, too."""
    if keys.name in sources:
        raise _bad(keys.name, f"is a part of {keys.of}'s picture, and has pictures of its own")
    if not sources:
        found = f"no picture says how large {keys.of}'s is, of which it is a part"
        raise _bad(keys.name, f"{found}; keep one in boards/{keys.of}")
    if keys.of not in sources:
        listed = ", ".join(sources)
        raise _bad(keys.name, f'of = "{keys.of}" is no camera with pictures; there are {listed}')


def _crop(keys: CameraKeys, whole_px: tuple[int, int]) -> Crop:
    """Return the part that a camera states. Raise BadInput where it is not within the picture."""
    left, top, width, height = keys.crop
    crop = Crop(keys.of, whole_px, left, top, width, height, keys.mirrored)
    is_inside = left + width <= whole_px[0] and top + height <= whole_px[1]
    if min(left, top) < 0 or min(width, height) < 1 or not is_inside:
        found = f"crop = {keys.crop} is not within {keys.of}'s picture"
        size = f"{whole_px[0]} x {whole_px[1]} px"
        raise _bad(keys.name, f"{found} of {size}; it is [left, top, width, height]")
    return crop


def _check_apart(crops: Mapping[str, Crop]) -> None:
    """Raise BadInput where two parts of a picture overlap: a pixel is evidence once."""
    for (name, crop), (other_name, other) in combinations(crops.items(), 2):
        if _overlap(crop, other):
            raise _bad(name, f"its crop overlaps that of camera {other_name}; keep them apart")


def _overlap(a: Crop, b: Crop) -> bool:
    """Return whether two parts of a picture have a pixel in common."""
    across = min(a.left + a.width, b.left + b.width) - max(a.left, b.left)
    down = min(a.top + a.height, b.top + b.height) - max(a.top, b.top)
    return across > 0 and down > 0


def _rest(crops: list[Crop]) -> Crop | None:
    """Return the largest rectangle of a picture outside the parts; None where nothing is left."""
    of = crops[0].of
    width, height = crops[0].whole_px
    columns = {0, width}
    rows = {0, height}
    for crop in crops:
        columns |= {crop.left, crop.left + crop.width}
        rows |= {crop.top, crop.top + crop.height}
    best = None
    sides = product(combinations(sorted(columns), 2), combinations(sorted(rows), 2))
    for (left, right), (top, bottom) in sides:
        part = Crop(of, (width, height), left, top, right - left, bottom - top)
        is_larger = best is None or part.width * part.height > best.width * best.height
        if is_larger and not any(_overlap(part, crop) for crop in crops):
            best = part
    return best


def _bad(name: str, found: str) -> BadInput:
    """Return the fault of a camera of session.toml."""
    return BadInput(f'[[cameras]] "{name}": {found}', file=SESSION_TOML)
