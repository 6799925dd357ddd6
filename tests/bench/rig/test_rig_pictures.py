"""The renderer against exact projection, brute force, and OpenCV's own prints."""

import itertools
import math

import cv2
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ndtr

from bench.rig import build
from bench.rig.bar import TouchedBar, unloaded_curve
from bench.rig.elastic_rod import Rod
from bench.rig.light import Light, Material
from bench.rig.painted_scene import HUB_FRONT_MM
from bench.rig.pinhole import PinholeCamera
from bench.rig.printed_board import Ink, PrintedBoard
from bench.rig.protocol import load
from bench.rig.sensor import Sensor
from bench.rig.studio import Instant, Studio
from bench.rig.tube import Tube
from bench.rig.window import Window
from tests.studies.accuracy.renderer import (
    ANGLES_DEG,
    BLURS_PX,
    CAMERA,
    WIDTHS_PX,
    corner_errors_px,
    crossing,
    rasterised,
    rms,
    wire,
    wire_errors_px,
    wire_profiles,
)

QUICK = load("quick")
SHARP_AND_SOFT = (min(BLURS_PX), max(BLURS_PX))


def studio(camera, blur_px=0.9, protocol=QUICK):
    return Studio(camera, build.scene(protocol), Sensor(blur_px, 0, 0, 0, 0))


@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("width_px, blur_px", list(itertools.product(WIDTHS_PX, SHARP_AND_SOFT)))
def test_wire_is_where_projection_says(width_px, blur_px, bent):
    """Allowed: bias 0.005 px, of each orientation too; RMS 0.01 px."""
    seen, centreline = wire_errors_px(width_px, blur_px, bent)
    assert seen.shape == (len(ANGLES_DEG), 50)
    assert np.abs(seen.mean(1)).max() < 0.005
    assert rms(seen) < 0.01
    if not bent:
        assert abs(centreline.mean()) < 0.005
        assert rms(centreline) < 0.01


@pytest.mark.parametrize("width_px", WIDTHS_PX)
def test_silhouettes_are_where_rays_graze(width_px):
    """And the wire's amount in a line of pixels is the way between them."""
    for angle_deg in ANGLES_DEG:
        tube = wire(angle_deg, width_px)
        at, axis, lines = wire_profiles(tube, angle_deg, 0.9)
        edges = np.sort([crossing(edge, at, axis) for edge in tube.silhouette(CAMERA)], 0)
        for i in (0, 25, 49):
            low, high = grazing(tube, at[i], axis)
            assert edges[:, i] == pytest.approx([low, high], abs=0.001)
            assert lines[:, i].sum() == pytest.approx(high - low, abs=0.002)


def grazing(tube, at, axis):
    """Where a ray of a column (axis 0) or row of pixels passes the tube's axis at the distance of its radius."""
    way = tube.axis_mm[-1] - tube.axis_mm[0]

    def gap(v):
        px = np.array([[[at, v]]] if axis == 0 else [[[v, at]]], float)
        ray = CAMERA.rotation.T @ np.append(
            cv2.undistortPoints(px, CAMERA.matrix, CAMERA.distortion)[0, 0], 1
        )
        normal = np.cross(ray, way)
        return (
            abs((tube.axis_mm[0] - CAMERA.centre_mm) @ normal) / np.linalg.norm(normal)
            - tube.radius_mm[0]
        )

    centre = float(crossing(CAMERA.project(tube.axis_mm), at, axis))
    return brentq(gap, centre - 30, centre, xtol=1e-6), brentq(gap, centre, centre + 30, xtol=1e-6)


