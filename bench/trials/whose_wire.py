"""Whether the wire that was seen for a whisker of an array is its own: by the bases that session.toml states, and by
where the others' wires are."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bench.records.trial import SeenTrial, SeenWhisk
from vision.pictures.others import Others, RodLines

_MOSTLY = 0.5  # of a wire's length: of two wires in one place most is, of two that cross little


def with_whose(seen: SeenTrial, straight: Mapping[str, Others], looked: Mapping[str, Others], own: str) -> SeenTrial:
    """The trial with a status on each whisk whose wire may be another whisker's.

    straight: by camera and whisker, its own too, the wires as the bases have them; looked: the others' as seen first;
    own: the whisker's name.
    """
    return replace(seen, whisks=tuple(_checked(whisk, straight, looked, own) for whisk in seen.whisks))


def _checked(whisk: SeenWhisk, straight, looked, own: str) -> SeenWhisk:
    if not whisk.overlay:
        return whisk
    drawing = next(iter(whisk.overlay.values()))
    wires = {camera: lines["wire"] for camera, lines in drawing.cameras.items() if camera in straight}
    others = sorted({name for one in straight.values() for name in one} - {own})
    doubted = [name for name in others if _starts_at(wires, straight, drawing.frame, name, own)
               or _lies_on(wires, looked, drawing.frame, name)]  # fmt: skip
    if not doubted:
        return whisk
    said = f"its wire may be that of {' or '.join(doubted)}"
    return replace(whisk, status="; ".join(filter(None, [whisk.status, said])), contradicted=True)


def _starts_at(wires: Mapping[str, np.ndarray], straight, frame: int, name: str, own: str) -> bool:
    """Whether the wire starts nearer to where another whisker's does than to where its own should, in all cameras
    together."""
    square = {one: sum(_first_px2(wire, straight[camera].get(one), frame) for camera, wire in wires.items())
              for one in (own, name)}  # fmt: skip
    return bool(square[name] < square[own])


def _first_px2(wire: np.ndarray, lines: RodLines | None, frame: int) -> float:
    """Mean square distance, px², of the first part of a wire's line from another one; NaN where there is none."""
    line = _line(lines, frame)
    if line is None:
        return np.nan
    return float(np.mean(_away_px(wire[1 : 1 + len(wire) // 10], line[0]) ** 2))


def _lies_on(wires: Mapping[str, np.ndarray], looked, frame: int, name: str) -> bool:
    """Whether most of the wire lies on another's picture in every camera: two wires hide each other in one camera, and
    in all only where they are one."""
    on = []
    for camera, wire in wires.items():
        line = _line(looked.get(camera, {}).get(name), frame)
        on.append(line is not None and float(np.mean(_away_px(wire, line[0]) < 2.0 * line[1])) > _MOSTLY)
    return bool(on) and all(on)


def _line(lines: RodLines | None, frame: int) -> tuple[np.ndarray, float] | None:
    """Middle (m, 2) and half-width, px, in a frame."""
    there = np.flatnonzero(lines.within(frame)) if lines is not None else ()
    return (lines.middle_px[there[0]], float(lines.half_px[there[0]])) if len(there) else None


def _away_px(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Distance (n,) of points (n, 2) from a line (m, 2) of straight parts."""
    start, step = line[:-1], np.diff(line, axis=0)
    share = np.einsum("nmi,mi->nm", points[:, None] - start, step) / np.maximum(np.sum(step**2, axis=1), 1e-12)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * step
    return np.min(np.linalg.norm(points[:, None] - nearest, axis=2), axis=1)
