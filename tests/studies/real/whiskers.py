"""Real whiskers followed between two given points, drawn over their pictures.

    python tests/studies/real/whiskers.py FOLDER OUT

FOLDER holds the public recordings (whiskiwrap/test_video2.mp4, pwhisk/testFRONT1.png, testFRONT2.png), OUT gets the
overlays. There are no traces of others with these pictures, so what is printed is how the tracer agrees with itself:

- followed: lines found of those asked for; points on them;
- sigma: median of what a point states of itself;
- scatter: of neighbouring points over their sigmas before these were widened by it (1: white noise as measured);
- z: of points left out against a parabola through the two on either side, over the stated sigmas; share beyond 3;
- again: between the line and the same one followed backwards from ends 2 px off, median over 0.6745, and RMS;
- kinks: lines with a point more than 1 px off the parabola through its neighbours: the path has changed whiskers.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from vision.geometry.refusals import Refused
from vision.pictures.files import read_picture
from vision.pictures.frames import Frames
from vision.wire.follow import Followed, follow
from vision.wire.points import LinePoints

PIECE_PX = 6
ZOOM = 3
_KINK_PX = 1.0

# Ends by eye, to about 2 px: (near the face), (near the tip), whiskiwrap/test_video2.mp4, by frame.
MIDDLE = {
    395: ((40, 188), (195, 171)),
    396: ((40, 188), (210, 174)),
    397: ((40, 187), (205, 166)),
    398: ((40, 187), (200, 168)),
    399: ((40, 188), (205, 177)),
    400: ((40, 188), (210, 179)),
    401: ((40, 188), (210, 177)),
    402: ((40, 188), (210, 184)),
    403: ((40, 188), (220, 192)),
    404: ((40, 187), (215, 184)),
    405: ((40, 187), (215, 179)),
    406: ((40, 187), (220, 178)),
    407: ((40, 186), (195, 172)),
    408: ((40, 186), (198, 162)),
    409: ((40, 185), (195, 158)),
    410: ((40, 185), (195, 159)),
}
LOWER = {
    395: ((40, 199), (150, 212)),
    396: ((40, 199), (168, 229)),
    397: ((40, 199), (168, 229)),
    398: ((40, 199), (168, 231)),
    399: ((40, 199), (165, 226)),
    400: ((40, 199), (163, 228)),
    401: ((40, 199), (158, 223)),
    402: ((40, 199), (155, 219)),
    403: ((40, 200), (168, 225)),
    404: ((40, 200), (168, 227)),
    405: ((40, 200), (168, 228)),
    406: ((40, 199), (168, 229)),
    407: ((40, 199), (168, 229)),
    408: ((40, 198), (165, 226)),
    409: ((40, 197), (168, 221)),
    410: ((40, 197), (168, 223)),
}
ON_BAR = {  # the tip lies against the bar's face
    402: ((58, 167), (143, 135)),
    403: ((58, 167), (144, 141)),
    404: ((58, 166), (144, 138)),
    405: ((58, 165), (144, 132)),
    406: ((58, 164), (144, 130)),
    407: ((58, 164), (144, 130)),
    408: ((58, 160), (143, 124)),
    409: ((60, 155), (144, 114)),
    410: ((58, 154), (144, 111)),
}
OVER_BAR = {  # bent over the bar's upper side
    402: ((52, 149), (136, 109)),
    403: ((52, 149), (138, 109)),
    404: ((52, 147), (138, 109)),
    405: ((52, 148), (138, 109)),
    406: ((52, 148), (138, 109)),
    407: ((52, 146), (138, 109)),
    408: ((52, 146), (138, 109)),
}
VIDEO_LINES = {"middle": MIDDLE, "lower": LOWER, "on the bar": ON_BAR, "over the bar": OVER_BAR}
STILL_LINES = {
    "testFRONT1.png": [
        ((950, 750), (710, 782)),
        ((978, 770), (745, 915)),
        ((985, 805), (870, 920)),
        ((1138, 690), (1243, 606)),
        ((1140, 610), (1230, 405)),
    ],
    "testFRONT2.png": [
        ((440, 705), (312, 505)),
        ((460, 763), (232, 588)),
        ((470, 790), (262, 730)),
        ((475, 810), (290, 819)),
        ((640, 802), (850, 735)),
        ((620, 837), (830, 911)),
    ],
}


@dataclass(frozen=True)
class Seen:
    """One line of one picture: followed there and back; None where it was refused, with the reason."""

    line: Followed | None
    back: Followed | None
    reason: str = ""


def follow_both_ways(grey, ends) -> Seen:
    """The line from ends as given, and backwards from ends moved by 2 px."""
    (x0, y0), (x1, y1) = ends
    try:
        return Seen(
            follow(grey, *ends, piece_px=PIECE_PX),
            follow(grey, (x1 - 1, y1 + 2), (x0 + 2, y0 - 1), piece_px=PIECE_PX),
        )
    except Refused as reason:
        return Seen(None, None, str(reason))


def left_out(points: LinePoints) -> tuple[np.ndarray, np.ndarray]:
    """Deviation in px of each inner point from the parabola through two neighbours on either side, and its sigma."""
    found = []
    for k in range(2, len(points) - 2):
        at = [k - 2, k - 1, k + 1, k + 2]
        place = points.place[at] - points.place[k]
        off = (points.px[at] - points.px[k]) @ points.normal[k]
        weight = np.linalg.pinv(np.stack([np.ones(4), place, place**2], axis=1))[0]
        found.append(
            (
                weight @ off,
                np.hypot(points.sigma_px[k], np.linalg.norm(weight * points.sigma_px[at])),
            )
        )
    return tuple(np.array(found).T)


def apart_px(line: Followed, back: Followed) -> np.ndarray:
    """Distance of the line's points from the other line, along their normals."""
    points, other = line.points, back.points.px
    away = other[None] - points.px[:, None]
    along = np.stack([points.normal[:, 1], -points.normal[:, 0]], axis=1)
    t = np.einsum("nmi,ni->nm", away, along)
    n = np.einsum("nmi,ni->nm", away, points.normal)
    found = []
    for row_t, row_n in zip(t, n):
        near = np.argsort(np.abs(row_t))[:4]
        if row_t[near].min() < 0 < row_t[near].max():
            found.append(np.polyval(np.polyfit(row_t[near], row_n[near], 2), 0.0))
    return np.array(found)


