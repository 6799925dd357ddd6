"""The cloud of contacts before the object's surface, in two views."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from bench.array.cloud import SEEN, Contact
from bench.array.surface import Surface
from bench.base.drawing import blank, is_drawn, save, style
from bench.base.results import DRAWING, hash_of, hash_of_code
from bench.records.plain import to_plain

_FELT = "with_friction"
_VIEWS = ((0, 2, "x (mm)", "z (mm)"), (0, 1, "x (mm)", "y (mm)"))
_MARGIN_MM = 15.0  # mm of object shown beyond the contacts
_POINTS = 400  # of the object's centreline that are drawn


def write_figures(out: Path, cloud: Sequence[Contact], surfaces: dict[str, Surface]) -> list[str]:
    """surface/<trial>.png, a trial with contacts each, drawn again only where what it shows changed. Their names."""
    names = []
    for trial in dict.fromkeys(contact.trial for contact in cloud):
        mine = [c for c in cloud if c.trial == trial and c.estimator in (SEEN, _FELT)]
        name, surface = f"surface/{trial}.png", surfaces.get(trial)
        stamp = hash_of(
            hash_of_code((*DRAWING, "bench/array")), to_plain(mine), surface and to_plain(surface)
        )
        if not is_drawn(out / name, stamp):
            with style():
                save(figure(trial, mine, surface), out / name, stamp)
        names.append(name)
    return names


def figure(trial: str, cloud: Sequence[Contact], surface: Surface | None) -> Figure:
    """From the side and from above: the object, contacts felt with their one-sigma ellipses, contacts seen as
    crosses."""
    drawn = blank(7.2, 3.6)
    names = dict.fromkeys(contact.whisker for contact in cloud)
    colours = {name: colormaps["tab20"](k % 20) for k, name in enumerate(names)}
    for axes, (x, y, x_name, y_name) in zip(drawn.subplots(1, 2), _VIEWS):
        points = np.array([c.point_mm for c in cloud])
        if surface is not None:
            _draw_object(axes, surface, points, x, y)
        for contact in cloud:
            _draw_contact(axes, contact, x, y, colours[contact.whisker])
        axes.set(
            xlabel=x_name,
            ylabel=y_name,
            aspect="equal",
            xlim=_span(points[:, x]),
            ylim=_span(points[:, y]),
        )
    for name, colour in colours.items():
        axes.plot([], [], "o", color=colour, label=name)
    drawn.legend(*axes.get_legend_handles_labels(), loc="outside right center", title="whisker")
    drawn.suptitle(
        f"{trial}: contacts felt (ellipses: one sigma), seen (crosses), and the object", fontsize=9
    )
    return drawn


def _span(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()) - _MARGIN_MM, float(values.max()) + _MARGIN_MM


def _draw_contact(axes, contact: Contact, x: int, y: int, colour) -> None:
    place = contact.point_mm[[x, y]]
    if contact.estimator == SEEN:
        axes.plot(*place, "x", color=colour, markersize=5)
        return
    values, vectors = np.linalg.eigh(contact.covariance_mm2[np.ix_([x, y], [x, y])])
    width, height = 2.0 * np.sqrt(np.clip(values, 0.0, None))
    angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
    axes.add_patch(Ellipse(place, width, height, angle=angle, facecolor="none", edgecolor=colour))
    axes.plot(*place, "o", color=colour, markersize=2, alpha=0.5 if contact.status else 1.0)


def _draw_object(axes, surface: Surface, points: np.ndarray, x: int, y: int) -> None:
    """As the discs of its radius about its centreline: together they are what is seen of it."""
    centreline = _centreline(surface, points)
    down = (surface.point_mm - centreline) @ surface.axis
    radii = (
        surface.radius_mm + np.sin(surface.half_angle_rad) * down
    )  # of balls that just fit in, of a cone
    for centre, radius in zip(centreline[:, [x, y]], radii):
        axes.add_patch(Ellipse(centre, 2 * radius, 2 * radius, facecolor="0.85", edgecolor="none"))


def _centreline(surface: Surface, points: np.ndarray) -> np.ndarray:
    """Points (n, 3) of the object's centreline about the contacts."""
    if surface.shape == "sphere":
        return surface.point_mm[None]
    if surface.shape == "bar":
        along = (points - surface.point_mm) @ surface.axis
        span = np.linspace(along.min() - 2 * _MARGIN_MM, along.max() + 2 * _MARGIN_MM, _POINTS)
        return surface.point_mm + np.outer(span, surface.axis)
    if surface.shape == "cone":
        down = (surface.point_mm - points) @ surface.axis
        span = np.linspace(0.0, max(down.max(), 0.0) + 2 * _MARGIN_MM, _POINTS)
        return surface.point_mm - np.outer(span, surface.axis)
    first = np.cross(surface.axis, np.eye(3)[np.argmin(np.abs(surface.axis))])
    first /= np.linalg.norm(first)
    second, turn = np.cross(surface.axis, first), np.linspace(0.0, 2 * np.pi, _POINTS)
    circle = np.outer(np.cos(turn), first) + np.outer(np.sin(turn), second)
    return surface.point_mm + surface.ring_radius_mm * circle
