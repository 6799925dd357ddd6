"""How exactly the rig's pictures are rasterised: wires and board corners against projection by OpenCV, without noise.

    python tests/studies/accuracy/renderer.py

Prints bias and RMS in pixels: of wires' centres over orientations, for each thickness and blur, straight and bent; of
board corners for each blur. Nothing of `vision` measures them: centres are centroids, corners are saddle points of a
spline.
"""

import itertools
import math
import sys
from pathlib import Path

import numpy as np
from scipy import ndimage

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig import boards, build
from bench.rig.light import Light, Material
from bench.rig.pinhole import PinholeCamera
from bench.rig.protocol import load
from bench.rig.sensor import Sensor
from bench.rig.studio import Studio
from bench.rig.tube import Tube
from bench.rig.window import Window

CAMERA = PinholeCamera.aim(
    "small",
    size_px=(320, 240),
    focal_px=2000.0,
    distortion=(-0.11, 0.14, 0.0006, -0.0004, 0.01),
    position_mm=np.array([0.0, -400.0, 50.0]),
    target_mm=np.zeros(3),
)
EVEN = Light(np.array([0.0, -1.0, 0.0]), lamp=0.0, soft=1.0)
GROUND, TONE = 0.1, 0.5
WIDTHS_PX, BLURS_PX = (1.5, 5.7, 12.0), (0.6, 0.9, 2.0)
ANGLES_DEG = (0, 0.5, 3, 30, 44, 46, 60, 89.7, 90, 120, 135, 170)
BENT_RADIUS_MM = 230.0  # of a whisker pushed by 5° at 60 mm


def rasterised(tube, blur_px, *, fine=3, soft_px=0.2, ground=GROUND, light=EVEN):
    """Brightness (rows, columns) of a tube before an even ground."""
    margin = math.ceil(4 * blur_px) + 1
    window = Window.whole(CAMERA, fine, min(soft_px, blur_px), margin)
    radiance = np.full(window.shape, ground, np.float32)
    tube.draw(window, radiance, light)
    return window.blur_to_pixels(radiance, blur_px)[margin:-margin, margin:-margin]


def wire(angle_deg, width_px, material=None, bent=False):
    """Through the picture's middle at an angle, somewhat oblique to it, of about this width; or an arc there."""
    to_rig, angle = CAMERA.rotation.T, math.radians(angle_deg)
    along = to_rig @ np.array([math.cos(angle), math.sin(angle), 0.2])
    middle = to_rig @ np.array([0.013, 0.009, 0]) * angle_deg / 10
    radius = width_px * CAMERA.in_camera(np.zeros(3))[2] / 2000 / 2
    material = material or Material(TONE)
    if not bent:
        return Tube.straight(middle - 30 * along, middle + 30 * along, radius, material)
    side = to_rig @ np.array([-math.sin(angle), math.cos(angle), 0.1])
    way = np.linspace(-30, 30, 257)[:, None] / BENT_RADIUS_MM
    axis = middle + BENT_RADIUS_MM * (np.sin(way) * along + (1 - np.cos(way)) * side)
    return Tube(axis, np.full(257, radius), material)


def crossing(line_px, at, axis):
    """Where a line of points crosses columns (axis 0) or rows (axis 1)."""
    order = np.argsort(line_px[:, axis])
    return np.interp(at, line_px[order, axis], line_px[order, 1 - axis])


