"""Each frame's still scene (board, bench, clamps) against the rig picture: a camera knocked by any amount, mirrored or
exchanged, a lens cap, an exposure that changed."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bench.session.session import Session
from vision.geometry.reasons import Reason
from vision.pictures.scene_match import Likeness, exposures, is_blank, likeness, texture

if TYPE_CHECKING:
    from bench.cameras.session_cameras import SessionCalibration

Pictures = Mapping[int, np.ndarray]
# Twice what sound scenes show, where a lit wire moves through the dark (0.028 in 54 scenes). Five of eleven frames 10 %
# brighter move the slope by 1.4 sigma, 20 % darker by 3.3 (tests/studies/accuracy/faults.py OUT exposure).
_STEADY = 0.05
# A frame whose exposure is further off is not made good: what is clipped or lost in noise stays so.
_MOST_CORRECTED = 1.25
# what is less is measured by the corners of the rig board, or not told from none
_LEAST_MOVED_PX = 3.0
# times: a picture that shows the scene otherwise does so much more clearly than as it is
_CLEARER = 2.0
_MOST_NAMED = 5  # frames in a line

_TURNED = {
    "mirrored left to right": lambda grey: grey[:, ::-1],
    "mirrored upside down": lambda grey: grey[::-1],
    "turned by 180°": lambda grey: grey[::-1, ::-1],
}


@dataclass(frozen=True)
class StillScene:
    """The frames to see by, camera to index to picture, as evenly exposed as they can be made; left_out: a line on each
    camera that shows another scene than the rig picture; notes: what was made good."""

    frames: dict[str, Pictures]
    left_out: dict[str, Reason]
    notes: tuple[str, ...]


def still_scene(
    session: Session, calibration: "SessionCalibration", frames: Mapping[str, Pictures]
) -> StillScene:
    """A trial's frames, held to the pictures of the scene without rods."""
    from bench.cameras.session_cameras import (
        moved_cameras,
    )  # with all of the calibration: `check` does without

    kept, left_out, notes = {}, {}, []
    for name, pictures in frames.items():
        doubt = (
            other_scene(name, pictures, calibration.background)
            if pictures
            else "none of its frames can be read"
        )
        if doubt:
            sentence = f"camera {name} was left out: {doubt}"
            left_out[name] = Reason("camera_left_out", sentence)
        else:
            kept[name], said = evenly_exposed(name, pictures)
            notes += said
    return StillScene(kept, left_out | moved_cameras(session, calibration, kept), tuple(notes))


def other_scene(name: str, pictures: Pictures, background: Mapping[str, np.ndarray | None]) -> str:
    """What the frame in the middle shows in place of the rig picture's scene; '' where it is that scene, or where
    nothing tells."""
    picture = pictures[sorted(pictures)[len(pictures) // 2]]
    if is_blank(picture):
        return "its frames show nothing, they are all of one grey; is its cap on, or its exposure far off?"
    rig = background.get(name)
    if rig is None or rig.shape != picture.shape:
        return ""
    shown = texture(picture)
    as_is = likeness(shown, texture(rig))
    if as_is.is_same_scene and as_is.shift_length_px < _LEAST_MOVED_PX:
        return ""
    said = [as_is_moved(as_is)] if as_is.is_same_scene else []
    others = {
        turn: likeness(texture(change(picture)), texture(rig)) for turn, change in _TURNED.items()
    }
    for turn, found in others.items():
        if found.is_same_scene and found.peak > _CLEARER * as_is.peak:
            said = [f"its frames are {turn}"]
    for other, scene in background.items():
        if other != name and scene is not None and scene.shape == picture.shape:
            found = likeness(shown, texture(scene))
            if found.is_same_scene and found.peak > _CLEARER * as_is.peak:
                said = [f"its frames are those of camera {other}"]
    return said[-1] if said else ""


def as_is_moved(found: Likeness) -> str:
    """On a camera that stands elsewhere."""
    x, y = found.shift_px
    return (
        f"the scene lies {x:+.0f}, {y:+.0f} px from where the rig picture has it, so it was moved"
    )


def evenly_exposed(name: str, pictures: Pictures) -> tuple[Pictures, list[str]]:
    """The pictures as bright as they are in the median, and lines on those that were not."""
    indices = sorted(pictures)
    full_scale = float(np.iinfo(pictures[indices[0]].dtype).max)
    gains = exposures([pictures[k] for k in indices], full_scale)
    off = {k: gain for k, gain in zip(indices, gains) if abs(gain - 1.0) > _STEADY}
    if not off:
        return pictures, []
    lost = [k for k, gain in off.items() if not 1.0 / _MOST_CORRECTED < gain < _MOST_CORRECTED]
    mended = {k: gain for k, gain in off.items() if k not in lost}
    even = {k: _divided(grey, mended.get(k, 1.0)) for k, grey in pictures.items() if k not in lost}
    return even, list(_exposure_lines(name, off, lost, mended, len(indices)))


def _exposure_lines(
    name: str, off: dict, lost: list[int], mended: dict, count: int
) -> Iterator[str]:
    if mended:
        yield f"camera {name}: {_brighter(mended, count, 3)}, made good ({_few(mended)})"
    if lost:
        found = _brighter({k: off[k] for k in lost}, count, 2)
        yield f"camera {name}: {found}, left out ({_few(lost)}): fix exposure and gain"


def _brighter(gains: Mapping[int, float], count: int, digits: int) -> str:
    """How many frames are how many times as bright: one number where all are alike."""
    ends = dict.fromkeys(f"{end(gains.values()):.{digits}f}" for end in (min, max))
    are = "is" if len(gains) == 1 else "are"
    return f"{len(gains)} of {count} frames {are} {' to '.join(ends)} times as bright as most"


def _few(indices: Collection[int]) -> str:
    shown = ", ".join(map(str, list(indices)[:_MOST_NAMED]))
    frames = "frame" if len(indices) == 1 else "frames"
    return f"{frames} {shown}" + (", …" if len(indices) > _MOST_NAMED else "")


def _divided(grey: np.ndarray, gain: float) -> np.ndarray:
    if gain == 1.0:
        return grey
    return np.clip(np.rint(grey / gain), 0, np.iinfo(grey.dtype).max).astype(grey.dtype)
