"""The wire, the bar's edges and the contact drawn on their pictures, at touch and at θ, in every camera."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from bench.base.drawing import is_drawn, save_picture
from bench.records.trial_result import Drawing, SeenWhisk, TrialResult
from bench.report.painting import as_8_bit, polyline
from bench.session.footage import read_frames
from bench.session.frame_times import frame_times
from bench.session.trial import Trial

# Colours, RGB.
_WIRE = (255, 217, 47)
_BAR = (77, 175, 74)
_CONTACT = (228, 26, 28)
_WHITE = (255, 255, 255)
_NO_PICTURE = (200, 200, 200)
_MOMENTS = {"touch": "at touch", "theta": "at θ"}
_AROUND_PX = 34  # half width of the view of the contact that is enlarged
_MARGIN_PX = 70  # of a picture, around the whisker
_PANEL_PX = (800, 450)
_INSET_PX = 186  # width of the enlarged view
_EDGE_PX = 12  # between the enlarged view and the panel's edges
_CROSS_PX = 6  # half width of a contact's cross
_GAP_PX = 10  # between panels
_TITLE_PX = 26
_FONT_PX = 16
_LEGEND_PX = 2 * _TITLE_PX  # below the panels
_LEGEND = ((_WIRE, "wire"), (_BAR, "edges of the bar"), (_CONTACT, "contact"))
_KEY_PX = 28  # length of a line in the legend
_DARK_EDGE = (
    "An edge drawn in the dark lies on the bar: the flank of a lit cylinder that faces away from the light "
    "is as dark as the bench behind it."
)


def draw_overlays(trial: Trial, result: TrialResult, out: Path, stamp: str) -> list[str]:
    """Draw overlays/<trial>_<whisk>.png of each whisk that was seen; return their names."""
    names = []
    for whisk in result.seen.whisks:
        if not whisk.overlay:
            continue
        name = f"overlays/{trial.name}_{whisk.whisk}.png"
        names.append(name)
        if not is_drawn(out / name, stamp):
            save_picture(np.asarray(overlay(trial, whisk)), out / name, stamp)
    return names


def overlay(trial: Trial, whisk: SeenWhisk) -> Image.Image:
    """Draw a row of panels for each camera: at touch and at θ."""
    drawings = {moment: whisk.overlay[moment] for moment in _MOMENTS}
    cameras = list(drawings["touch"].cameras)
    frames = {drawing.frame for drawing in drawings.values()}
    pictures = _pictures(trial, cameras, frames)
    rows = [_row_of_panels(camera, pictures[camera], drawings) for camera in cameras]
    width = rows[0].shape[1]
    below = np.full((_LEGEND_PX, width, 3), 255, np.uint8)
    picture = Image.fromarray(np.vstack([*rows, below]))
    pen = ImageDraw.Draw(picture)
    _write_titles(pen, cameras, drawings, whisk)
    _write_legend(pen, picture.height - _LEGEND_PX)
    return picture


def last_frame(
    pictures: Mapping[str, np.ndarray], lines: Mapping[str, Mapping[str, np.ndarray]]
) -> np.ndarray:
    """Draw a panel for each camera (h, w, 3), one below the other. lines: by camera, of its picture."""
    return np.vstack([_panel(pictures[camera], own) for camera, own in lines.items()])


def _row_of_panels(
    camera: str, pictures: Mapping[int, np.ndarray], drawings: Mapping[str, Drawing]
) -> np.ndarray:
    """Draw a camera's panels side by side, with room for their titles. pictures: by frame."""
    border = ((_TITLE_PX, _GAP_PX), (0, _GAP_PX), (0, 0))
    panels = []
    for drawing in drawings.values():
        panel = _panel(pictures.get(drawing.frame), drawing.cameras[camera])
        panels.append(np.pad(panel, border, constant_values=255))
    return np.hstack(panels)


def _write_legend(pen: ImageDraw.ImageDraw, top: int) -> None:
    """Write from the row `top` on what the colours are, and why an edge may lie in the dark."""
    left = 0
    for colour, name in _LEGEND:
        middle = top + _FONT_PX // 2 + 2
        pen.rectangle((left, middle - 2, left + _KEY_PX, middle + 2), fill=colour)
        left += _KEY_PX + _GAP_PX
        pen.text((left, top), name, fill=(0, 0, 0), font=_font())
        left += round(_font().getlength(name)) + 2 * _GAP_PX
    pen.text((0, top + _TITLE_PX), _DARK_EDGE, fill=(0, 0, 0), font=_font())


