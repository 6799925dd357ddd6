"""Places for cameras that a RIG.toml does not place: those from which d_x is known best, found by trying."""

import itertools
from collections.abc import Sequence

import msgspec
import numpy as np

from bench.base.errors import BadInput
from bench.plan.expected import expected
from bench.plan.painted import Clamp
from bench.plan.planned_cameras import seen_camera
from bench.plan.staged import Staged
from bench.plan.tries import USUAL, direction_of
from bench.rig import build
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import CameraTable
from vision.geometry.camera import Camera, Cameras

# From where cameras look, azimuth (0: beyond the tip; -90: from the side that the whisker comes from), elevation.
_AZIMUTHS_DEG, _ELEVATIONS_DEG = (-130.0, -90.0, -50.0, 60.0, 120.0), (25.0, 60.0)
_FILLS = 0.7  # of the picture's width, by a whisker seen across
_TRIALS = 2  # of the protocol, first to last, that places are judged by
_LEAST_TO_BAR_RAD = np.radians(25.0)  # a camera along the bar does not see it


def place_cameras(protocol: Protocol, staged: Sequence[Staged], target_mm: np.ndarray) -> Protocol:
    """The protocol with a place for every camera. Raises BadInput where no place gives any trial a truth."""
    if all(camera.position_mm is not None for camera in protocol.cameras):
        return protocol
    chosen = [staged[int(k)] for k in np.unique(np.linspace(0, len(staged) - 1, _TRIALS).round())]
    options = [_options(table, protocol, chosen, target_mm) for table in protocol.cameras]
    ways = [
        one
        for one in itertools.product(*options)
        if _differ(one) and _first_of_its_kind(one, protocol)
    ]
    best = min(ways, key=lambda tables: _largest_sigma(protocol, tables, chosen), default=None)
    if best is None or not np.isfinite(_largest_sigma(protocol, best, chosen)):
        found = "no place tried for the cameras without position_mm gives a truth; give them places, or other lenses"
        raise BadInput(found)
    return msgspec.structs.replace(protocol, cameras=list(best))


def _options(
    table: CameraTable, protocol: Protocol, staged: Sequence[Staged], target_mm
) -> list[CameraTable]:
    """A camera at each place from which it would see every bar from its side."""
    if table.position_mm is not None:
        return [table]
    distance = table.focal * protocol.whisker.length_mm / (_FILLS * table.size_px[0])
    ways = [direction_of(*angles) for angles in itertools.product(_AZIMUTHS_DEG, _ELEVATIONS_DEG)]
    able = [way for way in ways if all(_across(way, one) for one in staged)]
    places = [tuple(round(float(x), 1) for x in target_mm + distance * way) for way in able]
    aimed = tuple(round(float(x), 1) for x in target_mm)
    return [msgspec.structs.replace(table, position_mm=place, target_mm=aimed) for place in places]


def _across(way: np.ndarray, staged: Staged) -> bool:
    return bool(np.arccos(np.clip(abs(way @ staged.axis.direction), 0.0, 1.0)) > _LEAST_TO_BAR_RAD)


def _differ(tables: Sequence[CameraTable]) -> bool:
    """Whether no two stand in one place."""
    return len({table.position_mm for table in tables}) == len(tables)


def _first_of_its_kind(tables: Sequence[CameraTable], protocol: Protocol) -> bool:
    """Of cameras that are alike but for their names, exchanged ones are the same bench."""
    kinds: dict[bytes, list] = {}
    for placed, given in zip(tables, protocol.cameras):
        if given.position_mm is None:
            kind = msgspec.json.encode(msgspec.structs.replace(given, name="any"))
            kinds.setdefault(kind, []).append(placed.position_mm)
    return all(places == sorted(places) for places in kinds.values())


def _largest_sigma(
    protocol: Protocol, tables: Sequence[CameraTable], staged: Sequence[Staged]
) -> float:
    """The largest sigma of d_x over these whisks, mm, with exact cameras whose lines are as sure as usual."""
    cameras = Cameras(_seen(protocol, tables))
    lines = dict.fromkeys(cameras.names, USUAL)
    sigmas = [expected(one, cameras, lines, Clamp.of(one)).truth.d_x_mm.sigma for one in staged]
    return float(np.max(np.nan_to_num(sigmas, nan=np.inf)))


def _seen(protocol: Protocol, tables: Sequence[CameraTable]) -> tuple[Camera, ...]:
    return tuple(
        seen_camera(c)
        for c in build.cameras(msgspec.structs.replace(protocol, cameras=list(tables)))
    )
