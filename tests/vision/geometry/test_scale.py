"""The bent wire and its contact are the same in every unit of length, for wires of any size and taper."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vision.geometry.centreline import centrelines
from vision.geometry.contact import BarAxis, clearance
from vision.geometry.rods import Wire

# Newton's method ends at rounding of the whisker's length.
SAME = 1e-9


@settings(max_examples=60)
@given(
    length_mm=st.floats(10.0, 500.0),
    diameter_share=st.floats(1e-3, 0.05),
    loss=st.one_of(st.just(0.0), st.just(1.0), st.floats(0.05, 0.95)),
    part=st.floats(0.2, 0.9),
    theta=st.floats(np.radians(0.1), np.radians(30.0)),
    beta=st.floats(-1.2, 1.2),
    psi=st.floats(-0.3, 0.3),
    bow=st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)),
    unit=st.floats(1e-2, 1e2),
)
def test_a_bent_wire_and_where_it_touches_a_bar(
    length_mm, diameter_share, loss, part, theta, beta, psi, bow, unit
):
    """Points, contact and its distance in lengths of the wire."""
    found = []
    for length in (length_mm, length_mm * unit):
        wire = _wire(length, diameter_share * length, loss)
        rest_mm = length * np.array([[0.0, 0.0, bow[0], 0.0], [0.0, 0.0, bow[1], 0.0]])
        bend = theta * np.array([-np.cos(beta), np.sin(beta)])
        contact_mm = part * length
        curve = centrelines(rest_mm, bend, np.array(contact_mm), np.array(theta), wire, 0.1)
        points, _ = curve.at(np.array([contact_mm]))
        direction = np.array([np.sin(psi), np.cos(psi) * np.sin(beta), np.cos(psi) * np.cos(beta)])
        bar = BarAxis(points[0] + 0.03 * length * np.array([0.0, 1.0, 0.0]), direction)
        distance_mm, arc_mm, point_mm = clearance(curve, bar, wire)
        values = [curve.points_mm.ravel(), [distance_mm, arc_mm], point_mm]
        found.append(np.concatenate(values) / length)
    np.testing.assert_allclose(found[1], found[0], rtol=SAME, atol=SAME)


def _wire(length_mm: float, diameter_mm: float, loss: float) -> Wire:
    """Return a wire that loses a share of its diameter up to its tip."""
    if 0.0 < loss < 1.0:
        return Wire("tapered", length_mm, diameter_mm, tip_diameter_mm=(1.0 - loss) * diameter_mm)
    return Wire("cone" if loss else "cylinder", length_mm, diameter_mm)
