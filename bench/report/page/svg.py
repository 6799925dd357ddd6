"""Plots as inline SVG: their colours are the page's, light or dark, and each point carries its whisk."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape

WIDTH, HEIGHT = 480, 330  # px, of one panel
_LEFT, _RIGHT, _TOP, _BOTTOM = 62, 10, 26, 42
_R = 4.2  # px, half a marker
_MARGIN = 0.06  # of the data's reach, on either side
_TRIANGLE = np.array([(0, -1.25), (1.15, 0.85), (-1.15, 0.85)])
_SHAPES = (
    None,  # a circle
    np.array([(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
    _TRIANGLE,
    np.array([(0, -1.3), (1.3, 0), (0, 1.3), (-1.3, 0)]),
    -_TRIANGLE,
    np.array([(-1.2, -0.4), (1.2, -0.4), (1.2, 0.4), (-1.2, 0.4)]),
)


@dataclass(frozen=True)
class Mark:
    """A point of a whisk: where, one sigma in y, class and marker of its series, the whisk's key and name."""

    x: float
    y: float
    sigma: float
    series: str
    shape: int
    key: str
    trial: str
    whisk: int
    title: str
    aside_px: float = (
        0.0  # to the right of its place, so that points of one whisk do not hide each other
    )


@dataclass(frozen=True)
class Panel:
    """Limits of the data and the size in px; all lengths in what it draws are px."""

    x: tuple[float, float]
    y: tuple[float, float]
    width: int = WIDTH
    height: int = HEIGHT
    log: tuple[bool, bool] = (False, False)  # x, y: the data are logarithms to base 10

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where a point of the data lies."""
        share_x = (x - self.x[0]) / (self.x[1] - self.x[0])
        share_y = (y - self.y[0]) / (self.y[1] - self.y[0])
        across, down = self.width - _LEFT - _RIGHT, self.height - _TOP - _BOTTOM
        return _LEFT + across * share_x, self.height - _BOTTOM - down * share_y

    def line(self, xs: Iterable[float], ys: Iterable[float], series: str, dash: str = "") -> Markup:
        """A curve; it breaks where a value is missing."""
        parts, pen = [], "M"
        for x, y in zip(xs, ys):
            if not (math.isfinite(x) and math.isfinite(y)):
                pen = "M"
                continue
            parts.append(f"{pen}{_px(*self.at(x, y))}")
            pen = "L"
        return Markup('<path class="curve {}" d="{}"{}/>').format(
            series, "".join(parts), Markup(f' stroke-dasharray="{dash}"') if dash else ""
        )

    def band(
        self, xs: Sequence[float], lows: Sequence[float], highs: Sequence[float], series: str
    ) -> Markup:
        """The area between two curves (n,), all finite."""
        there = [*zip(xs, highs), *reversed(list(zip(xs, lows)))]
        return Markup('<path class="band {}" d="M{}Z"/>').format(
            series, "L".join(_px(*self.at(*p)) for p in there)
        )

    def mark(self, mark: Mark) -> Markup:
        """A point with its error bar, a link to its whisk's card."""
        if not (math.isfinite(mark.x) and math.isfinite(mark.y)):
            return Markup("")
        x, y = self.at(mark.x, mark.y)
        x += mark.aside_px
        bar = ""
        if math.isfinite(mark.sigma) and mark.sigma > 0:
            (_, low), (_, high) = (self.at(mark.x, mark.y + side * mark.sigma) for side in (-1, 1))
            bar = f'<path class="bar" d="M{x:.1f},{low:.1f}V{high:.1f}"/>'
        which = mark.key, mark.series, mark.key, mark.trial, mark.whisk
        return Markup(
            '<a href="#{}" class="mark {}" data-w="{}" data-trial="{}" data-whisk="{}"><title>{}</title>{}{}</a>'
        ).format(*which, mark.title, Markup(bar), shape(x, y, mark.shape))

    def drawing(
        self, content: Iterable[Markup], labels: tuple[str, str], title: str, alt: str
    ) -> Markup:
        """The panel with its axes and what it holds. labels: of x and y; alt: for readers who do not see it."""
        body = Markup("").join([*self._axes(*labels), *content])
        return Markup(
            '<svg class="plot" viewBox="0 0 {} {}" role="group" aria-label="{}"><text class="title" x="{}" y="16">{}'
            "</text>{}</svg>"
        ).format(self.width, self.height, alt, _LEFT, title, body)

    def _axes(self, x_label: str, y_label: str) -> Iterator[Markup]:
        bottom, right = self.height - _BOTTOM, self.width - _RIGHT
        for value, said in _ticks(self.x, self.log[0]):
            x, _ = self.at(value, self.y[0])
            yield Markup(
                '<path class="grid" d="M{:.1f},{}V{}"/><text class="tick" x="{:.1f}" y="{}">{}</text>'
            ).format(x, _TOP, bottom, x, bottom + 15, said)
        for value, said in _ticks(self.y, self.log[1]):
            _, y = self.at(self.x[0], value)
            kind = "grid zero" if abs(value) < 1e-12 and not self.log[1] else "grid"
            yield Markup(
                '<path class="{}" d="M{},{:.1f}H{}"/><text class="tick y" x="{}" y="{:.1f}">{}</text>'
            ).format(kind, _LEFT, y, right, _LEFT - 6, y + 4, said)
        middle = 0.5 * (_LEFT + right), 0.5 * (_TOP + bottom)
        yield Markup('<text class="label" x="{}" y="{}">{}</text>').format(
            middle[0], self.height - 8, x_label
        )
        turned = Markup('<text class="label" transform="translate(13 {}) rotate(-90)">{}</text>')
        yield turned.format(middle[1], y_label)