def video_lines(folder: Path) -> dict[str, list[tuple[str, np.ndarray, Seen]]]:
    """The video's lines by name: (picture's name, grey, what was seen)."""
    wanted = {frame for ends in VIDEO_LINES.values() for frame in ends}
    frames = Frames.open(folder / "whiskiwrap" / "test_video2.mp4")
    pictures = dict(frames.read(min(wanted), max(wanted) + 1))
    return {
        name: [
            (f"frame{frame}", pictures[frame], follow_both_ways(pictures[frame], pair))
            for frame, pair in ends.items()
        ]
        for name, ends in VIDEO_LINES.items()
    }


def still_lines(folder: Path) -> dict[str, list[tuple[str, np.ndarray, Seen]]]:
    """The stills' lines, by picture."""
    greys = {name: read_picture(folder / "pwhisk" / name) for name in STILL_LINES}
    return {
        name: [(Path(name).stem, greys[name], follow_both_ways(greys[name], pair)) for pair in ends]
        for name, ends in STILL_LINES.items()
    }


def row(name: str, lines) -> str:
    """Figures of one group of lines."""
    seen = [s for _, _, s in lines]
    good = [s for s in seen if s.line is not None]
    if not good:
        return f"{name:<20} 0/{len(seen)}"
    off = [left_out(s.line.points) for s in good]
    z = np.concatenate([deviation / sigma for deviation, sigma in off])
    kinks = sum(bool(np.any(np.abs(deviation) > _KINK_PX)) for deviation, _ in off)
    apart = np.concatenate([apart_px(s.line, s.back) for s in good])
    return (
        f"{name:<20} {len(good):>2}/{len(seen):<2} {sum(len(s.line.points) for s in good):>6} "
        f"{np.median(np.concatenate([s.line.points.sigma_px for s in good])):>9.3f} "
        f"{np.median([s.line.scatter for s in good]):>8.2f} {np.median(np.abs(z)) / 0.6745:>6.2f} "
        f"{100 * np.mean(np.abs(z) > 3):>6.1f} {np.sqrt(np.median(apart**2)) / 0.6745:>9.3f} "
        f"{np.sqrt(np.mean(apart**2)):>9.3f} {kinks:>6}"
    )


def draw(out: Path, groups) -> None:
    """Every picture three times as large with its lines: the path in yellow, a red bar of ± 3 sigma at each point."""
    canvases: dict[str, np.ndarray] = {}
    for name, grey, seen in (entry for lines in groups.values() for entry in lines):
        if name not in canvases:
            large = cv2.resize(grey, None, fx=ZOOM, fy=ZOOM, interpolation=cv2.INTER_CUBIC)
            canvases[name] = cv2.cvtColor(large, cv2.COLOR_GRAY2BGR)
        if seen.line is not None:
            _draw_line(canvases[name], seen.line.points)
    out.mkdir(parents=True, exist_ok=True)
    for name, canvas in canvases.items():
        cv2.imwrite(str(out / f"{name}.png"), canvas)


def _draw_line(canvas, points: LinePoints) -> None:
    large = lambda px: np.round(((px + 0.5) * ZOOM - 0.5) * 16).astype(np.int32)  # noqa: E731
    cv2.polylines(canvas, [large(points.px)], False, (0, 220, 255), 1, cv2.LINE_AA, 4)
    reach = 3.0 * points.sigma_px[:, None] * points.normal
    for one, other in zip(large(points.px - reach), large(points.px + reach)):
        cv2.line(canvas, one.tolist(), other.tolist(), (0, 0, 255), 1, cv2.LINE_AA, 4)


def main() -> None:
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    groups = video_lines(folder) | still_lines(folder)
    print(
        f"{'':<20} {'lines':>5} {'points':>6} {'sigma px':>9} {'scatter':>8} {'z':>6} {'>3 %':>6} "
        f"{'again px':>9} {'(RMS)':>9} {'kinks':>6}"
    )
    for name, lines in groups.items():
        print(row(name, lines))
        for picture, _, seen in lines:
            if seen.reason:
                print(f"  {picture}: {seen.reason}")
    draw(out, groups)


if __name__ == "__main__":
    main()
