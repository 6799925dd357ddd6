"""Rings, spheres and cones in pictures, against rays through implicit surfaces that share no code with the painter."""

import math
import tomllib

import cv2
import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.rig.bar import TouchedBar
from bench.rig.layer import Occluder
from bench.rig.light import Light, Material
from bench.rig.linear import rotate_about_z
from bench.rig.pinhole import PinholeCamera
from bench.rig.round_objects import TouchedCone, TouchedRing, TouchedSphere
from bench.rig.simulation import simulate
from bench.rig.solid import Solid
from bench.rig.tube import Tube, draw_tubes
from bench.rig.window import Window
from tests.scenes.rig_sessions import TINY, protocol_file

CAMERA = PinholeCamera.aim(
    "small",
    size_px=(320, 240),
    focal_px=1000.0,
    distortion=(-0.11, 0.14, 0.0006, -0.0004, 0.01),
    position_mm=np.array([60.0, -350.0, 150.0]),
    target_mm=np.array([60.0, 8.0, 0.0]),
)
EVEN = Light(np.array([0.0, -1.0, 0.0]), lamp=0.0, soft=1.0)
LAMP = Light(np.array([-0.3, -0.5, 0.8]) / math.sqrt(0.98), 0.55, 0.35)
METAL = Material(0.22, 0.6, 12.0, 0.5)
ORIGIN = np.zeros(3)
TOUCHED = np.array([60.0, 0.0, 0.0])


def placed(beta_deg: float, radius_mm: float, psi_deg: float = 8.0) -> TouchedBar:
    angles = {
        "beta_rad": math.radians(beta_deg),
        "psi_rad": math.radians(psi_deg),
        "touch_rad": 0.0,
    }
    return TouchedBar.at_contact(d_x_mm=60.0, **angles, radius_mm=radius_mm, whisker_radius_mm=0.5)


def ring(beta_deg: float, psi_deg: float = 8.0) -> TouchedRing:
    return TouchedRing.from_bar(placed(beta_deg, 3.0, psi_deg), TOUCHED, 20.0)


def sphere(beta_deg: float) -> TouchedSphere:
    bar = placed(beta_deg, 20.0)
    return TouchedSphere(bar.point_mm, bar.axis, bar.radius_mm)


def cone(beta_deg: float, half_angle_deg: float = 20.0, radius_mm: float = 12.0) -> TouchedCone:
    return TouchedCone.from_bar(placed(beta_deg, radius_mm), TOUCHED, math.radians(half_angle_deg))


def height_and_far(thing, points):
    apart = points - thing.point_mm
    height = apart @ thing.axis
    return height, np.sqrt(np.maximum((apart * apart).sum(-1) - height**2, 0))


def within(thing, points):
    """Negative within the body, at points (..., 3)."""
    height, far = height_and_far(thing, points)
    if isinstance(thing, TouchedSphere):
        return np.hypot(height, far) - thing.radius_mm
    if isinstance(thing, TouchedRing):
        return np.hypot(far - thing.ring_radius_mm, height) - thing.radius_mm
    sin, tan = math.sin(thing.half_angle_rad), math.tan(thing.half_angle_rad)
    touched = (
        thing.radius_mm * sin
    )  # of the circle on which it is touched, from the thinner cone's tip
    above = height - touched
    slanting = far - (thing.radius_mm / sin - height) * tan
    return np.maximum(slanting, np.maximum(above - 60.0, -30.0 - above))


def rays(u, v):
    """Unit directions (n, 3) of the sights through pixels, rig frame: OpenCV's inverse of the lens, corrected by what
    its projection of it is off by."""
    px = np.stack(np.broadcast_arrays(u, v), -1).reshape(-1, 1, 2).astype(float)
    asked = px
    for _ in range(6):
        ways = cv2.undistortPoints(asked, CAMERA.matrix, CAMERA.distortion)[:, 0]
        ways = np.column_stack([ways, np.ones(len(ways))])
        asked = (
            asked
            + px
            - cv2.projectPoints(ways, ORIGIN, ORIGIN, CAMERA.matrix, CAMERA.distortion)[0]
        )
    ways = ways @ CAMERA.rotation
    return ways / np.linalg.norm(ways, axis=1)[:, None]


def least(thing, ways):
    """How deep (n,) sights go into the body at most, by ever finer looks along each."""
    low, high = np.full(len(ways), 250.0), np.full(len(ways), 520.0)
    for count in (500, 40, 40):
        at = np.linspace(low, high, count)
        value = within(thing, CAMERA.centre_mm + at[..., None] * ways)
        best = value.argmin(0)
        low, high = (
            at[np.clip(best + side, 0, count - 1), np.arange(len(ways))] for side in (-1, 1)
        )
    return value.min(0)


