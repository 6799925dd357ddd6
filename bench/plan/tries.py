"""Changes to a bench, each to be tried: a camera elsewhere, a longer lens, more views, a third camera, more light."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bench.plan.planned_cameras import BoardWork, expected_cameras, seen_camera
from bench.plan.sight import ALONG_RAD, to_bar_rad
from bench.rig.pinhole import PinholeCamera
from vision.fit.line_noise import LineNoise
from vision.geometry.camera import N_PARAMETERS, Camera, Cameras
from vision.geometry.contact import BarAxis
from vision.geometry.refusals import Refused

_TURN_DEG = 30.0  # by which a camera is taken round the contact
_NEAR_SHARE = 0.7  # of its distance, to which it is brought
_LENS = 1.5  # times the focal length: the next in a shop
VIEWS = 4  # times as many of the board
PLACED = 4  # times as well is known where it stands on the rig
LIGHT = 4.0  # times as much light, at a quarter of the gain
# A third camera is tried from these directions, azimuth (0: beyond the tip) and elevation, degrees.
_THIRD_DEG = [*itertools.product((-150.0, -90.0, -30.0, 30.0, 90.0, 150.0), (35.0,)), (-90.0, 75.0)]
_APART_RAD = np.radians(35.0)  # from those that are there
# Of a camera that shows no such line where it stands, px: those of the median camera of 53 path-traced scenes
# (tests/studies/accuracy/plans.py).
USUAL = LineNoise(0.05, 0.0, np.array([[0.0, 0.11, 0.11]]))


@dataclass(frozen=True, eq=False)
class Try:
    """A changed bench. kind, words: what is changed; cameras: those of the bench then; like: of a camera that is not as
    it was, the one whose lines' sigmas are taken; light: whether there is more of it."""

    kind: str
    words: str
    cameras: Cameras
    like: Mapping[str, str] = field(default_factory=dict)
    light: bool = False

    def lines(self, lines: Mapping[str, LineNoise], axis: BarAxis) -> dict[str, LineNoise]:
        """How sure its cameras' lines are, px, from how sure they were: one that is new or elsewhere, and does not look
        along the bar, sees both rods."""
        as_they_were = {
            name: lines[self.like.get(name, name)]
            for name in self.cameras.names
            if self.like.get(name, name) in lines
        }
        seeing = [
            camera.name
            for camera in self.cameras
            if self.kind in ("move", "third")
            and camera.name in self.like
            and to_bar_rad(camera, axis) > ALONG_RAD
        ]
        return as_they_were | {name: _able(as_they_were.get(name)) for name in seeing}


def _able(noise: LineNoise | None) -> LineNoise:
    """Of a camera that sees both rods."""
    if noise is None:
        return USUAL
    middle = noise.bar_px[noise.bar_px[:, 0] == 0.0]
    wire_px = noise.wire_px if np.isfinite(noise.wire_px) else USUAL.wire_px
    return replace(noise, wire_px=wire_px, bar_px=middle if len(middle) else USUAL.bar_px)


def tries(
    cameras: Cameras, work: BoardWork | None, target_mm: np.ndarray, *, light: bool
) -> list[Try]:
    """The changes that can be calibrated. work: what the cameras are calibrated from, None where they were given: then
    each keeps its covariance. light: whether to try more of it."""
    found = []
    for kind, words, changed, like in _changes(cameras, target_mm):
        more = VIEWS if kind == "views" else 1, PLACED if kind == "board" else 1
        try:
            made = _calibrated(cameras, changed, like, work, more, target_mm)
        except Refused:
            continue  # its views would not do: no change to propose
        found.append(Try(kind, words, made, like))
    return [
        *found,
        *(
            [
                Try(
                    "light",
                    f"{LIGHT:g} times the light, at 1/{LIGHT:g} of the gain",
                    cameras,
                    light=True,
                )
            ]
            if light
            else []
        ),
    ]


def _changes(
    cameras: Cameras, target_mm: np.ndarray
) -> Iterator[tuple[str, str, tuple[Camera, ...], dict]]:
    """Kind, words, cameras and like of each."""
    everyone = cameras.cameras
    for number, camera in enumerate(everyone):
        for place in _places(camera, target_mm):
            moved = looking(camera, camera.name, place, target_mm)
            others = (*everyone[:number], moved, *everyone[number + 1 :])
            yield (
                "move",
                f"camera {camera.name} at {_said(place)}",
                others,
                {camera.name: camera.name},
            )
    longer = tuple(_longer(camera) for camera in everyone)
    yield "lens", f"lenses {_LENS:g} times as long", longer, {name: name for name in cameras.names}
    yield "views", f"{VIEWS} times as many views of the board", everyone, {}
    if cameras.placement is not None and cameras.placement.any():
        yield (
            "board",
            f"where the board stands on the rig known {PLACED} times as well",
            everyone,
            {},
        )
    for place in third_places(cameras, target_mm):
        name = next(name for name in ("third", "another", "one_more") if name not in cameras)
        third = looking(everyone[0], name, place, target_mm)
        yield (
            "third",
            f"a third camera at {_said(place)}",
            (*everyone, third),
            {name: everyone[0].name},
        )