def _write_titles(
    pen: ImageDraw.ImageDraw,
    cameras: Sequence[str],
    drawings: Mapping[str, Drawing],
    whisk: SeenWhisk,
) -> None:
    """Write camera, frame and pushing angle above each panel. drawings: by the name of the moment."""
    width, height = _PANEL_PX
    for column, (moment, drawing) in enumerate(drawings.items()):
        left = column * (width + _GAP_PX)
        (theta_rad,) = whisk.frames.theta_rad.value[whisk.frames.index == drawing.frame]
        angle = f"{np.degrees(theta_rad):+.2f}° past touch"
        for row, camera in enumerate(cameras):
            top = row * (height + _TITLE_PX + _GAP_PX) + 3
            title = f"{camera}, frame {drawing.frame}, {_MOMENTS[moment]}: {angle}"
            pen.text((left, top), title, fill=(0, 0, 0), font=_font())


@lru_cache
def _font() -> ImageFont.FreeTypeFont:
    """Return Matplotlib's own font, which is there wherever figures are drawn."""
    from matplotlib import get_data_path

    path = Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(str(path), _FONT_PX)


def _pictures(
    trial: Trial, cameras: Sequence[str], frames: set[int]
) -> dict[str, dict[int, np.ndarray]]:
    """Return the pictures by camera and frame; None where a camera dropped the frame."""
    times = frame_times(trial)
    pictures = {}
    for camera in cameras:
        index = {frame: int(times.picture[camera][frame]) for frame in frames}
        recorded = [k for k in index.values() if k >= 0]
        read = read_frames(trial.camera_sources[camera], recorded)
        pictures[camera] = {frame: read.get(k) for frame, k in index.items()}
    return pictures


def _panel(picture: np.ndarray | None, lines: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the picture around the whisker (h, w, 3) with its lines, the contact enlarged in a corner."""
    width, height = _PANEL_PX
    if picture is None:
        return np.full((height, width, 3), _NO_PICTURE, np.uint8)
    grey = as_8_bit(picture)
    corner, scale = _whisker_view(grey.shape, lines["wire"])
    panel = _draw_view(grey, corner, scale, _PANEL_PX, lines)
    contact = np.asarray(lines["contact"], dtype=float)
    if np.isfinite(contact).all():
        inset = _inset(grey, contact, lines)
        ends = np.stack([contact - _AROUND_PX, contact + _AROUND_PX])
        start, end = np.round(scale * (ends - corner)).astype(int).tolist()
        cv2.rectangle(panel, start, end, _WHITE, 1)
        place = slice(-_EDGE_PX - _INSET_PX, -_EDGE_PX)
        panel[place, place] = inset
    return panel


def _inset(grey: np.ndarray, contact_px: np.ndarray, lines: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the framed view (h, w, 3) of the contact (2,) enlarged, with the lines in it."""
    size = (_INSET_PX, _INSET_PX)
    scale = _INSET_PX / (2.0 * _AROUND_PX)
    inset = _draw_view(grey, contact_px - _AROUND_PX, scale, size, lines)
    cv2.rectangle(inset, (0, 0), (_INSET_PX - 1, _INSET_PX - 1), _WHITE, 2)
    return inset


def _draw_view(
    grey: np.ndarray,
    corner_px: np.ndarray,
    scale: float,
    size_px: tuple[int, int],
    lines: Mapping[str, np.ndarray],
) -> np.ndarray:
    """Draw the part of a picture from its pixel corner_px (2,) on, enlarged to size_px, with the lines in it."""
    shift = -scale * np.asarray(corner_px)
    enlarging = np.array([[scale, 0.0, shift[0]], [0.0, scale, shift[1]]])
    interpolation = cv2.INTER_NEAREST if scale > 1.0 else cv2.INTER_LINEAR
    part = cv2.warpAffine(grey, enlarging, size_px, flags=interpolation)
    view = cv2.cvtColor(part, cv2.COLOR_GRAY2RGB)
    for name, colour in (("bar_left", _BAR), ("bar_right", _BAR), ("wire", _WIRE)):
        polyline(view, scale * lines[name] + shift, colour)
    _draw_cross(view, scale * np.asarray(lines["contact"], dtype=float) + shift)
    return view


def _draw_cross(view: np.ndarray, place_px: np.ndarray) -> None:
    """Draw the contact's cross at a place (2,) of a view."""
    for arm in np.eye(2) * _CROSS_PX:
        polyline(view, np.stack([place_px - arm, place_px + arm]), _CONTACT)


def _whisker_view(shape: tuple[int, ...], wire: np.ndarray) -> tuple[np.ndarray, float]:
    """Return corner (2,) px and scale of the part that holds the whisker (n, 2), in the panel's shape.

    shape: of the picture, which the part does not leave.
    """
    known = wire[np.isfinite(wire).all(axis=1)]
    low = known.min(axis=0)
    high = known.max(axis=0)
    size = high - low + 2 * _MARGIN_PX
    panel = np.array(_PANEL_PX, dtype=float)
    scale = float(np.min(panel / size))
    shown = panel / scale
    picture = np.array(shape[1::-1])
    largest = np.maximum(picture - shown, 0.0)
    return np.clip(0.5 * (low + high) - 0.5 * shown, 0.0, largest), scale