def outline(thing, u):
    """Where the body begins and ends in the column at u, (n, 2): coarsely, then by bisection."""
    v = np.arange(-4.0, 244.0, 1.0)
    depth = least(thing, rays(u, v))
    edges, found = np.flatnonzero(np.diff(np.sign(depth))), []
    for low, high, rising in zip(v[edges], v[edges + 1], depth[edges] > 0):
        for _ in range(12):
            middle = 0.5 * (low + high)
            inside = least(thing, rays(u, middle))[0] < 0
            low, high = (low, middle) if inside == rising else (middle, high)
        found.append(0.5 * (low + high))
    return np.array(found).reshape(-1, 2)


def amount(thing, u, soft_px):
    """How long the body is in the column at u, and its middle, under a blur along the rows: by Gauss and Hermite."""
    sums = np.zeros(2)
    for away, weight in ((-math.sqrt(3), 1 / 6), (0.0, 2 / 3), (math.sqrt(3), 1 / 6)):
        low, high = outline(thing, u + away * soft_px).T
        sums += weight * np.array([(high - low).sum(), 0.5 * (high**2 - low**2).sum()])
    return sums[0], sums[1] / sums[0]


THINGS = {
    "ring": ring(0),
    "ring 40": ring(40),
    "ring face on": ring(20, 70.0),
    "sphere": sphere(0),
    "sphere 40": sphere(40),
    "cone": cone(0),
    "cone 40": cone(40),
    "cone -60": cone(-60),
    "slim cone": cone(20, 3.0, 6.0),
    "blunt cone": cone(30, 45.0, 5.0),
}


@pytest.mark.parametrize("name", THINGS)
def test_outlines_are_where_rays_graze(name):
    """The amount of a column that it covers, and its middle, within 0.012 px, where most edges are oblique to it."""
    thing, window = THINGS[name], Window.whole(CAMERA, 3, 0.2, 4)
    layer = Solid(thing, Material(1.0)).layer(window, EVEN)
    cover = np.zeros(window.shape)
    cover[layer.index] = layer.cover
    columns = np.flatnonzero((cover.sum(0) > 12) & (cover[[0, -1]].max(0) < 1e-6))
    for column in np.linspace(columns[0] + 9, columns[-1] - 9, 4).astype(int):
        long, middle = amount(thing, window.u_px[column], 0.2)
        profile = cover[:, column] / window.fine
        assert profile.sum() == pytest.approx(long, abs=0.012)
        assert profile @ window.v_px / profile.sum() == pytest.approx(middle, abs=0.006)


@pytest.mark.parametrize("name", THINGS)
def test_what_is_seen_is_what_sights_meet_first(name):
    thing, window = THINGS[name], Window.whole(CAMERA, 1, 0.3)
    layer = Solid(thing, Material(1.0)).layer(window, EVEN)
    inner = np.zeros(window.shape, np.uint8)
    inner[layer.index] = layer.cover > 1 - 1e-9
    whole = np.flatnonzero(cv2.erode(inner, np.ones((5, 5)))[layer.index])[::97]
    ways = rays(window.u_px[layer.index[1][whole]], window.v_px[layer.index[0][whole]])
    seen = layer.depth_mm[whole]
    before, behind = (
        within(thing, CAMERA.centre_mm + (seen + step)[:, None] * ways) for step in (-0.02, 0.02)
    )
    assert len(whole) > 10 and (behind < 0).all()
    up_to = np.linspace(0.5, 1, 400)[:, None] * (seen - 0.02)
    assert (before > 0).all() and (
        within(thing, CAMERA.centre_mm + up_to[..., None] * ways) > 0
    ).all()


def test_a_large_ring_looks_like_a_straight_bar():
    """Of 20 m, its light and edges are a tube's to a grey level of 255."""
    bar = placed(20, 3.0)
    window = Window.whole(CAMERA, 3, 0.2, 4)
    bent, straight = (np.full(window.shape, 0.3, np.float32) for _ in range(2))
    layer = Solid(TouchedRing.from_bar(bar, TOUCHED, 20000.0), METAL).layer(window, LAMP)
    bent[layer.index] += (layer.cover * (layer.tone - bent[layer.index])).astype(np.float32)
    foot = bar.foot_mm(TOUCHED)
    Tube.straight(foot - 120 * bar.axis, foot + 120 * bar.axis, 3.0, METAL).draw(
        window, straight, LAMP
    )
    pictures = [window.blur_to_pixels(one, 0.9)[4:-4, 4:-4] for one in (bent, straight)]
    assert pictures[1].std() > 0.02
    assert np.abs(pictures[0] - pictures[1]).max() < 1 / 255


