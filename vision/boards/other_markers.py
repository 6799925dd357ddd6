"""Markers of the board's dictionary that are not the board's: on the hub, on a clamp.

OpenCV finds a marker to about a pixel; where its corners are follows from the printed pattern as a
whole. With u, v the place of a pixel on the print, in modules, by a homography:

    grey = light + contrast · sum over modules p_ij b_i(u) b_j(v)

p is 1 in white modules and 0 in black ones, b a module's box blurred by a Gaussian whose width in px
is fitted along both sides. Light and contrast are linear over the picture. What surrounds the white
rim is unknown, so pixels that it blurs into are left out.
"""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtr

from vision.boards.corners import to_8_bit
from vision.boards.homography import map_places, slopes_of
from vision.boards.markers import detect_markers, marker_dictionary
from vision.geometry.board import Board

# [px] Pixels about a marker that are cut out with it: what OpenCV's corners are off by. Stated.
_MARGIN_PX = 15
# [px] Blur that the fit starts from, sigma: of a marker in focus. Stated.
_FIRST_BLUR_PX = 1.0
# [px] Sharper is a pixel's edge, softer no edge: as of saddles (vision/boards/saddle.py). Stated.
_BLUR_LIMITS_PX = (0.2, 8.0)
# [sigma of blur] Of a pixel from the rim's outer edge: 1.2 % of what is beyond shows there. Derived.
_CLEAR_OF_SURROUND = 2.25
# [modules] The white rim that every marker has. A layout, no threshold.
_RIM = 1.0
# [1] Correlation of pattern and picture: less is glare, a hidden corner, or no marker. 0.75 to 0.92
# find the same markers. Study: tests/vision/boards/test_other_markers.py.
_LEAST_CORRELATION = 0.85
# [passes] Over which pixels are used, as the blur is known better. Stated.
_PASSES = 2
# [1] Of the sum of squares, and of the parameters: a thousandth of a corner's sigma. Derived.
_CONVERGED = 1e-6
# [pixels] Of a module; with fewer it is no pattern. Stated.
_LEAST_PIXELS_A_MODULE = 4
# [parameters] Homography to the print, logarithms of the blur along both sides, light, contrast. A
# layout, no threshold.
_TO_PRINT, _BLUR, _LIGHT, _CONTRAST = slice(0, 8), slice(8, 10), slice(10, 13), slice(13, 16)
# [parameters] Of homography and blur, which come first. A layout, no threshold.
_GEOMETRY = 10
# [1] Over sqrt(2 pi): a normal density. Derived.
_DENSITY = 1.0 / np.sqrt(2.0 * np.pi)


@dataclass(frozen=True, eq=False)
class Marker:
    """A marker in a picture: its number in the dictionary, and its corners px (4, 2) in OpenCV's
    order.
    """

    number: int
    px: np.ndarray


def find_other_markers(grey: np.ndarray, board: Board) -> list[Marker]:
    """Find the markers of the board's dictionary that the board does not use, in a grey picture.

    With a board without markers all count, of DICT_5X5_100.
    """
    picture = to_8_bit(grey)
    if board.is_white_on_black:
        picture = 255 - picture
    name, first_spare = board.spare_markers
    dictionary = marker_dictionary(name)
    numbers, outlines_px = detect_markers(picture, name)
    found = []
    for number, outline_px in zip(numbers.tolist(), outlines_px):
        if number < first_spare:
            continue
        px = _refine(picture, dictionary, number, outline_px)
        if px is not None:
            found.append(Marker(number, px))
    return found


def _refine(
    picture: np.ndarray, dictionary: cv2.aruco.Dictionary, number: int, outline_px: np.ndarray
) -> np.ndarray | None:
    """Return a marker's corners (4, 2), px, by its whole pattern; None where that does not fit."""
    modules = dictionary.markerSize + 2
    is_white = cv2.aruco.generateImageMarker(dictionary, number, modules) > 0
    low = np.maximum(np.floor(outline_px.min(axis=0) - _MARGIN_PX).astype(int), 0)
    high = np.ceil(outline_px.max(axis=0)).astype(int) + _MARGIN_PX
    window = picture[low[1] : high[1], low[0] : high[0]].astype(float)
    fitted = _fit_pattern(
        window, np.pad(is_white.astype(float), 1, constant_values=1.0), outline_px - low
    )
    return None if fitted is None else fitted + low


