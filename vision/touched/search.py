"""Find the touched object from the pictures of one whisk, before any wire is known.

A bar is found in three stages. First, its edges: a search over all places where the whisker may
touch it gives a few axes whose two edges are strong in all cameras (`vision.touched.find`). Second,
its lines: the pixels about each of these axes say in every camera where the bar's line is and how
clearly it is a bar (`vision.touched.line`). Any two of these lines, each of another camera, are an
axis (`vision.touched.axis`), so the bar is found even if no axis of the first stage was right in
two cameras. It is measured again until its lines lie where they were expected: only then are
detection scores comparable, for a line that still moves scores high near a bar. All pairs that
could win are measured, and the axis with the highest detection score over all cameras wins. Third,
where no camera sees a bar there, or all of them see it from one side, each camera is evaluated
alone, by the bar's width (`vision.touched.one_view`). Rings, spheres and cones have their own
searches, in `vision.touched.rounded_search`. Which search a form of object has is registered below.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, singledispatch
from itertools import combinations, product
from operator import itemgetter

import numpy as np

from vision.geometry.camera import Camera
from vision.geometry.centreline import resting_lines
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused
from vision.geometry.ring import Ring
from vision.geometry.rods import Bar
from vision.geometry.rounded import Rounded
from vision.geometry.touched import Axis, Touched
from vision.touched.axis import meeting_axis, offset_px, settle_axis
from vision.touched.edge_map import EdgeMap, compute_edge_map
from vision.touched.find import can_touch, find_bars
from vision.touched.line import BarLineEstimate, find_lines
from vision.touched.object_view import ObjectView
from vision.touched.one_view import find_bars_alone, see_bar_alone, seen_from_one_side
from vision.touched.rounded_search import find_by_coverage, find_by_silhouette
from vision.touched.search_scene import SearchScene

# [px] An axis that its lines move by less is not measured again: half of a quick measurement's
# blur. From 1.5 px the width in one camera moved by 3.8 of its sigma. Study: bar_scenes.py.
_CONVERGED_PX = 0.5
# [px] Lines nearer to each other than this are one: half the reach of a quick measurement. Derived.
_SAME_LINE_PX = 1.5
# [log] A bar whose score is so much less than another's is none: two measurements about the same
# axis differ by 0.5. Study: bar_scenes.py.
CLEARER = 1.0
# [passes] Most measurements of one axis: each moves a line by up to 3 px, so all of them by 36 px, more
# than the width of most bars. Derived.
_MOST_PASSES = 12


@dataclass(frozen=True)
class SeenBar:
    """The axis of the touched object, and by camera the bar's lines that it passes through.

    Of a rounded object there are no lines. rivals: axes of other bars that may be the one that is
    touched: as clear ones, or where all cameras stand on one side of it, that by all of them.
    """

    axis: Axis
    lines: Mapping[str, BarLineEstimate]
    rivals: tuple[BarAxis, ...] = ()

    @property
    def seen_by(self) -> list[str]:
        """Return the names of the cameras that see a bar there."""
        return [
            name for name, line in self.lines.items() if line.has_edges or line.joint_score > 0.0
        ]

    @property
    def detection_score(self) -> float:
        """Return how clearly all cameras see a bar there: a sum of logs, higher is clearer.

        The evidence is no such score: each hypothesis has its own pixels, and a wrong one along
        something bright in one camera has more evidence there than the bar has in both.
        """
        return sum(line.joint_score for line in self.lines.values())


def find_object(scene: SearchScene) -> SeenBar:
    """Find the touched object in the pictures of all frames, before any wire is known.

    Raises Refused where nothing like it is seen.
    """
    return _search(scene.rods.bar, scene)


def find_object_again(scene: SearchScene, axis: Axis) -> SeenBar:
    """Find the object where it was before, or search for it where it no longer is.

    axis: where it was. It counts where two cameras or more see a straight bar there, from different
    sides. Raises Refused where nothing like it is seen.
    """
    if isinstance(axis, BarAxis) and isinstance(scene.rods.bar, Bar):
        there = BarSearch(scene).bar_about(axis)
        if there is not None:
            return there
    return find_object(scene)


def find_bars_as_clear_as(scene: SearchScene, score: float) -> list[BarAxis]:
    """Find the axes of all straight bars that cameras see as clearly as a detection score says."""
    return [bar.axis for bar in BarSearch(scene).bars_as_clear_as(score)]


def with_lines(scene: SearchScene, bar: SeenBar) -> SeenBar:
    """Return a straight bar with its lines about its axis, where that is from elsewhere than the search.

    A camera that sees the axis end on, or has it behind it, ends this: the bar stays as it is.
    """
    if not bar.lines and isinstance(bar.axis, BarAxis) and isinstance(scene.rods.bar, Bar):
        with suppress(Refused):
            return replace(bar, lines=find_lines(scene.object_views, bar.axis))
    return bar


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
    """Find a straight bar by its two edges. Raises Refused where no camera sees one."""
    search = BarSearch(scene)
    if len(scene.views) == 1:
        return SeenBar(search.axis_of_one_camera(scene.object_views[0]), {})
    by_all = search.best_by_all_cameras()
    is_seen = bool(by_all.seen_by)
    if is_seen and not seen_from_one_side(scene.cameras, by_all.axis):
        return by_all
    alone = search.bars_of_single_cameras()
    if alone:
        clearest = max(alone, key=_detection_score)
        return replace(clearest, rivals=(by_all.axis,)) if is_seen else clearest
    if is_seen:
        return by_all
    raise Refused(
        f"no {touched.label} is seen near the whisker; record with the bar in view of every camera",
        code="no_bar_seen",
    )


@dataclass
class LineCandidate:
    """A line that may be the bar's in one camera.

    axis: one that passes through it; the search moves it to where the line converges. joint_score:
    as of `BarLineEstimate`, where it was measured first.
    """

    camera: Camera
    axis: BarAxis
    joint_score: float


class BarSearch:
    """The search for a straight bar in one scene, stage by stage, see the module's introduction."""

    def __init__(self, scene: SearchScene):
        self.scene = scene

    @cached_property
    def edge_maps(self) -> dict[str, EdgeMap]:
        """Return the edge map of every camera."""
        scene = self.scene
        edge_maps = {}
        for view in scene.views:
            edges = compute_edge_map(view, scene.rods, scene.mid_motor_rad)
            edge_maps[view.camera.name] = edges
        return edge_maps

    def bar_about(self, axis: BarAxis) -> SeenBar | None:
        """Return the bar that the cameras see about an axis; None where they do not.

        All of them see its edges, and it converges nearby, within a bar's width.
        """
        scene = self.scene
        found: list[SeenBar] = []
        with suppress(Refused):
            self._converge(axis, found)
        for bar in found:
            if len(bar.seen_by) < max(2, len(scene.views)) or not self._is_near(bar.axis, axis):
                continue
            can_be_touched = can_touch(bar.axis, scene.rods, scene.motor_range_rad)
            if can_be_touched and not seen_from_one_side(scene.cameras, bar.axis):
                return bar
        return None

    def _is_near(self, axis: BarAxis, other: BarAxis) -> bool:
        """Return whether every camera sees two axes less than a bar's width apart."""
        for camera in self.scene.cameras:
            _, radius_px = axis.covering_discs(camera, self.scene.radius_mm)
            if not offset_px(camera, axis, other) < 2.0 * np.nanmedian(radius_px):
                return False
        return True

    def best_by_all_cameras(self) -> SeenBar:
        """Find the bar by its lines in all cameras: that with the highest detection score.

        Where no lines converge, the bar is where edges are the strongest, or there without lines.
        """
        found = self._converged_bars()
        if found:
            return _clearest_of(found)
        with suppress(Refused):
            return self._converge(self.strong_axes[0], found)
        return SeenBar(self.strong_axes[0], {})

    def bars_as_clear_as(self, score: float) -> list[SeenBar]:
        """Find all bars whose detection score is within CLEARER of one, or above it."""
        found = self._converged_bars(score)
        return [bar for bar in found if bar.detection_score > score - CLEARER]

    @cached_property
    def strong_axes(self) -> list[BarAxis]:
        """Return the axes whose edges are strong in all cameras, the strongest first."""
        return find_bars(list(self.edge_maps.values()), self.scene)

    def _converged_bars(self, score: float = np.inf) -> list[SeenBar]:
        """Measure pairs of lines until they converge, as long as they could come within CLEARER of the
        best so far, or of a score that is less."""
        scene = self.scene
        found: list[SeenBar] = []
        for highest, one, other in _pairs_of(self._candidates(self.strong_axes)):
            clearest = max(map(_detection_score, found), default=-np.inf)
            if highest < min(clearest, score) - CLEARER:
                break
            axis = meeting_axis(one.camera, one.axis, other.camera, other.axis)
            if can_touch(axis, scene.rods, scene.motor_range_rad):
                with suppress(Refused):  # lines that contradict each other are no bar's
                    one.axis = other.axis = self._converge(axis, found).axis
        return found

    def _candidates(self, axes: Sequence[BarAxis]) -> list["LineCandidate"]:
        """Measure the bar's line about each axis, once where a camera sees two axes as one."""
        scene = self.scene
        candidates: list[LineCandidate] = []
        for axis, view in product(axes, scene.object_views):
            camera = view.camera
            others = [one.axis for one in candidates if one.camera is camera]
            if any(offset_px(camera, axis, other) < _SAME_LINE_PX for other in others):
                continue
            lines: dict[str, BarLineEstimate] = {}
            with suppress(Refused):  # a camera that looks along an axis has no line of it
                lines = find_lines([view], axis)
            for line in lines.values():
                if line.is_bar:
                    through = self._axis_through(axis, {camera.name: line})
                    candidates.append(LineCandidate(camera, through, line.joint_score))
        return candidates

    def _converge(self, axis: BarAxis, found: list[SeenBar]) -> SeenBar:
        """Measure the lines about an axis, and again those that it has left, until it converges.

        Returns the bar, or that of those found before at which it arrives. Adds it to these where
        it has converged.
        """
        lines: dict[str, BarLineEstimate] = {}
        about: dict[str, BarAxis] = {}  # by camera, the axis that its line was measured about
        for _ in range(_MOST_PASSES):
            for before in found:
                if self._is_same(axis, before.axis):
                    return before
            left = [one for one in self.scene.object_views if _has_left(one.camera, axis, about)]
            if not left:
                found.append(SeenBar(axis, lines))
                break
            names = [view.camera.name for view in left]
            about |= dict.fromkeys(names, axis)
            kept = {name: line for name, line in lines.items() if name not in names}
            lines = kept | find_lines(left, axis)
            axis = self._axis_through(axis, lines)
        return SeenBar(axis, lines)

    def _is_same(self, axis: BarAxis, other: BarAxis) -> bool:
        """Return whether every camera sees two axes as one."""
        cameras = self.scene.cameras
        return all(offset_px(camera, axis, other) < _SAME_LINE_PX for camera in cameras)

    def bars_of_single_cameras(self) -> list[SeenBar]:
        """Return the bar by each camera alone that sees one."""
        found = []
        for view in self.scene.object_views:
            with suppress(Refused):
                axis = self.axis_of_one_camera(view)
                lines = find_lines(self.scene.object_views, axis)
                alone = SeenBar(self._axis_through(axis, lines), lines)
                if view.camera.name in alone.seen_by:
                    found.append(alone)
        return found

    def axis_of_one_camera(self, view: ObjectView) -> BarAxis:
        """Compute the axis by one camera alone.

        Raises Refused where its edges do not say how far away it is.
        """
        scene = self.scene
        edges = self.edge_maps[view.camera.name]
        first = find_bars_alone(edges, scene)[0]
        wires_px = resting_lines(view.camera, scene.rods.wire, np.unique(scene.motor_rad))
        return see_bar_alone(first, replace(view, wires_px=wires_px))

    def _axis_through(self, axis: BarAxis, lines: Mapping[str, BarLineEstimate]) -> BarAxis:
        """Return the axis through those lines that are a bar's.

        lines: by camera, measured about the axis given.
        """
        bars = {name: line.points for name, line in lines.items() if line.is_bar}
        return settle_axis(axis, self.scene.cameras, bars, self.scene.radius_mm)