def _said(place_mm: np.ndarray) -> str:
    return "({:.0f}, {:.0f}, {:.0f}) mm".format(*place_mm)


def _places(camera: Camera, target_mm: np.ndarray) -> Iterator[np.ndarray]:
    """Round the target to four sides, and nearer."""
    away = camera.centre_mm - target_mm
    distance, azimuth, elevation = in_angles(away)
    for turn, lift in ((_TURN_DEG, 0.0), (-_TURN_DEG, 0.0), (0.0, _TURN_DEG), (0.0, -_TURN_DEG)):
        lifted = elevation + lift
        if 0.0 < lifted < 85.0:
            yield target_mm + distance * direction_of(azimuth + turn, lifted)
    yield target_mm + _NEAR_SHARE * away


def in_angles(away_mm: np.ndarray) -> tuple[float, float, float]:
    """Distance, azimuth and elevation (degrees) of a place seen from the target."""
    distance = float(np.linalg.norm(away_mm))
    return (
        distance,
        float(np.degrees(np.arctan2(away_mm[1], away_mm[0]))),
        float(np.degrees(np.arcsin(away_mm[2] / distance))),
    )


def direction_of(azimuth_deg: float, elevation_deg: float) -> np.ndarray:
    """Unit vector (3,) of these angles."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def third_places(cameras: Cameras, target_mm: np.ndarray) -> list[np.ndarray]:
    """Places for one camera more, as far from the target as the others in the mean, apart from them."""
    aways = np.array([camera.centre_mm - target_mm for camera in cameras])
    distances = np.linalg.norm(aways, axis=1)
    ways = [direction_of(*angles) for angles in _THIRD_DEG]
    cosines = np.array(ways) @ (aways / distances[:, None]).T
    return [
        target_mm + float(np.mean(distances)) * way
        for way, cosine in zip(ways, cosines)
        if np.max(cosine) < np.cos(_APART_RAD)
    ]


def looking(camera: Camera, name: str, place_mm: np.ndarray, target_mm: np.ndarray) -> Camera:
    """A camera with this one's lens somewhere else, the rig's z upwards in its picture."""
    fx, fy, cx, cy = camera.lens[:4]
    return seen_camera(
        PinholeCamera.aim(
            name,
            size_px=camera.size_px,
            focal_px=fx,
            aspect=fy / fx,
            centre_px=(cx, cy),
            distortion=camera.distortion,
            position_mm=place_mm,
            target_mm=target_mm,
        )
    )


def _longer(camera: Camera) -> Camera:
    return replace(
        camera,
        matrix=np.diag([_LENS, _LENS, 1.0]) @ camera.matrix
        + (1.0 - _LENS)
        * np.array([[0, 0, camera.matrix[0, 2]], [0, 0, camera.matrix[1, 2]], [0, 0, 0]]),
    )


def _calibrated(
    before: Cameras,
    changed: Sequence[Camera],
    like: Mapping[str, str],
    work: BoardWork | None,
    more: tuple[int, int],
    target_mm: np.ndarray,
) -> Cameras:
    """Cameras with a covariance: by predicted views, or each with that of the camera it is like. more: times the views,
    and times as well placed. Raises Refused."""
    if work is not None:
        return expected_cameras(changed, work.times(*more))
    views, better = more
    placement = None if before.placement is None else before.placement / better**2
    placed = np.zeros_like(before.covariance)
    if before.placement is not None:
        placed = before.by_placement @ before.placement @ before.by_placement.T
    covariance = (before.covariance - placed) / views + placed / better**2
    models = [before[like.get(camera.name, camera.name)] for camera in changed]
    rows = np.concatenate(
        [np.arange(N_PARAMETERS) + before.parameters_of(model.name).start for model in models]
    )
    scale = np.concatenate(
        [_scale(model, camera, target_mm) for model, camera in zip(models, changed)]
    )
    return Cameras(
        tuple(changed), covariance[np.ix_(rows, rows)] * np.outer(scale, scale), placement
    )


def _scale(model: Camera, camera: Camera, target_mm: np.ndarray) -> np.ndarray:
    """How much larger a camera's sigmas are than those of the one it is like, (15,): focal lengths and shifts are known
    to parts of them."""
    scale = np.ones(N_PARAMETERS)
    scale[:2] = camera.lens[:2] / model.lens[:2]
    scale[-3:] = np.linalg.norm(camera.centre_mm - target_mm) / np.linalg.norm(
        model.centre_mm - target_mm
    )
    return scale
