"""The cloud of contacts before the object's surface, in two views."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from bench.array.cloud import SEEN, ContactPoint
from bench.array.shape_verdict import FELT
from bench.array.surface import ObjectSurface
from bench.base.drawing import blank, is_drawn, save, style
from bench.base.results import DRAWING, hash_of, hash_of_code
from bench.records.plain import to_plain

_VIEWS = ((0, 2, "x (mm)", "z (mm)"), (0, 1, "x (mm)", "y (mm)"))
# [mm] Of a bar, drawn beyond the contacts. A layout.
_MARGIN_MM = 15.0
# [entries] Of a column of the legend that is as high as the figure. A layout.
_MOST_ENTRIES = 14
_MARKERS = "os^D"

Colour = tuple[float, ...]  # red, green, blue, perhaps opacity


def write_figures(
    out: Path, cloud: Sequence[ContactPoint], surfaces: dict[str, ObjectSurface]
) -> list[str]:
    """Write surface/<trial>.png for each trial with contacts; return their names.

    A figure is drawn again only where its data or the drawing code changed.
    """
    by_trial = {}
    for contact in cloud:
        chosen = by_trial.setdefault(contact.trial, [])
        if contact.estimator in (SEEN, FELT):
            chosen.append(contact)
    code = hash_of_code((*DRAWING, "bench/array"))
    names = []
    for trial, chosen in by_trial.items():
        name = f"surface/{trial}.png"
        surface = surfaces.get(trial)
        stamp = hash_of(code, to_plain(chosen), surface and to_plain(surface))
        if not is_drawn(out / name, stamp):
            with style():
                save(draw(trial, chosen, surface), out / name, stamp)
        names.append(name)
    return names


def draw(trial: str, cloud: Sequence[ContactPoint], surface: ObjectSurface | None) -> Figure:
    """Draw the object from the side and from above, with the contacts before it.

    Felt contacts have their one-sigma ellipses, seen contacts are crosses.
    """
    styles = _point_styles(dict.fromkeys(contact.whisker for contact in cloud))
    columns = -(-len(styles) // _MOST_ENTRIES)  # of the legend
    figure = blank(6.4 + 0.9 * columns, 3.8)
    for axes, view in zip(figure.subplots(1, 2), _VIEWS):
        _draw_view(axes, view, cloud, surface, styles)
    for name, point_style in styles.items():
        axes.plot([], [], point_style.marker, color=point_style.colour, ms=4, label=name)
    figure.legend(
        *axes.get_legend_handles_labels(),
        loc="outside right center",
        title="whisker",
        ncols=columns,
    )
    title = f"{trial}: contacts felt (ellipses: one sigma), seen (crosses), and the object"
    figure.suptitle(title, fontsize=9)
    return figure


@dataclass(frozen=True)
class _PointStyle:
    """How the contacts of a whisker are drawn."""

    colour: Colour
    marker: str


def _point_styles(whiskers: Collection[str]) -> dict[str, _PointStyle]:
    """Return colour and marker of each whisker: neighbours in colour differ in their markers."""
    palette = colormaps["tab10"].colors
    if len(whiskers) > len(palette):
        palette = colormaps["turbo"](np.linspace(0.04, 0.96, len(whiskers)))
    styles = {}
    for number, name in enumerate(whiskers):
        styles[name] = _PointStyle(tuple(palette[number]), _MARKERS[number % len(_MARKERS)])
    return styles


def _draw_view(axes, view, cloud: Sequence[ContactPoint], surface, styles) -> None:
    """Draw object and contacts in the view along two of the rig's axes.

    view: numbers of these axes, then their names. styles: by whisker.
    """
    x, y, x_name, y_name = view
    points = np.array([contact.point_mm for contact in cloud])
    low = points[:, [x, y]].min(axis=0) - _MARGIN_MM
    high = points[:, [x, y]].max(axis=0) + _MARGIN_MM
    if surface is not None:
        object_low, object_high = _draw_object(axes, surface, points, x, y)
        low = np.minimum(low, object_low)
        high = np.maximum(high, object_high)
    for contact in cloud:
        _draw_contact(axes, contact, x, y, styles[contact.whisker])
    axes.set(xlabel=x_name, ylabel=y_name, aspect="equal")
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))


def _draw_contact(axes, contact: ContactPoint, x: int, y: int, point_style: _PointStyle) -> None:
    """Draw a contact in the view along two of the rig's axes."""
    place = contact.point_mm[[x, y]]
    if contact.estimator == SEEN:
        axes.plot(*place, "x", color=point_style.colour, ms=5)
        return
    variances, vectors = np.linalg.eigh(contact.covariance_mm2[np.ix_([x, y], [x, y])])
    width, height = 2.0 * np.sqrt(np.clip(variances, 0.0, None))
    angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
    axes.add_patch(
        Ellipse(place, width, height, angle=angle, facecolor="none", edgecolor=point_style.colour)
    )
    axes.plot(
        *place,
        point_style.marker,
        color=point_style.colour,
        ms=3,
        alpha=0.5 if contact.status else 1.0,
    )


def _draw_object(
    axes, surface: ObjectSurface, points: np.ndarray, x: int, y: int
) -> tuple[np.ndarray, np.ndarray]:
    """Draw the object as discs of its radius about its centreline, of a cone as those of balls that
    just fit in; return the ends (2,), (2,) of what is drawn, mm."""
    heights = (points - surface.point_mm) @ surface.axis
    low = heights.min() - _MARGIN_MM
    high = heights.max() + _MARGIN_MM
    centreline = surface.form.centreline_mm(surface, low, high)
    below_tip = (surface.point_mm - centreline) @ surface.axis
    radii = surface.radius_mm + np.sin(surface.half_angle_rad) * below_tip
    centres = centreline[:, [x, y]]
    for centre, radius in zip(centres, radii):
        axes.add_patch(Ellipse(centre, 2 * radius, 2 * radius, facecolor="0.85", edgecolor="none"))
    return (centres - radii[:, None]).min(axis=0), (centres + radii[:, None]).max(axis=0)
