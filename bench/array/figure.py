"""The cloud of contacts before the object's surface, in two views."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from bench.array.cloud import SEEN, ContactPoint
from bench.array.surface import ObjectSurface
from bench.base.drawing import blank, is_drawn, save, style
from bench.base.results import DRAWING, hash_of, hash_of_code
from bench.records.plain import to_plain

_FELT = "with_friction"
_VIEWS = ((0, 2, "x (mm)", "z (mm)"), (0, 1, "x (mm)", "y (mm)"))
_MARGIN_MM = 15.0  # mm of the object that are drawn beyond the contacts


def write_figures(
    out: Path, cloud: Sequence[ContactPoint], surfaces: dict[str, ObjectSurface]
) -> list[str]:
    """Write surface/<trial>.png for each trial with contacts; return their names.

    A figure is drawn again only where its data or the drawing code changed.
    """
    by_trial = {}
    for contact in cloud:
        chosen = by_trial.setdefault(contact.trial, [])
        if contact.estimator in (SEEN, _FELT):
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
    figure = blank(7.2, 3.6)
    whiskers = dict.fromkeys(contact.whisker for contact in cloud)
    colours = {name: colormaps["tab20"](k % 20) for k, name in enumerate(whiskers)}
    for axes, view in zip(figure.subplots(1, 2), _VIEWS):
        _draw_view(axes, view, cloud, surface, colours)
    for name, colour in colours.items():
        axes.plot([], [], "o", color=colour, label=name)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right center", title="whisker")
    title = f"{trial}: contacts felt (ellipses: one sigma), seen (crosses), and the object"
    figure.suptitle(title, fontsize=9)
    return figure


def _draw_view(axes, view, cloud: Sequence[ContactPoint], surface, colours) -> None:
    """Draw object and contacts in the view along two of the rig's axes.

    view: numbers of these axes, then their names. colours: by whisker.
    """
    x, y, x_name, y_name = view
    points = np.array([contact.point_mm for contact in cloud])
    if surface is not None:
        _draw_object(axes, surface, points, x, y)
    for contact in cloud:
        _draw_contact(axes, contact, x, y, colours[contact.whisker])
    axes.set(xlabel=x_name, ylabel=y_name, aspect="equal")
    axes.set(xlim=_span(points[:, x]), ylim=_span(points[:, y]))


def _span(values: np.ndarray) -> tuple[float, float]:
    """Return the limits of an axis, mm."""
    return float(values.min()) - _MARGIN_MM, float(values.max()) + _MARGIN_MM


def _draw_contact(axes, contact: ContactPoint, x: int, y: int, colour) -> None:
    """Draw a contact in the view along two of the rig's axes."""
    place = contact.point_mm[[x, y]]
    if contact.estimator == SEEN:
        axes.plot(*place, "x", color=colour, markersize=5)
        return
    variances, vectors = np.linalg.eigh(contact.covariance_mm2[np.ix_([x, y], [x, y])])
    width, height = 2.0 * np.sqrt(np.clip(variances, 0.0, None))
    angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
    axes.add_patch(Ellipse(place, width, height, angle=angle, facecolor="none", edgecolor=colour))
    axes.plot(*place, "o", color=colour, markersize=2, alpha=0.5 if contact.status else 1.0)


def _draw_object(axes, surface: ObjectSurface, points: np.ndarray, x: int, y: int) -> None:
    """Draw the object as discs of its radius about its centreline, of a cone as those of balls that
    just fit in."""
    heights = (points - surface.point_mm) @ surface.axis
    low = heights.min() - 2 * _MARGIN_MM
    high = heights.max() + 2 * _MARGIN_MM
    centreline = surface.form.centreline_mm(surface, low, high)
    below_tip = (surface.point_mm - centreline) @ surface.axis
    radii = surface.radius_mm + np.sin(surface.half_angle_rad) * below_tip
    for centre, radius in zip(centreline[:, [x, y]], radii):
        axes.add_patch(Ellipse(centre, 2 * radius, 2 * radius, facecolor="0.85", edgecolor="none"))
