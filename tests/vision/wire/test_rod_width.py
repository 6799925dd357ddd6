"""How thick a rod looks: told by what lies outside its edges, not by what shines on it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.studies.accuracy.lines import KNOTS, SCENES, first_look
from vision.truth.wire_width import LIGHT_PX
from vision.wire.rod_width import log_width


@pytest.mark.parametrize("name", ["highlight and step", "highlight over printed squares"])
@pytest.mark.parametrize("told", [1.5, 1.0, 0.7])
def test_a_rod_told_too_thick_or_too_thin_looks_as_thick_as_it_is(rng, name, told):
    """Allowed: four times what its light leaves, beside the stated sigma."""
    *_, seen = first_look(SCENES[name], rng, off_px=0.3)
    half_px = np.median(seen.pieces.radius_px)
    pieces = replace(seen.pieces, radius_px=told * seen.pieces.radius_px)
    log, sigma = log_width(pieces, seen.blur_px, KNOTS)
    assert abs(log + np.log(told)) < 4.0 * np.hypot(sigma, LIGHT_PX / half_px)
    assert (log == 0.0) == (told == 1.0)
