"""Base lines of a whisker that turns about a hub which stands off by a known step."""

import numpy as np

from vision.geometry.base_lines import BaseLines
from vision.geometry.rotation import exp_rotation

RISE = 0.01
STEP = np.array([0.002, -0.003, 0.004, 0.05, -0.04, 0.03])


def some_lines(width_deg, step=STEP, across_mm=0.0, turn_rad=0.0, frames=30, rng=None):
    """Base lines of a whisker that turns about step's centre and axis; sigmas stated as drawn."""
    rng = rng or np.random.default_rng(0)
    motor = np.radians(np.linspace(-width_deg, 0, frames))
    fan = np.column_stack(
        [np.cos(RISE) * np.cos(motor), np.cos(RISE) * np.sin(motor), np.full(frames, np.sin(RISE))]
    )
    direction = fan @ exp_rotation(step[:3]).T
    point = (
        step[3:]
        + rng.uniform(15, 30, (frames, 1)) * direction
        + across_mm * rng.standard_normal((frames, 3))
    )
    turned = direction + turn_rad * rng.standard_normal((frames, 3))
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    square = np.broadcast_to(np.eye(3), (frames, 3, 3))
    return BaseLines(
        motor, point, max(across_mm, 1e-6) ** 2 * square, turned, max(turn_rad, 1e-8) ** 2 * square
    )
