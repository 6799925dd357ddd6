"""Check that the wire seen for a whisker of an array is its own: by the bases that session.toml
states, and by the places of the others' wires.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bench.base.input_problems import in_one_status
from bench.base.statuses import reason
from bench.records.trial_result import Drawing, SeenTrial, SeenWhisk
from vision import REST_PRIOR_MM
from vision.geometry import Reason
from vision.pictures import Others, RodLines

# [1] Of a wire's length: of two wires in one place most is, of two that cross little. Stated.
_MOSTLY = 0.5
# mm: as far as a wire is traced for, two sigma of what is believed of a clamp (`vision.fit.blocks`).
_MOST_BESIDE_MM = 2.0 * float(REST_PRIOR_MM[0])


@dataclass(frozen=True, eq=False)
class _Line:
    """Picture of a wire in one frame: middle (m, 2) and half-width, px."""

    middle_px: np.ndarray
    half_px: float

    def distance_px(self, points: np.ndarray) -> np.ndarray:
        """Return the distance (n,) of points (n, 2) from the middle, a polygonal line."""
        start = self.middle_px[:-1]
        step = np.diff(self.middle_px, axis=0)
        from_start = points[:, None] - start  # (n, m - 1, 2)
        length2 = np.maximum(np.sum(step**2, axis=1), 1e-12)
        share = np.clip(np.einsum("nmi,mi->nm", from_start, step) / length2, 0.0, 1.0)
        return np.linalg.norm(from_start - share[..., None] * step, axis=2).min(axis=1)


def with_whose(
    seen: SeenTrial, straight: Mapping[str, Others], traced: Mapping[str, Others], own: str
) -> SeenTrial:
    """Return the trial with a status on each whisk whose wire may be another whisker's.

    straight: by camera and whisker, its own too, straight wires from their bases. traced: the
    others' wires as seen before. own: the whisker's name.
    """
    checked = []
    for whisk in seen.whisks:
        checked.append(_checked(whisk, straight, traced, own, seen.wire_radius_mm))
    return replace(seen, whisks=tuple(checked))


def _checked(
    whisk: SeenWhisk,
    straight: Mapping[str, Others],
    traced: Mapping[str, Others],
    own: str,
    radius_mm: float,
) -> SeenWhisk:
    """Return the whisk with a status where its wire is not from its base or lies on another's."""
    if not whisk.overlay:
        return whisk
    drawing = next(iter(whisk.overlay.values()))
    frame = drawing.frame
    wires = _wires(drawing, straight)
    others = sorted(set().union(*straight.values()) - {own})
    taken = [name for name in others if _lies_on(wires, traced, frame, name)]
    offsets = [(0.0, own)]
    for camera, wire in wires.items():
        offsets.append(_base_offset(wire, straight[camera], frame, own, radius_mm))
    offset_mm, nearest = max(offsets)
    found = _wire_reasons(offset_mm, nearest, taken, own)
    return whisk.with_contradiction(in_one_status(*found))


def _wire_reasons(offset_mm: float, nearest: str, taken: list[str], own: str) -> list[Reason]:
    """Return why a wire may be another whisker's.

    offset_mm: of the wire from its base. nearest: whisker whose base is nearest to it. taken:
    whiskers on whose wires it lies. own: the whisker's name.
    """
    found = []
    names = list(taken)
    if offset_mm > _MOST_BESIDE_MM:
        found.append(reason("wire_off_its_base", beside_mm=offset_mm))
        if nearest not in (own, *taken):
            names.append(nearest)
    if names:
        found.append(reason("wire_of_another", names=" or ".join(names)))
    return found


def _wires(drawing: Drawing, straight: Mapping[str, Others]) -> dict[str, np.ndarray]:
    """Return the whisk's wire (m, 2), px, in each camera that has straight wires to compare."""
    found = {}
    for camera, lines in drawing.cameras.items():
        if camera in straight:
            found[camera] = lines["wire"]
    return found


def _base_offset(
    wire: np.ndarray, straight: Others, frame: int, own: str, radius_mm: float
) -> tuple[float, str]:
    """Return the lateral offset, mm, of a wire's first part in a camera from where its base has it,
    and the whisker whose base has its wire nearest.

    wire (m, 2): px. The offset is 0 where the camera does not show the whisker's own base.
    """
    first = wire[1 : 1 + len(wire) // 10]
    offsets_px = {}
    for name, rods in straight.items():
        line = _line(rods, frame)
        if line is not None:
            offsets_px[name] = float(np.sqrt(np.mean(line.distance_px(first) ** 2)))
    if own not in offsets_px:
        return 0.0, own
    px_per_mm = _line(straight[own], frame).half_px / radius_mm
    nearest = min(offsets_px, key=lambda name: (offsets_px[name], name != own))
    return offsets_px[own] / px_per_mm, nearest


def _lies_on(
    wires: Mapping[str, np.ndarray], traced: Mapping[str, Others], frame: int, name: str
) -> bool:
    """Return whether most of the wire lies on another's picture in every camera.

    Two wires hide each other in one camera, and in all only where they are one.
    """
    for camera, wire in wires.items():
        line = _line(traced.get(camera, {}).get(name), frame)
        if line is None:
            return False
        is_on = line.distance_px(wire) < 2.0 * line.half_px
        if not float(np.mean(is_on)) > _MOSTLY:
            return False
    return bool(wires)


def _line(rods: RodLines | None, frame: int) -> _Line | None:
    """Return the picture of a wire in a frame; None where there is none."""
    if rods is None:
        return None
    there = np.flatnonzero(rods.within(frame))
    if len(there) == 0:
        return None
    return _Line(rods.middle_px[there[0]], float(rods.half_px[there[0]]))
