"""The whisker's base as lines in space, one per frame of a free stroke, from which the rig is
located.
"""

from dataclasses import dataclass, field

import numpy as np

from vision.geometry.refusals import Refused


@dataclass(frozen=True, eq=False)
class BaseLines:
    """The whisker's straight part near its base on free strokes, one row per frame, in the rig
    frame that the board defines.

    motor_rad (n,).
    point_mm (n, 3): any point on the line; point_covariance (n, 3, 3), mm².
    direction (n, 3): unit, from the base outward; direction_covariance (n, 3, 3). Both covariances
    are of the errors that each frame has by itself.
    shared_covariance (6, 6): of a rotation w about the base and a shift v, rad and mm, that all
    lines have in common (light on the wire).
    point_by_shared, direction_by_shared (n, 3, k): how each line changes with each of k independent
    errors of unit variance (of cameras, and of light that changes as the whisker turns); k = 0 of
    None.
    Raises Refused where shapes do not match.
    """

    motor_rad: np.ndarray
    point_mm: np.ndarray
    point_covariance: np.ndarray
    direction: np.ndarray
    direction_covariance: np.ndarray
    shared_covariance: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    point_by_shared: np.ndarray | None = None
    direction_by_shared: np.ndarray | None = None

    def __post_init__(self):
        """Raise Refused where shapes do not match."""
        n = len(self.motor_rad)
        for name in ("point_by_shared", "direction_by_shared"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.zeros((n, 3, 0)))
        errors = self.point_by_shared.shape[-1]
        shapes = {
            "point_mm": (n, 3),
            "direction": (n, 3),
            "point_covariance": (n, 3, 3),
            "direction_covariance": (n, 3, 3),
            "shared_covariance": (6, 6),
            "point_by_shared": (n, 3, errors),
            "direction_by_shared": (n, 3, errors),
        }
        for name, shape in shapes.items():
            found = np.shape(getattr(self, name))
            if found != shape:
                raise Refused(f"base lines: {name} of {n} frames must be {shape}, found {found}")

    @property
    def width_rad(self) -> float:
        """Return the range of motor angles over the frames; 0 of none."""
        return float(np.ptp(self.motor_rad)) if len(self.motor_rad) else 0.0
