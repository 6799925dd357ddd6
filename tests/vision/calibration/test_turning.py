"""The first look at the rig: exact on exact lines, not led astray by others, and a drawn line found to a pixel."""

import numpy as np
import pytest

from tests.scenes.model_scenes import CAMERAS
from vision.calibration.hub_turning import first_rig, first_rig_about
from vision.calibration.moving_line import MovingLines, moving_lines
from vision.geometry.refusals import Refused
from vision.geometry.rotation import apply, compose, exp_rotation, invert_transform

T_WORLD_RIG = np.column_stack([exp_rotation(np.array([0.4, -2.0, 0.9])), [30.0, -200.0, 410.0]])


def fan(motor_deg, bend_after_deg=np.inf, noise_mm=0.0, rng=None):
    """Lines of a whisker that turns in T_WORLD_RIG, and lags behind by half of what it is pushed."""
    motor = np.radians(motor_deg)
    lag = 0.5 * np.maximum(motor - np.radians(bend_after_deg), 0.0)
    along = np.column_stack([np.cos(motor - lag), np.sin(motor - lag), np.zeros(len(motor))])
    points = apply(T_WORLD_RIG, 55.0 * along)
    if noise_mm:
        points = points + noise_mm * rng.standard_normal(points.shape)
    either_way = np.where(np.arange(len(motor)) % 2, 1.0, -1.0)[:, None]
    return MovingLines(motor, points, either_way * (along @ T_WORLD_RIG[:, :3].T))


def off(found):
    """mm and rad between the frame found and the true one."""
    T = compose(found.T_rig_world, T_WORLD_RIG)
    return np.linalg.norm(T[:, 3]), np.linalg.norm(T[:, :3] - np.eye(3)) / np.sqrt(2)


def test_exact_lines_give_the_rig_exactly():
    found = first_rig([fan(np.linspace(-20, 2, 12)), fan(np.linspace(-9, 1, 6))])
    # Rounding of 1e-16 over a fan of 0.4 rad and 500 mm.
    assert off(found) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert np.degrees(found.width_rad) == pytest.approx(22.0) and found.strokes == 2


def test_a_touching_whisker_and_strays_are_left_out():
    lines = fan(np.linspace(-20, 6, 27), bend_after_deg=0.0)
    lines.point_mm[9] += 30.0
    lines.direction[12] = [0.0, 0.0, 1.0]
    found = first_rig([lines])
    # Lines within 1 mm of where the motor has them count: at 55 mm a whisker that lags by 1 degree. Two such of 20.
    assert np.degrees(found.width_rad) == pytest.approx(20.0, abs=2.0)
    shift_mm, turn_rad = off(found)
    assert shift_mm < 1.0 and turn_rad < np.radians(0.5)


def test_a_centre_is_found_as_well_as_the_fan_tells():
    rng = np.random.default_rng(3)
    shifts = [
        off(first_rig([fan(np.linspace(-20, 0, 21), noise_mm=0.1, rng=rng)]))[0] for _ in range(50)
    ]
    # Along the whisker 0.1 mm / √21 over the fan's standard deviation of 0.106 rad: 0.21 mm, across a tenth of that.
    assert 0.14 < np.sqrt(np.mean(np.square(shifts))) < 0.28


def test_about_a_known_axis_a_stroke_of_a_degree_does():
    """The axis as a marker gives it: elsewhere along itself, its x anywhere."""
    turned = np.column_stack([exp_rotation(np.array([0.0, 0.0, 1.1])), [0.0, 0.0, 7.0]])
    lines = fan(np.linspace(0.5, 7.0, 14), bend_after_deg=2.3)
    lines.direction[2] = [0.0, 0.0, 1.0]  # a stray
    found = first_rig_about(compose(T_WORLD_RIG, turned), [lines])
    shift_mm, turn_rad = off(found)
    # Lines of the first quarter of the stroke, which are free, lie on the whisker.
    assert shift_mm < 1e-6 and turn_rad < 1e-6


def test_about_an_axis_that_no_line_passes_nothing_is_found():
    beside = np.column_stack([np.eye(3), [0.0, 30.0, 0.0]])
    with pytest.raises(Refused, match="nothing is seen to turn"):
        first_rig_about(compose(T_WORLD_RIG, beside), [fan(np.linspace(0.5, 7.0, 14))])


def test_nothing_that_turns_is_refused():
    still = fan(np.linspace(-2, 2, 3))
    with pytest.raises(
        Refused, match=r"nothing is seen to turn .*record free strokes of some 10 degrees"
    ):
        first_rig([still])


def test_a_drawn_line_is_found():
    rng = np.random.default_rng(1)
    motor = dict(enumerate(np.radians(np.linspace(-12.0, 0.0, 17))))
    frames = {c.name: {f: drawn(c, m, rng) for f, m in motor.items()} for c in CAMERAS}
    lines = moving_lines(frames, motor, CAMERAS)
    assert len(lines.motor_rad) == len(motor)
    along = np.column_stack(
        [np.cos(lines.motor_rad), np.sin(lines.motor_rad), np.zeros(len(motor))]
    )
    # A line of 300 px found to a pixel at its ends, by two cameras that see it from one side and triple that.
    assert np.linalg.norm(np.cross(along, lines.direction), axis=1).max() < 3 / 150
    # And to half a pixel of 0.2 mm in its middle, tripled.
    assert np.linalg.norm(np.cross(along, lines.point_mm), axis=1).max() < 0.3
    assert invert_transform(first_rig([lines]).T_rig_world)[:, 3] == pytest.approx(
        [0, 0, 0], abs=1.5
    )


def drawn(camera, motor_rad, rng):
    """A grey picture of a bright line of 100 mm from the rig's origin, and of a still bright block beside it."""
    width, height = camera.size_px
    grey = 60.0 + 2.0 * rng.standard_normal((height, width))
    grey[: height // 4, : width // 4] += 90.0
    arc = np.linspace(0.0, 100.0, 2000)[:, None]
    px = camera.project(arc * [np.cos(motor_rad), np.sin(motor_rad), 0.0])
    for row in (-2, -1, 0, 1, 2):
        column, line = np.round(px + np.array([0, row])).astype(int).T
        inside = (column >= 0) & (column < width) & (line >= 0) & (line < height)
        grey[line[inside], column[inside]] = 160.0
    return grey
