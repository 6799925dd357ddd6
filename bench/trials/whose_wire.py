"""Whether the wire that was seen for a whisker of an array is its own: by the bases that session.toml states, and by
where the others' wires are."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bench.base.doubts import in_one_status
from bench.base.statuses import reason
from bench.records.trial_result import SeenTrial, SeenWhisk
from vision.fit.blocks import REST_PRIOR_MM
from vision.pictures.others import Others, RodLines

_MOSTLY = 0.5  # of a wire's length: of two wires in one place most is, of two that cross little
# mm: as far as a wire is looked for, two sigma of what is believed of a clamp (`vision.fit.blocks`).
_MOST_BESIDE_MM = 2.0 * float(REST_PRIOR_MM[0])


def with_whose(
    seen: SeenTrial, straight: Mapping[str, Others], looked: Mapping[str, Others], own: str
) -> SeenTrial:
    """The trial with a status on each whisk whose wire may be another whisker's.

    straight: by camera and whisker, its own too, the wires as the bases have them; looked: the others' as seen first;
    own: the whisker's name.
    """
    told = straight, looked, own, seen.wire_radius_mm
    return replace(seen, whisks=tuple(_checked(whisk, *told) for whisk in seen.whisks))


def _checked(whisk: SeenWhisk, straight, looked, own: str, radius_mm: float) -> SeenWhisk:
    if not whisk.overlay:
        return whisk
    drawing = next(iter(whisk.overlay.values()))
    wires = {
        camera: lines["wire"] for camera, lines in drawing.cameras.items() if camera in straight
    }
    others = sorted({name for one in straight.values() for name in one} - {own})
    starts = [
        _start(wire, straight[camera], drawing.frame, own, radius_mm)
        for camera, wire in wires.items()
    ]
    beside_mm, nearest = max(starts, default=(0.0, own))
    taken = [name for name in others if _lies_on(wires, looked, drawing.frame, name)]
    said = []
    if beside_mm > _MOST_BESIDE_MM:
        said.append(reason("wire_off_its_base", beside_mm=beside_mm))
        taken += [nearest] * (nearest != own and nearest not in taken)
    if taken:
        said.append(reason("wire_of_another", names=" or ".join(taken)))
    status = in_one_status(whisk.status, *said)
    return replace(whisk, status=status, contradicted=whisk.contradicted or bool(said))


def _start(
    wire: np.ndarray, straight: Others, frame: int, own: str, radius_mm: float
) -> tuple[float, str]:
    """How far, mm, the first part of a wire's line (m, 2) in a camera is beside where its base has it, and the whisker
    whose base has its wire nearest to it."""
    lines = {name: line for name in straight if (line := _line(straight[name], frame)) is not None}
    if own not in lines:
        return 0.0, own
    first = wire[1 : 1 + len(wire) // 10]
    off_px = {
        name: float(np.sqrt(np.mean(_away_px(first, line) ** 2)))
        for name, (line, _) in lines.items()
    }
    px_per_mm = lines[own][1] / radius_mm
    return off_px[own] / px_per_mm, min(off_px, key=lambda name: (off_px[name], name != own))


def _lies_on(wires: Mapping[str, np.ndarray], looked, frame: int, name: str) -> bool:
    """Whether most of the wire lies on another's picture in every camera: two wires hide each other in one camera, and
    in all only where they are one."""
    on = []
    for camera, wire in wires.items():
        line = _line(looked.get(camera, {}).get(name), frame)
        on.append(
            line is not None and float(np.mean(_away_px(wire, line[0]) < 2.0 * line[1])) > _MOSTLY
        )
    return bool(on) and all(on)


def _line(lines: RodLines | None, frame: int) -> tuple[np.ndarray, float] | None:
    """Middle (m, 2) and half-width, px, in a frame."""
    there = np.flatnonzero(lines.within(frame)) if lines is not None else ()
    return (lines.middle_px[there[0]], float(lines.half_px[there[0]])) if len(there) else None


def _away_px(points: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Distance (n,) of points (n, 2) from a line (m, 2) of straight parts."""
    start, step = line[:-1], np.diff(line, axis=0)
    share = np.einsum("nmi,mi->nm", points[:, None] - start, step) / np.maximum(
        np.sum(step**2, axis=1), 1e-12
    )
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * step
    return np.min(np.linalg.norm(points[:, None] - nearest, axis=2), axis=1)
