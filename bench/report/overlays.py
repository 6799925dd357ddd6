"""What was found, drawn on its pictures: wire, bar's edges and contact, at touch and at θ, in every camera."""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from bench.base.drawing import is_drawn, save_picture
from bench.records.trial_result import SeenWhisk, TrialResult
from bench.report.painting import as_8_bit, polyline
from bench.session.footage import read_frames
from bench.session.frame_times import frame_times
from bench.session.trial import Trial

_WIRE, _BAR, _CONTACT, _WHITE = (255, 217, 47), (77, 175, 74), (228, 26, 28), (255, 255, 255)
_MOMENTS = {"touch": "at touch", "theta": "at θ"}
_AROUND_PX = 34  # half width of the view that is enlarged
_MARGIN_PX = 70  # of a picture, around the whisker
_PANEL_PX = (800, 450)
_INSET_PX, _EDGE_PX, _CROSS_PX = (
    186,
    12,
    6,
)  # enlarged view, distance from the panel's edges; half of a contact's cross
_GAP_PX, _TITLE_PX, _FONT_PX = 10, 26, 16


def draw_overlays(trial: Trial, result: TrialResult, out: Path, stamp: str) -> list[str]:
    """overlays/<trial>_<whisk>.png of each whisk that was seen; names of the files."""
    names = []
    for whisk in result.seen.whisks:
        if whisk.overlay:
            names.append(f"overlays/{trial.name}_{whisk.whisk}.png")
            if not is_drawn(out / names[-1], stamp):
                save_picture(np.asarray(overlay(trial, whisk)), out / names[-1], stamp)
    return names


def overlay(trial: Trial, whisk: SeenWhisk) -> Image.Image:
    """A row of panels a camera: at touch and at θ."""
    chosen = whisk.overlay
    cameras = list(chosen["touch"].cameras)
    pictures = _pictures(trial, cameras, {chosen[m].frame for m in _MOMENTS})
    (width, height), rows, titles = _PANEL_PX, [], []
    for row, camera in enumerate(cameras):
        panels = [
            _panel(pictures[camera].get(chosen[m].frame), chosen[m].cameras[camera])
            for m in _MOMENTS
        ]
        rows.append(
            np.hstack(
                [
                    np.pad(p, ((_TITLE_PX, _GAP_PX), (0, _GAP_PX), (0, 0)), constant_values=255)
                    for p in panels
                ]
            )
        )
        for column, (moment, said) in enumerate(_MOMENTS.items()):
            frame = chosen[moment].frame
            place = column * (width + _GAP_PX), row * (height + _TITLE_PX + _GAP_PX) + 3
            titles.append((place, f"{camera}, frame {frame}, {said}: {_theta(whisk, frame)}"))
    picture = Image.fromarray(np.vstack(rows))
    for place, title in titles:
        ImageDraw.Draw(picture).text(place, title, fill=(0, 0, 0), font=_font())
    return picture


@lru_cache
def _font() -> ImageFont.FreeTypeFont:
    """Matplotlib's own, which is there wherever figures are drawn."""
    from matplotlib import get_data_path

    return ImageFont.truetype(
        str(Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), _FONT_PX
    )


def _theta(whisk: SeenWhisk, frame: int) -> str:
    (theta_rad,) = whisk.frames.theta_rad.value[whisk.frames.index == frame]
    return f"{np.degrees(theta_rad):+.2f}° past touch"


def _pictures(trial: Trial, cameras, frames: set[int]) -> dict[str, dict[int, np.ndarray]]:
    """Pictures by camera and frame; a camera that dropped a frame lacks it."""
    times, pictures = frame_times(trial), {}
    for camera in cameras:
        index = {frame: int(times.picture[camera][frame]) for frame in frames}
        read = read_frames(trial.camera_sources[camera], [k for k in index.values() if k >= 0])
        pictures[camera] = {frame: read.get(k) for frame, k in index.items()}
    return pictures


def _panel(picture: np.ndarray | None, lines: Mapping[str, np.ndarray]) -> np.ndarray:
    """The picture around the whisker (h, w, 3) with its lines, and the contact enlarged in a corner."""
    width, height = _PANEL_PX
    if picture is None:
        return np.full((height, width, 3), 200, np.uint8)
    grey = as_8_bit(picture)
    corner, scale = _around(grey.shape, lines["wire"])
    panel = _drawn(grey, corner, scale, _PANEL_PX, lines)
    contact = np.asarray(lines["contact"], dtype=float)
    if np.isfinite(contact).all():
        seen = contact - _AROUND_PX
        inset = _drawn(grey, seen, _INSET_PX / (2.0 * _AROUND_PX), (_INSET_PX, _INSET_PX), lines)
        low, high = (
            np.round(scale * (at - corner)).astype(int) for at in (seen, contact + _AROUND_PX)
        )
        cv2.rectangle(panel, low.tolist(), high.tolist(), _WHITE, 1)
        cv2.rectangle(inset, (0, 0), (_INSET_PX - 1, _INSET_PX - 1), _WHITE, 2)
        panel[-_EDGE_PX - _INSET_PX : -_EDGE_PX, -_EDGE_PX - _INSET_PX : -_EDGE_PX] = inset
    return panel


def _drawn(
    grey: np.ndarray, corner_px, scale: float, size_px, lines: Mapping[str, np.ndarray]
) -> np.ndarray:
    """The part of a picture from its pixel corner_px (2,) on, enlarged by scale to size_px, with the lines in it."""
    shift = -scale * np.asarray(corner_px)
    moved = np.array([[scale, 0.0, shift[0]], [0.0, scale, shift[1]]])
    how = cv2.INTER_NEAREST if scale > 1.0 else cv2.INTER_LINEAR
    view = cv2.cvtColor(cv2.warpAffine(grey, moved, size_px, flags=how), cv2.COLOR_GRAY2RGB)
    for name, colour in (("bar_left", _BAR), ("bar_right", _BAR), ("wire", _WIRE)):
        polyline(view, scale * lines[name] + shift, colour)
    at = scale * np.asarray(lines["contact"], dtype=float) + shift
    for way in np.eye(2) * _CROSS_PX:
        polyline(view, np.stack([at - way, at + way]), _CONTACT)
    return view


def _around(shape: tuple[int, ...], wire: np.ndarray) -> tuple[np.ndarray, float]:
    """Corner (2,) of the part that holds the whisker (n, 2), in the panel's shape, and its scale there."""
    finite, panel = wire[np.isfinite(wire).all(axis=1)], np.array(_PANEL_PX, dtype=float)
    middle, size = (
        0.5 * (finite.min(axis=0) + finite.max(axis=0)),
        np.ptp(finite, axis=0) + 2 * _MARGIN_PX,
    )
    scale = float(np.min(panel / size))
    room = np.maximum(np.array(shape[1::-1]) - panel / scale, 0.0)
    return np.clip(middle - 0.5 * panel / scale, 0.0, room), scale
