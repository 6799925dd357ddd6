"""The motor's motion in time: forward strokes, perhaps with ramps, pauses and back strokes."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Stroke:
    """Piecewise motion of constant acceleration.

    At `times_s` (n,) the motor is at `angles_rad` with `speeds_rad_s`. forward, back: beginning and
    end of each stroke at constant speed, s.
    """

    times_s: np.ndarray
    angles_rad: np.ndarray
    speeds_rad_s: np.ndarray
    forward: tuple[tuple[float, float], ...]
    back: tuple[tuple[float, float], ...] = ()

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
        """Return strokes from below `low_rad` to above `high_rad`, at constant speed between the two.

        Raises ValueError for several without a back stroke.
        """
        if whisks > 1 and not back:
            raise ValueError("several whisks in one recording need a back stroke")
        span_rad = high_rad - low_rad
        first_speed = 0.0 if ramp_s else speed_rad_s
        knots = [(0.0, low_rad - 0.5 * speed_rad_s * ramp_s, first_speed)]
        forward = []
        backward = []
        for _ in range(whisks):
            _rest(knots, pause_s)
            forward.append(_move(knots, span_rad, speed_rad_s, ramp_s))
            _rest(knots, pause_s)
            if back:
                backward.append(_move(knots, -span_rad, -speed_rad_s, ramp_s))
        times, angles, speeds = np.array(knots).T
        return cls(times, angles, speeds, tuple(forward), tuple(backward))

    @property
    def end_s(self) -> float:
        """Return when the recording ends."""
        return float(self.times_s[-1])

    def angle_rad(self, time_s: float | np.ndarray) -> np.ndarray:
        """Return the motor angle at times within the recording."""
        last = len(self.times_s) - 2
        part = np.clip(np.searchsorted(self.times_s, time_s, side="right") - 1, 0, last)
        durations_s = np.diff(self.times_s)
        gained_rad_s = np.diff(self.speeds_rad_s)
        # Without a ramp the speed changes in an instant, in which nothing is gained.
        accelerations = gained_rad_s / np.where(durations_s > 0, durations_s, 1)
        since_s = np.asarray(time_s) - self.times_s[part]
        at_speed_rad = self.speeds_rad_s[part] * since_s
        return self.angles_rad[part] + at_speed_rad + 0.5 * accelerations[part] * since_s**2

    def time_s(self, whisk: int, angle_rad: float | np.ndarray, back: bool = False) -> np.ndarray:
        """Return when a whisk's forward (or back) stroke passes angles, at constant speed."""
        start, end = (self.back if back else self.forward)[whisk]
        first = self.angle_rad(start)
        last = self.angle_rad(end)
        return start + (np.asarray(angle_rad) - first) / (last - first) * (end - start)


def _rest(knots, pause_s):
    """Add a pause where the motor stands still."""
    time, angle, speed = knots[-1]
    if pause_s and speed == 0:
        knots.append((time + pause_s, angle, 0.0))


def _move(knots, span, speed, ramp_s):
    """Add speeding up, going and slowing down; return beginning and end of the constant
    speed."""
    time, angle, _ = knots[-1]
    ramp = 0.5 * speed * ramp_s
    start = time + ramp_s
    end = start + span / speed
    knots.append((start, angle + ramp, speed))  # without a ramp one instant has two speeds
    knots.append((end, angle + ramp + span, speed))
    if ramp_s:
        knots.append((end + ramp_s, angle + 2 * ramp + span, 0.0))
    return start, end
