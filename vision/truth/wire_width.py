"""The whisker's diameter in the pictures over the stated one, which checks the manifest."""

import numpy as np

from vision.truth.traced_lines import clear_pieces, wire_knots
from vision.truth.value import Value
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.truth.whisk_place import WhiskPlace
from vision.wire.rod_width import log_width

# [frames] From which the width is measured: the wire is before another background in each. Derived.
_FRAMES = 4
# [px] By so much the half-width may look off by what no model of light and lens has. Study:
# docs/truth.md.
LIGHT_PX = 0.25


def wire_widths(whisk: WhiskPictures, fitted: FittedWhisk) -> dict[str, Value]:
    """Return the wire's width over its stated one, by camera; cameras that do not resolve it are
    left out.
    """
    some = fitted.some_curves(_FRAMES)
    place = WhiskPlace(fitted.axis, some, whisk.bar_swept_mm)
    knots = wire_knots(whisk.during(list(some)))
    widths = {}
    for view in whisk.views:
        name = view.camera.name
        pieces = clear_pieces(whisk, view, place)
        if not len(pieces) or name not in whisk.light:
            continue
        log_ratio = log_width(pieces, whisk.light[name].blur_px, knots)
        if log_ratio is None:
            continue
        value, sigma = log_ratio
        ratio = float(np.exp(value))
        light = LIGHT_PX / float(np.median(pieces.radius_px))
        widths[name] = Value(ratio, float(np.hypot(ratio * sigma, light)))
    return widths
