"""What cameras are calibrated from: views of the board, and its pose on the rig as it was measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from vision.boards.corners import Corners


@dataclass(frozen=True, eq=False)
class BoardViews:
    """Corners by camera.

    boards: views of the board held before the cameras, a view a frame, empty where the board is not seen; view k of one
    camera may be of the same instant as view k of another. sizes_px: of each camera's pictures. rig: the board standing
    on the rig, absent where there is no picture; trials: the same board in the trials' frames, of cameras that did not
    move. times_s: of each picture in `boards`, None where not recorded.
    """

    boards: Mapping[str, Sequence[Corners]]
    sizes_px: Mapping[str, tuple[int, int]]
    rig: Mapping[str, Corners] = field(default_factory=dict)
    trials: Mapping[str, Sequence[Corners]] = field(default_factory=dict)
    times_s: Mapping[str, Sequence[float]] | None = None

    def without(self, is_held: Sequence[bool] | np.ndarray) -> Self:
        """The same without the views k of the held board with is_held[k]."""
        kept = {
            name: [Corners.none() if out else view for view, out in zip(views, is_held)]
            for name, views in self.boards.items()
        }
        return replace(self, boards=kept)


@dataclass(frozen=True, eq=False)
class MeasuredPose:
    """T_rig_board (3, 4), mm, as it was measured; its sigmas are per axis, of the shift and of a turn about the board's
    origin, and are shared by all cameras. 0: taken as exact."""

    T_rig_board: np.ndarray
    sigma_mm: float = 0.0
    sigma_rad: float = 0.0

    @property
    def is_exact(self) -> bool:
        """Whether nothing is to be learnt of the pose."""
        return self.sigma_mm == 0 and self.sigma_rad == 0