def shape(x: float, y: float, number: int) -> Markup:
    """The marker of a series, which is told by its form as by its colour."""
    corners = _SHAPES[number % len(_SHAPES)]
    if corners is None:
        return Markup(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{_R}"/>')
    return Markup('<path class="dot" d="M{}Z"/>').format(
        "L".join(_px(x + _R * u, y + _R * v) for u, v in corners)
    )


def legend(entries: Sequence[tuple[str, str, int | None]]) -> Markup:
    """(label, class, shape; None for a line) of each series, as HTML below a plot."""
    items = []
    for label, series, number in entries:
        inner = (
            Markup('<path class="curve" d="M1,8H21"/>') if number is None else shape(11, 8, number)
        )
        icon = Markup('<svg class="key {}" viewBox="0 0 22 16" aria-hidden="true">{}</svg>').format(
            series, inner
        )
        items.append(Markup("<li>{}{}</li>").format(icon, label))
    return Markup('<ul class="legend">{}</ul>').format(Markup("").join(items))


def limits(
    values: Iterable[float], least: tuple[float, float] | None = None
) -> tuple[float, float]:
    """Limits that hold all finite values, and `least`, with a margin on either side."""
    known = [v for v in values if math.isfinite(v)] + list(least or ())
    low, high = (min(known), max(known)) if known else (0.0, 1.0)
    room = _MARGIN * ((high - low) or abs(high) or 1.0)
    return low - room, high + room


def ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Round values within the limits.

    >>> ticks(-2.0, 82.0)
    [0.0, 20.0, 40.0, 60.0, 80.0]
    """
    step = (high - low) / about
    power = 10.0 ** math.floor(math.log10(step))
    step = power * next((m for m in (1, 2, 5) if m * power >= 0.8 * step), 10)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(k * step, 10) for k in range(first, last + 1)]


def _ticks(span: tuple[float, float], log: bool) -> list[tuple[float, str]]:
    """Where grid lines stand, and what is written there."""
    if not log:
        return [(value, _tick(value)) for value in ticks(*span)]
    decades = range(math.floor(span[0]), math.ceil(span[1]) + 1)
    round_ones = [m * 10.0**decade for decade in decades for m in (1, 2, 5)]
    return [(math.log10(v), _tick(v)) for v in round_ones if span[0] <= math.log10(v) <= span[1]]


def _tick(value: float) -> str:
    return escape(f"{value:g}".replace("-", "−"))


def _px(x: float, y: float) -> str:
    return f"{x:.1f},{y:.1f}"
