"""How another program's points may be meant otherwise than they are read: mirrored, turned, exchanged, in other pixels."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from vision.geometry.camera import Camera
from vision.truth.trace_points import Trace


def misreadings(trace: Trace, camera: Camera) -> Iterator[tuple[str, Trace]]:
    """Yield what may be wrong with a camera's trace, in words, and the trace as it is meant then."""
    u, v = trace.px.T
    last_u, last_v = np.subtract(camera.size_px, 1.0)
    from_right = last_u - u
    from_bottom = last_v - v
    meant = {
        "mirrored left to right it is: give it as the pictures are": (from_right, v),
        "mirrored top to bottom it is: give it as the pictures are": (u, from_bottom),
        "turned by half a turn it is: give it as the pictures are": (from_right, from_bottom),
        "with u and v exchanged it is: u_px goes to the right, v_px down": (v, u),
        # the first pixel's middle is 0, its outer edge -0.5
        "of pictures half as large it is: give it in pixels of these": (
            2.0 * u + 0.5,
            2.0 * v + 0.5,
        ),
        "of pictures twice as large it is: give it in pixels of these": (
            0.5 * u - 0.25,
            0.5 * v - 0.25,
        ),
    }
    for said, columns in meant.items():
        yield said, replace(trace, px=np.stack(columns, axis=1))
