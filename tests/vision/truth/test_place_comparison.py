"""Whether painted pictures contradict a bar that is drawn elsewhere; and what follows from that."""

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from tests.scenes.recorded import RODS, Recorded
from tests.studies.accuracy.bar_scenes import read_scene
from vision.geometry.camera import Camera
from vision.geometry.centreline import Curves
from vision.geometry.contact import BarAxis, axis_frame
from vision.geometry.reasons import NO_REASON
from vision.geometry.refusals import Refused
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.pixel_noise import Noise
from vision.pictures.view import View
from vision.touched.search import SeenBar, find_object
from vision.truth import explanations, observe
from vision.truth.explanations import Explanation, best_explanation
from vision.truth.observe import observe_trial
from vision.truth.place_comparison import PlaceComparison
from vision.truth.trial_pictures import TrialPictures
from vision.truth.value import Value

SIZE_PX = (420, 360)
FOCAL_PX = 1600.0
DISTANCE_MM = 320.0
TRUE = BarAxis(np.array([60.0, 5.0, 0.0]), np.array([0.0, 0.2, 0.98]) / np.hypot(0.2, 0.98))
PAPER = 150.0
BAR = 60.0
FINE = 4  # of a pixel, in which a painted edge is exact


def camera(name: str, sight: tuple[float, float, float]) -> Camera:
    """A camera that looks along a direction at the bar's point."""
    forward = np.array(sight) / np.linalg.norm(sight)
    right = np.cross(forward, [0.3, 0.1, 1.0])
    right /= np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward])
    centre = TRUE.point_mm - DISTANCE_MM * forward
    middle = 0.5 * (np.array(SIZE_PX) - 1.0)
    matrix = np.array([[FOCAL_PX, 0, middle[0]], [0, FOCAL_PX, middle[1]], [0, 0, 1.0]])
    return Camera(name, SIZE_PX, matrix, np.zeros(5), np.column_stack([R, -R @ centre]))


CAMERAS = (camera("high", (0.1, 1.0, -0.6)), camera("low", (-0.9, 0.9, 0.2)))


