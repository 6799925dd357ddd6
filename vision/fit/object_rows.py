"""What line points of the touched object mean to a fit: their residuals, and what they show.

Of a straight bar they lie on the middle of its outline or on one of its edges, at places along its
axis. Of any other object they lie on its silhouette: a residual is how far a sight passes outside.
Which of both an object has is registered at the end.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from vision.fit.blocks import BAR_MODES_PX, BAR_OFFSET_PX, Block, columns_of
from vision.fit.problem import BAR_TILT_ARM_MM, Problem, bar_axis, shifts_mm
from vision.geometry.camera import Camera
from vision.geometry.grazing import sights_beside
from vision.geometry.rods import Bar
from vision.geometry.rounded import Rounded
from vision.geometry.silhouette import edges, grazed
from vision.geometry.touched import Touched
from vision.wire.points import LinePoints, Observed

# Residuals (n,) and Jacobian rows (n, size) of some observations, over their sigma.
Part = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class ObjectRows(ABC):
    """The residuals of line points of the touched object in one problem."""

    problem: Problem

    @abstractmethod
    def part(
        self, number: int, group: Sequence[Observed], with_jacobian: bool, vector: np.ndarray
    ) -> Part:
        """Return residuals and Jacobian rows of all line points of one camera."""

    @abstractmethod
    def shown_mm(self, seen: Observed, vector: np.ndarray) -> list[np.ndarray]:
        """Return points (n, 3) that line points are pictures of; several that count alike."""

    @abstractmethod
    def sigmas_px(self, seen: Observed) -> list[list[float]]:
        """Return side and two sigmas of lines that are handed on as such, see `LineNoise`."""

    def moved_alone(
        self, blocks: Sequence[Block], vector: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the columns (k,) of some blocks, and the vector (k + 1, size) as it is and with
        each of them moved.
        """
        columns = columns_of(*blocks)
        moved = np.tile(vector, (len(columns) + 1, 1))
        moved[np.arange(1, len(moved)), columns] += self.problem.blocks.steps[columns]
        return columns, moved


class BarRows(ObjectRows):
    """The residuals of points on the middle or the edges of a straight bar."""

    def part(
        self, number: int, group: Sequence[Observed], with_jacobian: bool, vector: np.ndarray
    ) -> Part:
        """Return residuals and Jacobian rows of one camera's points of the bar."""
        points = joined_points(group)
        side = of_each_point(group, [seen.side for seen in group])
        frame = of_each_point(group, [seen.bar_in for seen in group])
        blocks = self.problem.blocks
        wider = [blocks.reach] if np.any(side) else []
        moved_blocks = [blocks.bar_axis, *wider, blocks.motion] if with_jacobian else []
        columns, moved = self.moved_alone(moved_blocks, vector)
        camera = self.problem.cameras.cameras[number]
        px = self._expected_px(camera, moved, points, side, frame)
        jacobian = np.zeros((len(points), self.problem.size))
        change_px = np.einsum("knj,nj->nk", px[1:] - px[0], points.normal)
        jacobian[:, columns] = change_px / blocks.steps[columns]
        modes = np.stack([np.ones(len(points)), points.place / BAR_TILT_ARM_MM], axis=1)
        return over_sigma(points, px[0], jacobian, blocks.bar_offsets[number], modes, vector)

    def _expected_px(
        self,
        camera: Camera,
        vector: np.ndarray,
        points: LinePoints,
        side: np.ndarray,
        frame: np.ndarray,
    ) -> np.ndarray:
        """Return where the outline's middle or edge (…, n, 2) is expected; of an edge the reach's
        error widens the bar.

        side, frame (n,): of each point, `Observed.side` and, of a bar that moves, the frame in
        which it is seen.
        """
        problem = self.problem
        axis = bar_axis(problem, vector)
        direction = axis.direction[..., None, :]
        middle_mm = axis.point_mm[..., None, :] + points.place[:, None] * direction
        if problem.motion is not None:
            middle_mm = middle_mm + shifts_mm(problem, vector)[..., frame, :]
        shape = middle_mm.shape  # (…, n, 3)
        directions = np.broadcast_to(direction, shape)
        wider_mm = vector[..., problem.blocks.reach.slice] * (side != 0)
        radius_mm = np.broadcast_to(problem.rods.bar.radius_mm + wider_mm, shape[:-1])
        one, other = edges(
            camera, middle_mm.reshape(-1, 3), directions.reshape(-1, 3), radius_mm.ravel()
        )
        one = one.reshape(*shape[:-1], 2)
        other = other.reshape(*shape[:-1], 2)
        half_px = 0.5 * np.abs(np.sum((one - other) * points.normal, axis=-1, keepdims=True))
        return 0.5 * (one + other) + side[:, None] * half_px * points.normal

    def shown_mm(self, seen: Observed, vector: np.ndarray) -> list[np.ndarray]:
        """Return points (n, 3) of the bar's edge that line points show, or of both its edges."""
        problem = self.problem
        axis = bar_axis(problem, vector)
        camera = problem.cameras.cameras[seen.camera]
        middle_mm = axis.point_mm + seen.points.place[:, None] * axis.direction
        middle_mm = middle_mm + shifts_mm(problem, vector)[seen.bar_in]
        directions = np.broadcast_to(axis.direction, middle_mm.shape)
        both_mm = grazed(camera, middle_mm, directions, problem.rods.bar.radius_mm)
        if not seen.side:
            return list(both_mm)
        middle_px = camera.project(middle_mm)
        offsets_px = []
        for edge_mm in both_mm:
            offset_px = camera.project(edge_mm) - middle_px
            offsets_px.append(float(np.sum(offset_px * seen.points.normal)))
        return [both_mm[int(np.argmax(seen.side * np.array(offsets_px)))]]

    def sigmas_px(self, seen: Observed) -> list[list[float]]:
        """Return side and two sigmas of a line of the bar."""
        return [[seen.side, *seen.points.sigma_px]]


