"""The whisker's base as lines in space, a line a frame: what a free stroke tells of where the rig is."""

from dataclasses import dataclass, field

import numpy as np

from vision.geometry.refusals import Refused


@dataclass(frozen=True, eq=False)
class BaseLines:
    """The whisker's straight piece near its base on free strokes, a row a frame, in the rig frame as the board has it.

    motor_rad (n,); point_mm (n, 3) anywhere on the line and its covariance (n, 3, 3), mm²; direction (n, 3), unit, from
    the base outward, and its covariance (n, 3, 3): errors of each frame by itself. shared_covariance (6, 6): of a turn
    w about the base and a shift v, rad and mm, that all lines have in common (light on the wire, lenses). Refused where
    shapes do not fit.
    """

    motor_rad: np.ndarray
    point_mm: np.ndarray
    point_covariance: np.ndarray
    direction: np.ndarray
    direction_covariance: np.ndarray
    shared_covariance: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))

    def __post_init__(self):
        n = len(self.motor_rad)
        vectors, matrices = ("point_mm", "direction"), ("point_covariance", "direction_covariance")
        shapes = (
            dict.fromkeys(vectors, (n, 3))
            | dict.fromkeys(matrices, (n, 3, 3))
            | {"shared_covariance": (6, 6)}
        )
        for name, shape in shapes.items():
            found = np.shape(getattr(self, name))
            if found != shape:
                raise Refused(f"base lines: {name} of {n} frames must be {shape}, found {found}")

    @property
    def width_rad(self) -> float:
        """How far the motor turned over the frames."""
        return float(np.ptp(self.motor_rad)) if len(self.motor_rad) else 0.0
