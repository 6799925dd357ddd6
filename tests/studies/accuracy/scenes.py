"""Scenes drawn at random whose truth is known: the rig's exact mechanics, cameras calibrated from noisy corners, and
line points of wire and bar that are wrong in every way that the fit allows for.

    seed → protocol → recording (bench/rig) → truth
                    → cameras → noisy corners → calibration ┐
                    → line points with noise, offsets        ┴→ vision's Problem

Nothing in here uses the fit's model of whisker or touch. All lengths in mm.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import msgspec
import numpy as np

from bench.rig import build
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import (
    BoardTable,
    CameraTable,
    LightTable,
    PicturesTable,
    TrialTable,
    WhiskerTable,
)
from bench.rig.recording import Recording
from tests.studies.accuracy.board_scenes import BOARD, board_views, measured_pose, noisy, rig_view
from vision.calibration.calibrate import calibrate_cameras
from vision.calibration.views import BoardViews, MeasuredPose
from vision.fit import problem as model
from vision.fit.problem import Problem, State
from vision.geometry.camera import Camera, Cameras
from vision.geometry.contact import BarAxis
from vision.geometry.polyline import normals
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.silhouette import outline
from vision.touched.edges import EDGE_PX
from vision.wire.points import LinePoints, Observed

POINT_STEP_MM, FIRST_POINT_MM, BESIDE_BAR_PX = 2.4, 6.0, 4.0
# Small pictures and few frames: a scene costs seconds, and many are wanted.
SIZE_PX, STEP_DEG = (960, 600), 0.7
BAR_PLACES_MM = np.array([-20.0, 20.0])
GROUP = 4  # so many neighbouring points have one error
LEAST_SIGHT_DEG = 20.0  # between a camera's sight and bar or wire; nearer there is no line to see
# Where the cameras' planes through the bar nearly coincide, its slope is told by nothing but offsets of whole lines:
# sigmas of tens of degrees, where nothing is linear.
LEAST_PLANES_DEG = 1.0
FEWEST_RIG_CORNERS = 12


@dataclass(frozen=True)
class Sigmas:
    """How wrong what is seen and given may be: one standard deviation each."""

    wire_px: float = 0.05
    bar_px: float = 0.04
    corner_px: float = 0.05
    wire_diameter_mm: float = 0.004
    bar_diameter_mm: float = 0.008
    rig_mm: float = 0.0
    rig_rad: float = 0.0


@dataclass(frozen=True, eq=False)
class Truth:
    """What the fit should find: angles in rad, lengths in mm, slip (f,) NaN where nothing touches."""

    touch: float
    d_x: float
    beta: float
    slip: np.ndarray


@dataclass(frozen=True, eq=False)
class Scene:
    """One whisk in front of exact cameras."""

    seed: int
    protocol: Protocol
    recording: Recording
    cameras: Cameras
    sigmas: Sigmas

    @property
    def wire(self) -> Wire:
        """The whisker as it is."""
        whisker = self.protocol.whisker
        sigma = self.sigmas.wire_diameter_mm
        return Wire(
            whisker.shape,
            whisker.length_mm,
            whisker.diameter_mm,
            0.0,
            sigma,
            whisker.tip_diameter_mm,
        )

    @property
    def bar(self) -> Bar:
        """The bar as it is."""
        return Bar(2 * self.recording.bar.radius_mm, self.sigmas.bar_diameter_mm)

    @property
    def axis(self) -> BarAxis:
        return BarAxis(
            self.recording.bar.foot_mm(self.recording.touch.point_mm), self.recording.bar.axis
        )

    @property
    def motor_rad(self) -> np.ndarray:
        return self.recording.frames.motor_rad

    @cached_property
    def states(self) -> list:
        """What the rig's mechanics says of each frame; None before touch."""
        return [self.recording.whisks[0].forward.state_at(motor) for motor in self.motor_rad]

    @property
    def truth(self) -> Truth:
        touch, (whisk, *_) = self.recording.touch, self.recording.whisks
        beta, _ = self.recording.bar.slope(touch.motor_rad, touch.point_mm)
        points = [np.full(3, np.nan) if s is None else s.point_mm for s in self.states]
        return Truth(touch.motor_rad, touch.d_x_mm, beta, whisk.slip_mm(points, self.motor_rad))

    @property
    def plane_angle_deg(self) -> float:
        """Largest angle between two cameras' planes through the bar, 0 to 90; 0 for a single camera."""
        axis = self.axis
        across = np.array(
            [np.cross(axis.direction, c.centre_mm - axis.point_mm) for c in self.cameras]
        )
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        return float(np.degrees(np.arccos(np.clip(np.abs(across @ across.T), 0.0, 1.0))).max())


