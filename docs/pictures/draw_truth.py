"""seeing.png for docs/truth.md, words.png for docs/glossary.md: what is read of a frame, and how touch is defined.

    python docs/pictures/draw_truth.py

From trial b60_4 of fixtures/small-session, seen through its true cameras.
"""

import sys
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.scenes.recorded import Recorded
from vision.geometry.vision_settings import VisionSettings

HERE = Path(__file__).resolve().parent
SESSION = HERE.parents[1] / "fixtures" / "small-session"
CAMERA, FRAME = "high", 10
LONG_PX = 24
ACROSS_PX = np.arange(-16.0, 16.01, 0.25)
BLUE, ORANGE = "#1f6fb4", "#e07b00"


def normals(line: np.ndarray) -> np.ndarray:
    """Unit normals (n, 2) of a polyline (n, 2)."""
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.column_stack([-along[:, 1], along[:, 0]])


def resampled(line: np.ndarray, step_px: float) -> np.ndarray:
    """A polyline (n, 2) with equal steps."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.column_stack(
        [np.interp(np.arange(0, arc[-1], step_px), arc, axis) for axis in line.T]
    )


def across(picture: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Grey (n, m) of the picture across a line (n, 2), at ACROSS_PX."""
    places = (line[:, None] + ACROSS_PX[:, None] * normals(line)[:, None]).astype(np.float32)
    return cv2.remap(picture.astype(np.float32), places[..., 0], places[..., 1], cv2.INTER_CUBIC)


def draw_frame(axes: Axes, picture: np.ndarray, lines: dict, settings: VisionSettings) -> None:
    """A crop with the wire's band, its pieces, and the bar's rims."""
    wire = np.array(lines["wire"])
    half = 0.5 * 11.0 + settings.wire_margin_px
    axes.imshow(picture, cmap="gray", vmin=0, vmax=picture.max())
    piece = resampled(wire, settings.wire_piece_px)
    side = half * normals(piece)
    for sign in (-1, 1):
        axes.plot(*(piece + sign * side).T, color=BLUE, lw=0.9)
    for a, b in zip(piece - side, piece + side):
        axes.plot(*np.array([a, b]).T, color=BLUE, lw=0.4)
    axes.plot(*piece.T, ".", color=ORANGE, ms=3)
    for rim in ("bar_left", "bar_right"):
        axes.plot(*np.array(lines[rim]).T, color="#2ca02c", lw=1.0)
    axes.plot(*np.array(lines["contact"]), "o", mfc="none", mec="red", ms=9)
    middle = np.array(lines["contact"])
    axes.set(
        xlim=(middle[0] - 190, middle[0] + 130),
        ylim=(middle[1] + 110, middle[1] - 110),
        xticks=[],
        yticks=[],
    )
    axes.set_title(
        "band and pieces of the wire (blue), line points (orange),\nthe bar's rims (green), contact (red)"
    )


def draw_profile(axes: Axes, picture: np.ndarray, background: np.ndarray, line: np.ndarray) -> None:
    """Grey across the wire, two pieces long: the frame, the rig picture, the difference."""
    frame, behind = across(picture, line).mean(axis=0), across(background, line).mean(axis=0)
    axes.plot(ACROSS_PX, frame, color=BLUE, label="frame")
    axes.plot(ACROSS_PX, behind, color="0.5", ls="--", label="rig picture: what is behind")
    axes.plot(
        ACROSS_PX, frame - behind, color=ORANGE, label="difference: the lit cylinder, blurred"
    )
    axes.set(xlabel="across the wire  [px]", ylabel="grey level", title="shading, two pieces long")
    axes.margins(y=0.3)
    axes.legend(fontsize=7, frameon=False, loc="lower left")


def draw_seeing() -> Figure:
    recorded = Recorded(SESSION, "b60_4")
    lines = recorded.see().overlay[FRAME][CAMERA]
    picture, background = recorded.frames[CAMERA][FRAME], recorded.background[CAMERA]
    figure = Figure(figsize=(10, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
    draw_frame(left, picture, lines, VisionSettings())
    wire = resampled(np.array(lines["wire"]), 1.0)
    starts = range(60, len(wire) - LONG_PX, 4)  # beyond the clamp
    evenest = min(
        starts, key=lambda k: np.ptp(across(background, wire[k : k + LONG_PX]).mean(axis=0))
    )
    draw_profile(right, picture, background, wire[evenest : evenest + LONG_PX])
    return figure


def draw_words() -> Figure:
    """The sensing plane from above: rest shape, touch, bend, reach, d_x, θ."""
    figure = Figure(figsize=(8, 2.2), layout="constrained")
    axes = figure.subplots()
    d_x, reach, theta = 65.0, 5.0, np.radians(9.0)
    arc = np.linspace(0, 100, 201)
    axes.plot(arc, 0 * arc, color="0.6", lw=4, label="resting wire at first touch")
    load = np.minimum(arc, d_x)
    bend = -np.tan(theta) * d_x * (3 * d_x * load**2 - load**3) / (2 * d_x**3)
    bend -= np.where(arc > d_x, 1.5 * np.tan(theta) * (arc - d_x), 0.0)
    axes.plot(
        arc * np.cos(theta),
        arc * np.sin(theta) + bend,
        color=BLUE,
        lw=4,
        label="bent wire, pushed by θ",
    )
    unbent = 100 * np.array([[0.0, 0.0], [np.cos(theta), np.sin(theta)]])
    axes.plot(*unbent.T, color=BLUE, lw=0.9, ls="--", label="where it would rest")
    axes.add_patch(Circle((d_x, reach), 3.6, color="#2ca02c", alpha=0.6))
    axes.annotate("", (d_x, reach), (d_x, 0), arrowprops={"arrowstyle": "<->", "lw": 1.0})
    axes.text(d_x + 4.5, reach - 1.5, "bar; reach = both radii", fontsize=8, va="top")
    axes.annotate("", (0, -4), (d_x, -4), arrowprops={"arrowstyle": "<->", "lw": 1.0})
    axes.text(
        d_x / 2, -4.6, "d_x: base to contact at first touch", ha="center", va="top", fontsize=8
    )
    end = np.array([95 * np.cos(theta), 95 * np.sin(theta)])
    axes.annotate(
        "",
        end,
        (95 * np.cos(theta), np.interp(95, arc, arc * np.sin(theta) + bend)),
        arrowprops={"arrowstyle": "<->", "lw": 0.9, "color": "0.3"},
    )
    axes.text(end[0] + 1.5, 0.6 * end[1], "bend", fontsize=8)
    turn = np.linspace(0, theta, 20)
    axes.plot(30 * np.cos(turn), 30 * np.sin(turn), "k", lw=0.9)
    axes.text(31, 1.6, "θ", fontsize=9)
    axes.plot(0, 0, "ks")
    axes.text(-1, 2.2, "base", ha="center", fontsize=8)
    axes.set(aspect="equal", xlim=(-4, 108), ylim=(-8, 17))
    axes.axis("off")
    axes.legend(fontsize=7, frameon=False, loc="upper left", bbox_to_anchor=(0.08, 1.0))
    return figure


def main() -> None:
    for name, figure in (("seeing", draw_seeing()), ("words", draw_words())):
        figure.savefig(HERE / f"{name}.png", dpi=110)


if __name__ == "__main__":
    main()
