"""Light from one side: seen by the width against the known diameter, corrected from the lit edge, told in a line."""

import numpy as np
import pytest

from tests.studies.accuracy.lines import SCENES, errors, first_look
from vision.fit.blocks import WIRE_OFFSET_PX
from vision.wire.one_sided import SeenWidth, WireAppearance, one_sided_widths, seen_width
from vision.wire.trace import to_points


def looked_at(name, rng):
    """Width seen in one of the drawn scenes, and the mean error of the axis found there over what is stated of it."""
    *_, seen = first_look(SCENES[name], rng, off_px=0.3)
    points, source = to_points(seen)
    stated = np.hypot(np.median(np.linalg.norm(seen.solved.shared_px, axis=1)), WIRE_OFFSET_PX)
    return seen_width(seen.pieces, seen.blur_px), float(
        np.mean(errors(SCENES[name], points, source))
    ) / stated


@pytest.mark.parametrize("name", ["highlight and step", "highlight over printed squares"])
def test_a_rod_seen_whole_is_as_wide_as_it_is(rng, name):
    width, _ = looked_at(name, rng)
    # bins of a quarter of a pixel in all, and 3.3 times the error of the blur, which is some 0.1 px
    assert width.seen_px == pytest.approx(5.6, abs=0.6)
    assert not width.is_one_sided


@pytest.mark.parametrize(
    "name, off_px", [("one lamp, 45°, on dark", -0.82), ("one lamp, 15°, on dark", -1.04)]
)
def test_a_rod_lit_from_one_side_is_seen_narrower_and_its_axis_is_found(rng, name, off_px):
    """What is lit ends at sin 45° (sin 15°) of the radius beyond the axis, so its middle lies off by (1 - that)/2.

    -0.41 and -1.04 px for a sharp end; brightness fades towards it, so what is plainly seen ends earlier. The axis
    comes from the lit edge and the diameter, to what is stated: it lies 0.4 and 0.9 px nearer to what is seen, for a
    side that is just as dark as what is behind it is less probable than none; 1.2 and 1.4 sigma.
    """
    width, sigmas = looked_at(name, rng)
    assert width.is_one_sided
    assert width.off_px < 0.35 * off_px
    assert abs(sigmas) < 2.0


def test_the_report_names_camera_and_width_once():
    narrow, whole = (
        WireAppearance(0.9, SeenWidth(*width)) for width in ((3.1, 5.6, -1.4), (5.5, 5.6, 0.0))
    )
    ((camera, width),) = one_sided_widths([{"high": narrow, "low": whole}, {"high": whole}]).items()
    assert width == narrow.width
    assert width.line(camera).startswith(
        "camera high sees 3.1 of the wire's 5.6 px: light from one side"
    )


def test_light_that_is_not_explained_is_a_doubt():
    width = SeenWidth(5.5, 5.6, 0.0)
    assert not WireAppearance(0.9, width, misfit=5.0).warning("low")
    assert WireAppearance(0.9, width, misfit=10.1).warning("low")
