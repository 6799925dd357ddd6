"""A block with plain faces, on one of which a print may be."""

from dataclasses import dataclass
from itertools import product

import numpy as np

from bench.rig.light import Light
from bench.rig.plate import Plate, Print
from bench.rig.window import Window

Face = tuple[int, int]  # an axis of a block, and its low (−1) or high (1) end


@dataclass(frozen=True, eq=False)
class Box:
    """A block in the rig frame.

    low_mm, high_mm (3,): its limits on its own axes. axes (3, 3): these, right-handed, as columns.
    origin_mm (3,). is_marked: whether a marker is printed on it.
    """

    low_mm: np.ndarray
    high_mm: np.ndarray
    axes: np.ndarray
    origin_mm: np.ndarray
    reflectance: float
    is_marked: bool = False

    def face(self, face: Face) -> Plate:
        """Return a face, its print outwards."""
        axis, side = face
        across = (axis + 1) % 3
        up = (axis + 2) % 3
        corner = np.where(side > 0, self.high_mm, self.low_mm)
        corner[across] = self.low_mm[across]
        pose = np.column_stack([self.axes[:, [across, up, axis]], self.origin_mm])
        pose[:, 1:3] *= -side
        pose[:, 3] += self.axes @ corner
        width, height = (self.high_mm - self.low_mm)[[across, up]]
        return Plate(Print.plain(width, height, self.reflectance), pose)

    def faces(self) -> dict[Face, Plate]:
        """Return the six faces, prints outwards."""
        return {face: self.face(face) for face in product(range(3), (-1, 1))}

    def corners_mm(self) -> np.ndarray:
        """Return the corners (24, 3) in the rig frame, face by face."""
        return np.concatenate([plate.corners_mm() for plate in self.faces().values()])

    def draw(
        self,
        window: Window,
        radiance: np.ndarray,
        light: Light,
        print_: Print | None,
        printed_on: Face,
    ) -> None:
        """Draw all faces over what is there, and a print centred on one of them."""
        for face, plate in self.faces().items():
            plate.draw(window, radiance, light)
            if print_ is not None and face == printed_on:
                shifted = print_.shift(0.5 * plate.print.x_mm[-1], 0.5 * plate.print.y_mm[-1])
                Plate(shifted, plate.pose).draw(window, radiance, light)