@pytest.mark.parametrize(
    "off_px, largest, whole", [(1.5, 0.5 / 255, 0.01), (-1.5, 0.5 / 255, 0.01), (0.0, 0.03, 0.08)]
)
def test_drawing_finer_changes_nothing(off_px, largest, whole):
    """A shaded wire over a step in the background along its edge, at 3 and at 12 samples a pixel.

    The step is what a border of printed squares is: beside the wire or under it, nothing changes by half a grey level.
    Exactly along the edge, coverage squared is what differs: 0.6·0.2/√π = 0.068 px·brightness across the edge.
    Composing after the blur would be off by 0.15 at the edge in all three.
    """
    light, material = (
        Light(np.array([-0.3, -0.5, 0.8]) / math.sqrt(0.98), 0.55, 0.35),
        Material(0.25, 0.5, 18, 0.3),
    )
    tube, pictures = wire(7.0, 5.7, material), []
    for fine, soft_px in ((3, 0.2), (12, 0.05)):
        margin = 5
        window = Window.whole(CAMERA, fine, soft_px, margin)
        border = crossing(tube.silhouette(CAMERA)[0], window.u_px, 0) + off_px
        radiance = (0.05 + 0.6 * ndtr((window.v_px[:, None] - border) / soft_px)).astype(np.float32)
        tube.draw(window, radiance, light)
        pictures.append(window.blur_to_pixels(radiance, 0.9)[margin:-margin, margin:-margin])
    difference = np.abs(pictures[0] - pictures[1])[40:-40, 40:-40]
    assert difference.max() < largest
    assert difference.sum(0).max() < whole


@pytest.mark.parametrize("blur_px", SHARP_AND_SOFT)
def test_board_corners_are_where_projection_says(blur_px):
    """Allowed: bias 0.005 px, RMS 0.01 px; in the rig's picture (fine samples) and in held views (edges at once)."""
    pictures = corner_errors_px(blur_px)
    assert all(np.abs(errors.mean(0)).max() < 0.005 for errors in pictures)
    errors = np.concatenate(pictures)
    assert len(errors) > 100
    assert np.sqrt((errors**2).mean()) < 0.01


def test_lens_is_inverted_over_the_picture_and_its_margin():
    camera = build.cameras(QUICK)[0]
    u, v = np.arange(-30, 1310, 41.0), np.arange(-25, 745, 37.0)
    x, y = (r.astype(float) for r in camera.rays(u, v))
    points = np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3)
    px = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, camera.distortion)[
        0
    ].reshape(*x.shape, 2)
    assert px == pytest.approx(
        np.stack(np.meshgrid(u, v), -1), abs=1e-4
    )  # float32 rays: 6e-8 · 2000 px


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize("inverted", [False, True])
def test_the_print_is_opencvs(legacy, inverted):
    board = PrintedBoard((7, 6), 15.0, 11.0, "DICT_5X5_100", legacy=legacy, inverted=inverted)
    print_ = board.to_print(Ink(1.0, 0.0), 5.0)
    per_mm = 7  # marker modules of 11/7 mm are 11 px then
    px = (np.arange(7 * 15 * per_mm) + 0.5) / per_mm
    column, row = (np.searchsorted(e, px[px < e[-2]]) - 1 for e in (print_.x_mm, print_.y_mm))
    drawn = (
        board.opencv().generateImage((7 * 15 * per_mm, 6 * 15 * per_mm), marginSize=0, borderBits=1)
        / 255
    )
    ours = print_.reflectance[np.ix_(row, column)]
    assert np.mean(ours != (1 - drawn if inverted else drawn)) == 0


def moment(motor_rad, material=None):
    rod, arc = Rod("cylinder", 100.0, 1.0, 60.0), np.linspace(HUB_FRONT_MM, 100, 257)
    tube = Tube(
        unloaded_curve(rod, motor_rad, arc)[0], rod.radius_mm(arc), material or Material(0.25)
    )
    return Instant.alone(motor_rad, tube)


@pytest.fixture(scope="module", params=[0, 1])
def setting(request):
    camera = build.cameras(QUICK)[request.param]
    bar = TouchedBar.at_contact(
        d_x_mm=60.0, beta_rad=0.5, psi_rad=0.1, touch_rad=0.04, radius_mm=3.0, whisker_radius_mm=0.5
    )
    return studio(camera).setting(bar, bar.foot_mm(np.array([60.0, 2.4, 0.0]))), camera, bar


