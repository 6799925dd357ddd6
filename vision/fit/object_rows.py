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


@dataclass(frozen=True, eq=False)
class CameraPoints:
    """All line points (n,) of one rod in one camera.

    frame, side, bar_in (n,): of each point, as of its `Observed`.
    """

    camera: int
    points: LinePoints
    frame: np.ndarray
    side: np.ndarray
    bar_in: np.ndarray

    @classmethod
    def joined(cls, camera: int, group: Sequence[Observed]) -> "CameraPoints":
        """Return the line points of all observations of a group in one camera."""
        points = LinePoints.join([seen.points for seen in group])
        values = np.array([[seen.frame, seen.side, seen.bar_in] for seen in group])
        counts = [len(seen.points) for seen in group]
        frame, side, bar_in = np.repeat(values, counts, axis=0).T
        return cls(camera, points, frame, side, bar_in)

    def over_sigma(
        self,
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
        points = self.points
        jacobian[:, offsets.slice] = modes
        residual = np.sum(points.normal * (px - points.px), axis=1) + modes @ vector[offsets.slice]
        return residual / points.sigma_px, jacobian / points.sigma_px[:, None]


@dataclass(frozen=True)
class ObjectRows(ABC):
    """The residuals of line points of the touched object in one problem."""

    problem: Problem

    @abstractmethod
    def part(self, seen: CameraPoints, with_jacobian: bool, vector: np.ndarray) -> Part:
        """Return residuals and Jacobian rows of all line points of one camera."""

    @abstractmethod
    def shown_mm(self, seen: Observed, vector: np.ndarray) -> list[np.ndarray]:
        """Return points (n, 3) that line points are pictures of; several that count alike."""

    @abstractmethod
    def sigmas_px(self, seen: Observed) -> list[list[float]]:
        """Return side and two sigmas of lines that are handed on as such, see `LineNoise`."""

    def camera(self, number: int) -> Camera:
        """Return a camera by its number."""
        return self.problem.cameras.cameras[number]

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

    def jacobian_of(self, columns: np.ndarray, change: np.ndarray) -> np.ndarray:
        """Return derivatives (n, size) by some columns (k,), from changes (k, n) by their steps."""
        jacobian = np.zeros((change.shape[1], self.problem.size))
        jacobian[:, columns] = change.T / self.problem.blocks.steps[columns]
        return jacobian


class BarRows(ObjectRows):
    """The residuals of points on the middle or the edges of a straight bar."""

    def part(self, seen: CameraPoints, with_jacobian: bool, vector: np.ndarray) -> Part:
        """Return residuals and Jacobian rows of one camera's points of the bar."""
        blocks = self.problem.blocks
        varied = []
        if with_jacobian:
            varied = [blocks.bar_axis, blocks.motion]
            if np.any(seen.side):  # edges also move with the bar's width
                varied.append(blocks.reach)
        columns, moved = self.moved_alone(varied, vector)
        px = self._expected_px(moved, seen)
        change_px = np.sum((px[1:] - px[0]) * seen.points.normal, axis=-1)
        jacobian = self.jacobian_of(columns, change_px)
        modes = np.stack([np.ones(len(seen.side)), seen.points.place / BAR_TILT_ARM_MM], axis=1)
        return seen.over_sigma(px[0], jacobian, blocks.bar_offsets[seen.camera], modes, vector)

    def _expected_px(self, vector: np.ndarray, seen: CameraPoints) -> np.ndarray:
        """Return where the outline's middle or edge (…, n, 2) is expected; of an edge the reach's
        error widens the bar.
        """
        problem = self.problem
        axis = bar_axis(problem, vector)
        direction = axis.direction[..., None, :]
        middle_mm = axis.points_at(seen.points.place)
        if problem.motion is not None:
            middle_mm = middle_mm + shifts_mm(problem, vector)[..., seen.bar_in, :]
        wider_mm = vector[..., problem.blocks.reach.slice] * (seen.side != 0)  # (…, n)
        radius_mm = problem.rods.bar.radius_mm + wider_mm
        one, other = edges(self.camera(seen.camera), middle_mm, direction, radius_mm)
        normal = seen.points.normal
        half_px = 0.5 * np.abs(np.sum((one - other) * normal, axis=-1, keepdims=True))
        return 0.5 * (one + other) + seen.side[:, None] * half_px * normal

    def shown_mm(self, seen: Observed, vector: np.ndarray) -> list[np.ndarray]:
        """Return points (n, 3) of the bar's edge that line points show, or of both its edges."""
        problem = self.problem
        axis = bar_axis(problem, vector)
        camera = self.camera(seen.camera)
        middle_mm = axis.points_at(seen.points.place) + shifts_mm(problem, vector)[seen.bar_in]
        both_mm = grazed(camera, middle_mm, axis.direction, problem.rods.bar.radius_mm)
        if not seen.side:
            return list(both_mm)
        from_middle_px = camera.project(np.stack(both_mm)) - camera.project(middle_mm)
        offset_px = np.sum(from_middle_px * seen.points.normal, axis=(1, 2))
        return [both_mm[int(np.argmax(seen.side * offset_px))]]

    def sigmas_px(self, seen: Observed) -> list[list[float]]:
        """Return side and two sigmas of a line of the bar, with what its points have in common
        beyond the prior of lines that are handed on.
        """
        in_common = np.mean(seen.points.shared_px**2, axis=0)[:2] - BAR_MODES_PX**2
        sigma_px = np.sqrt(seen.points.sigma_px**2 + max(float(np.sum(in_common)), 0.0))
        return [[seen.side, *sigma_px]]


class SilhouetteRows(ObjectRows):
    """The residuals of points on the silhouette of an object that is no straight bar."""

    def part(self, seen: CameraPoints, with_jacobian: bool, vector: np.ndarray) -> Part:
        """Return residuals and Jacobian rows of one camera's silhouette: how far its sights pass
        outside of the object.
        """
        points = seen.points
        blocks = self.problem.blocks
        moved_blocks = [blocks.bar_axis, blocks.shift_along] if with_jacobian else []
        columns, moved = self.moved_alone(moved_blocks, vector)
        outside_px, px_per_mm = self._outside_px(moved, seen)
        jacobian = self.jacobian_of(columns, outside_px[0] - outside_px[1:])
        bias = blocks.outline_bias.start + seen.camera
        jacobian[:, blocks.reach.start] = px_per_mm
        jacobian[:, bias] = 1.0
        expected_px = points.px - (outside_px[0] - vector[bias])[:, None] * points.normal
        modes = points.normal * (BAR_OFFSET_PX / BAR_MODES_PX)  # along rows and columns alike
        offsets = blocks.bar_offsets[seen.camera]
        return seen.over_sigma(expected_px, jacobian, offsets, modes, vector)

    def _outside_px(self, vector: np.ndarray, seen: CameraPoints) -> tuple[np.ndarray, np.ndarray]:
        """Return how far (…, n) px points lie outside the silhouette, by parameters (…, size).

        Returns with it px per mm (n,) by which the silhouette moves with the surface.
        """
        camera = self.camera(seen.camera)
        points = seen.points
        axis = bar_axis(self.problem, vector)
        grazing = sights_beside(camera, axis, points.px, points.place)
        px_per_mm = grazing.px_per_mm(camera, points.normal)
        wider_mm = vector[..., self.problem.blocks.reach.slice]
        outside_mm = grazing.outside_mm - self.problem.rods.bar.radius_mm - wider_mm
        return px_per_mm * outside_mm, px_per_mm

    def shown_mm(self, seen: Observed, vector: np.ndarray) -> list[np.ndarray]:
        """Return points (n, 3) where sights graze the object."""
        axis = bar_axis(self.problem, vector)
        points = seen.points
        return [sights_beside(self.camera(seen.camera), axis, points.px, points.place).points_mm]

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