def draw_scene(seed: int, **fixed) -> Scene:
    """A scene that a session may hold: slope −70 to 70 degrees, the bar anywhere along the outer half, two or three
    cameras, friction smooth or in jumps, a wire that is not straight. fixed: protocol tables or `sigmas` to keep.
    """
    rng = np.random.default_rng([seed, 20])
    while True:
        protocol, sigmas = _protocol(rng), fixed.get("sigmas") or _sigmas(rng)
        tables = {name: value for name, value in fixed.items() if name != "sigmas"}
        try:
            scene = make_scene(replace_tables(protocol, **tables), sigmas, seed)
        except ArithmeticError:  # the whisker cannot hold on to this bar
            continue
        if can_be_seen(scene):
            return scene


def replace_tables(protocol: Protocol, **tables) -> Protocol:
    """The protocol with some of its tables exchanged."""
    return Protocol(
        **{name: getattr(protocol, name) for name in protocol.__struct_fields__} | tables
    )


def make_scene(protocol: Protocol, sigmas: Sigmas, seed: int) -> Scene:
    """The scene of a protocol's first trial. Raises ArithmeticError where its whisker slips off the bar."""
    recording = Recording.make(protocol.runs()[0], np.random.default_rng([seed, 21]))
    return Scene(seed, protocol, recording, exact_cameras(protocol), sigmas)


def exact_cameras(protocol: Protocol) -> Cameras:
    """The cameras of a protocol as they are."""
    return Cameras(
        tuple(
            Camera(
                c.name,
                c.size_px,
                c.matrix,
                c.distortion,
                np.column_stack([c.rotation, c.translation_mm]),
            )
            for c in build.cameras(protocol)
        )
    )


def _protocol(rng) -> Protocol:
    kinetic = rng.uniform(0.1, 0.35)
    static = kinetic * rng.choice([1.0, rng.uniform(1.1, 1.4)])
    trial = TrialTable(
        beta_deg=rng.uniform(-70, 70),
        psi_deg=rng.normal(0, 4),
        d_x_mm=rng.uniform(45, 80),
        friction=kinetic,
        static_friction=static,
    )
    whisker = WhiskerTable(
        sag_mm=rng.uniform(0, 0.4), set_y_mm=rng.normal(0, 0.6), set_z_mm=rng.normal(0, 0.6)
    )
    count = int(rng.choice([2, 2, 2, 3]))
    drawn = Protocol(
        name="drawn",
        whisker=whisker,
        bar_diameter_mm=rng.uniform(4, 8),
        board=BoardTable(),
        cameras=[_camera(rng, k) for k in range(count)],
        light=_light(rng),
        pictures=_pictures(rng),
        trials=[trial],
    )
    return msgspec.json.decode(
        msgspec.json.encode(drawn, enc_hook=float), type=Protocol
    )  # plain floats throughout


def _camera(rng, number: int) -> CameraTable:
    """The first high, the second low, others anywhere; all on the side that the whisker comes from."""
    low, high = ((45, 75), (8, 40), (8, 75))[min(number, 2)]
    elevation, azimuth = np.radians([rng.uniform(low, high), rng.uniform(-125, -55)])
    target = np.array([52.0, 3.0, 0.0]) + rng.normal(0, 3, 3)
    way = np.array(
        [
            math.cos(elevation) * math.cos(azimuth),
            math.cos(elevation) * math.sin(azimuth),
            math.sin(elevation),
        ]
    )
    distortion = rng.normal(0, [0.08, 0.08, 4e-4, 4e-4, 0.01])
    return CameraTable(
        name="abcdef"[number],
        position_mm=tuple(target + rng.uniform(340, 460) * way),
        target_mm=tuple(target),
        roll_deg=rng.normal(0, 2),
        focal_px=rng.uniform(1800, 2200),
        size_px=SIZE_PX,
        centre_px=tuple(0.5 * np.array(SIZE_PX) - 0.5 + rng.normal(0, 6, 2)),
        distortion=tuple(distortion),
    )


def _light(rng) -> LightTable:
    """Light and materials much as those of a recorded session."""
    towards = np.array([rng.normal(-0.3, 0.2), rng.normal(-0.5, 0.2), 0.8])
    lamp = rng.uniform(0.45, 0.6)
    return LightTable(towards=tuple(towards), lamp=lamp, soft=0.9 - lamp)


def hard_light(seed: int) -> LightTable:
    """A wire and a bar of any brightness, the background's own among them: an edge may vanish for half its length."""
    rng = np.random.default_rng([seed, 25])
    wire, bar = np.exp(rng.uniform(np.log(0.05), np.log(0.35), 2)).tolist()
    shiny = rng.uniform([0.05, 0.1], [0.5, 0.6]).tolist()
    return LightTable(wire_matt=wire, bar_matt=bar, wire_shiny=shiny[0], bar_shiny=shiny[1])


