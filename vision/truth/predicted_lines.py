"""Line points of a whisk that is known exactly, as precise as each camera's lines are."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vision.fit.line_noise import LineNoise
from vision.geometry.camera import Camera, Cameras
from vision.geometry.polyline import normals
from vision.geometry.silhouette import outline
from vision.touched.pieces import ARM_MM
from vision.truth.known_whisk import KnownWhisk
from vision.truth.line_source import LineSource
from vision.truth.sight import Sight
from vision.truth.whisk_place import WhiskPlace
from vision.wire.points import LinePoints, Observed
from vision.wire.trace import observed


@dataclass(frozen=True, eq=False)
class PredictedLines(LineSource):
    """The lines of a known whisk, without error, with the sigmas that they would have.

    sights: by camera, what it has in sight. noise: by camera; one without gives no line. The whisk
    is where it is known to be: the place of the pass before only says in which frames.
    """

    known: KnownWhisk
    cameras: Cameras
    sights: Mapping[str, Sight]
    noise: Mapping[str, LineNoise]

    def wire_points(self, place: WhiskPlace, *, last: bool) -> dict[str, list[Observed]]:
        """Return by camera the points of the wire that it has in sight."""
        found = {}
        for number, camera in enumerate(self.cameras):
            noise = self.noise.get(camera.name)
            is_seen = noise is not None and np.isfinite(noise.wire_px)
            points = self._wire_points(camera, number, place, noise.wire_px) if is_seen else []
            found[camera.name] = points
        return found

    def _wire_points(
        self, camera: Camera, number: int, place: WhiskPlace, sigma_px: float
    ) -> list[Observed]:
        """Return one camera's points of the wire, an Observed for each frame that has any."""
        sight = self.sights[camera.name]
        pieces = sight.pieces
        points = LinePoints(
            camera.project(sight.points_mm),
            pieces.normal,
            np.full(len(pieces), sigma_px),
            pieces.place,
        )
        return observed(points, pieces.source, number, list(place.curves))

    def object_points(self, place: WhiskPlace, *, last: bool) -> dict[str, list[Observed]]:
        """Return by camera the lines of the bar, of each the two ends of its middle part."""
        found = {}
        for number, camera in enumerate(self.cameras):
            if camera.name in self.noise:
                sigmas_px = self.noise[camera.name].bar_px
                found[camera.name] = _bar_lines(self.known, camera, number, sigmas_px)
        return found


def _bar_lines(
    known: KnownWhisk, camera: Camera, number: int, sigmas_px: np.ndarray
) -> list[Observed]:
    """Return one camera's lines of the bar. sigmas_px (k, 3): see `LineNoise.bar_px`."""
    axis = known.axis
    place_mm = np.array([-ARM_MM, 0.0, ARM_MM])
    radius_mm = known.rods.bar.radius_mm
    middle_px, half_px = outline(camera, axis.points_at(place_mm), axis.direction, radius_mm)
    is_end = np.array([True, False, True])
    points = LinePoints(middle_px, normals(middle_px), np.ones(3), place_mm)
    ends = points.select(is_end)
    lines = []
    for side, *sigma_px in sigmas_px:
        px = ends.px + side * half_px[is_end, None] * ends.normal
        line = replace(ends, px=px, sigma_px=np.array(sigma_px))
        lines.append(Observed(-1, number, line, int(side)))
    return lines
