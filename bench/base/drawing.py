"""Common style and colours of all figures, and files written whole with the hash of their content."""

import io
import re
import struct
import zlib
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

import cv2
import numpy as np
from PIL import Image

from bench.base.atomic import whole_file, write_whole

if TYPE_CHECKING:  # matplotlib is loaded where something is drawn: tables and names go without
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

COLOURS = {
    "no_slip": "#b2182b",
    "with_friction": "#2166ac",
    "frictionless": "#e08214",
    "corrected": "#542788",
    "exact_rod": "#c51b7d",
    "with_friction_fitted": "#67a9cf",
    "with_friction_seen": "#35978f",
    "with_friction_kinetic": "#999999",
    "known_motion": "#1b7837",
}
OTHER_COLOURS = ("#1b7837", "#762a83", "#8c510a", "#01665e")
LABELS = {
    "no_slip": "(2) no slip",
    "with_friction": "(10) with friction",
    "frictionless": "(12) frictionless",
    "corrected": "(10) corrected",
    "exact_rod": "exact rod",
    "with_friction_fitted": "(10), α fitted",
    "with_friction_seen": "(10), α seen",
    "with_friction_kinetic": "(10) at kinetic ends",
    "touch_alone": "touch alone",
    "moment_rate": "rate of the moment",
    "force_and_moment": "force and moment",
    "known_motion": "(10), motion known",
    "both_ways": "there and back",
    "estimator.builtin:printed_17": "(17) as printed",
}
_STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10,
    "axes.titley": 1.0,  # left to find, the title costs an eighth of a plane
    "legend.frameon": False,
    "legend.fontsize": 8,
    "axes.linewidth": 0.8,
    "path.simplify_threshold": 0.01,  # px; by the usual 0.11 a curve on the page is chords
}
_PAPER = {
    **{"font.size": 8, "axes.titlesize": 8, "axes.labelsize": 8, "legend.fontsize": 7},
    **{"xtick.labelsize": 7, "ytick.labelsize": 7, "lines.markersize": 4},
    **{"pdf.fonttype": 42, "svg.fonttype": "path"},  # fonts stand in the file, whole or as outlines
}
_UNDATED = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
    "svg": {"Date": None},
}
_STAMP = "Source"
# Level 2 and no filter of rows: an overlay takes 33 ms of processor and 1.19 MB, by level 3 53 ms and 1.08 MB; by
# Pillow, which tries each row's filters, 89 ms and 1.11 MB. Sensing planes come out smaller, too.
_PNG = (
    cv2.IMWRITE_PNG_COMPRESSION,
    2,
    cv2.IMWRITE_PNG_STRATEGY,
    cv2.IMWRITE_PNG_STRATEGY_DEFAULT,
    cv2.IMWRITE_PNG_FILTER,
    cv2.IMWRITE_PNG_FILTER_NONE,
)
_POINT_SIZE = 4.0  # points: of a whisk in a figure
_HEADER_BYTES = 33  # of a PNG: its signature and what says the size
SLOPES_DEG = np.linspace(0.0, 82.0, 329)  # at which curves over the slope are drawn


def style() -> AbstractContextManager[None]:
    """Return the context in which figures are made."""
    return _context(_STYLE)


def paper_style() -> AbstractContextManager[None]:
    """Return the context in which figures of a journal's column are made."""
    return _context(_STYLE | _PAPER)


def _context(settings: dict) -> AbstractContextManager[None]:
    """Return a context with these settings of Matplotlib."""
    from matplotlib import rc_context

    return rc_context(settings)


def blank(width_in: float, height_in: float) -> "Figure":
    """Return an empty figure of this size."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), layout="constrained")


def add_legend(figure: "Figure", columns: int) -> None:
    """Add a legend of all lines that have a label below the axes of a figure, an entry a label."""
    named = {}
    for axes in figure.axes:
        for line, label in zip(*axes.get_legend_handles_labels()):
            named.setdefault(label, line)
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=columns)


def colour_of(estimator: str, number: int = 0) -> str:
    """Return the colour of an estimator: of a built-in one its own, of another by number."""
    return COLOURS.get(estimator, OTHER_COLOURS[number % len(OTHER_COLOURS)])


def label_of(estimator: str) -> str:
    """Return the name of an estimator in a legend."""
    return LABELS.get(estimator, estimator.partition(":")[2] or estimator)


def nested_size(number: int, count: int, least: float, step: float) -> float:
    """Return the width of a line, or the size of a marker, in points, of one of several that may coincide.

    Those that are drawn first are larger, so that each shows under what lies over it.
    """
    return least + step * (count - 1 - number)


def label_logarithmic(axis: "Axis") -> None:
    """Label a logarithmic axis with plain numbers at 1, 2 and 5."""
    from matplotlib.ticker import LogLocator, StrMethodFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter("")


def whisk_url(trial: str, whisk: int) -> str:
    """Return the link that a drawn point of a whisk carries; the page leads it to the whisk's card."""
    return f"whisk:{quote(trial, safe='')}/{whisk}"


