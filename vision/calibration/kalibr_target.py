"""The target file of Kalibr: which board, and its sizes in metres."""

from pathlib import Path
from typing import Any

from vision.calibration.foreign_camera import MM_PER_M
from vision.calibration.yaml_text import read_yaml
from vision.geometry.refusals import Refused

_KINDS = ("aprilgrid", "checkerboard", "circlegrid")


def read_kalibr_target(path: Path) -> dict[str, Any]:
    """Return the keys of [board] that a target file of Kalibr states, lengths in mm.

    Raises Refused where the file is none, or its target no board that is known here.
    """
    target = read_yaml(path)
    kind = target.get("target_type") if isinstance(target, dict) else None
    if kind not in _KINDS:
        raise Refused(
            f"{path.name} is no target file of Kalibr: target_type is {kind!r}; {', '.join(_KINDS)} are known"
        )
    if kind == "aprilgrid":
        return _april_grid(target, path)
    counts = [_count(target, "targetCols", path), _count(target, "targetRows", path)]
    if kind == "circlegrid":
        raise Refused(
            f"{path.name} does not state the circles' diameter: enter kind, squares, square_mm and marker_mm"
        )
    across_mm = MM_PER_M * _number(target, "colSpacingMeters", path)
    down_mm = MM_PER_M * _number(target, "rowSpacingMeters", path)
    if across_mm != down_mm:
        raise Refused(f"{path.name} states {across_mm:g} x {down_mm:g} mm: no squares")
    return {
        "kind": "checkerboard",
        "squares": [n + 1 for n in counts],  # Kalibr counts inner corners
        "square_mm": across_mm,
    }


def _april_grid(target: dict[str, Any], path: Path) -> dict[str, Any]:
    """Return the keys of [board] of an AprilGrid's target. Raises Refused."""
    tag_mm = MM_PER_M * _number(target, "tagSize", path)
    gap = _number(target, "tagSpacing", path)
    return {
        "kind": "aprilgrid",
        "squares": [_count(target, "tagCols", path), _count(target, "tagRows", path)],
        "square_mm": tag_mm * (1.0 + gap),
        "marker_mm": tag_mm,
    }


def _number(target: dict[str, Any], key: str, path: Path) -> float:
    """Return a length or ratio of the file; raise Refused where it is none above 0."""
    value = target.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
        raise Refused(f"{path.name}: {key} is {value!r}, must be a number above 0")
    return float(value)


def _count(target: dict[str, Any], key: str, path: Path) -> int:
    """Return a count of the file; raise Refused where it is none."""
    value = target.get(key)
    if isinstance(value, bool) or not isinstance(value, int):
        raise Refused(f"{path.name}: {key} is {value!r}, must be a whole number")
    return value
