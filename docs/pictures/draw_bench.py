"""bench.svg for the README: cameras, board, hub, whisker, bar and the rig frame, drawn in perspective from numbers.

python docs/pictures/draw_bench.py
"""

from pathlib import Path

import numpy as np

OUT = Path(__file__).with_name("bench.svg")
SIZE_PX, MIDDLE_PX = (960, 560), (430, 380)
EYE_MM, LOOK_AT_MM, FOCAL_PX = np.array([430.0, -480.0, 300.0]), np.array([55.0, 0.0, 0.0]), 1330.0
INK, BLUE, RED, ORANGE, GREY = "#222222", "#2166ac", "#b2182b", "#b35f00", "#9aa0a8"
CAMERAS = {
    "camera “high”": np.array([15.0, -40.0, 165.0]),
    "camera “low”": np.array([190.0, 60.0, 80.0]),
}
_HALO = 'paint-order="stroke" stroke="#ffffff" stroke-width="4" stroke-linejoin="round"'
SLOPE_RAD, LENGTH_MM, D_X_MM = np.radians(35.0), 100.0, 62.0


def px(points) -> np.ndarray:
    """Points (n, 3), mm, on the sheet, (n, 2)."""
    forward = (LOOK_AT_MM - EYE_MM) / np.linalg.norm(LOOK_AT_MM - EYE_MM)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    seen = (np.atleast_2d(points) - EYE_MM) @ np.array([right, np.cross(right, forward), forward]).T
    return np.array(MIDDLE_PX) + FOCAL_PX * seen[:, :2] / seen[:, 2:] * [1, -1]


def path(points, *, fill="none", stroke=INK, width=1.4, closed=False, opacity=1.0, dash="") -> str:
    """A line or an area through points (n, 3)."""
    d = "M" + "L".join(f"{x:.1f},{y:.1f}" for x, y in px(points)) + ("Z" if closed else "")
    dashed = f' stroke-dasharray="{dash}"' if dash else ""
    look = f'fill="{fill}" stroke="{stroke}" stroke-width="{width}" opacity="{opacity}"{dashed}'
    return f'<path d="{d}" {look} stroke-linejoin="round" stroke-linecap="round"/>'


def label(text: str, point, by=(8, -8), colour=INK, anchor="start") -> str:
    """Words beside a point (3,)."""
    ((x, y),) = px(point) + np.array(by)
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" text-anchor="{anchor}" {_HALO}>{text}</text>'


def board() -> list[str]:
    """8 x 6 squares of 15 mm lying on the bench."""
    squares = []
    for i in range(8):
        for j in range(6):
            x, y = -20 + 15 * i, -45 + 15 * j
            corners = [(x, y, -40), (x + 15, y, -40), (x + 15, y + 15, -40), (x, y + 15, -40)]
            squares.append(
                path(
                    corners,
                    fill="#ffffff" if (i + j) % 2 else "#555555",
                    stroke=GREY,
                    width=0.6,
                    closed=True,
                )
            )
    return [
        *squares,
        label("ChArUco board on the rig: places the cameras", (40, -45, -40), (-60, 44)),
    ]