def wire_profiles(tube, angle_deg, blur_px):
    """(positions, axis, profiles): the share of the wire in 50 lines of pixels that cross it."""
    amount = (rasterised(tube, blur_px) - GROUND) / (TONE - GROUND)
    axis = 0 if abs(math.cos(math.radians(angle_deg))) > 0.7 else 1
    profile = (amount if axis == 0 else amount.T).astype(float)
    at = np.arange(profile.shape[1] // 2 - 25, profile.shape[1] // 2 + 25)
    return at, axis, profile[:, at]


def wire_errors_px(width_px, blur_px, bent=False):
    """(angles, 50) twice: centroids across evenly bright wires, minus the middle between the two silhouettes, and minus
    the projected centreline.

    The first is exact but for the rasterising. A thick wire, oblique to the view or bent, is not seen midway about its
    centreline in a column: the second holds that too, at a width of 12 px up to 0.006 px where it is straight.
    """
    middle_errors, axis_errors = [], []
    for angle_deg in ANGLES_DEG:
        tube = wire(angle_deg, width_px, bent=bent)
        at, axis, lines = wire_profiles(tube, angle_deg, blur_px)
        centroid = (lines * np.arange(len(lines))[:, None]).sum(0) / lines.sum(0)
        middle = 0.5 * sum(crossing(edge, at, axis) for edge in tube.silhouette(CAMERA))
        shift = blur_shift_px(at, middle, blur_px)
        middle_errors.append(centroid - middle - shift)
        axis_errors.append(centroid - crossing(CAMERA.project(tube.axis_mm), at, axis) - shift)
    return np.array(middle_errors), np.array(axis_errors)


def blur_shift_px(at, line, blur_px):
    """What a blur of variance s² along x adds to the centroid of a column across a line y(x) of even thickness:
    s²·(y″/2 + y′·w′/w), the height in a column being w ∝ √(1 + y′²). The pixel's own width counts 1/12.
    """
    _, steep, curved = np.polynomial.Polynomial.fit(at - at.mean(), line, 3).convert().coef[:3]
    return (blur_px**2 + 1 / 12) * 2 * curved * (0.5 + steep**2 / (1 + steep**2))


def corner_errors_px(blur_px):
    """Saddle points minus projected corners, (n, 2) a picture: rig pictures and views of a held board."""
    protocol, errors = load("quick"), []
    board, scene = build.board(protocol), build.scene(protocol)
    for camera in build.cameras(protocol):
        studio = Studio(camera, scene, Sensor(blur_px, 0, 0, 0, 0))
        pose = boards.draw_poses(board, camera, 3, np.random.default_rng(3))[2]
        for picture, T in (
            (studio.rig_brightness(), build.T_rig_board(protocol)),
            (studio.board_brightness(pose), pose),
        ):
            px = camera.project(board.corners_mm @ T[:, :3].T + T[:, 3])
            inside = ((px > 25) & (px < np.array(camera.size_px) - 25)).all(1)
            errors.append(np.array([saddle_px(picture, p, blur_px) - p for p in px[inside]]))
    return errors


def saddle_px(picture, near, blur_px):
    """Where the gradient vanishes, by Newton's method on a quintic spline: exact on a point-symmetric corner."""
    half = int(6 * blur_px + 6)
    centre = np.round(near).astype(int)
    cut = picture[
        centre[1] - half : centre[1] + half + 1, centre[0] - half : centre[0] + half + 1
    ].astype(float)
    spline = ndimage.spline_filter(ndimage.gaussian_filter(cut, 0.8), 5)

    def value(dx, dy):
        return ndimage.map_coordinates(
            spline, [[at[1] + dy], [at[0] + dx]], order=5, prefilter=False
        )[0]

    at, h = near - centre + half, 0.05
    for _ in range(6):
        slope = np.array([value(h, 0) - value(-h, 0), value(0, h) - value(0, -h)]) / (2 * h)
        mixed = (value(h, h) - value(h, -h) - value(-h, h) + value(-h, -h)) / (4 * h * h)
        xx, yy = ((value(*d) - 2 * value(0, 0) + value(*(-d))) / h**2 for d in h * np.eye(2))
        at = at - np.linalg.solve(np.array([[xx, mixed], [mixed, yy]]), slope)
    return at + centre - half


def main() -> None:
    print(
        "wires: bias of the worst orientation and RMS against the seen middle; bias and RMS against the centreline"
    )
    for bent, width_px, blur_px in itertools.product((False, True), WIDTHS_PX, BLURS_PX):
        middle, axis = wire_errors_px(width_px, blur_px, bent)
        worst = max(middle.mean(1), key=abs)
        name = f"{'bent' if bent else 'straight':<9}{width_px:4} px, blur {blur_px} px"
        print(f"{name}: {worst:+.4f} {rms(middle):.4f}   {axis.mean():+.4f} {rms(axis):.4f}")
    print("board corners: bias of the worst picture, RMS")
    for blur_px in BLURS_PX:
        errors = corner_errors_px(blur_px)
        worst, every = max(np.abs(e.mean(0)).max() for e in errors), np.concatenate(errors)
        print(f"{len(every)} corners, blur {blur_px} px: {worst:.4f} {rms(every):.4f}")


def rms(errors) -> float:
    return float(np.sqrt(np.mean(errors**2)))


if __name__ == "__main__":
    main()