def test_a_wire_is_seen_before_an_object_and_not_behind_it():
    thing, window = sphere(20), Window.whole(CAMERA, 3, 0.2)
    layer = Solid(thing, Material(0.6)).layer(window, EVEN)
    front = Occluder.from_layer(layer, window)
    towards = (CAMERA.centre_mm - thing.point_mm) / np.linalg.norm(
        CAMERA.centre_mm - thing.point_mm
    )
    still = np.full(window.shape, 0.3, np.float32)
    still[layer.index] += (layer.cover * (layer.tone - still[layer.index])).astype(np.float32)
    part = window.crop(np.array([[60.0, 60.0], [260.0, 200.0]]), 3)
    for away_mm, is_seen in ((30.0, True), (-30.0, False)):
        middle = thing.point_mm + away_mm * towards
        half = np.array([35.0, 0, 0])
        wire = Tube.straight(middle - half, middle + half, 0.5, Material(0.05))
        drawn = still[part.slices_in(window)].copy()
        draw_tubes([wire], part, drawn, EVEN, front)
        dark = drawn < 0.1
        on = front.cover[part.slices_in(window)] > 0.99
        assert dark[~on].sum() > 300
        assert (dark[on].sum() > 300) == is_seen
        assert is_seen or np.abs(drawn - still[part.slices_in(window)])[on].max() < 1e-4


def test_an_object_beside_a_camera_is_refused():
    beside = TouchedSphere(CAMERA.centre_mm + 3.0, np.array([0, 0, 1.0]), 5.0)
    with pytest.raises(BadInput, match="camera small stands within"):
        Solid(beside, METAL).layer(Window.whole(CAMERA, 1, 0.3), EVEN)


OBJECTS = {
    "ring": "ring_diameter_mm = 80.0\n",
    "sphere": "bar_diameter_mm = 40.0\n",
    "cone": "cone_half_angle_deg = 20.0\nbar_diameter_mm = 30.0\n",
}


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rounded")
    camera, text = (
        TINY.split("[[cameras]]")[1],
        "".join(
            f'[[trials]]\nname = "{name}"\nbeta_deg = 20\nobject = "{name}"\n{keys}'
            for name, keys in OBJECTS.items()
        ),
    )
    text = f"[[cameras]]{camera}[board]\nviews = 1\n[pictures]\nbefore_deg = 0.5\nafter_deg = 1.0\n{text}"
    return simulate(folder / "session", protocol=protocol_file(folder, text), seed=2)


@pytest.mark.parametrize("name", OBJECTS)
def test_a_session_shows_it_and_says_what_it_is(session, name):
    """What trial.toml says has no place; truth.toml has one, on which the true contact lies at first touch."""
    (trial,) = (session / "trials").glob(f"{name}*")
    stated = tomllib.loads((trial / "trial.toml").read_text())["object"]
    truth = tomllib.loads((trial / "truth.toml").read_text())
    assert (
        stated["shape"] == name
        and "point_mm" not in stated
        and stated.items() <= truth["object"].items()
    )
    empty = cv2.imread(str(session / "boards" / "rig" / "left.png"), 0).astype(float)
    first = cv2.imread(str(trial / "left" / "000000.jpg"), 0)
    assert (np.abs(first - empty) > 12).sum() > 400
    touched = rotate_about_z(np.array([truth["d_x_mm"], 0, 0]), math.radians(truth["touch_deg"]))
    point, radius_mm = np.array(truth["object"]["point_mm"]), truth["object"]["diameter_mm"] / 2
    axis = np.array(truth["object"].get("axis", [0, 0, 1.0]))
    height = (touched - point) @ axis
    far = math.sqrt((touched - point) @ (touched - point) - height**2)
    angle = math.radians(stated.get("half_angle_deg", 0))
    off = {
        "ring": math.hypot(far - 40.0, height) - radius_mm,
        "sphere": math.hypot(far, height) - radius_mm,
        "cone": math.cos(angle) * far + math.sin(angle) * height,
    }[name]
    assert off == pytest.approx(0.5, abs=1e-3)  # the wire's radius
