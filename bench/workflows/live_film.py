"""The film of a push that is evaluated while it is recorded: its pictures, and what is known at each moment."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bench.report import painting

if TYPE_CHECKING:
    from bench.workflows.live_push import LivePush, Played

FILM_HZ = 25.0
_HELD_S = 2.0  # so long the answer is shown
_COLOURS = {"bar_left": painting.BAR, "bar_right": painting.BAR, "wire": painting.WIRE}
_ANSWER_PLACE = (12, 48)  # of a camera's picture, px


@dataclass(eq=False)
class LiveFilm:
    """A film at the push's own speed. pictures: its frames (h, w, 3), FILM_HZ a second."""

    pictures: list[np.ndarray] = field(default_factory=list)
    _shown: np.ndarray | None = None
    _begin_s: float = 0.0
    _count: int = 0

    def watch(self, now_s: float, push: "LivePush") -> None:
        """Show what a push shows from a time on, s."""
        if self._shown is None:
            self._begin_s = now_s
            self._count = 0
        self._show_until(now_s)
        if push.pictures:
            title = f"{now_s - self._begin_s:.2f} s"
            self._shown = _drawn(push.pictures, push.whisk.lines_px(), title, "")

    def end(self, played: "Played") -> None:
        """Show the truth of a push when it came, and begin anew."""
        now_s = played.clock.now_s()
        self._show_until(now_s)
        truth = played.truth
        lines = truth.overlay[max(truth.overlay)] if truth.overlay else {}
        d_x = truth.d_x_mm
        answer = f"d_x {d_x.value:.3f} +- {d_x.sigma:.3f} mm" if lines else "no distance"
        title = f"{now_s - self._begin_s:.2f} s, {played.late}"
        self._shown = _drawn(played.pictures, lines, title, answer)
        self._show_until(now_s + _HELD_S)
        self._shown = None

    def _show_until(self, now_s: float) -> None:
        """Add what is shown until a time, s."""
        while self._shown is not None and self._count < (now_s - self._begin_s) * FILM_HZ:
            self.pictures.append(self._shown)
            self._count += 1


def _drawn(
    pictures: Mapping[str, np.ndarray],
    lines_px: Mapping[str, Mapping[str, np.ndarray]],
    title: str,
    answer: str,
) -> np.ndarray:
    """Return the cameras' pictures (h, w, 3) side by side, with lines by camera and name, and words."""
    drawn = []
    for camera in sorted(pictures):
        picture = _with_lines(pictures[camera], lines_px.get(camera, {}))
        painting.put_text(picture, f"{camera}, {title}", painting.TITLE_PLACE, painting.PAPER)
        painting.put_text(picture, answer, _ANSWER_PLACE, painting.PAPER)
        drawn.append(picture)
    return painting.side_by_side(drawn)


def _with_lines(grey: np.ndarray, lines_px: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return a camera's picture (h, w, 3) at the film's width, with wire and bar drawn in."""
    picture = painting.shrink(grey, painting.FILM_WIDTH_PX)
    scale = painting.FILM_WIDTH_PX / grey.shape[1]
    for name, points_px in lines_px.items():
        if name in _COLOURS:
            painting.polyline(picture, painting.shrink_px(points_px, scale), _COLOURS[name])
    return picture