@dataclass(frozen=True)
class PointStyle:
    """How points are drawn, and what the legend says of them."""

    colour: str
    label: str | None = None
    marker: str = "o"
    is_filled: bool = True


def draw_whisks(
    axes: "Axes",
    x: Sequence[float],
    y: Sequence[float],
    sigma: Sequence[float],
    urls: Iterable[str],
    point_style: PointStyle,
) -> None:
    """Draw a point with its error bar for each whisk; each point links to its whisk.

    x, y, sigma (n,): in the units of the axes. urls (n,): see `whisk_url`.
    """
    axes.errorbar(x, y, sigma, fmt="none", ecolor=point_style.colour, elinewidth=1.0, capsize=2.5)
    points = axes.scatter(
        x,
        y,
        s=_POINT_SIZE**2,
        marker=point_style.marker,
        facecolors=point_style.colour if point_style.is_filled else "white",
        edgecolors=point_style.colour,
        linewidths=0.8,
        label=point_style.label,
        zorder=3,
    )
    points.set_urls(list(urls))


def name_stage(figure: "Figure") -> None:
    """Write above a figure that the truth that it shows comes from a stage."""
    figure.suptitle("truth: stage", x=0.99, ha="right", fontsize=7, color="0.35")


def save(figure: "Figure", path: Path, stamp: str, dpi: int = 160) -> None:
    """Write a PNG whole, with the hash of what it shows."""
    save_picture(pixels_of(figure, dpi), path, stamp)


def pixels_of(figure: "Figure", dpi: int) -> np.ndarray:
    """Return a figure as a picture (h, w, 3), red first."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    _lay_out(figure)
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(dpi)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]


def save_picture(picture: np.ndarray, path: Path, stamp: str) -> None:
    """Write a picture (h, w, 3), red first, as a PNG, whole, with the hash of what it shows."""
    _, png = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), _PNG)
    png = png.tobytes()
    write_whole(path, png[:_HEADER_BYTES] + _text_chunk(_STAMP, stamp) + png[_HEADER_BYTES:])


def _text_chunk(name: str, text: str) -> bytes:
    """Return a line of text as PNG holds it: length, kind, name and text, checksum."""
    body = b"tEXt" + f"{name}\0{text}".encode("latin-1")
    return struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))


def _lay_out(figure: "Figure") -> None:
    """Place all axes. Left to `savefig`, everything is drawn twice, its pictures too."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)


def publish(
    figure: "Figure", stem: Path, formats: Sequence[str] = ("png", "svg"), dpi: int = 150
) -> list[Path]:
    """Write <stem>.<format> in each format, whole, and return the paths.

    The same figure gives the same bytes.
    """
    paths = [stem.with_name(f"{stem.name}.{name}") for name in formats]
    _lay_out(figure)
    with _context({"svg.hashsalt": stem.name}):
        for path, name in zip(paths, formats):
            with whole_file(path) as temporary:
                figure.savefig(temporary, dpi=dpi, metadata=_UNDATED[name])
    return paths


def svg_of(figure: "Figure", name: str) -> str:
    """Return a figure as an SVG element that may stand in a page with others.

    name: unique in the page; all ids begin with it. The same figure gives the same text.
    """
    _lay_out(figure)
    buffer = io.StringIO()
    with _context({"svg.hashsalt": name, "svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg", metadata=_UNDATED["svg"])
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    return re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{name}-", text)


def is_drawn(path: Path, stamp: str) -> bool:
    """Return whether the file shows what has this hash."""
    try:
        with Image.open(path) as picture:
            return getattr(picture, "text", {}).get(_STAMP) == stamp
    except OSError:
        return False