def view(
    seen_by: Camera,
    rng: np.random.Generator,
    shadow: float,
) -> View:
    """A bar before a printed background. shadow: how bright that is in a strip as wide as the bar, beside it."""
    height, width = SIZE_PX[1], SIZE_PX[0]
    coarse = rng.uniform(0.8, 1.2, (height // 12, width // 12))
    empty = PAPER * cv2.resize(coarse, SIZE_PX, interpolation=cv2.INTER_LINEAR)
    bare = _painted(empty, seen_by, (1.3, 3.3), shadow * empty)
    bare = _painted(bare, seen_by, (-1.0, 1.0), np.full_like(empty, BAR))
    blurred = cv2.GaussianBlur(bare, (0, 0), 0.9)
    frames = {k: blurred + rng.normal(0.0, 3.0, blurred.shape) for k in range(3)}
    background = empty + rng.normal(0.0, 3.0, empty.shape)
    return View(seen_by, frames, background, Noise(9.0, 0.0))


def _painted(
    picture: np.ndarray, seen_by: Camera, part: tuple[float, float], paint: np.ndarray
) -> np.ndarray:
    """The picture with paint on a strip along the bar, from one lateral place to another in radii."""
    one, other = TRUE.edges_px(seen_by, RODS.bar.radius_mm, 60.0, 2)
    corners = []
    for place, ends in zip(part, (slice(None), slice(None, None, -1))):
        corners += list((one + 0.5 * (place + 1.0) * (other - one))[ends])
    fine = np.zeros((FINE * SIZE_PX[1], FINE * SIZE_PX[0]), dtype=np.float32)
    nodes = FINE * (np.array(corners) + 0.5) - 0.5
    cv2.fillPoly(fine, [np.round(nodes).astype(np.int32)], 1.0)
    share = cv2.resize(fine, SIZE_PX, interpolation=cv2.INTER_AREA)
    return picture + share * (paint - picture)


def wire() -> dict[int, Curves]:
    """A straight wire across the bar, the same in three frames."""
    arc = np.linspace(0.0, 100.0, 21)
    points = arc[:, None] * np.array([1.0, 0.0, 0.0])
    curve = Curves(arc, points, np.tile([1.0, 0.0, 0.0], (21, 1)))
    return dict.fromkeys(range(3), curve)


def moved(mm: float, degrees: float, towards: float) -> BarAxis:
    """The true axis, shifted and turned in a direction, rad."""
    way = np.array([np.cos(towards), np.sin(towards)])
    vector = np.concatenate([mm * way, np.radians(degrees) * way])
    return TRUE.shifted(axis_frame(TRUE.direction), vector)


def comparison_about(drawn: BarAxis, shadow: float = 1.0) -> PlaceComparison:
    rng = np.random.default_rng(3)
    return PlaceComparison([view(one, rng, shadow) for one in CAMERAS], wire(), drawn, RODS)


def test_no_other_place_explains_more_than_the_true_one():
    comparison = comparison_about(TRUE)
    gain, _ = comparison.gain(comparison.best, TRUE)
    assert gain < 0.02 and comparison.apart_px(comparison.best, TRUE) < 2.0


@pytest.mark.parametrize(
    "drawn",
    [moved(1.5, 0.0, 1.0), moved(2.0, 0.0, 2.0), moved(0.5, 4.0, 4.0), moved(3.0, 3.0, 5.0)],
)
def test_the_place_that_explains_more_is_the_true_one(drawn):
    comparison = comparison_about(drawn)
    gain, sigma = comparison.gain(comparison.best, drawn)
    assert gain > 0.02 and gain > 2.5 * sigma
    assert comparison.apart_px(comparison.best, TRUE) < 2.0


def test_a_shadow_beside_the_bar_makes_no_other_place_better():
    comparison = comparison_about(TRUE, shadow=0.7)
    gain, sigma = comparison.gain(comparison.best, TRUE)
    assert gain < max(0.02, 2.5 * sigma) or comparison.apart_px(comparison.best, TRUE) < 2.0


@pytest.mark.parametrize("degrees, asked", [(8.0, 0), (25.0, 1)])
def test_a_camera_that_looks_along_the_bar_is_not_asked(degrees, asked):
    """60 mm of a bar of 6 mm look 10 sin(degrees) of its width long: 1.4 and 4.2, where 2 are needed."""
    across = axis_frame(TRUE.direction)[0]
    angle = np.radians(degrees)
    looks = camera("along", tuple(np.cos(angle) * TRUE.direction + np.sin(angle) * across))
    comparison = PlaceComparison([view(looks, np.random.default_rng(3), 1.0)], wire(), TRUE, RODS)
    assert len(comparison.bands) == asked


def test_a_bar_behind_a_camera_is_refused():
    """It has no outline there to compare."""
    forward = CAMERAS[0].T_camera_rig[2, :3]
    behind = BarAxis(CAMERAS[0].centre_mm - 50.0 * forward, TRUE.direction)
    with pytest.raises(Refused) as refused:
        comparison_about(behind)
    assert refused.value.code == "bar_behind_camera"


def test_a_wire_on_the_bar_is_left_out():
    hidden = comparison_about(TRUE).bands[0].changed == 0.5
    assert 0.005 < np.mean(hidden) < 0.1


@dataclass
class Fit:
    """As much of a fitted whisk as explanations ask for."""

    x_mm: float
    d_x_mm: float

    def of_whisk(self, name: str):
        return Value(self.d_x_mm, 0.05)


@dataclass(frozen=True)
class Pictures:
    """As much of a whisk as explanations ask for."""

    light: dict
    bar: SeenBar
    motion: object = None
    views: tuple = (View(CAMERAS[0], {}, np.ones((2, 2)), Noise(1.0, 0.0)),)


class Placed(Explanation):
    """A fit at a place, whose fits from elsewhere are given."""

    @property
    def axis(self) -> BarAxis:
        return at(self.fitted.x_mm)

    @property
    def place_comparison(self):
        return ComparedPlaces()

    def from_place(self, axis: BarAxis):
        other = OTHERS[axis.point_mm[0]]
        if isinstance(other, Refused):
            raise other
        return other


class ComparedPlaces:
    """Places on a line, x mm; COVERED: the share of the bar's width that each explains."""

    bands = (None,)  # a camera

    @property
    def best(self) -> BarAxis:
        return at(BEST[0])

    def gain(self, place, other):
        return COVERED[place.point_mm[0]] - COVERED[other.point_mm[0]], 0.01

    def apart_px(self, place, other):
        return 10.0 * abs(place.point_mm[0] - other.point_mm[0])


COVERED: dict[float, float] = {}
OTHERS: dict[float, object] = {}
BEST: list[float] = []


def at(x_mm: float) -> BarAxis:
    return BarAxis(np.array([x_mm, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))


def placed(x_mm: float, d_x_mm: float, begin_mm: float | None = None) -> Placed:
    begin = x_mm if begin_mm is None else begin_mm
    return Placed(Pictures({"x": x_mm}, SeenBar(at(begin), {})), Fit(x_mm, d_x_mm))


@pytest.fixture
def world():
    """Three places: 0 as fitted, 5 the best, and 4 where the fit from there ends."""
    COVERED.clear()
    COVERED.update({0.0: 0.5, 5.0: 0.8, 4.0: 0.79})
    OTHERS.clear()
    OTHERS[5.0] = placed(4.0, 61.0)
    BEST[:] = [5.0]


def test_the_fit_that_explains_more_is_the_truth(world):
    first = placed(0.0, 60.0)
    COVERED[5.0] = 0.8
    best = best_explanation(first)
    assert best.fitted.d_x_mm == 61.0 and best.warning == NO_REASON
    assert best.whisk.light is first.whisk.light and first.whisk.light == {"x": 4.0}


def test_two_fits_that_explain_equally_much_are_no_number(world):
    COVERED[4.0] = 0.51
    with pytest.raises(Refused, match=r"1\.00 mm apart") as refused:
        best_explanation(placed(0.0, 60.0))
    assert refused.value.code == "two_explanations"


def test_two_fits_that_explain_equally_much_and_agree_are_one(world):
    COVERED[4.0] = 0.51
    OTHERS[5.0] = placed(4.0, 60.01)
    assert best_explanation(placed(0.0, 60.0)).fitted.d_x_mm == 60.0


@pytest.mark.parametrize("end", ["no fit there", "a fit that explains less"])
def test_a_better_place_where_no_whisk_fits_is_a_warning(world, end):
    COVERED[4.0] = 0.3
    if end == "no fit there":
        OTHERS[5.0] = Refused("nothing there")
    best = best_explanation(placed(0.0, 60.0))
    assert best.fitted.d_x_mm == 60.0 and best.warning.codes == ("bar_elsewhere",)


def test_what_the_pictures_do_not_contradict_is_fitted_once(world):
    COVERED[5.0] = 0.51
    OTHERS.clear()
    assert best_explanation(placed(0.0, 60.0)).warning == NO_REASON


def test_a_fit_that_ends_far_from_its_beginning_begins_again(world):
    COVERED.update({5.0: 0.5, 4.0: 0.5})
    OTHERS[0.0] = placed(0.1, 60.2)
    COVERED[0.1] = 0.5
    assert best_explanation(placed(0.0, 60.0, begin_mm=1.0)).fitted.d_x_mm == 60.2


@pytest.mark.parametrize("end", ["no fit there", "a fit that explains less", "always elsewhere"])
def test_a_fit_that_does_not_converge_has_a_warning(world, end):
    COVERED.update({5.0: 0.5, 4.0: 0.5})
    if end == "no fit there":
        OTHERS[0.0] = Refused("nothing there")
    elif end == "a fit that explains less":
        OTHERS[0.0] = placed(4.0, 61.0)
        COVERED[4.0] = 0.3
    else:
        OTHERS.update({0.0: placed(4.0, 61.0, 0.0), 4.0: placed(0.0, 60.0, 4.0)})
    best = best_explanation(placed(0.0, 60.0, begin_mm=1.0))
    assert best.warning.codes == ("bar_unconverged",)


def test_the_last_fit_may_converge(world):
    COVERED.update(dict.fromkeys([0.0, 1.0, 2.0, 2.1, 5.0], 0.5))
    OTHERS.update({0.0: placed(1.0, 61.0, 0.0), 1.0: placed(2.0, 62.0, 1.0)})
    OTHERS[2.0] = placed(2.1, 62.1, 2.0)
    best = best_explanation(placed(0.0, 60.0, begin_mm=-1.0))
    assert best.fitted.d_x_mm == 62.1 and best.warning == NO_REASON


def test_a_bar_that_moves_is_not_asked_about(world):
    first = placed(0.0, 60.0)
    moving = replace(first, whisk=replace(first.whisk, motion=object()))
    assert best_explanation(moving) is moving


def test_a_whisk_fitted_from_a_wrong_place_has_the_truth(small_session, monkeypatch):
    """The search ends 2 mm away; the fit from there ends elsewhere, and its own sigma does not cover that."""
    steep = Recorded(small_session, "b60_4")

    def find_elsewhere(scene):
        found = find_object(scene)
        frame = axis_frame(found.axis.direction)
        return replace(found, axis=found.axis.shifted(frame, np.array([1.5, -1.5, 0.0, 0.05])))

    monkeypatch.setattr(observe, "find_object", find_elsewhere)
    motor_rad = np.radians(steep.rows["motor_deg"])
    pictures = TrialPictures(steep.frames, steep.rows["time_s"], motor_rad, steep.background)
    whole = [slice(0, len(motor_rad))]
    trial = observe_trial(pictures, whole, steep.cameras, RODS, VisionSettings())
    (seen,) = trial.whisks
    assert abs(seen.d_x_mm.value - steep.truth["d_x_mm"]) < 3 * seen.d_x_mm.sigma
    assert seen.status == ""
    assert set(trial.bar_widths) == {"high", "low"}  # measured where the bar is
    for width in trial.bar_widths.values():
        assert abs(width.value - 1.0) < 3.0 * width.sigma


def shadowed():
    """Return the arguments of `observe_trial` for a polished bar beside its shadow, which is darker and as wide in one
    camera: its slope was false by 18 sigma."""
    scene = Path(__file__).parents[3] / "fixtures" / "scenes" / "sun"
    views, cameras, rods, motor_rad, _ = read_scene(scene)
    frames = {view.camera.name: view.frames for view in views}
    background = {view.camera.name: view.background for view in views}
    time_s = 0.05 * np.arange(len(motor_rad))
    pictures = TrialPictures(frames, time_s, motor_rad, background)
    return pictures, [slice(0, len(motor_rad))], cameras, rods, VisionSettings()


def assert_right(whisk):
    """Assert that d_x and slope are those of the scene's truth.toml."""
    assert abs(whisk.d_x_mm.value - 49.704) < 2.0 * whisk.d_x_mm.sigma
    assert abs(whisk.beta_rad.value - np.radians(-1.503)) < 2.0 * whisk.beta_rad.sigma


def test_a_bar_beside_its_shadow_is_found(monkeypatch):
    """The search excludes the bar, for its edge in one camera and the shadow's in the other are clearer; the fit leaves
    both for one that is less clear than the bar."""

    def find_without_rivals(scene):
        return replace(find_object(scene), rivals=())

    monkeypatch.setattr(observe, "find_object", find_without_rivals)
    (whisk,) = observe_trial(*shadowed()).whisks
    assert_right(whisk)


def test_of_a_bar_and_its_shadow_the_clearer_one_is_the_truth_and_the_other_is_told(monkeypatch):
    """The search takes the shadow, and finds the bar as clear."""

    def find_shadow(scene):
        found = find_object(scene)
        direction = np.array([0.01306, -0.19837, 0.98004])
        shadow = BarAxis(np.array([49.785, 1.701, 0.652]), direction)
        return replace(found, axis=shadow, lines={}, rivals=(found.axis, *found.rivals))

    monkeypatch.setattr(observe, "find_object", find_shadow)
    (whisk,) = observe_trial(*shadowed()).whisks
    assert_right(whisk)
    assert "bar_elsewhere" in whisk.status.codes


def test_where_the_pictures_cannot_be_compared_the_clearer_of_two_slopes_is_the_truth(monkeypatch):
    """Both cameras of a mirror looked along an upright bar: a fit that began 41° off ended at 113°, 580 sigma off."""
    upright = BarAxis(np.array([49.4, 5.6, 0.0]), np.array([0.0, 0.0, 1.0]))
    leaning = BarAxis(np.array([49.4, 3.4, 3.1]), np.array([0.0, -0.92, 0.39]))
    alone = object()  # no later whisk fits the one that has lost
    clear = SimpleNamespace(axis=upright, detection_score=8.0, without_rivals=lambda: alone)
    first = SimpleNamespace(axis=leaning, detection_score=-2.5, from_place=lambda _: clear)
    monkeypatch.setattr(explanations, "_comparison", lambda *_: None)
    monkeypatch.setattr(explanations, "_in_place_of", lambda _, best: best)
    assert explanations._weigh_rivals(first, [upright]) is alone