def test_a_frame_is_the_still_scene_but_for_what_moves(setting):
    still, camera, _ = setting
    first, second = (still.brightness([moment(m)]) for m in (0.0, 0.01))
    changed = np.abs(first - second) > 1e-4
    px = np.concatenate([camera.project(moment(m).whiskers[0].axis_mm) for m in (0.0, 0.01)])
    rows, columns = np.nonzero(changed)
    assert 500 < len(rows) < 0.1 * changed.size
    hub = camera.project(
        np.array([[x, y, z] for x in (-18, 6) for y in (-10, 10) for z in (-7, 8)])
    )
    low, high = np.minimum(px.min(0), hub.min(0)) - 6, np.maximum(px.max(0), hub.max(0)) + 6
    assert columns.min() > low[0] and columns.max() < high[0]
    assert rows.min() > low[1] and rows.max() < high[1]


def test_whisker_covers_the_bar_where_it_touches(setting):
    """The whisker lies on the cameras' side of the bar: at the crossing its own tone is seen, not the bar's."""
    still, camera, _ = setting
    bright = still.brightness([moment(0.04, Material(0.9))])
    column, row = np.round(
        camera.project(60.0 * np.array([[math.cos(0.04), math.sin(0.04), 0.0]]))[0]
    ).astype(int)
    assert bright[row, column] > 0.6


def test_motion_blur_is_the_mean_of_its_moments(setting):
    still, _, _ = setting
    angles = (0.0, 0.004, 0.008)
    blurred = still.brightness([moment(a) for a in angles])
    mean = np.mean([still.brightness([moment(a)]) for a in angles], 0)
    assert np.abs(blurred - mean).max() < 1e-5  # float32 sums


def test_lamp_from_one_side_moves_the_seen_wire_towards_it():
    """What real metal does, by far more than noise: the dark side of the wire is lost on a dark ground."""
    tube, shifts = wire(0.0, 5.7, Material(0.25, 0.5, 18.0, 0.3)), []
    for side in (-1, 1):
        towards = CAMERA.rotation.T @ np.array([0.0, side * 0.94, -0.34])
        picture = rasterised(tube, 0.9, ground=0.02, light=Light(towards, 0.9, 0.02))
        column = picture[:, 160].astype(float) - 0.02
        low, high = (crossing(edge, 160, 0) for edge in tube.silhouette(CAMERA))
        shifts.append((column * np.arange(len(column))).sum() / column.sum() - 0.5 * (low + high))
    assert shifts[0] < -0.5 and shifts[1] > 0.5


@pytest.mark.parametrize("bits, kind", [(8, np.uint8), (12, np.uint16)])
def test_noise_has_the_spread_that_the_protocol_says(bits, kind):
    sensor = Sensor(0.9, 0.0, read=1.5, shot=0.3, grain=0.02, bits=bits)
    level = 0.4 * 255
    exposed = sensor.expose(np.full((400, 500), 0.4, np.float32), np.random.default_rng(0))
    scale = (2**bits - 1) / 255
    expected = scale * math.sqrt(1.5**2 + 0.3**2 * level + (0.02 * level) ** 2 + 1 / 12 / scale**2)
    assert exposed.dtype == kind
    assert exposed.std() == pytest.approx(expected, rel=0.01)  # of 200 000 samples: 0.2 %
    assert exposed.mean() == pytest.approx(scale * level, abs=0.05 * scale)


def test_vignetting_darkens_corners_by_what_it_says():
    exposed = Sensor(0.9, 0.3, 0, 0, 0, bits=12).expose(np.full((100, 160), 0.5, np.float32), None)
    assert exposed[0, 0] / exposed[50, 80] == pytest.approx(0.7, abs=0.005)


def test_a_camera_that_looks_straight_down_is_refused():
    with pytest.raises(ValueError, match="straight"):
        PinholeCamera.aim(
            "c",
            size_px=(64, 48),
            focal_px=100.0,
            distortion=np.zeros(5),
            position_mm=np.array([0, 0, 9.0]),
            target_mm=np.zeros(3),
        )
