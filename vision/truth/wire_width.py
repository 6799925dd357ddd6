"""How thick the whisker looks: a length that the manifest states too."""

import numpy as np

from vision.fit.problem import bar_axis, curves_of
from vision.truth.value import Value
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.truth.whisk_truth import clear_pieces, wire_knots
from vision.wire.rod_width import log_width

# [frames] Of which the width is told: the wire is before another background in each. Derived.
_LOOKS = 4
# [px] By so much the half-width may look off by what no model of light and lens has. Study:
# docs/truth.md.
LIGHT_PX = 0.25


def wire_looks(whisk: WhiskPictures, fitted: FittedWhisk) -> dict[str, Value]:
    """How thick the wire looks over how thick it is said to be, by camera, of those that tell."""
    chosen = np.unique(np.linspace(0, len(fitted.frames) - 1, _LOOKS).astype(int)).tolist()
    curves, _ = curves_of(fitted.problem, fitted.state.vector, fitted.state.arcs_mm)
    axis, some = (
        bar_axis(fitted.problem, fitted.state.vector),
        {fitted.frames[k]: curves.one(k) for k in chosen},
    )
    found, knots = {}, wire_knots(whisk.during(list(some)))
    for view in whisk.views:
        name, pieces = view.camera.name, clear_pieces(whisk, view, axis, some)
        width = log_width(pieces, whisk.light[name].blur_px, knots) if len(pieces) else None
        if width is not None:
            factor, half_px = float(np.exp(width[0])), float(np.median(pieces.radius_px))
            found[name] = Value(factor, float(np.hypot(factor * width[1], LIGHT_PX / half_px)))
    return found