def _fit_pattern(
    window: np.ndarray, pattern: np.ndarray, corners_px: np.ndarray
) -> np.ndarray | None:
    """Return the corners (4, 2), px, of a pattern of modules in a window of a picture, near these;
    None where it does not fit.

    pattern (m, m): 1 where a module is white, with the white rim.
    """
    units = _MarkerUnits.about(corners_px)
    on_print = _corners_on_print(len(pattern))
    parameters = _first_parameters(units, corners_px, on_print)
    places = units.of_window(window.shape)
    for _ in range(_PASSES):
        is_used = _shows_pattern(places, parameters, len(pattern))
        if is_used.sum() < _LEAST_PIXELS_A_MODULE * pattern.size:
            return None
        model = _Pattern(places[is_used], window.ravel()[is_used], pattern)
        fitted = model.fit(parameters)
        if fitted is None:
            return None
        parameters = fitted[:_GEOMETRY]
    if not _is_pattern(model, fitted, units.scale_px):
        return None
    from_print = np.linalg.inv(_homography(parameters))
    return units.to_px(map_places(from_print, on_print)[0])


@dataclass(frozen=True, eq=False)
class _MarkerUnits:
    """Convert pixels to places from a marker's middle (2,), px, in units of its size, px, in which
    homographies are well conditioned.
    """

    middle_px: np.ndarray
    scale_px: float

    @staticmethod
    def about(corners_px: np.ndarray) -> "_MarkerUnits":
        """Return the units of a marker with these corners (4, 2)."""
        middle_px = corners_px.mean(axis=0)
        return _MarkerUnits(middle_px, np.linalg.norm(corners_px - middle_px, axis=1).mean())

    def from_px(self, px: np.ndarray) -> np.ndarray:
        """Return places (n, 2) of pixels (n, 2)."""
        return (px - self.middle_px) / self.scale_px

    def of_window(self, shape: tuple[int, ...]) -> np.ndarray:
        """Return places (n, 2) of all pixels of a window of this shape (h, w), row by row."""
        rows, columns = np.indices(shape).reshape(2, -1)
        return self.from_px(np.column_stack([columns, rows]))

    def to_px(self, places: np.ndarray) -> np.ndarray:
        """Return pixels (n, 2) of places (n, 2)."""
        return self.middle_px + self.scale_px * places


def _first_parameters(
    units: _MarkerUnits, corners_px: np.ndarray, on_print: np.ndarray
) -> np.ndarray:
    """Return homography and blur (10,) by a marker's corners (4, 2) in the picture and on the print."""
    corners = units.from_px(corners_px).astype(np.float32)
    to_print = cv2.getPerspectiveTransform(corners, on_print).ravel()[:8]
    return np.append(to_print, np.log(np.repeat(_FIRST_BLUR_PX / units.scale_px, 2)))


def _is_pattern(model: "_Pattern", fitted: np.ndarray, scale_px: float) -> bool:
    """Return whether the picture is as fitted, and the blur along both sides that of an edge.

    fitted (16,): all parameters. scale_px: of the marker.
    """
    blur_px = scale_px * np.exp(fitted[_BLUR])
    if not np.all((blur_px > _BLUR_LIMITS_PX[0]) & (blur_px < _BLUR_LIMITS_PX[1])):
        return False
    return bool(np.corrcoef(model.predict(fitted), model.grey)[0, 1] >= _LEAST_CORRELATION)


def _corners_on_print(modules: int) -> np.ndarray:
    """Return the corners (4, 2) of a marker in a rim, in modules from the rim's own corner, as OpenCV
    takes them.
    """
    far = modules - _RIM
    return np.array([[_RIM, _RIM], [far, _RIM], [far, far], [_RIM, far]], dtype=np.float32)


