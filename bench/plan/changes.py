"""Changes to a bench, each to be tried: a camera elsewhere, a longer lens, more views, a third camera, more light."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from bench.base.progress import count_parts
from bench.plan.planned_cameras import PlannedCalibration, as_seen_camera, expected_cameras
from bench.rig.pinhole import PinholeCamera
from vision import KnownWhisk, LineNoise
from vision.geometry import Camera, Cameras, Refused

# [deg] By which a camera is taken round the contact. Stated.
_TURN_DEG = 30.0
# [deg] Elevations to which it is taken, at most. Stated.
_STEEPEST_DEG = 85.0
# [1] Of its distance, to which a camera is brought. Stated.
_NEAR_SHARE = 0.7
# [1] Factor of a longer focal length: the next in a shop. Stated.
_LENS = 1.5
# [1] Factor of the number of the board's views. Stated.
VIEWS = 4
# [1] Factor by which the sigmas of the board's pose on the rig are smaller. Stated.
PLACED = 4
# [1] Factor of the light, with the gain that much less. Stated.
LIGHT = 4.0
# [deg] Azimuth (0: beyond the tip) and elevation from which a third camera is tried. Stated.
_THIRD_DEG = (
    (-150.0, 35.0),
    (-90.0, 35.0),
    (-30.0, 35.0),
    (30.0, 35.0),
    (90.0, 35.0),
    (150.0, 35.0),
    (-90.0, 75.0),
)
# [rad] From the cameras that are there. Stated.
_APART_RAD = np.radians(35.0)
# Noise of a camera that shows no such line where it stands, px: that of the median camera of 53
# path-traced scenes (tests/studies/accuracy/plans.py).
USUAL = LineNoise(0.05, 0.0, np.array([[0.0, 0.11, 0.11]]))


@dataclass(frozen=True, eq=False)
class Change:
    """A changed bench.

    kind, words: what is changed. cameras: those of the bench then. like: of each changed camera,
    the present one whose lines it has. light: whether there is more of it.
    """

    kind: str
    words: str
    cameras: Cameras
    like: Mapping[str, str] = field(default_factory=dict)
    light: bool = False

    def line_noise(
        self, present: Mapping[str, LineNoise], known: KnownWhisk
    ) -> dict[str, LineNoise]:
        """Return by camera the noise of its lines, from that on the present bench.

        A camera that is new or elsewhere sees both rods, unless its line of sight is along the bar.
        """
        found = {}
        for camera in self.cameras:
            name = camera.name
            own = present.get(self.like.get(name, name))
            is_elsewhere = self.kind in ("move", "third") and name in self.like
            if is_elsewhere and not known.is_seen_along_bar(camera):
                own = _of_both_rods(own)
            if own is not None:
                found[name] = own
        return found


def _of_both_rods(noise: LineNoise | None) -> LineNoise:
    """Return the noise of a camera that sees both rods, usual where it was not known."""
    if noise is None:
        return USUAL
    middle = noise.bar_px[noise.bar_px[:, 0] == 0.0]
    wire_px = noise.wire_px if np.isfinite(noise.wire_px) else USUAL.wire_px
    return replace(noise, wire_px=wire_px, bar_px=middle if len(middle) else USUAL.bar_px)


def list_changes(
    cameras: Cameras, calibration: PlannedCalibration | None, target_mm: np.ndarray, *, light: bool
) -> list[Change]:
    """Return the changes to be tried of which the cameras can be calibrated.

    calibration: what they are calibrated from; None where they were given: then each keeps its covariance.
    target_mm (3,): where the contact is. light: whether to try more of it.
    """
    found = []
    to_try = list(_changes(cameras, target_mm))
    for change in count_parts(to_try, "cameras calibrated with a change", len(to_try)):
        try:
            calibrated = _calibrate(cameras, change, calibration, target_mm)
        except Refused:
            continue  # its views would not do: no change to propose
        found.append(replace(change, cameras=calibrated))
    if light:
        words = f"{LIGHT:g} times the light, at 1/{LIGHT:g} of the gain"
        found.append(Change("light", words, cameras, light=True))
    return found


def _changes(cameras: Cameras, target_mm: np.ndarray) -> Iterator[Change]:
    """Yield the changes with exact cameras."""
    yield from _moves(cameras, target_mm)
    present = cameras.cameras
    longer = Cameras(tuple(_with_longer_lens(camera) for camera in present))
    same = {name: name for name in cameras.names}
    yield Change("lens", f"lenses {_LENS:g} times as long", longer, same)
    exact = Cameras(present)
    yield Change("views", f"{VIEWS} times as many views of the board", exact)
    if cameras.placement is not None and cameras.placement.any():
        words = f"where the board stands on the rig known {PLACED} times as well"
        yield Change("board", words, exact)
    new = next(name for name in ("third", "another", "one_more") if name not in cameras)
    for place_mm in third_places(cameras, target_mm):
        third = aim_camera(present[0], new, place_mm, target_mm)
        words = f"a third camera at {_place_text(place_mm)}"
        yield Change("third", words, Cameras((*present, third)), {new: present[0].name})


def _moves(cameras: Cameras, target_mm: np.ndarray) -> Iterator[Change]:
    """Yield the changes by which one camera stands elsewhere."""
    for number, camera in enumerate(cameras):
        name = camera.name
        for place_mm in _places(camera, target_mm):
            moved = list(cameras)
            moved[number] = aim_camera(camera, name, place_mm, target_mm)
            words = f"camera {name} at {_place_text(place_mm)}"
            yield Change("move", words, Cameras(tuple(moved)), {name: name})


def _place_text(place_mm: np.ndarray) -> str:
    """Return a place (3,) as text."""
    return "({:.0f}, {:.0f}, {:.0f}) mm".format(*place_mm)


def _places(camera: Camera, target_mm: np.ndarray) -> Iterator[np.ndarray]:
    """Yield places (3,) of a camera round the target to four sides, and nearer."""
    offset_mm = camera.centre_mm - target_mm
    distance_mm = float(np.linalg.norm(offset_mm))
    azimuth_deg = math.degrees(np.arctan2(offset_mm[1], offset_mm[0]))
    elevation_deg = math.degrees(np.arcsin(offset_mm[2] / distance_mm))
    for turn, lift in ((_TURN_DEG, 0.0), (-_TURN_DEG, 0.0), (0.0, _TURN_DEG), (0.0, -_TURN_DEG)):
        lifted_deg = elevation_deg + lift
        if 0.0 < lifted_deg < _STEEPEST_DEG:
            yield target_mm + distance_mm * direction_of(azimuth_deg + turn, lifted_deg)
    yield target_mm + _NEAR_SHARE * offset_mm


def direction_of(azimuth_deg: float, elevation_deg: float) -> np.ndarray:
    """Return the unit vector (3,) of these angles."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def third_places(cameras: Cameras, target_mm: np.ndarray) -> list[np.ndarray]:
    """Return places (3,) for one camera more, apart from the others.

    They are as far from the target as the others in the mean.
    """
    offsets_mm = np.array([camera.centre_mm - target_mm for camera in cameras])
    distances_mm = np.linalg.norm(offsets_mm, axis=1)
    sights = offsets_mm / distances_mm[:, None]
    directions = np.array([direction_of(*angles) for angles in _THIRD_DEG])
    cosines = directions @ sights.T  # (places, cameras)
    is_apart = np.max(cosines, axis=1) < np.cos(_APART_RAD)
    distance_mm = float(np.mean(distances_mm))
    return [target_mm + distance_mm * direction for direction in directions[is_apart]]


