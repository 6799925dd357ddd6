"""The data of a calibration: views of the board, and its measured pose on the rig."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from vision.boards.corners import Corners
from vision.geometry.crop import Crop


@dataclass(frozen=True, eq=False)
class BoardViews:
    """The corners of a board by camera.

    boards: views of the board held before the cameras, a view a frame, empty where the board is not
    seen; view k of one camera may be of the same instant as view k of another. sizes_px: of each
    camera's pictures. rig: the board standing on the rig, absent where there is no picture; trials:
    the same board in the trials' frames, of cameras that did not move. times_s: of each picture in
    `boards`, None where not recorded. crops: of the cameras that are parts of another camera's picture.
    pixel_aspects: fx/fy of cameras, where stated.
    """

    boards: Mapping[str, Sequence[Corners]]
    sizes_px: Mapping[str, tuple[int, int]]
    rig: Mapping[str, Corners] = field(default_factory=dict)
    trials: Mapping[str, Sequence[Corners]] = field(default_factory=dict)
    times_s: Mapping[str, Sequence[float]] | None = None
    crops: Mapping[str, Crop] = field(default_factory=dict)
    pixel_aspects: Mapping[str, float] = field(default_factory=dict)

    def crop(self, name: str) -> Crop:
        """Return the part of a picture that a camera is, the whole of its own where not stated."""
        return self.crops.get(name) or Crop.whole(name, self.sizes_px[name])

    def without(self, is_held: Sequence[bool] | np.ndarray) -> Self:
        """Return these views without the views k of the held board with is_held[k]."""
        kept = {}
        for name, views in self.boards.items():
            kept[name] = [Corners.none() if out else view for view, out in zip(views, is_held)]
        return replace(self, boards=kept)


@dataclass(frozen=True, eq=False)
class MeasuredPose:
    """The measured pose of the board on the rig, T_rig_board (3, 4), mm.

    sigma_mm, sigma_rad: per axis, of the shift and of a rotation about the board's origin, shared
    by all cameras; 0 takes the pose as exact.
    """

    T_rig_board: np.ndarray
    sigma_mm: float = 0.0
    sigma_rad: float = 0.0

    @property
    def is_exact(self) -> bool:
        """Return whether the pose is held instead of fitted."""
        return self.sigma_mm == 0 and self.sigma_rad == 0
