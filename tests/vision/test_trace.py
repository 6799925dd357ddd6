"""Reading the wire's bands."""

import numpy as np

from tests.vision.test_fit import camera
from vision.line import Noise
from vision.scene import Wire
from vision.trace import View, wire_pieces
from vision.wire import centrelines


def test_frames_of_a_wire_that_passes_a_whole_pixel_of_radius_are_read_together():
    """Where the wire comes nearer, its half-width goes from below to above a whole pixel: one band width serves all."""
    view = camera("one", (38, -175, 335))
    wire = Wire("cylinder", 100.0, 1.11)  # 2.95 to 3.05 px
    motor = np.radians(np.linspace(-20.0, 20.0, 9))
    curves = {k: centrelines(np.zeros((2, 4)), np.zeros(2), np.array(60.0), angle, wire)
              for k, angle in enumerate(motor)}
    grey = np.full((720, 1280), 60.0)
    pieces = wire_pieces(View(view, dict.fromkeys(curves, grey), grey, Noise(1.0, 0.0)), curves, wire, 12, 7)
    widest = [pieces.radius_px[pieces.source == k].max() for k in curves]
    assert len(set(np.ceil(widest))) > 1
    assert set(pieces.source) == set(curves)
