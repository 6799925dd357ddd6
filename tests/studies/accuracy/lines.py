"""How well the profile fit finds a wire and a bar in pictures whose truth is known: bias, scatter, and what it says.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/lines.py [REPEATS]

Pictures are drawn on a grid five times as fine as the pixels with exact coverage at edges, blurred, and summed; nothing
of the fit is used. A scene is 13 frames of a wire 5.6 px wide that moves 4 px a frame over one background, as in a
whisk. Noise is 2 grey levels, contrast about 60. Columns:

- kept: points that the fit trusts, of all its pieces
- bias: mean error in px; stated: sigma of a shift of all points
- common: what of the error all frames share at a place, RMS over places about the bias. It goes into the rest shape and
  cancels in every difference; the fit of the whisk prices it
- scatter about that over the Cramér–Rao bound of one who knows everything but the centre (for an even rod:
  sigma_n/A sqrt(sqrt(pi) s / (L (1 - exp(-w²/4s²)))))
- z: the same over the stated sigma
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from vision.pictures.pixel_noise import Noise
from vision.wire.bands import cut_pieces, read_band
from vision.wire.shading import Knots
from vision.wire.trace import WireTrace, clear_of_bar, to_points, trace

FINE, FRAMES, SHAPE = 5, 13, (110, 300)
NOISE, PIECE_PX, MARGIN_PX = 2.0, 12, 7
BESIDE_BAR_PX = 4.0  # as vision.truth.observe has it


@dataclass(frozen=True)
class Scene:
    """A wire before a background.

    angle_deg (first, last frame); radius, blur in px; radiance(t, x): grey across (-1 … 1) and along; behind(x, y);
    bar: None, or a bar's (x at the wire, slope dx/dy, half-width, grey) behind the wire and not in the background.
    """

    angle_deg: tuple[float, float] = (3.0, 6.0)
    radius: float = 2.8
    blur: float = 0.9
    radiance: Callable = lambda t, x: 120.0 + 0.0 * t
    behind: Callable = lambda x, y: 60.0 + 0.0 * x
    bar: tuple[float, float, float, float] | None = None


def even(t, x):
    return 120.0 + 0.0 * t


def lit(t, x):
    """A round rod in soft light from one side with a highlight along it."""
    return 105.0 + 30.0 * t + 70.0 * np.exp(-0.5 * ((t + 0.4) / 0.25) ** 2)


def changing(t, x):
    """WireAppearance, and fading from light to dark along the wire."""
    return lit(t, x) - 0.45 * (x - 20.0)


def step(x, y):
    """A step of a fifth of the contrast under the wire's middle frames."""
    return np.where(y > 0.5 * SHAPE[0], 60.0, 48.0)


def squares(x, y):
    """Printed squares of 30 px."""
    return np.where((np.floor(x / 30.0) + np.floor(y / 30.0)) % 2 > 0, 20.0, 190.0)


def dark(t, x):
    return 25.0 + 8.0 * t


def lamp(elevation_deg: float) -> Callable:
    """A matt rod under one lamp at right angles to it, this high above the plane across the line of sight."""
    turn = np.radians(90.0 - elevation_deg)
    return lambda t, x: 20.0 + 120.0 * np.maximum(0.0, np.cos(np.arcsin(t) + turn))


def night(x, y):
    """As dark as the side of the rod that no lamp reaches."""
    return 20.0 + 0.0 * x


SCENES = {
    "even rod, flat background": Scene(),
    "highlight, flat": Scene(radiance=lit),
    "step of a fifth of the contrast": Scene(behind=step),
    "highlight and step": Scene(radiance=lit, behind=step),
    "highlight over printed squares": Scene(radiance=lit, behind=squares),
    "dark wire over squares": Scene(radiance=dark, behind=squares),
    "light to dark along the wire, squares": Scene(radiance=changing, behind=squares),
    "within 2° of the rows, highlight": Scene(radiance=lit, angle_deg=(-2.0, 2.0)),
    "blur 0.6 px, highlight, squares": Scene(radiance=lit, behind=squares, blur=0.6),
    "blur 2 px, highlight, squares": Scene(radiance=lit, behind=squares, blur=2.0),
    "thin: 2 px wide, dark, squares": Scene(radiance=dark, behind=squares, radius=1.0),
    "one lamp, 45°, on dark": Scene(radiance=lamp(45.0), behind=night),
    "one lamp, 15°, on dark": Scene(radiance=lamp(15.0), behind=night),
    "crossing a bar, dark": Scene(radiance=lit, behind=squares, bar=(150.0, 0.3, 16.0, 30.0)),
    "crossing a bar, light": Scene(radiance=lit, behind=squares, bar=(150.0, 0.3, 16.0, 150.0)),
}