class SilhouetteRows(ObjectRows):
    """The residuals of points on the silhouette of an object that is no straight bar."""

    def part(
        self, number: int, group: Sequence[Observed], with_jacobian: bool, vector: np.ndarray
    ) -> Part:
        """Return residuals and Jacobian rows of one camera's silhouette: how far its sights pass
        outside of the object.
        """
        problem = self.problem
        points = joined_points(group)
        blocks = problem.blocks
        moved_blocks = [blocks.bar_axis, blocks.shift_along] if with_jacobian else []
        columns, moved = self.moved_alone(moved_blocks, vector)
        camera = problem.cameras.cameras[number]
        reach = blocks.reach.start
        grazing = sights_beside(camera, bar_axis(problem, moved), points.px, points.place)
        px_per_mm = grazing.px_per_mm(camera, points.normal)
        outside_mm = grazing.outside_mm - problem.rods.bar.radius_mm - vector[reach]
        off_px = px_per_mm * outside_mm  # (copies, n)
        outward = blocks.outline_bias.start + number
        jacobian = np.zeros((len(points), problem.size))
        jacobian[:, columns] = -(off_px[1:] - off_px[0]).T / blocks.steps[columns]
        jacobian[:, reach] = px_per_mm
        jacobian[:, outward] = 1.0
        off_px[0] -= vector[outward]
        px = points.px - off_px[0][:, None] * points.normal
        modes = points.normal * (BAR_OFFSET_PX / BAR_MODES_PX)  # along rows and columns alike
        return over_sigma(points, px, jacobian, blocks.bar_offsets[number], modes, vector)

    def shown_mm(self, seen: Observed, vector: np.ndarray) -> list[np.ndarray]:
        """Return points (n, 3) where sights graze the object."""
        camera = self.problem.cameras.cameras[seen.camera]
        axis = bar_axis(self.problem, vector)
        return [sights_beside(camera, axis, seen.points.px, seen.points.place).points_mm]

    def sigmas_px(self, seen: Observed) -> list[list[float]]:
        """Return none: a silhouette is no line."""
        return []


def object_rows(problem: Problem) -> ObjectRows:
    """Return the residuals of line points that the form of the touched object has."""
    return _rows_class(problem.rods.bar)(problem)


@singledispatch
def _rows_class(touched: Touched) -> type[ObjectRows]:
    """Return the class of an object's residuals."""
    raise NotImplementedError(f"no residuals for a {touched.name}")


@_rows_class.register
def _rows_of_bar(touched: Bar) -> type[ObjectRows]:
    """Return the residuals of a straight bar."""
    return BarRows


@_rows_class.register
def _rows_of_rounded(touched: Rounded) -> type[ObjectRows]:
    """Return the residuals of any other object."""
    return SilhouetteRows


def joined_points(group: Sequence[Observed]) -> LinePoints:
    """Return the line points of all observations of a group."""
    fields = {}
    for name in LinePoints.__dataclass_fields__:
        fields[name] = np.concatenate([getattr(seen.points, name) for seen in group])
    return LinePoints(**fields)


def of_each_point(group: Sequence[Observed], values: Sequence[int]) -> np.ndarray:
    """Return one value of each observation (n,) for each of its points."""
    return np.repeat(values, [len(seen.points) for seen in group])


def over_sigma(
    points: LinePoints,
    px: np.ndarray,
    jacobian: np.ndarray,
    offsets: Block,
    modes: np.ndarray,
    vector: np.ndarray,
) -> Part:
    """Return residuals of points predicted at px (n, 2), and their Jacobian, over sigma.

    modes (n, k): shapes in which the whole line may be off, by the parameters of the block
    `offsets`.
    """
    jacobian[:, offsets.slice] = modes
    residual = np.sum(points.normal * (px - points.px), axis=1) + modes @ vector[offsets.slice]
    return residual / points.sigma_px, jacobian / points.sigma_px[:, None]
