"""The motor's way in time: forward strokes, perhaps with ramps, pauses and back strokes."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Stroke:
    """Piecewise motion of constant acceleration: at `times_s` (n,) the motor is at `angles_rad` with `speeds_rad_s`."""

    times_s: np.ndarray
    angles_rad: np.ndarray
    speeds_rad_s: np.ndarray
    forward: tuple[tuple[float, float], ...]  # times of each forward stroke at constant speed
    back: tuple[tuple[float, float], ...] = ()  # and of each back stroke

    @classmethod
    def plan(
        cls,
        low_rad: float,
        high_rad: float,
        speed_rad_s: float,
        *,
        whisks: int = 1,
        ramp_s: float = 0.0,
        pause_s: float = 0.0,
        back: bool = False,
    ) -> "Stroke":
        """`whisks` strokes from below `low_rad` to above `high_rad`, at constant speed between the two. Raises
        ValueError for several without a back stroke."""
        knots, forward = (
            [(0.0, low_rad - 0.5 * speed_rad_s * ramp_s, 0.0 if ramp_s else speed_rad_s)],
            [],
        )
        backward = []
        for whisk in range(whisks):
            _rest(knots, pause_s)
            if whisk and not back:
                raise ValueError("several whisks in one recording need a back stroke")
            forward.append(_move(knots, high_rad - low_rad, speed_rad_s, ramp_s))
            _rest(knots, pause_s)
            if back:
                backward.append(_move(knots, low_rad - high_rad, -speed_rad_s, ramp_s))
        return cls(*(np.array(c) for c in zip(*knots)), tuple(forward), tuple(backward))

    @property
    def end_s(self) -> float:
        """When the recording ends."""
        return float(self.times_s[-1])

    def angle_rad(self, time_s: float | np.ndarray) -> np.ndarray:
        """Motor angle at times within the recording."""
        i = np.clip(
            np.searchsorted(self.times_s, time_s, side="right") - 1, 0, len(self.times_s) - 2
        )
        length = self.times_s[i + 1] - self.times_s[i]
        part = np.asarray(time_s) - self.times_s[i]
        gained = (self.speeds_rad_s[i + 1] - self.speeds_rad_s[i]) / np.where(length > 0, length, 1)
        straight = self.angles_rad[i] + self.speeds_rad_s[i] * part + 0.5 * gained * part**2
        return straight

    def time_s(self, whisk: int, angle_rad: float | np.ndarray, back: bool = False) -> np.ndarray:
        """When a whisk's forward (or back) stroke passes angles (at constant speed)."""
        start, end = (self.back if back else self.forward)[whisk]
        first, last = self.angle_rad(start), self.angle_rad(end)
        return start + (np.asarray(angle_rad) - first) / (last - first) * (end - start)


def _rest(knots, pause_s):
    time, angle, speed = knots[-1]
    if pause_s and speed == 0:
        knots.append((time + pause_s, angle, 0.0))


def _move(knots, way, speed, ramp_s):
    """Speed up, go, slow down; returns the times of the constant speed."""
    time, angle, _ = knots[-1]
    if not ramp_s:  # the motor turns at once: one instant, two speeds
        knots.append((time, angle, speed))
    ramped = 0.5 * speed * ramp_s
    if ramp_s:
        knots.append((time + ramp_s, angle + ramped, speed))
    start = knots[-1][0]
    end = start + way / speed
    knots.append((end, angle + ramped + way, speed))
    if ramp_s:
        knots.append((end + ramp_s, angle + 2 * ramped + way, 0.0))
    return start, end
