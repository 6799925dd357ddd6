"""The curves below a film's pictures: slip and force angle over the motor angle."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike

from bench.records.trial_result import SeenWhisk
from bench.report.painting import polyline, put_text

_STRIP_PX = 190  # height of the curves
# Colours, BGR.
_NOW = (28, 26, 228)
_INK = (30, 30, 30)
_GREY = (170, 170, 170)
_GRID = (225, 225, 225)
# [1] A layout: of the reach of a curve, on either side.
_MARGIN = 0.06


@dataclass(frozen=True)
class Limits:
    """Ends of an axis: in the quantity's unit, and the pixels that they have in a panel."""

    low: float
    high: float
    low_px: int
    high_px: int

    @classmethod
    def around(cls, values: np.ndarray, low_px: int, high_px: int) -> "Limits":
        """Return limits that hold all values, with a margin on either side."""
        low = float(values.min())
        high = float(values.max())
        margin = _MARGIN * ((high - low) or abs(high) or 1.0)
        return cls(low - margin, high + margin, low_px, high_px)

    def to_px(self, values: ArrayLike) -> np.ndarray:
        """Return where values lie, px."""
        return np.interp(values, (self.low, self.high), (self.low_px, self.high_px))

    def ticks(self, most: int) -> dict[int, str]:
        """Return round values within the limits, in words, by the pixel where they lie."""
        from matplotlib.ticker import MaxNLocator  # with all of matplotlib

        values = MaxNLocator(most, steps=[1, 2, 5, 10]).tick_values(self.low, self.high)
        within = values[(values >= self.low) & (values <= self.high)]
        return {round(float(self.to_px(value))): f"{value:g}" for value in within}


def with_curves(picture: np.ndarray, whisk: SeenWhisk, k: int) -> np.ndarray:
    """Return the picture with a strip of curves below it: dark up to frame k, grey from there."""
    strip = np.full((_STRIP_PX, picture.shape[1], 3), 255, np.uint8)
    curves = _curves_of(whisk)
    width = strip.shape[1] // len(curves)
    theta_deg = np.degrees(whisk.frames.theta_rad.value)
    for place, (name, values) in enumerate(curves.items()):
        panel = strip[:, place * width : (place + 1) * width]
        _plot(panel, name, theta_deg, values, k)
    whole = np.vstack([picture, strip])
    height, width, _ = whole.shape
    return whole[: height // 2 * 2, : width // 2 * 2]  # coders want even sizes


def _curves_of(whisk: SeenWhisk) -> dict[str, np.ndarray]:
    """Return slip and force angle (frames,) by name and unit, NaN where the whisker does not touch."""
    frames = whisk.frames
    touching = np.asarray(frames.touching, dtype=bool)
    slip_mm = np.where(touching, frames.slip_mm.value, np.nan)
    phi_deg = np.where(touching, np.degrees(frames.phi_rad.value), np.nan)
    return {"slip [mm]": slip_mm, "phi [deg]": phi_deg}


def _plot(panel: np.ndarray, name: str, theta_deg: np.ndarray, values: np.ndarray, k: int) -> None:
    """Draw values over the pushing angle (frames,) into their panel (h, w, 3), up to now, frame k, in ink."""
    height, width, _ = panel.shape
    known = values[np.isfinite(values)]
    x_axis = Limits.around(theta_deg, 56, width - 14)
    y_axis = Limits.around(np.append(known, 0.0), height - 26, 30)
    _draw_grid(panel, x_axis, y_axis)
    points = np.stack([x_axis.to_px(theta_deg), y_axis.to_px(values)], axis=1)
    polyline(panel, points, _GREY)
    polyline(panel, points[: k + 1], _INK)
    now_px = round(points[k, 0])
    cv2.line(panel, (now_px, y_axis.high_px), (now_px, y_axis.low_px), _NOW, 1)
    title = _title(name, theta_deg[k], values[k])
    put_text(panel, title, (x_axis.low_px, 18), _INK)


def _title(name: str, theta_deg: float, value: float) -> str:
    """Return the title of a panel: the value in the frame, if it is known, and the pushing angle."""
    known = f" = {value:.3f}" if np.isfinite(value) else ""
    return f"{name}{known}  at theta = {theta_deg:.2f} deg"


def _draw_grid(panel: np.ndarray, x_axis: Limits, y_axis: Limits) -> None:
    """Draw a line at each tick of the upright axis, and the values of both axes' ticks."""
    for row, value in y_axis.ticks(3).items():
        cv2.line(panel, (x_axis.low_px, row), (x_axis.high_px, row), _GRID, 1)
        put_text(panel, value, (6, row + 4), _INK)
    for column, value in x_axis.ticks(5).items():
        put_text(panel, value, (column - 6, panel.shape[0] - 8), _INK)
