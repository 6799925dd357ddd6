"""Pieces of a bar that a wire sweeps along: what lies beside the wire is kept."""

from dataclasses import fields

import numpy as np

from vision.touched.pieces import beside_wires
from vision.wire.bands import Pieces


def test_pixels_near_a_wire_weigh_nothing_and_hidden_pieces_are_left_out():
    """Three pieces across a bar along y; a wire along the second's whole width, one beside the middle of the others."""
    rows = np.array([0.0, 30.0, 60.0])
    across = np.tile(np.arange(-20.0, 21.0), (3, 1))
    known = {
        "foot_px": np.column_stack([np.zeros(3), rows]),
        "normal": np.tile([1.0, 0.0], (3, 1)),
        "offset_px": across,
        "weight": np.ones_like(across),
    }
    pieces = Pieces(**{one.name: known.get(one.name, np.zeros(3)) for one in fields(Pieces)})
    along = np.column_stack([np.arange(-30.0, 31.0), np.full(61, 30.0)])
    beside = np.column_stack([np.full(81, 15.0), np.arange(-10.0, 71.0)])
    kept = beside_wires(pieces, [along, beside])
    assert np.array_equal(kept.foot_px[:, 1], [0.0, 60.0])
    assert np.array_equal(kept.weight > 0, np.abs(across[:2] - 15.0) >= 6.0)
