"""Where the bar is, before any wire is known: looked for by its edges, then by its lines in all cameras."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from vision.geometry.camera import Cameras
from vision.geometry.centreline import resting_lines
from vision.geometry.contact import Axis, BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.rods import Rods
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.change import HALF
from vision.pictures.view import View, median_of
from vision.touched.axis import settle_axis
from vision.touched.find import Clear, clear_edges, find_bars
from vision.touched.line import BarLineEstimate, find_lines, find_lines_farther, measure_bars
from vision.touched.one_view import (
    find_bars_alone,
    see_bar_alone,
    seen_from_one_side,
    widest_angle_rad,
)
from vision.touched.rounded_search import see_rounded

# [rad] Planes through the bar nearer to each other than this have it at another slope as soon as
# one line is a little off. Study: bar_scenes.py.
_NARROW_RAD = np.radians(8.0)
# [log] What a camera that shows the place but no edge takes from a hypothesis: bars are 5 to 9
# clear. Study: bar_scenes.py.
_NO_EDGES = 3.0
# [px] Lines that lay so near to where they were looked for are not looked at again: half of a
# quick look's blur. From 1.5 px the width in one camera moved by 3.8 of its sigma. Study:
# bar_scenes.py.
_STOOD_PX = 0.5
# [log] By so much one camera's axis must be clearer than one that edges in all cameras led to;
# looks at one axis differ by 0.5. Study: bar_scenes.py.
_CLEARER = 1.0
# [lines] Over the stroke: where pieces of the bar may show the wire, too. Set by eye. Study:
# bar_scenes.py.
_WIRES = 8
_NO_BAR = "no bar of diameter {:g} mm is seen near the whisker; record with the bar in view of every camera"
# [frames] More would not make the bar clearer; a wire that moves vanishes. Study: bar_scenes.py.
_MEDIAN_OF = 11


@dataclass(frozen=True)
class SeenBar:
    """An axis and the lines of the bar by which it was settled; of a rounded object none."""

    axis: Axis
    lines: Mapping[str, BarLineEstimate]

    @property
    def seen_by(self) -> list[str]:
        """The cameras that see a bar there, and its edges."""
        return [name for name, line in self.lines.items() if line.has_edges]

    @property
    def clearness(self) -> float:
        """How clearly all cameras see a bar there. Not by the evidence: each hypothesis has its own pixels, and a wrong
        one along something bright in one camera has more evidence there than the bar has in both. A camera that shows
        the place and no edge there speaks against it."""
        return sum(
            max(line.detection_score, 0.0) if line.has_edges else -_NO_EDGES
            for line in self.lines.values()
        )

    @property
    def stood(self) -> bool:
        """Whether the lines lie where they were looked for: another look from there would see the same."""
        return all(np.all(np.abs(line.line) < _STOOD_PX) for line in self.lines.values())

    @property
    def at_best(self) -> float:
        """How clearly, were its edges seen in all of them."""
        return sum(max(line.detection_score, 0.0) for line in self.lines.values())


def see_bar(
    views: Sequence[View],
    cameras: Cameras,
    rods: Rods,
    motor_rad: np.ndarray,
    settings: VisionSettings,
) -> SeenBar:
    """The bar from the pictures of all frames, before any wire is known. Raises Refused where none is seen.

    Of the axes whose edges are clear in all cameras, that whose lines are the best seen in all of them. Where the
    sights of all cameras are nearly the same, or not all see it, each is asked alone, too: by its two edges one camera
    tells roughly how far away a bar is, and finds no other for it.
    """
    if rods.bar.form is not None:
        return SeenBar(see_rounded(views, cameras, rods, motor_rad, settings, _median_picture), {})
    span = float(np.min(motor_rad)), float(np.max(motor_rad))
    clear = [
        clear_edges(
            view.camera, _median_picture(view), view.background[::HALF, ::HALF], rods, sum(span) / 2
        )
        for view in views
    ]
    if len(views) == 1:
        return SeenBar(_alone(views[0], clear[0], rods, motor_rad, settings), {})
    wires = {
        view.camera.name: resting_lines(view.camera, rods.wire, np.linspace(*span, _WIRES))
        for view in views
    }

    def by_lines(axis: BarAxis, lines: Mapping[str, BarLineEstimate]) -> BarAxis:
        bars = {name: line.points for name, line in lines.items() if line.is_bar}
        return settle_axis(axis, cameras, bars, rods.bar.radius_mm)

    def settled(axis: BarAxis) -> SeenBar:
        lines = find_lines(views, axis, rods.bar.radius_mm, wires, settings)
        return SeenBar(by_lines(axis, lines), lines)

    likely = _likeliest((settled(axis) for axis in find_bars(clear, rods, span)), settled)
    lines = find_lines_farther(likely.lines)  # a bar whose rims are dark, found by its highlight
    best = max(likely, SeenBar(by_lines(likely.axis, lines), lines), key=lambda one: one.clearness)
    best = best if best.stood else settled(best.axis)
    if len(best.seen_by) == len(views) and widest_angle_rad(cameras, best.axis) > _NARROW_RAD:
        return best
    found = [best] if best.seen_by else []
    for view, one in zip(views, clear):
        with suppress(Refused):
            seen = settled(_alone(view, one, rods, motor_rad, settings))
            found += [seen] if view.camera.name in seen.seen_by else []
    if not found:
        raise Refused(_NO_BAR.format(2.0 * rods.bar.radius_mm), code="no_bar_seen")
    if len(found) > 1 and seen_from_one_side(cameras, found[1].axis):
        found = found[1:]
    clearer = max(found, key=lambda one: one.clearness)
    chosen = clearer if clearer.clearness > found[0].clearness + _CLEARER else found[0]
    lines = measure_bars(
        views, chosen.axis, rods.bar.radius_mm, wires, settings
    )  # a quick look turns the one sight
    return replace(chosen, axis=by_lines(chosen.axis, lines))


def _likeliest(found: Iterable[SeenBar], settled: Callable[[BarAxis], SeenBar]) -> SeenBar:
    """The clearest when settled once more, where its lines lay elsewhere; what was less clear before, its edges taken
    for seen, is not asked again."""
    best = None
    for one in sorted(found, key=lambda one: one.at_best, reverse=True):
        if best is None or one.at_best > best.clearness:
            again = one if one.stood else settled(one.axis)
            best = max(filter(None, [best, again]), key=lambda one: one.clearness)
    return best


def _alone(view: View, clear: Clear, rods: Rods, motor_rad, settings: VisionSettings) -> BarAxis:
    """The axis as one camera alone sees it. Raises Refused where it sees none, or not how far away it is."""
    first = find_bars_alone(clear, rods, float(np.mean(motor_rad)))[0]
    return see_bar_alone(first, view, rods.wire, rods.bar.radius_mm, motor_rad, settings)


def _median_picture(view: View) -> np.ndarray:
    """Median of some frames at every HALF-th pixel: a wire that moves vanishes. Where rods are known, a mean without
    these: one that rests on the bar vanishes, too."""
    median = median_of(
        [np.ascontiguousarray(picture[::HALF, ::HALF]) for picture in view.some(_MEDIAN_OF)]
    )
    if view.itself is None:
        return median
    mean = view.mean[::HALF, ::HALF]
    return np.where(np.isnan(mean), median, mean)