def aim_camera(camera: Camera, name: str, place_mm: np.ndarray, target_mm: np.ndarray) -> Camera:
    """Return a camera with this one's lens somewhere else, the rig's z upwards in its picture."""
    fx, fy, cx, cy = camera.lens[:4]
    aimed = PinholeCamera.aim(
        name,
        size_px=camera.size_px,
        focal_px=fx,
        aspect=fy / fx,
        centre_px=(cx, cy),
        distortion=camera.distortion,
        position_mm=place_mm,
        target_mm=target_mm,
    )
    return as_seen_camera(aimed)


def _with_longer_lens(camera: Camera) -> Camera:
    """Return a camera with a longer focal length and the same centre of its picture."""
    centre = np.zeros((3, 3))
    centre[:2, 2] = camera.matrix[:2, 2]
    longer = np.diag([_LENS, _LENS, 1.0]) @ camera.matrix
    return replace(camera, matrix=longer + (1.0 - _LENS) * centre)


def _calibrate(
    present: Cameras, change: Change, calibration: PlannedCalibration | None, target_mm: np.ndarray
) -> Cameras:
    """Return a change's cameras with a covariance: by predicted views, or that of those they are like.

    Raises Refused where the views would not do.
    """
    views = VIEWS if change.kind == "views" else 1
    pose = PLACED if change.kind == "board" else 1
    if calibration is not None:
        return expected_cameras(change.cameras.cameras, calibration.improved(views, pose))
    covariance, placement = _improved_covariance(present, views, pose)
    rows = []
    scales = []
    for camera in change.cameras:
        model = present[change.like.get(camera.name, camera.name)]
        rows.append(np.arange(len(covariance))[present.parameters_of(model.name)])
        scales.append(_sigma_scale(model, camera, target_mm))
    row = np.concatenate(rows)
    scale = np.concatenate(scales)
    scaled = covariance[np.ix_(row, row)] * np.outer(scale, scale)
    return Cameras(change.cameras.cameras, scaled, placement)


def _improved_covariance(
    cameras: Cameras, views: int, pose: int
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the covariances of cameras and of their placement, calibrated by more.

    views, pose: so many times the views of the board, and its pose known so many times as well.
    """
    if cameras.placement is None:
        return cameras.covariance / views, None
    by_placement = cameras.by_placement @ cameras.placement @ cameras.by_placement.T
    own = cameras.covariance - by_placement
    return own / views + by_placement / pose**2, cameras.placement / pose**2


def _sigma_scale(model: Camera, camera: Camera, target_mm: np.ndarray) -> np.ndarray:
    """Return how much larger (15,) a camera's sigmas are than those of the one it is like.

    Focal lengths and shifts are known to parts of them.
    """
    distance_mm = np.linalg.norm(camera.centre_mm - target_mm)
    farther = distance_mm / np.linalg.norm(model.centre_mm - target_mm)
    longer = camera.lens[:2] / model.lens[:2]
    lens = [*longer, *np.ones(len(model.lens) - 2)]
    return np.array([*lens, *np.ones(3), *np.full(3, farther)])