def _pictures(rng) -> PicturesTable:
    return PicturesTable(
        step_deg=STEP_DEG,
        blur_px=rng.uniform(0.7, 1.4),
        grain=rng.uniform(0.01, 0.055),
        read_noise=rng.uniform(0.5, 2),
    )


def _sigmas(rng) -> Sigmas:
    """The rig board is known exactly or to a tenth of a millimetre and degree."""
    loose = float(rng.random() < 0.5)
    return Sigmas(
        wire_px=float(np.exp(rng.uniform(np.log(0.02), np.log(0.15)))),
        bar_px=float(np.exp(rng.uniform(np.log(0.015), np.log(0.08)))),
        corner_px=rng.uniform(0.03, 0.1),
        rig_mm=0.1 * loose,
        rig_rad=math.radians(0.1) * loose,
    )


def can_be_seen(scene: Scene) -> bool:
    """Whether no camera looks along bar or wire, each sees the board on the rig, and two tell the bar's slope."""
    along = np.array([scene.axis.direction, [1.0, 0.0, 0.0]])
    sight = np.array([c.centre_mm - scene.axis.point_mm for c in scene.cameras])
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    corners = [len(rig_view(c, build.T_rig_board(scene.protocol))[0]) for c in scene.cameras]
    return (
        np.abs(sight @ along.T).max() < math.cos(math.radians(LEAST_SIGHT_DEG))
        and min(corners) >= FEWEST_RIG_CORNERS
        and scene.plane_angle_deg >= LEAST_PLANES_DEG
    )


def calibrated(scene: Scene, rng: np.random.Generator, views: int = 10) -> Cameras:
    """The scene's cameras as `calibrate_cameras` finds them from noisy corners, with their covariance."""
    corner, T = scene.sigmas.corner_px, build.T_rig_board(scene.protocol)
    held = {
        c.name: [noisy(view, corner, rng) for view in board_views(c, views, rng)]
        for c in scene.cameras
    }
    standing = {c.name: noisy(rig_view(c, T), corner, rng) for c in scene.cameras}
    stated = measured_pose(T, scene.sigmas.rig_mm, scene.sigmas.rig_rad, rng)
    views = BoardViews(held, {c.name: c.size_px for c in scene.cameras}, standing)
    return calibrate_cameras(
        views, BOARD, MeasuredPose(stated, scene.sigmas.rig_mm, scene.sigmas.rig_rad)
    ).cameras


def given(scene: Scene, rng: np.random.Generator) -> tuple[Wire, Bar]:
    """Wire and bar as someone measured them."""
    wire, bar = scene.wire, scene.bar
    return (
        replace(
            wire, diameter_mm=wire.diameter_mm + wire.diameter_sigma_mm * rng.standard_normal()
        ),
        replace(bar, diameter_mm=bar.diameter_mm + bar.diameter_sigma_mm * rng.standard_normal()),
    )


def line_points(
    scene: Scene,
    rng: np.random.Generator | None = None,
    light: np.random.Generator | None = None,
) -> list[Observed]:
    """Line points of wire and bar in all frames and cameras; exact without a generator.

    light: draws by what each camera's lines are off as a whole; rng where there is none.

    With one, each point has its noise, the wire's correlated; each camera's lines are off as a whole; wire and bar are
    out of round at each frame's contact, by as much as the fit's priors say.
    """
    frames = len(scene.motor_rad)
    not_round = (
        np.zeros(frames) if rng is None else model.CONTACT_SIGMA_MM * rng.standard_normal(frames)
    )
    return [
        seen
        for number, camera in enumerate(scene.cameras)
        for seen in [
            *_wire_points(scene, number, camera, not_round, rng, light or rng),
            *_bar_points(scene, number, camera, rng, light or rng),
        ]
    ]


def _wire_points(
    scene: Scene, number: int, camera: Camera, not_round, rng, light
) -> list[Observed]:
    length, sigma, seen = scene.wire.length_mm, scene.sigmas.wire_px, []
    off_by = _whole(light, model.WIRE_MODES_PX)
    bar = scene.axis.covering_discs(camera, scene.bar.radius_mm)
    place = np.arange(FIRST_POINT_MM, length - 1.0, POINT_STEP_MM)
    for frame, more_mm in enumerate(not_round):
        px = camera.project(_centreline_mm(scene, frame, place, more_mm))
        normal = normals(px)
        motor = np.full(len(place), scene.motor_rad[frame])
        whole = model.wire_modes(length, place, motor, scene.motor_rad) @ off_by
        off = whole + sigma * correlated_noise(len(place), rng)
        keep = _clear(px, *bar) & np.all((px > 3) & (px < np.array(camera.size_px) - 4), axis=1)
        points = LinePoints(px + off[:, None] * normal, normal, np.full(len(px), sigma), place)
        seen.append(Observed(frame, number, points.select(keep)))
    return seen