def cylinder(low, high, radius: float, fill: str) -> list[str]:
    """A rod between two points (3,): its outline as seen from the eye, and its upper end."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    along = (high - low) / np.linalg.norm(high - low)
    side = np.cross(along, low - EYE_MM)
    side *= radius / np.linalg.norm(side)
    turn = np.linspace(0, 2 * np.pi, 40)[:, None]
    u = np.cross(along, [0.3, 1.0, 0.2])
    u /= np.linalg.norm(u)
    rings = [
        end + radius * (np.cos(turn) * u + np.sin(turn) * np.cross(along, u)) for end in (low, high)
    ]
    body = [low - side, high - side, high + side, low + side]
    return [
        path(rings[0], fill=fill, stroke=GREY, width=0.8, closed=True),
        path(body, fill=fill, stroke=fill, width=0.5, closed=True),
        path([low - side, high - side], stroke=GREY, width=0.9),
        path([low + side, high + side], stroke=GREY, width=0.9),
        path(rings[1], fill="#eceef1", stroke=GREY, width=0.9, closed=True),
    ]


def whisker(motor_rad: float, slip_mm: float, *, faint: bool) -> str:
    """The wire as a beam with a point load, touching the bar where it has slipped to."""
    base = np.array([np.cos(motor_rad), np.sin(motor_rad), 0.0])
    contact = np.array([D_X_MM, 0, 0]) + slip_mm * np.array(
        [0, np.sin(SLOPE_RAD), np.cos(SLOPE_RAD)]
    )
    reach = contact @ base
    s = np.linspace(0, LENGTH_MM / reach, 50)
    bend = np.where(s < 1, 0.5 * (3 * s**2 - s**3), 1 + 1.5 * (s - 1))
    points = (s * reach)[:, None] * base + bend[:, None] * (contact - reach * base)
    return path(
        points,
        stroke=BLUE,
        width=1.2 if faint else 3.0,
        opacity=0.45 if faint else 1.0,
        dash="5 4" if faint else "",
    )


def camera(name: str, centre: np.ndarray) -> list[str]:
    """Its field of view towards the contact."""
    forward = np.array([50.0, 0, 0]) - centre
    depth = np.linalg.norm(forward)
    forward /= depth
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)

    def corners(share: float) -> list[np.ndarray]:
        reach = share * depth
        return [
            centre + reach * (forward + 0.3 * a * right + 0.19 * b * up)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]

    near, far = corners(0.22), corners(1.0)
    rays = [path([centre, corner], stroke=ORANGE, width=0.7, opacity=0.5) for corner in far]
    field = path(far, stroke=ORANGE, width=0.7, opacity=0.5, closed=True)
    faces = [
        path(
            [centre, near[k], near[(k + 1) % 4]],
            fill=ORANGE,
            stroke=ORANGE,
            width=1.0,
            closed=True,
            opacity=0.35,
        )
        for k in range(4)
    ]
    return [*rays, field, *faces, label(name, centre, (10, -10), ORANGE)]


def axes() -> list[str]:
    """The rig frame."""
    ends = {"x": (34, 0, 0), "y": (0, 40, 0), "z": (0, 0, 42)}
    return [
        p
        for name, end in ends.items()
        for p in (path([(0, 0, 0), end], width=1.1), label(name, end, (4, -4)))
    ]


def main() -> None:
    """Write the drawing."""
    along = np.array([0, np.sin(SLOPE_RAD), np.cos(SLOPE_RAD)])
    on_bar = np.array([D_X_MM, 3.5 * np.cos(SLOPE_RAD), -3.5 * np.sin(SLOPE_RAD)])
    slip = 9.0  # drawn larger than life
    contact = np.array([D_X_MM, 0, 0]) + slip * along
    parts = [
        *board(),
        *cylinder((0, 0, -40), (0, 0, -6), 9, "#c3c8cf"),
        *cylinder((0, 0, -6), (0, 0, 7), 6, "#dfe2e6"),
        *cylinder(on_bar - 48 * along, on_bar + 75 * along, 3.0, "#d5d8dc"),
        *axes(),
        whisker(0.0, 0.0, faint=True),
        whisker(0.16, slip, faint=False),
        path([np.array([D_X_MM, 0, 0]), contact], stroke=RED, width=3),
        label("slip σ along the bar", contact, (16, -14), RED),
        path([(0, 0, -14), (D_X_MM, 0, -14)], width=0.8),
        label("d_x: base to first contact", (0.5 * D_X_MM, 0, -14), (-40, 20)),
        label("motor and hub with strain gauges", (0, 0, -25), (-30, 18), anchor="end"),
        label("bar, leaning by the slope β", on_bar + 70 * along, (12, 4)),
        label("whisker", (LENGTH_MM, 16, 3), (12, 10), BLUE),
        *(p for name, centre in CAMERAS.items() for p in camera(name, centre)),
    ]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE_PX[0]} {SIZE_PX[1]}" width="{SIZE_PX[0]}" '
    style = 'font-family="DejaVu Sans, Arial, sans-serif" font-size="15">'
    alt = "<title>Two cameras look at a whisker in a motor's hub, the leaning bar that it touches, and a board</title>"
    paper = f'<rect width="{SIZE_PX[0]}" height="{SIZE_PX[1]}" fill="#ffffff"/>'
    OUT.write_text("\n".join([head + style, alt, paper, *parts, "</svg>"]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
