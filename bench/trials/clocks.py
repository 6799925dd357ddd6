"""Touch felt against touch seen, over all whisks of a session: an error that they share is the session's, not chance.

    felt − seen = zero + clock · speed

The speed is negative on the way back. zero: what moves either touch by an angle (diameters, light on the bar, the
gauges' onset); clock: by how much the frames' clock runs behind the signals', plus what the delay of the gauges' filter
is longer than what was taken out. Whisks at one speed and in one direction tell their sum alone. No truth is moved by
what is felt: an error that is more than chance is a doubt, and enters the sigma of touch seen.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from bench.gauges.felt import motor_speed
from bench.records.trial_result import SeenWhisk, TrialResult, whisks
from vision.geometry.counted import counted
from vision.geometry.reasons import NO_REASON, Reason
from vision.truth.value import Value

# Chance by which sound sigmas would show as much: one session in a thousand.
FALSE_ALARM = 1e-3
# Before anything is known: wider than any bench has it.
_PRIOR = np.array([np.radians(1.0), 0.05])
# By so much (chi²) a clock must explain better than a zero, or the other way round, to be named alone: three sigma.
_TOLD_APART = 9.0
_ALIKE = 0.1  # speeds: a motor's own scatter


@dataclass(frozen=True)
class SharedTouch:
    """values (2,) = zero (rad) and clock (s) with covariance (2, 2); chance: of as much by sound sigmas.

    likelier: by how much chi² the clock alone explains better than the zero alone. speeds_rad_s: lowest and highest.
    whisks, back: how many forward and back strokes tell.
    """

    values: np.ndarray
    covariance: np.ndarray
    chance: float
    likelier: float
    speeds_rad_s: tuple[float, float]
    whisks: int
    back: int

    @property
    def is_error(self) -> bool:
        """Whether it is more than chance."""
        return self.chance < FALSE_ALARM

    def at(self, speed_rad_s: float) -> tuple[float, float]:
        """felt − seen that whisks at this speed share, rad, and its sigma."""
        row = np.array([1.0, speed_rad_s])
        return float(row @ self.values), float(np.sqrt(row @ self.covariance @ row))

    @property
    def tells_clock(self) -> bool:
        """Whether speeds or directions tell a clock from a zero."""
        low, high = self.speeds_rad_s
        return high - low >= _ALIKE * abs(high)

    @property
    def line(self) -> str:
        """For the summary."""
        if not self.tells_clock:
            late, sigma = np.degrees(self.at(self.speeds_rad_s[1]))
            return (
                f"felt − seen, by {_strokes(self.whisks, self.back)} together: {late:+.3f} ± {sigma:.3f}°; at one "
                "speed and in one direction a clock is not told from a zero"
            )
        zero, clock = self.values * [np.degrees(1.0), 1e3]
        sigma = np.sqrt(np.diag(self.covariance)) * [np.degrees(1.0), 1e3]
        return (
            f"felt − seen, by {_strokes(self.whisks, self.back)} together: zero {zero:+.3f} ± {sigma[0]:.3f}°, and "
            f"{clock:+.2f} ± {sigma[1]:.2f} ms times the motor's speed"
        )


def shared_touch(results: Iterable[TrialResult]) -> SharedTouch | None:
    """What all whisks of a session have in common of felt − seen; None where none has both touches."""
    rows = np.array(list(_rows(results)))
    if not len(rows):
        return None
    difference, seen, felt, speed, late_s = rows.T
    lever = np.stack([np.ones_like(speed), speed], axis=1)
    # What moves the seen touch of one whisk (light, lenses, diameters) may move all; clocks and filter surely do.
    late = late_s * speed
    weight = np.linalg.inv(np.diag(felt**2 + seen**2) + np.outer(seen, seen) + np.outer(late, late))
    told = lever.T @ weight @ lever
    pull = lever.T @ weight @ difference
    covariance = np.linalg.inv(told + np.diag(_PRIOR**-2.0))
    zero, moved = (pull[k] ** 2 / (told[k, k] + _PRIOR[k] ** -2.0) for k in range(2))
    chance = float(chdtrc(2, pull @ covariance @ pull))
    back = int(np.sum(speed < 0))
    speeds = float(speed.min()), float(speed.max())
    return SharedTouch(
        covariance @ pull, covariance, chance, float(moved - zero), speeds, len(rows) - back, back
    )


def _rows(results: Iterable[TrialResult]):
    """Of each stroke felt − seen, the sigmas of seen (its clock apart) and felt (the filter's delay apart), rad; its
    speed, and the sigma of clock and delay together, s."""
    for result in results:
        clock_s, back = result.seen.clock.sigma_s if result.seen.clock else 0.0, result.seen.back
        delay_s = max((f.delay_s.sigma for f in result.felt.whisks), default=np.nan)
        pairs = [
            (
                s.touch_rad,
                s.touch_shared_rad,
                Value(f.touch_felt_rad.value, f.theta_sigma_rad),
                motor_speed(s.frames),
                f.delay_s.sigma,
            )
            for _, s, f in whisks([result])
            if np.isfinite(s.touch_rad.value)
        ]
        pairs += (
            [(back.touch_rad, 0.0, result.felt.back_touch_rad, back.speed_rad_s, delay_s)]
            if back
            else []
        )
        for seen, shared, felt, speed, filter_s in pairs:
            own = np.sqrt(max(seen.sigma**2 - shared**2 - (clock_s * speed) ** 2, 0.0))
            row = felt.value - seen.value, own, felt.sigma
            if np.isfinite(row).all():
                yield *row, speed, float(np.hypot(clock_s, filter_s))


def with_shared_touch(
    results: Sequence[TrialResult], shared: SharedTouch | None
) -> tuple[TrialResult, ...]:
    """The results with the error that all whisks share in the sigma of touch seen, where there is one."""
    if shared is None or not shared.is_error:
        return tuple(results)
    return tuple(
        replace(
            result,
            seen=replace(result.seen, whisks=tuple(_wider(s, shared) for s in result.seen.whisks)),
        )
        for result in results
    )


def _wider(seen: SeenWhisk, shared: SharedTouch) -> SeenWhisk:
    if not np.isfinite(seen.touch_rad.value):
        return seen
    error = abs(shared.at(motor_speed(seen.frames))[0])
    wider = float(np.hypot(seen.touch_rad.sigma, error))
    return replace(seen, touch_rad=Value(seen.touch_rad.value, wider), touch_shared_rad=error)


def shared_doubt(results: Sequence[TrialResult], shared: SharedTouch | None) -> Reason:
    """Return what to say of an error that all whisks share, with its most probable causes.

    Nothing is said where there is no such error.
    """
    if shared is None or not shared.is_error:
        return NO_REASON
    forward = [shared.at(row[3]) for row in _rows(results) if row[3] > 0]
    late, sigma = np.degrees(max(forward, key=lambda one: abs(one[0])))
    clock_ms = 1e3 * shared.values[1]
    if shared.likelier > _TOLD_APART:
        cause = (
            f"it goes with the motor's speed, as {abs(clock_ms):.1f} ms do by which the frames' clock runs "
            f"{'behind' if clock_ms > 0 else 'ahead of'} the signals': check how frames are stamped"
        )
    elif shared.likelier < -_TOLD_APART:
        cause = (
            "it does not go with the motor's speed, so no clock does it: check the diameters of bar and whisker, and "
            "that nothing touches the whisker or its gauges earlier"
        )
    else:
        cause = (
            "likeliest the clock of frames or signals, else diameters or the gauges' onset: strokes of one speed and "
            "direction do not tell which; record back strokes with frames, or another speed"
        )
    return Reason(
        "touch_apart",
        f"touch felt less seen is {late:+.3f} ± {sigma:.3f}° by {_strokes(shared.whisks, shared.back)} together (sound "
        f"sigmas show as much in {shared.chance:.0e} of sessions); {cause}. It is in the sigma of touch seen",
    )


def _strokes(forward: int, back: int) -> str:
    return counted(forward, "whisk") + (f" and {counted(back, 'back stroke')}" if back else "")
