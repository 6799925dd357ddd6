"""Find the touched object from the pictures of one whisk, before any wire is known.

A bar is found in three stages. First, its edges: a search over all places where the whisker may
touch it gives a few axes whose two edges are strong in all cameras (`vision.touched.find`). Second,
its lines: the pixels about each of these axes say in every camera where the bar's line is and how
clearly it is a bar (`vision.touched.line`); the axis through these lines is computed
(`vision.touched.axis`), and measured once more if it moved. The axis with the highest detection
score over all cameras wins. Third, where not all cameras see it or their planes through it nearly
coincide, each camera is evaluated alone as well, by the bar's width (`vision.touched.one_view`),
and replaces the axis if it scores clearly higher. Rings, spheres and cones have their own searches,
in `vision.touched.rounded_search`. Which search a form of object has is registered below.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np

from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.ring import Ring
from vision.geometry.rods import Bar
from vision.geometry.rounded import Rounded
from vision.geometry.touched import Axis, Touched
from vision.pictures.change import HALF
from vision.pictures.view import View
from vision.touched.axis import settle_axis
from vision.touched.edge_map import EdgeMap, compute_edge_map
from vision.touched.find import find_bars
from vision.touched.line import BarLineEstimate, find_lines, find_lines_farther, measure_bars
from vision.touched.one_view import (
    find_bars_alone,
    see_bar_alone,
    seen_from_one_side,
    widest_angle_rad,
)
from vision.touched.rounded_search import find_by_coverage, find_by_silhouette
from vision.touched.search_scene import SearchScene, still_picture

# [rad] Where the cameras' planes through the bar are nearer to each other than this, a small error
# of one line gives it another slope. Study: bar_scenes.py.
_NARROW_RAD = np.radians(8.0)
# [log] What a camera that shows the place but no edge takes from the score of a hypothesis: bars
# score 5 to 9. Study: bar_scenes.py.
_NO_EDGES = 3.0
# [px] Lines that lie so near to where they were expected are not measured again: half of a quick
# measurement's blur. From 1.5 px the width in one camera moved by 3.8 of its sigma. Study:
# bar_scenes.py.
_CONVERGED_PX = 0.5
# [log] By so much one camera's axis must score higher than one that edges in all cameras led to;
# two measurements about the same axis differ by 0.5. Study: bar_scenes.py.
_CLEARER = 1.0


@dataclass(frozen=True)
class SeenBar:
    """The axis of the touched object, and by camera the bar's lines that it passes through.

    Of a rounded object there are no lines.
    """

    axis: Axis
    lines: Mapping[str, BarLineEstimate]

    @property
    def seen_by(self) -> list[str]:
        """Return the names of the cameras that see a bar there, and its edges."""
        return [name for name, line in self.lines.items() if line.has_edges]

    @property
    def detection_score(self) -> float:
        """Return how clearly all cameras see a bar there: a sum of logs, higher is clearer.

        A camera that shows the place and no edge there counts against it. The evidence is no such
        score: each hypothesis has its own pixels, and a wrong one along something bright in one
        camera has more evidence there than the bar has in both.
        """
        scores = [
            max(line.detection_score, 0.0) if line.has_edges else -_NO_EDGES
            for line in self.lines.values()
        ]
        return sum(scores)

    @property
    def highest_score(self) -> float:
        """Return the detection score that it would have if all cameras saw its edges."""
        return sum(max(line.detection_score, 0.0) for line in self.lines.values())

    @property
    def converged(self) -> bool:
        """Return whether the lines lie where they were expected.

        Another measurement from there would give the same.
        """
        return all(np.all(np.abs(line.line) < _CONVERGED_PX) for line in self.lines.values())


def find_object(scene: SearchScene) -> SeenBar:
    """Find the touched object in the pictures of all frames, before any wire is known.

    Raises Refused where nothing like it is seen.
    """
    return _search(scene.rods.bar, scene)


@singledispatch
def _search(touched: Touched, scene: SearchScene) -> SeenBar:
    """Find an object by the search that its form has."""
    raise NotImplementedError(f"no search for a {touched.name}")


@_search.register
def _search_rounded(touched: Rounded, scene: SearchScene) -> SeenBar:
    """Find an object by its silhouette, as any that is no straight bar."""
    return SeenBar(find_by_silhouette(scene), {})


@_search.register
def _search_ring(touched: Ring, scene: SearchScene) -> SeenBar:
    """Find a ring by what it covers: its edges are too much alike."""
    return SeenBar(find_by_coverage(scene), {})


@_search.register
def _search_bar(touched: Bar, scene: SearchScene) -> SeenBar:
    """Find a straight bar by its two edges."""
    search = BarSearch(scene)
    views = scene.views
    if len(views) == 1:
        return SeenBar(search.axis_of_one_camera(views[0]), {})
    by_all = search.best_by_all_cameras()
    sees_all = len(by_all.seen_by) == len(views)
    if sees_all and widest_angle_rad(scene.cameras, by_all.axis) > _NARROW_RAD:
        return by_all
    return search.measured_finely(search.best_with_single_cameras(by_all))


class BarSearch:
    """The search for a straight bar in one scene, stage by stage, see the module's introduction."""

    def __init__(self, scene: SearchScene):
        """Compute the edge map of every camera."""
        self.scene = scene
        self.edge_maps: dict[str, EdgeMap] = {}
        for view in scene.views:
            self.edge_maps[view.camera.name] = compute_edge_map(
                view.camera,
                still_picture(view),
                view.background[::HALF, ::HALF],
                scene.rods,
                scene.mid_motor_rad,
            )

    def best_by_all_cameras(self) -> SeenBar:
        """Find the bar by the edges in all cameras: that with the highest detection score."""
        scene = self.scene
        axes = find_bars(list(self.edge_maps.values()), scene.rods, scene.motor_range_rad)
        best = self._most_probable([self._measured(axis) for axis in axes])
        # A bar whose rims are dark was found by its highlight: its lines lie farther away.
        farther = find_lines_farther(best.lines)
        there = SeenBar(self._axis_through(best.axis, farther), farther)
        best = max(best, there, key=_detection_score)
        return best if best.converged else self._measured(best.axis)

    def best_with_single_cameras(self, by_all: SeenBar) -> SeenBar:
        """Return the bar by all cameras, or by a single one where that scores clearly higher.

        Where all cameras stand on one side of the bar, the single cameras come first: they alone
        know how far away it is. Raises Refused where no camera sees a bar.
        """
        found = [by_all] if by_all.seen_by else []
        for view in self.scene.views:
            with suppress(Refused):
                alone = self._measured(self.axis_of_one_camera(view))
                if view.camera.name in alone.seen_by:
                    found.append(alone)
        if not found:
            raise Refused(
                f"no {self.scene.rods.bar.label} is seen near the whisker; "
                "record with the bar in view of every camera",
                code="no_bar_seen",
            )
        if len(found) > 1 and seen_from_one_side(self.scene.cameras, found[1].axis):
            found = found[1:]
        first = found[0]
        clearest = max(found, key=_detection_score)
        is_clearer = clearest.detection_score > first.detection_score + _CLEARER
        return clearest if is_clearer else first

    def axis_of_one_camera(self, view: View) -> BarAxis:
        """Compute the axis by one camera alone.

        Raises Refused where its edges do not say how far away it is.
        """
        scene = self.scene
        edges = self.edge_maps[view.camera.name]
        first = find_bars_alone(edges, scene.rods, float(np.mean(scene.motor_rad)))[0]
        wire = scene.rods.wire
        return see_bar_alone(first, view, wire, scene.radius_mm, scene.motor_rad, scene.settings)

    def measured_finely(self, bar: SeenBar) -> SeenBar:
        """Return the bar with its axis through finely measured lines.

        A quick measurement may turn the axis about the line of sight.
        """
        scene = self.scene
        lines = measure_bars(scene.views, bar.axis, scene.radius_mm, scene.wires_px, scene.settings)
        return replace(bar, axis=self._axis_through(bar.axis, lines))

    def _measured(self, axis: BarAxis) -> SeenBar:
        """Measure the lines about an axis quickly, and return the axis through them."""
        scene = self.scene
        lines = find_lines(scene.views, axis, scene.radius_mm, scene.wires_px, scene.settings)
        return SeenBar(self._axis_through(axis, lines), lines)

    def _axis_through(self, axis: BarAxis, lines: Mapping[str, BarLineEstimate]) -> BarAxis:
        """Return the axis through those lines that are a bar's.

        lines: by camera, measured about the axis given.
        """
        bars = {name: line.points for name, line in lines.items() if line.is_bar}
        return settle_axis(axis, self.scene.cameras, bars, self.scene.radius_mm)

    def _most_probable(self, bars: Sequence[SeenBar]) -> SeenBar:
        """Return the bar with the highest detection score after a second measurement.

        Bars that have converged are not measured again, nor those that would score lower than the
        best so far even if all cameras saw their edges.
        """
        best = None
        for bar in sorted(bars, key=lambda one: one.highest_score, reverse=True):
            if best is not None and bar.highest_score <= best.detection_score:
                continue
            again = bar if bar.converged else self._measured(bar.axis)
            if best is None or again.detection_score > best.detection_score:
                best = again
        return best


def _detection_score(bar: SeenBar) -> float:
    """Return a bar's detection score, as a key to compare bars by."""
    return bar.detection_score