def _detection_score(bar: SeenBar) -> float:
    """Return a bar's detection score, as a key to compare bars by."""
    return bar.detection_score


def _clearest_of(bars: Sequence[SeenBar]) -> SeenBar:
    """Return the bar with the highest detection score, with those that are as clear as its rivals."""
    clearest = max(bars, key=_detection_score)
    least = clearest.detection_score - CLEARER
    rivals = [bar.axis for bar in bars if bar is not clearest and bar.detection_score > least]
    return replace(clearest, rivals=tuple(rivals))


def _pairs_of(
    candidates: Sequence[LineCandidate],
) -> list[tuple[float, LineCandidate, LineCandidate]]:
    """Return each pair of lines of two cameras, with the highest score that its axis may have.

    Any two lines, each of another camera, are one axis. Cameras that have no part in the pair
    count as with their clearest line. The pair with the highest score comes first.
    """
    clearest: dict[str, float] = {}
    for one in candidates:
        name = one.camera.name
        clearest[name] = max(one.joint_score, clearest.get(name, 0.0))
    pairs = []
    for one, other in combinations(candidates, 2):
        if one.camera is not other.camera:
            less = clearest[one.camera.name] + clearest[other.camera.name]
            highest = sum(clearest.values()) - less + one.joint_score + other.joint_score
            pairs.append((highest, one, other))
    return sorted(pairs, key=itemgetter(0), reverse=True)


def _has_left(camera: Camera, axis: BarAxis, about: Mapping[str, BarAxis]) -> bool:
    """Return whether a camera sees an axis elsewhere than that which its line was measured about.

    about: axes by camera, of those in which a line was measured.
    """
    before = about.get(camera.name)
    return before is None or offset_px(camera, axis, before) > _CONVERGED_PX
