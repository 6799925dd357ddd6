"""How another program's points may be meant otherwise than they are read: mirrored, turned, exchanged, in other pixels."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from vision.geometry.camera import Camera
from vision.truth.trace_points import Trace

# What is said of a trace, and its points (n, 2) as they are meant, by columns u, v and the picture's size.
_Meant = Callable[[np.ndarray, np.ndarray, int, int], tuple[np.ndarray, np.ndarray]]
_MISREADINGS: dict[str, _Meant] = {
    "mirrored left to right it is: give it as the pictures are": lambda u, v, w, h: (
        w - 1.0 - u,
        v,
    ),
    "mirrored top to bottom it is: give it as the pictures are": lambda u, v, w, h: (
        u,
        h - 1.0 - v,
    ),
    "turned by half a turn it is: give it as the pictures are": lambda u, v, w, h: (
        w - 1.0 - u,
        h - 1.0 - v,
    ),
    "with u and v exchanged it is: u_px goes to the right, v_px down": lambda u, v, w, h: (v, u),
    "of pictures half as large it is: give it in pixels of these": lambda u, v, w, h: (
        2.0 * u + 0.5,
        2.0 * v + 0.5,
    ),
    "of pictures twice as large it is: give it in pixels of these": lambda u, v, w, h: (
        0.5 * u - 0.25,
        0.5 * v - 0.25,
    ),
}


def misreadings(trace: Trace, camera: Camera) -> Iterator[tuple[str, Trace]]:
    """Yield what may be wrong with a camera's trace, in words, and the trace as it is meant then."""
    width, height = camera.size_px
    for said, meant in _MISREADINGS.items():
        columns = meant(*trace.px.T, width, height)
        yield said, replace(trace, px=np.stack(columns, axis=1))