def _homography(parameters: np.ndarray) -> np.ndarray:
    """Return the homography (3, 3) from the picture to the print."""
    return np.append(parameters[_TO_PRINT], 1.0).reshape(3, 3)


def _blur_on_print(uv: np.ndarray, depth: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Return the blur (n, 2) along u and v, in modules."""
    rate = np.linalg.norm(slopes_of(_homography(parameters), uv, depth), axis=2)
    return rate * np.exp(parameters[_BLUR])


def _shows_pattern(places: np.ndarray, parameters: np.ndarray, modules: int) -> np.ndarray:
    """Return which places (n, 2) show the marker and its rim, and not what is beyond, (n,) bool."""
    uv, depth = map_places(_homography(parameters), places)
    clear = np.minimum(_CLEAR_OF_SURROUND * _blur_on_print(uv, depth, parameters), _RIM)
    return np.all((uv > clear) & (uv < modules - clear), axis=1) & (depth > 0)


@dataclass(frozen=True, eq=False)
class _Pattern:
    """The picture of a pattern (m, m) at places (n, 2), with its grey levels (n,)."""

    places: np.ndarray
    grey: np.ndarray
    pattern: np.ndarray

    @cached_property
    def _light(self) -> np.ndarray:
        """Return the columns (n, 3) of light that is linear over the picture."""
        return np.column_stack([np.ones(len(self.places)), self.places])

    def light_and_contrast(self, parameters: np.ndarray) -> np.ndarray:
        """Return the light and the contrast (6,) that fit best."""
        share = self._white_share(parameters).share
        design = np.column_stack([self._light, share[:, None] * self._light])
        return np.linalg.lstsq(design, self.grey, rcond=None)[0]

    def fit(self, first: np.ndarray) -> np.ndarray | None:
        """Return all parameters (16,) that fit best, from those of homography and blur (10,); None
        where the fit does not converge.
        """
        start = np.append(first, self.light_and_contrast(first))
        fitted = least_squares(
            self.residuals, start, self.jacobian, method="lm", ftol=_CONVERGED, xtol=_CONVERGED
        )
        if fitted.status <= 0 or not np.all(np.isfinite(fitted.x[:_GEOMETRY])):
            return None
        return fitted.x

    def predict(self, parameters: np.ndarray) -> np.ndarray:
        """Return the grey levels (n,)."""
        light = self._light @ parameters[_LIGHT]
        share = self._white_share(parameters).share
        return light + share * (self._light @ parameters[_CONTRAST])

    def residuals(self, parameters: np.ndarray) -> np.ndarray:
        """Return the grey levels (n,) less those of the picture."""
        return self.predict(parameters) - self.grey

    def jacobian(self, parameters: np.ndarray) -> np.ndarray:
        """Return the derivatives (n, 16) of the residuals.

        How the blur's width in modules changes with the homography is left out: it moves no edge.
        """
        white = self._white_share(parameters)
        contrast = self._light @ parameters[_CONTRAST]
        J = np.empty((len(self.places), 16))
        J[:, _TO_PRINT] = self._by_homography(parameters, contrast[:, None] * white.by_uv)
        J[:, _BLUR] = contrast[:, None] * white.by_log_blur
        J[:, _LIGHT] = self._light
        J[:, _CONTRAST] = white.share[:, None] * self._light
        return J

    def _by_homography(self, parameters: np.ndarray, by_uv: np.ndarray) -> np.ndarray:
        """Return derivatives (n, 8) by the homography, from those by u and v (n, 2)."""
        uv, depth = map_places(_homography(parameters), self.places)
        by_numerator = by_uv / depth[:, None]  # (n, 2)
        by_denominator = -np.einsum("ni,ni->n", by_numerator, uv)
        xy1 = self._light[:, [1, 2, 0]]
        by_u = by_numerator[:, :1] * xy1
        by_v = by_numerator[:, 1:] * xy1
        return np.hstack([by_u, by_v, by_denominator[:, None] * self.places])

    def _white_share(self, parameters: np.ndarray) -> "_WhiteShare":
        """Return how white the print is at each place, under the blur there."""
        H = _homography(parameters)
        uv, depth = map_places(H, self.places)
        blur = _blur_on_print(uv, depth, parameters)
        cosine = _cosine_of_sides(slopes_of(H, uv, depth))
        return _WhiteShare(
            self.pattern,
            _BlurredModules.at(uv[:, 0], blur[:, 0], len(self.pattern)),
            _BlurredModules.at(uv[:, 1], blur[:, 1], len(self.pattern)),
            blur,
            cosine * np.prod(blur, axis=1),
        )


def _cosine_of_sides(slopes: np.ndarray) -> np.ndarray:
    """Return the cosine (n,) of the angle between the gradients of u and v, of slopes (n, 2, 2)."""
    along_both = np.sum(slopes[:, 0] * slopes[:, 1], axis=1)
    return along_both / np.prod(np.linalg.norm(slopes, axis=2), axis=1)


@dataclass(frozen=True, eq=False)
class _WhiteShare:
    """The white share of n places on a blurred pattern (m, m).

    across, down: the modules along u and v. blur (n, 2): along both, in modules. covariance (n,): of
    the blur along u with that along v. Where the print is seen aslant these are correlated:
    exp(covariance ∂²/∂u∂v) of the share without that is taken to its second order.
    """

    pattern: np.ndarray
    across: "_BlurredModules"
    down: "_BlurredModules"
    blur: np.ndarray
    covariance: np.ndarray

    @property
    def share(self) -> np.ndarray:
        """Return the share (n,) itself."""
        share = self._sum(self.down.share, self.across.share)
        share += self.covariance * self._sum(self.down.slope, self.across.slope)
        share += 0.5 * self.covariance**2 * self._sum(self.down.bend, self.across.bend)
        return share

    @property
    def by_uv(self) -> np.ndarray:
        """Return the derivatives (n, 2) by u and v, to the first order in the covariance."""
        by_u = self._sum(self.down.share, self.across.slope)
        by_u += self.covariance * self._sum(self.down.slope, self.across.bend)
        by_v = self._sum(self.down.slope, self.across.share)
        by_v += self.covariance * self._sum(self.down.bend, self.across.slope)
        return np.column_stack([by_u, by_v])

    @property
    def by_log_blur(self) -> np.ndarray:
        """Return the derivatives (n, 2) by the logarithm of the blur along u and v.

        A Gaussian's width s changes a blurred edge by s² times its second derivative.
        """
        by_u_blur = self.blur[:, 0] ** 2 * self._sum(self.down.share, self.across.bend)
        by_v_blur = self.blur[:, 1] ** 2 * self._sum(self.down.bend, self.across.share)
        return np.column_stack([by_u_blur, by_v_blur])

    def _sum(self, of_v: np.ndarray, of_u: np.ndarray) -> np.ndarray:
        """Return the sum (n,) over modules of factors (n, m) of their rows and columns."""
        return np.sum((of_v @ self.pattern) * of_u, axis=1)


@dataclass(frozen=True, eq=False)
class _BlurredModules:
    """The share of each module in a row at places, (n, m), with its first and second derivative by
    the place. The outer modules go on without end.
    """

    share: np.ndarray
    slope: np.ndarray
    bend: np.ndarray

    @staticmethod
    def at(place: np.ndarray, blur: np.ndarray, modules: int) -> "_BlurredModules":
        """Return the shares at places (n,), blurred by sigmas (n,), in modules."""
        blur = blur[:, None]
        t = (place[:, None] - np.arange(1, modules)) / blur  # (n, m - 1), of the inner edges
        density = _DENSITY * np.exp(-0.5 * t**2) / blur
        return _BlurredModules(
            _between(ndtr(t), 1.0), _between(density, 0.0), _between(-t / blur * density, 0.0)
        )


def _between(past_edge: np.ndarray, past_first: float) -> np.ndarray:
    """Return values (n, m) of modules from those past their edges (n, m - 1), and past the first's."""
    first = np.full((len(past_edge), 1), past_first)
    last = np.zeros((len(past_edge), 1))
    return -np.diff(np.hstack([first, past_edge, last]), axis=1)
