"""Line points of wire and object, traced in the pictures of a whisk."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vision.geometry.optics import known_gamma
from vision.pictures.view import SATURATED, View
from vision.truth.line_source import EarlierWhisk, LineSource
from vision.truth.readers import ObjectReader
from vision.truth.whisk_pictures import WhiskPictures
from vision.truth.whisk_place import WhiskPlace
from vision.wire.bands import Pieces
from vision.wire.one_sided import WireAppearance, seen_width
from vision.wire.points import Observed
from vision.wire.shading import Knots
from vision.wire.trace import (
    NEAR_CLAMP_MM,
    WireTrace,
    clear_of_bar,
    observed,
    to_points,
    trace,
    wire_pieces,
)

# [mm] Between knots of the wire's shading: light and finish are much the same a centimetre
# farther on. Study: thresholds.py truth.traced_lines _WIRE_KNOT_MM ….
_WIRE_KNOT_MM = 12.0
# [px] Beside the wire: three of a lens blur of a pixel. A piece that lacks a pixel within, for
# another whisker's wire, gives no point: of those that lacked some the wire scattered by 0.09 px,
# without them by 0.05. Study: arrays_seen.py.
_EDGE_PX = 3.0
# [px] Wire nearer to the bar's outline is mixed with it by the lens: four blurs. Study:
# thresholds.py truth.traced_lines BESIDE_BAR_PX ….
BESIDE_BAR_PX = 4.0


@dataclass
class TracedLines(LineSource):
    """The lines that a whisk's pictures show.

    reader: reads the object; None where its points are not needed. blur_px: of each camera's
    lens, by the pass before.
    """

    whisk: WhiskPictures
    reader: ObjectReader | None = None
    blur_px: Mapping[str, float] = field(default_factory=dict)

    def begin_as(self, earlier: EarlierWhisk) -> None:
        """Begin with the lens blurs of an earlier whisk, and its lines of the object where it kept them."""
        self.blur_px = earlier.blur_px
        if type(self.reader) is type(earlier.reader):
            self.reader.begin_as(earlier.reader)

    def wire_points(self, place: WhiskPlace, *, last: bool) -> dict[str, list[Observed]]:
        """Return by camera the wire's points. Fills whisk.light with how each camera sees it."""
        found = {}
        for view in self.whisk.views:
            name = view.camera.name
            found[name] = trace_wire(
                self.whisk, view, place, blur_px=self.blur_px.get(name), last=last
            )
        self.blur_px = blurs_px(self.whisk)
        return found

    def object_points(self, place: WhiskPlace, *, last: bool) -> dict[str, list[Observed]]:
        """Return by camera the object's lines. Raises Refused where it is not seen clearly."""
        names = self.whisk.cameras.names
        found = {}
        for name, lines in self.reader.read(place, last=last).items():
            number = names.index(name)
            found[name] = [
                Observed(-1, number, line.points, line.side, line.frame) for line in lines
            ]
        return found


def blurs_px(whisk: WhiskPictures) -> dict[str, float]:
    """Return the lens blur of each camera in which the wire was traced."""
    return {name: light.blur_px for name, light in whisk.light.items()}


def trace_wire(
    whisk: WhiskPictures,
    view: View,
    place: WhiskPlace,
    *,
    blur_px: float | None = None,
    last: bool = True,
) -> list[Observed]:
    """Trace the wire in one of a whisk's cameras near its curves by frame.

    blur_px: of the pass that gave the curves. Fills whisk.light with how the camera sees the wire.
    """
    traced = trace_camera(whisk, view, place, blur_px=blur_px, last=last)
    if traced is None:
        return []
    points, source = to_points(traced)
    number = whisk.cameras.names.index(view.camera.name)
    return observed(points, source, number, list(place.curves))


def trace_camera(
    whisk: WhiskPictures, view: View, place: WhiskPlace, *, blur_px: float | None, last: bool
) -> WireTrace | None:
    """Return the wire's segments brought to where it is; None where there are none.

    Arguments and effect as of `trace_wire`.
    """
    pieces = clear_pieces(whisk, view, place)
    if len(pieces) == 0:
        return None
    optics = view.camera.optics
    traced = trace(pieces, wire_knots(whisk), optics, seen_blur_px=blur_px, last=last)
    width = seen_width(traced.pieces, traced.blur_px)
    misfit = float(np.sqrt(traced.misfit))
    whisk.light[view.camera.name] = WireAppearance(traced.blur_px, width, misfit)
    return traced


def clear_pieces(whisk: WhiskPictures, view: View, place: WhiskPlace) -> Pieces:
    """Return the wire's segments near its curves in one camera, clear of clamp and object, in light
    where the transfer curve is known."""
    settings = whisk.settings
    pieces = wire_pieces(
        view, place.curves, whisk.rods.wire, settings.wire_piece_px, settings.wire_margin_px
    )
    if view.others:
        pieces = pieces.select(pieces.show_rod(_EDGE_PX))
    pieces = pieces.below(SATURATED * view.full_scale)
    discs_px = place.axis.covering_discs(view.camera, place.swept_mm)
    is_clear = clear_of_bar(pieces, discs_px, BESIDE_BAR_PX)
    pieces = pieces.select(is_clear & (pieces.place > NEAR_CLAMP_MM))
    gamma = known_gamma(one.camera.optics for one in whisk.views)
    return pieces.in_light(gamma, view.full_scale)


def wire_knots(whisk: WhiskPictures) -> Knots:
    """Return the knots between which the wire's shading is linear."""
    length_mm = whisk.rods.wire.length_mm
    return Knots.of_turning(np.arange(NEAR_CLAMP_MM, length_mm, _WIRE_KNOT_MM), whisk.motor)
