"""Places for cameras that a RIG.toml does not place: those from which d_x is known best, found by trying."""

import itertools
from collections.abc import Iterator, Sequence

import msgspec
import numpy as np

from bench.base.errors import BadInput
from bench.base.progress import count_parts
from bench.plan.changes import USUAL, direction_of
from bench.plan.painter import Clamp
from bench.plan.planned_cameras import as_seen_camera
from bench.plan.staged import StagedWhisk
from bench.rig import build
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import CameraTable
from vision import predict_truth
from vision.geometry import Cameras, spread

# [deg] Directions of cameras from the contact: azimuth; 0 is beyond the tip, -90 the side that the whisker comes
# from. Stated.
_AZIMUTHS_DEG = (-130.0, -90.0, -50.0, 60.0, 120.0)
# [deg] Directions of cameras from the contact: elevation. Stated.
_ELEVATIONS_DEG = (25.0, 60.0)
# [1] Of the picture's width, filled by a whisker that is seen from its side. Stated.
_FILLS = 0.7
# [trials] Of the protocol, first to last, that places are judged by. Stated.
_TRIALS = 2
# [rad] Least angle between line of sight and bar, by which the bar is seen. Stated.
_LEAST_TO_BAR_RAD = np.radians(25.0)


def place_cameras(
    protocol: Protocol, staged: Sequence[StagedWhisk], target_mm: np.ndarray
) -> Protocol:
    """Return the protocol with a place for every camera.

    target_mm (3,): what they are aimed at. Raises BadInput where no place gives all trials a truth.
    """
    if all(camera.position_mm is not None for camera in protocol.cameras):
        return protocol
    whisks = spread(staged, _TRIALS)
    places = [_placed_tables(table, protocol, whisks, target_mm) for table in protocol.cameras]
    best = None
    least_mm = np.inf
    candidates = list(_candidates(protocol, places))
    for candidate in count_parts(candidates, "places of cameras", len(candidates)):
        sigma_mm = _largest_sigma_mm(candidate, whisks)
        if sigma_mm < least_mm:
            best = candidate
            least_mm = sigma_mm
    if best is None:
        raise BadInput(
            "no place tried for the cameras without position_mm gives a truth; "
            "give them places, or other lenses"
        )
    return best


def _candidates(protocol: Protocol, places: Sequence[Sequence[CameraTable]]) -> Iterator[Protocol]:
    """Yield the protocol with each choice of places for its cameras that are apart and in order."""
    for tables in itertools.product(*places):
        if _are_apart(tables) and _are_in_order(tables, protocol):
            yield msgspec.structs.replace(protocol, cameras=list(tables))


def _placed_tables(
    table: CameraTable, protocol: Protocol, staged: Sequence[StagedWhisk], target_mm: np.ndarray
) -> list[CameraTable]:
    """Return a camera at each place from which it would see every bar from its side."""
    if table.position_mm is not None:
        return [table]
    distance_mm = table.focal * protocol.whisker.length_mm / (_FILLS * table.size_px[0])
    target = _rounded(target_mm)
    tables = []
    for azimuth_deg, elevation_deg in itertools.product(_AZIMUTHS_DEG, _ELEVATIONS_DEG):
        direction = direction_of(azimuth_deg, elevation_deg)
        if all(_is_beside_bar(direction, whisk) for whisk in staged):
            place = _rounded(target_mm + distance_mm * direction)
            tables.append(msgspec.structs.replace(table, position_mm=place, target_mm=target))
    return tables


def _rounded(place_mm: np.ndarray) -> tuple[float, ...]:
    """Return a place (3,) to a tenth of a millimetre."""
    return tuple(round(float(x), 1) for x in place_mm)


def _is_beside_bar(direction: np.ndarray, staged: StagedWhisk) -> bool:
    """Return whether a camera in this direction (3,) sees the bar from its side."""
    cosine = abs(direction @ staged.known.axis.direction)
    return bool(np.arccos(np.clip(cosine, 0.0, 1.0)) > _LEAST_TO_BAR_RAD)


def _are_apart(tables: Sequence[CameraTable]) -> bool:
    """Return whether no two cameras stand in one place."""
    return len({table.position_mm for table in tables}) == len(tables)


def _are_in_order(tables: Sequence[CameraTable], protocol: Protocol) -> bool:
    """Return whether cameras that are alike but for their names stand in the order of their places.

    Exchanged ones are the same bench.
    """
    places: dict[bytes, list] = {}
    for placed, given in zip(tables, protocol.cameras):
        if given.position_mm is None:
            kind = msgspec.json.encode(msgspec.structs.replace(given, name="any"))
            places.setdefault(kind, []).append(placed.position_mm)
    return all(own == sorted(own) for own in places.values())


def _largest_sigma_mm(protocol: Protocol, staged: Sequence[StagedWhisk]) -> float:
    """Return the largest sigma of d_x over these whisks, mm, infinite where one has no truth.

    The cameras are exact, and their lines as uncertain as usual.
    """
    cameras = Cameras(tuple(as_seen_camera(camera) for camera in build.cameras(protocol)))
    noise = dict.fromkeys(cameras.names, USUAL)
    sigmas_mm = []
    for whisk in staged:
        predicted = predict_truth(whisk.known, cameras, noise, Clamp.of(whisk))
        sigmas_mm.append(predicted.truth.d_x_mm.sigma)
    return float(np.max(np.nan_to_num(sigmas_mm, nan=np.inf)))
