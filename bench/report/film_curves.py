"""The curves below a film's pictures: slip and force angle as the whisk's figure has them, and a line at the frame."""

from dataclasses import dataclass

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.base.drawing import pixels_of, style
from bench.records.trial_result import SeenWhisk
from bench.report.painting import put_text
from bench.report.planes import draw_curves, force_angle_over_stroke, slip_over_stroke

_HEIGHT_PX = 220
_DPI = 100
# Colours, BGR.
_NOW = (28, 26, 228)
_INK = (30, 30, 30)
_TEXT_PLACE = (12, 16)  # px
_TEXT_SHARE = 0.1  # of the strip's height, above its panels


@dataclass(frozen=True, eq=False)
class CurveStrip:
    """Slip and force angle of a whisk over the pushing angle, drawn once for all of its frames.

    picture (h, w, 3): BGR. now_px (frames, 2): in each panel the column of a frame's pushing angle. rows_px: the
    panels' first and last row.
    """

    whisk: SeenWhisk
    picture: np.ndarray
    now_px: np.ndarray
    rows_px: tuple[int, int]

    @classmethod
    def draw(cls, whisk: SeenWhisk, width_px: int) -> "CurveStrip":
        """Draw the curves of a whisk, so wide."""
        theta_deg = np.degrees(whisk.frames.theta_rad.value)
        with style():
            figure = Figure(figsize=(width_px / _DPI, _HEIGHT_PX / _DPI), layout="constrained")
            figure.get_layout_engine().set(rect=(0.0, 0.0, 1.0, 1.0 - _TEXT_SHARE))
            slip, angle = figure.subplots(1, 2)
            draw_curves(slip, "slip σ  [mm]", slip_over_stroke(whisk))
            draw_curves(angle, "force angle φ  [°]", force_angle_over_stroke(whisk))
            for axes in (slip, angle):
                axes.set(xlim=(theta_deg.min(), theta_deg.max()), xlabel="pushing angle θ  [°]")
            picture = pixels_of(figure, _DPI)[..., ::-1]
        now_px = np.stack([_columns_px(axes, theta_deg) for axes in (slip, angle)], axis=1)
        panel = slip.get_window_extent()
        rows_px = round(len(picture) - panel.y1), round(len(picture) - panel.y0)
        return cls(whisk, picture, now_px, rows_px)

    def below(self, picture: np.ndarray, k: int) -> np.ndarray:
        """Return a picture (h, w, 3) with the curves below it, and a line where frame k is."""
        strip = self.picture.copy()
        for column in self.now_px[k].tolist():
            cv2.line(strip, (column, self.rows_px[0]), (column, self.rows_px[1]), _NOW, 1)
        put_text(strip, _text(self.whisk, k), _TEXT_PLACE, _INK)
        whole = np.vstack([picture, strip])
        height, width, _ = whole.shape
        return whole[: height // 2 * 2, : width // 2 * 2]  # coders want even sizes


def _columns_px(axes: Axes, theta_deg: np.ndarray) -> np.ndarray:
    """Return the columns (n,) of the drawn figure at which pushing angles (n,) lie."""
    places_px = axes.transData.transform(np.column_stack([theta_deg, np.zeros_like(theta_deg)]))
    return np.round(places_px[:, 0]).astype(int)


def _text(whisk: SeenWhisk, k: int) -> str:
    """Return pushing angle, slip and force angle in frame k in words, those that are known."""
    frames = whisk.frames
    text = f"theta = {np.degrees(frames.theta_rad.value[k]):.2f} deg"
    if frames.touching[k] and np.isfinite(frames.slip_mm.value[k]):
        phi_deg = np.degrees(frames.phi_rad.value[k])
        text += f", slip = {frames.slip_mm.value[k]:.3f} mm, phi = {phi_deg:.2f} deg"
    return text