def axis_height(scene: Scene, frame: int, x) -> np.ndarray:
    """Height of the wire's axis at columns x in a frame: turning, moving by 4.3 px a frame."""
    slope = np.tan(np.radians(np.interp(frame, [0, FRAMES - 1], scene.angle_deg)))
    return 0.5 * SHAPE[0] + 4.3 * (frame - FRAMES // 2) + slope * (np.asarray(x) - 0.5 * SHAPE[1])


def coverage(distance) -> np.ndarray:
    """Share of a fine cell inside an edge at this distance (px, positive inside)."""
    return np.clip(distance * FINE + 0.5, 0.0, 1.0)


def drawn(scene: Scene, frame: int | None, shift_px: float = 0.0) -> np.ndarray:
    """A noiseless frame, the wire moved by shift_px along its normal; frame None: the background alone."""
    y, x = np.meshgrid(*((np.arange(n * FINE) + 0.5) / FINE - 0.5 for n in SHAPE), indexing="ij")
    picture = scene.behind(x, y)
    if frame is not None:
        if scene.bar is not None:
            picture = _over(
                picture, coverage(scene.bar[2] - np.abs(_beside_bar(scene, x, y))), scene.bar[3]
            )
        slope = np.tan(np.radians(np.interp(frame, [0, FRAMES - 1], scene.angle_deg)))
        across = (y - axis_height(scene, frame, x)) / np.hypot(1.0, slope) - shift_px
        t = np.clip(across / scene.radius, -1.0, 1.0)
        picture = _over(picture, coverage(scene.radius - np.abs(across)), scene.radiance(t, x))
    blurred = cv2.GaussianBlur(picture, (0, 0), scene.blur * FINE, borderType=cv2.BORDER_REPLICATE)
    return blurred.reshape(SHAPE[0], FINE, SHAPE[1], FINE).mean(axis=(1, 3))


def _over(picture, cover, grey):
    return picture + cover * (grey - picture)


def _beside_bar(scene: Scene, x, y):
    """Signed distance (px) from the bar's axis."""
    at, slope, _, _ = scene.bar
    return (x - at - slope * (y - 0.5 * SHAPE[0])) / np.hypot(1.0, slope)


COLUMNS, PLACES = (np.linspace(12.0, SHAPE[1] - 12.0, count) for count in (80, 4))
KNOTS = Knots(PLACES)


def rough_curve(scene: Scene, frame: int, off_px: float) -> np.ndarray:
    """A predicted curve (80, 2) that is off by up to off_px."""
    return np.stack(
        [COLUMNS, axis_height(scene, frame, COLUMNS) + off_px * np.sin(COLUMNS / 60.0 + frame)],
        axis=1,
    )


def _through(points) -> np.ndarray:
    """A cubic (80, 2) through a frame's points, as the fit of the whisk gives a nearer curve for the second look."""
    cubic = np.polyfit(points.px[:, 0] - 150.0, points.px[:, 1], 3, w=1.0 / points.sigma_px)
    return np.stack([COLUMNS, np.polyval(cubic, COLUMNS - 150.0)], axis=1)


def band(scene: Scene, picture, background, curve):
    """Pixels beside a curve; place: the column."""
    x = curve[:, 0]
    return read_band(
        picture,
        background,
        curve,
        x,
        np.full(len(x), scene.radius),
        int(np.ceil(scene.radius)) + MARGIN_PX,
    )


@dataclass(frozen=True)
class Measured:
    """Points of all frames: error, stated sigma, bound (px), place, distance from the bar's outline; share kept; stated
    sigma of a shift of all points."""

    error: np.ndarray
    sigma: np.ndarray
    bound: np.ndarray
    place: np.ndarray
    from_bar: np.ndarray
    kept: float
    stated: float

    def select(self, keep) -> "Measured":
        fields = ("error", "sigma", "bound", "place", "from_bar")
        return replace(self, **{name: getattr(self, name)[keep] for name in fields})


def bounds(scene: Scene, frames, background) -> np.ndarray:
    """Cramér–Rao bound of each piece's position, px, everything else known."""
    bands = []
    for frame in frames:
        slope = (drawn(scene, frame, 0.05) - drawn(scene, frame, -0.05)) / 0.1
        bands.append(band(scene, slope, background, rough_curve(scene, frame, 0.0)))
    pieces = cut_pieces(bands, PIECE_PX, Noise(NOISE**2, 0.0))
    return NOISE / np.sqrt(np.sum(pieces.grey**2, axis=1))


def first_look(scene: Scene, rng, off_px: float = 0.7):
    """Noisy frames, background, and the wire as it is measured from a rough curve."""
    background = drawn(scene, None)
    pictures = [drawn(scene, f) + NOISE * rng.standard_normal(SHAPE) for f in range(FRAMES)]
    bands = [
        band(scene, p, background, rough_curve(scene, f, off_px)) for f, p in enumerate(pictures)
    ]
    pieces = cut_pieces(bands, PIECE_PX, Noise(NOISE**2, 0.0))
    if scene.bar is not None:
        pieces = pieces.select(clear_of_bar(pieces, _bar_outline(scene), BESIDE_BAR_PX))
    return pictures, background, trace(pieces, KNOTS)


def look_again(scene: Scene, pictures, background, seen: WireTrace) -> tuple[WireTrace, np.ndarray]:
    """The wire beside a curve through what was measured, and the bound of each piece's position, px."""
    points, source = to_points(seen)
    curves = [_through(points.select(source == f)) for f in range(FRAMES)]
    bands = [band(scene, p, background, c) for c, p in zip(curves, pictures)]
    pieces, bound = (
        cut_pieces(bands, PIECE_PX, Noise(NOISE**2, 0.0)),
        bounds(scene, range(FRAMES), background),
    )
    if scene.bar is not None:
        clear = clear_of_bar(pieces, _bar_outline(scene), BESIDE_BAR_PX)
        pieces, bound = pieces.select(clear), bound[clear]
    return trace(pieces, KNOTS, seen_blur_px=seen.blur_px), bound


def find(scene: Scene, rng) -> Measured:
    """The scene's wire as vision finds it: from a rough start, then again beside a curve through what was measured."""
    traced, bound = look_again(scene, *first_look(scene, rng))
    points, source = to_points(traced)
    kept = np.isin(traced.pieces.place + 1e4 * traced.pieces.source, points.place + 1e4 * source)
    return Measured(
        errors(scene, points, source),
        points.sigma_px,
        bound[kept],
        np.round(points.place),
        _from_bar(scene, points),
        len(points) / len(traced.pieces),
        float(np.median(np.linalg.norm(points.shared_px, axis=1))),
    )


def errors(scene: Scene, points, source) -> np.ndarray:
    height = np.array([axis_height(scene, f, x) for f, x in zip(source, points.px[:, 0])])
    slope = np.array([axis_height(scene, f, 1.0) - axis_height(scene, f, 0.0) for f in source])
    return (points.px[:, 1] - height) / np.hypot(1.0, slope)


def _bar_outline(scene: Scene):
    """Middle (m, 2) and half-width (m,) of the bar."""
    y = np.arange(-20.0, SHAPE[0] + 20.0)
    at, slope, half, _ = scene.bar
    return np.stack([at + slope * (y - 0.5 * SHAPE[0]), y], axis=1), np.full(len(y), half)


def _from_bar(scene: Scene, points) -> np.ndarray:
    if scene.bar is None:
        return np.full(len(points), np.inf)
    return np.abs(_beside_bar(scene, *points.px.T)) - scene.bar[2]


@dataclass(frozen=True)
class Figures:
    """Of one scene: see the module's text."""

    count: int
    kept: float
    bias: float
    stated: float
    common: float
    ratio: float
    z: float

    @classmethod
    def of(cls, measured: Measured) -> "Figures":
        own, common, share = _apart(measured)
        return cls(
            len(measured.error),
            measured.kept,
            float(measured.error.mean()),
            measured.stated,
            float(np.std(common)),
            _rms(own / measured.bound) / share,
            _rms(own / measured.sigma) / share,
        )

    def line(self, name: str) -> str:
        return (
            f"{name:<40} {self.count:>5} {100 * self.kept:>5.0f} % {self.bias:>+8.4f} {self.stated:>7.3f} "
            f"{self.common:>8.4f} "
            f"{self.ratio:>7.2f} {self.z:>6.2f}"
        )


def _rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _apart(measured: Measured):
    """Errors less what the frames share at a place (n,), that (p,), and by how much sharing shrinks the former."""
    bins = np.unique(measured.place, return_inverse=True)[1]
    count = np.bincount(bins)
    common = np.bincount(bins, measured.error) / count
    return (
        measured.error - common[bins],
        common[count > 1],
        np.sqrt(1.0 - len(count) / len(measured.error)),
    )


def joined(parts: list[Measured]) -> Measured:
    """Repeats of a scene as one; their places stay apart."""
    columns = {
        name: np.concatenate([getattr(p, name) for p in parts])
        for name in ("error", "sigma", "bound", "from_bar")
    }
    place = np.concatenate([p.place + 1000 * k for k, p in enumerate(parts)])
    kept, stated = (
        float(np.mean([getattr(p, name) for p in parts])) for name in ("kept", "stated")
    )
    return Measured(place=place, kept=kept, stated=stated, **columns)


def main() -> None:
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    rng = np.random.default_rng(0)
    print(
        f"{'wire':<40} {'n':>5} {'kept':>7} {'bias':>8} {'stated':>7} {'common':>8} {'/bound':>7} {'z':>6}"
    )
    for name, scene in SCENES.items():
        measured = joined([find(scene, rng) for _ in range(repeats)])
        if scene.bar is None:
            print(Figures.of(measured).line(name), flush=True)
            continue
        near = measured.from_bar < 10.0
        print(Figures.of(measured.select(near)).line(f"{name}: within 10 px of it"))
        print(Figures.of(measured.select(~near)).line(f"{name}: farther"), flush=True)


if __name__ == "__main__":
    main()