def _centreline_mm(scene: Scene, frame: int, arc_mm, more_mm: float) -> np.ndarray:
    """Points (n, 3) of the whisker, pushed a little further where the bar's radius is `more_mm` larger: as a rod that
    is clamped and pushed at its contact, with (3 u² - u³)/2 up to there and straight beyond."""
    motor, state = scene.motor_rad[frame], scene.states[frame]
    points = scene.recording.whisks[0].centreline_mm(motor, state, arc_mm)
    if state is None or more_mm == 0.0:
        return points
    away = state.point_mm - scene.recording.bar.foot_mm(state.point_mm)
    u = arc_mm / state.arc_mm
    pushed = np.where(u < 1.0, 0.5 * (3.0 - u) * u**2, 1.5 * u - 0.5)
    return points + more_mm * pushed[:, None] * away / np.linalg.norm(away)


def _bar_points(scene: Scene, number: int, camera: Camera, rng, light) -> list[Observed]:
    """Two points of the bar's middle, as vision hands it on; of its two edges where there is one camera."""
    if len(scene.cameras) == 1:
        return _edge_points(scene, number, camera, rng)
    offset, tilt = _whole(light, model.BAR_MODES_PX)
    axis, sigma = scene.axis, scene.sigmas.bar_px
    points = axis.point_mm + BAR_PLACES_MM[:, None] * axis.direction
    px = outline(
        camera, points, np.broadcast_to(axis.direction, points.shape), scene.bar.radius_mm
    )[0]
    noise = np.zeros(2) if rng is None else sigma * rng.standard_normal(2)
    off, normal = offset + tilt * BAR_PLACES_MM / model.BAR_TILT_ARM_MM + noise, normals(px)
    return [
        Observed(
            -1,
            number,
            LinePoints(px + off[:, None] * normal, normal, np.full(2, sigma), BAR_PLACES_MM),
        )
    ]


def _edge_points(scene: Scene, number: int, camera: Camera, rng) -> list[Observed]:
    """Two points of each of the bar's edges, each edge with an error of its own."""
    points = scene.axis.point_mm + BAR_PLACES_MM[:, None] * scene.axis.direction
    middle, half = outline(
        camera, points, np.broadcast_to(scene.axis.direction, points.shape), scene.bar.radius_mm
    )
    normal, sigma, seen = normals(middle), np.hypot(scene.sigmas.bar_px, EDGE_PX), []
    for side in (-1, 1):
        noise = np.zeros(2) if rng is None else sigma * rng.standard_normal(2)
        px = middle + (side * half + noise)[:, None] * normal
        seen.append(
            Observed(-1, number, LinePoints(px, normal, np.full(2, sigma), BAR_PLACES_MM), side)
        )
    return seen


def _whole(rng, modes_px: np.ndarray) -> np.ndarray:
    return np.zeros(len(modes_px)) if rng is None else modes_px * rng.standard_normal(len(modes_px))


def correlated_noise(count: int, rng) -> np.ndarray:
    """Noise (count,) of unit variance, the same over each GROUP neighbours, which begin anywhere. Zeros without rng."""
    if rng is None:
        return np.zeros(count)
    group = (np.arange(count) + rng.integers(GROUP)) // GROUP
    return rng.standard_normal(group[-1] + 1)[group]


def _clear(px, middle_px, half_px) -> np.ndarray:
    """Which points (n,) lie beside the bar's outline."""
    away = np.linalg.norm(px[:, None] - middle_px[None], axis=2)
    return np.min(away - half_px, axis=1) > BESIDE_BAR_PX


def as_problem(
    scene: Scene, cameras: Cameras, wire: Wire, bar: Bar, seen: Sequence[Observed]
) -> Problem:
    """Vision's problem, its bar counted from where a first look would have put it."""
    away = scene.motor_rad - scene.truth.touch
    return Problem(
        cameras,
        Rods(wire, bar),
        scene.axis,
        scene.motor_rad,
        away > math.radians(0.3),
        away > 0,
        seen,
    )


def begin(problem: Problem) -> State:
    """No bend and a straight whisker, the contact where the bar is."""
    return model.start(problem, float(np.linalg.norm(problem.axis.point_mm)))
