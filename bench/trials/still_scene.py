"""Still scene (board, bench, clamps) of each frame, compared with the rig picture: a camera knocked by
any amount, mirrored or exchanged, a lens cap, an exposure that changed.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bench.base.numbers import first_names
from bench.session.session import Session
from vision.geometry import Reason
from vision.pictures import Likeness, exposures, is_blank, likeness, texture

if TYPE_CHECKING:
    from bench.cameras.session_cameras import SessionCalibration

Pictures = Mapping[int, np.ndarray]
# Twice what sound scenes show, where a lit wire moves through the dark (0.028 in 54 scenes). Five of eleven frames 10 %
# brighter move the slope by 1.4 sigma, 20 % darker by 3.3 (tests/studies/accuracy/faults.py OUT exposure).
_STEADY = 0.05
# A brighter frame is not made good: what is clipped stays so.
_MOST_CORRECTED = 1.25
# Of a darker one only the noise grows; one of 0.79 at touch is as good as the others (path-traced, flickering light).
_LEAST_CORRECTED = 0.6
# what is less is measured by the corners of the rig board, or not told from none
_LEAST_MOVED_PX = 3.0
# times: a picture that shows the scene otherwise does so much more clearly than as it is
_CLEARER = 2.0
_MOST_NAMED = 5  # frames in a line

_FLIPS = {
    "mirrored left to right": np.fliplr,
    "mirrored upside down": np.flipud,
    "turned by 180°": np.flip,
}


@dataclass(frozen=True)
class StillScene:
    """Frames whose still scene is that of the rig picture.

    frames: by camera and index, as evenly exposed as they can be made. left_out: a line on each
    camera that shows another scene. notes: lines on frames that were corrected. unusable: a line on
    each camera with frames that were left out, for they are far brighter or darker than most.
    """

    frames: dict[str, Pictures]
    left_out: dict[str, Reason]
    notes: tuple[str, ...]
    unusable: tuple[Reason, ...] = ()


def still_scene(
    session: Session,
    calibration: "SessionCalibration",
    frames: Mapping[str, Pictures],
    unmoved: Collection[str] = (),
) -> StillScene:
    """Compare a trial's frames with the pictures of the scene without rods.

    unmoved: cameras of which it is known that they stand as they were calibrated.
    """
    # It imports all of the calibration, which `check` does without.
    from bench.cameras.session_cameras import moved_cameras

    kept, left_out, notes, unusable = {}, {}, [], []
    for name, pictures in frames.items():
        fault = "none of its frames can be read"
        if pictures:
            fault = other_scene(name, pictures, calibration.background)
        if fault:
            left_out[name] = Reason("camera_left_out", f"camera {name} was left out: {fault}")
        else:
            kept[name], corrected, lost = evenly_exposed(name, pictures)
            notes += corrected
            unusable += lost
    unknown = {name: pictures for name, pictures in kept.items() if name not in unmoved}
    moved = moved_cameras(session, calibration, unknown)
    return StillScene(kept, left_out | moved, tuple(notes), tuple(unusable))


def other_scene(name: str, pictures: Pictures, background: Mapping[str, np.ndarray | None]) -> str:
    """Return what the frame in the middle shows instead of the rig picture's scene.

    It is '' where it shows that scene, or where nothing decides it.
    """
    picture = pictures[sorted(pictures)[len(pictures) // 2]]
    if is_blank(picture):
        return "its frames show nothing, they are all of one grey; is its cap on, or its exposure far off?"
    rig = background.get(name)
    if rig is None or rig.shape != picture.shape:
        return ""
    label = texture(picture)
    rig_texture = texture(rig)
    as_is = likeness(label, rig_texture)
    if as_is.is_same_scene and as_is.shift_length_px < _LEAST_MOVED_PX:
        return ""
    fault = _moved_sentence(as_is) if as_is.is_same_scene else ""
    for flip, flipped in _FLIPS.items():
        if _is_clearer(likeness(texture(flipped(picture)), rig_texture), as_is):
            fault = f"its frames are {flip}"
    for other, scene in background.items():
        if other == name or scene is None or scene.shape != picture.shape:
            continue
        if _is_clearer(likeness(label, texture(scene)), as_is):
            fault = f"its frames are those of camera {other}"
    return fault


def _is_clearer(found: Likeness, as_is: Likeness) -> bool:
    """Return whether a scene is found, and far more clearly than in the picture as it is."""
    return found.is_same_scene and found.peak > _CLEARER * as_is.peak


def _moved_sentence(found: Likeness) -> str:
    """Return the sentence on a camera that stands elsewhere."""
    x, y = found.shift_px
    return (
        f"the scene lies {x:+.0f}, {y:+.0f} px from where the rig picture has it, so it was moved"
    )


def evenly_exposed(name: str, pictures: Pictures) -> tuple[Pictures, list[str], list[Reason]]:
    """Return the pictures as bright as they are in the median, with lines on those that were not.

    The first lines are on pictures that were corrected, the others on those that were left out, for
    their brightness is too far from that.
    """
    indices = sorted(pictures)
    full_scale = float(np.iinfo(pictures[indices[0]].dtype).max)
    gains = exposures([pictures[k] for k in indices], full_scale)
    corrected, lost = {}, {}
    for k, gain in zip(indices, gains):
        if abs(gain - 1.0) > _STEADY:
            is_usable = _LEAST_CORRECTED < gain < _MOST_CORRECTED
            (corrected if is_usable else lost)[k] = gain
    if not corrected and not lost:
        return pictures, [], []
    even = {}
    for k, grey in pictures.items():
        if k not in lost:
            even[k] = _divided(grey, corrected[k]) if k in corrected else grey
    return (
        even,
        list(_corrected_lines(name, corrected, indices)),
        list(_lost_lines(name, lost, indices)),
    )


def _corrected_lines(
    name: str, corrected: Mapping[int, float], indices: Sequence[int]
) -> Iterator[str]:
    """Yield a line on the frames that were corrected, of those with these indices."""
    if corrected:
        found = _brightness(corrected, len(indices), digits=3)
        yield f"camera {name}: {found}, made good ({_which_frames(corrected, indices)})"


def _lost_lines(name: str, lost: Mapping[int, float], indices: Sequence[int]) -> Iterator[Reason]:
    """Yield a line on the frames that were left out, of those with these indices."""
    if lost:
        found = _brightness(lost, len(indices), digits=2)
        line = f"camera {name}: {found}, left out ({_which_frames(lost, indices)}): fix exposure and gain"
        yield Reason("exposure_changed", line)


def _brightness(gains: Mapping[int, float], count: int, *, digits: int) -> str:
    """Return how many frames are how many times as bright: one number where all are alike."""
    ends = [f"{end:.{digits}f}" for end in (min(gains.values()), max(gains.values()))]
    are = "is" if len(gains) == 1 else "are"
    times = " to ".join(dict.fromkeys(ends))
    return f"{len(gains)} of {count} frames {are} {times} times as bright as most"


def _which_frames(changed: Collection[int], indices: Sequence[int]) -> str:
    """Return the changed frames by number: those from one on, or up to one, or the first of them."""
    frames = sorted(changed)
    if len(frames) > 1:
        if frames == list(indices[-len(frames) :]):
            return f"from frame {frames[0]} on"
        if frames == list(indices[: len(frames)]):
            return f"up to frame {frames[-1]}"
    return f"{'frame' if len(frames) == 1 else 'frames'} {first_names(frames, _MOST_NAMED)}"


def _divided(grey: np.ndarray, gain: float) -> np.ndarray:
    """Return a picture with its brightness divided by a gain, clipped to its type's range."""
    return np.clip(np.rint(grey / gain), 0, np.iinfo(grey.dtype).max).astype(grey.dtype)
