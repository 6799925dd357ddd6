"""Touch felt against touch seen, over all whisks of a session: an error that they share is the
session's, not chance.

    felt − seen = zero + clock · speed + what a trial's whisks share

The speed is negative on the way back. zero: what moves either touch by an angle (diameters, light
on the bar, the gauges' onset). clock: delay of the frames' clock behind the signals', plus the part
of the gauges' filter's delay that was not removed. Whisks at one speed and in one direction
determine their sum alone. No truth is moved by what is felt: an error that is more than chance is a
warning, and enters the sigma of touch seen.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from bench.base.combined import between_settings, sigma_without
from bench.gauges.felt import motor_speed
from bench.records.trial_result import BackStroke, FeltTrial, FeltWhisk, SeenWhisk, TrialResult
from vision import Value
from vision.geometry import NO_REASON, Reason, counted

# Chance by which sound sigmas would give as large an error: one session in a thousand.
FALSE_ALARM = 1e-3
# [sigma] Least error that all whisks share, over the median sigma of felt − seen of one stroke. By hundreds of
# whisks an error is found that is far below what matters to any of them. Stated: as where a camera is left out.
_LEAST_SHARE = 0.5
# Before anything is known: wider than any bench has it.
_PRIOR = np.array([np.radians(1.0), 0.05])
# By so much (chi²) a clock must explain better than a zero, or the other way round, to be named alone: three sigma.
_CLEAR_PREFERENCE = 9.0
# Whisks with these codes have no part in the clock: what is off is told by cameras or encoder.
_NO_CLOCK = {"camera_late", "turns_unlike_motor"}
_ALIKE = 0.1  # speeds: a motor's own scatter


@dataclass(frozen=True)
class SharedTouch:
    """Error of touch that all whisks share.

    values (2,): zero (rad) and clock (s), with covariance (2, 2). chance: of as much by sound
    sigmas. clock_preference: by how much χ² the clock alone explains better than the zero alone.
    share_of_sigma: the largest of it over the median sigma of felt − seen of a single stroke.
    speeds_rad_s (n,): of the strokes that show it, negative on the way back.
    """

    values: np.ndarray
    covariance: np.ndarray
    chance: float
    share_of_sigma: float
    clock_preference: float
    speeds_rad_s: np.ndarray

    @property
    def is_error(self) -> bool:
        """Return whether it is more than chance, and large enough to matter to a whisk."""
        return self.chance < FALSE_ALARM and self.share_of_sigma > _LEAST_SHARE

    def at(self, speed_rad_s: float) -> tuple[float, float]:
        """Return felt − seen that whisks at this speed share, rad, and its sigma."""
        row = np.array([1.0, speed_rad_s])
        return float(row @ self.values), float(np.sqrt(row @ self.covariance @ row))

    @property
    def separates_clock(self) -> bool:
        """Return whether speeds or directions differ enough to separate a clock from a zero."""
        return bool(np.ptp(self.speeds_rad_s) >= _ALIKE * abs(np.max(self.speeds_rad_s)))

    @property
    def strokes(self) -> str:
        """Return the numbers of strokes in words."""
        back = int(np.sum(self.speeds_rad_s < 0))
        forward = counted(len(self.speeds_rad_s) - back, "whisk")
        return f"{forward} and {counted(back, 'back stroke')}" if back else forward

    @property
    def line(self) -> str:
        """Return the line of the summary."""
        begin = f"felt − seen, by {self.strokes} together: "
        if not self.separates_clock:
            late, sigma = np.degrees(self.at(np.max(self.speeds_rad_s)))
            alone = "strokes at one speed and in one direction do not separate a late clock from a shifted zero"
            return f"{begin}{late:+.3f} ± {sigma:.3f}°; {alone}"
        units = [np.degrees(1.0), 1e3]  # degrees, ms
        zero, clock = self.values * units
        zero_sigma, clock_sigma = np.sqrt(np.diag(self.covariance)) * units
        return (
            f"{begin}zero {zero:+.3f} ± {zero_sigma:.3f}°, and {clock:+.2f} ± {clock_sigma:.2f} ms "
            "times the motor's speed"
        )


def shared_touch(results: Iterable[TrialResult]) -> SharedTouch | None:
    """Fit what all whisks of a session have in common of felt − seen; None where none has both."""
    strokes = list(_strokes(results))
    if not strokes:
        return None
    speed = np.array([stroke.speed_rad_s for stroke in strokes])
    sigmas = np.array([np.hypot(stroke.seen_rad, stroke.felt_rad) for stroke in strokes])
    design = np.vander(speed, 2, increasing=True)  # (n, 2): zero, clock
    information, gradient = _normal_equations(strokes, design)
    prior = _PRIOR**-2.0
    of_values = np.linalg.inv(information + np.diag(prior))
    values = of_values @ gradient
    largest_rad = float(np.max(np.abs(design @ values)))
    zero_alone, clock_alone = gradient**2 / (np.diag(information) + prior)
    return SharedTouch(
        values,
        of_values,
        chance=float(chdtrc(2, gradient @ values)),
        share_of_sigma=largest_rad / float(np.median(sigmas)),
        clock_preference=float(clock_alone - zero_alone),
        speeds_rad_s=speed,
    )


def _normal_equations(
    strokes: Sequence["_Stroke"], design: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the normal matrix (2, 2) and right-hand side (2,) of zero and clock. design (n, 2)."""
    difference = np.array([stroke.difference_rad for stroke in strokes])
    settings = [stroke.trial for stroke in strokes]
    covariance = _covariance(strokes)
    covariance += between_settings(difference, covariance, design, settings)
    weighted = design.T @ np.linalg.inv(covariance)
    return weighted @ design, weighted @ difference


@dataclass(frozen=True)
class _Stroke:
    """A stroke, forward or back, whose touch is both felt and seen.

    difference_rad: felt − seen. seen_rad: sigma of seen without the clock's, of which seen_shared_rad is
    the part that all strokes share. felt_rad: sigma of felt without that of the filter's delay. delay_s:
    sigma of clock and filter together.
    """

    trial: str
    difference_rad: float
    seen_rad: float
    seen_own_rad: float
    seen_shared_rad: float
    felt_rad: float
    speed_rad_s: float
    delay_s: float


def _covariance(strokes: Sequence[_Stroke]) -> np.ndarray:
    """Return the covariance (n, n) of felt − seen, by what strokes have of their own and share."""
    own_rad2 = np.array([stroke.felt_rad**2 + stroke.seen_own_rad**2 for stroke in strokes])
    shared_rad = np.array([stroke.seen_shared_rad for stroke in strokes])
    late_rad = np.array([stroke.delay_s * stroke.speed_rad_s for stroke in strokes])
    return np.diag(own_rad2) + np.outer(shared_rad, shared_rad) + np.outer(late_rad, late_rad)


def _strokes(results: Iterable[TrialResult]) -> Iterator[_Stroke]:
    """Yield each stroke whose touch is both felt and seen."""
    for result in results:
        clock_s = result.seen.clock.sigma_s if result.seen.clock else 0.0
        name = result.trial.name
        for seen, felt in zip(result.seen.whisks, result.felt.whisks):
            # Frames or motor that are off by themselves have a status of their own.
            is_timed = not _NO_CLOCK.intersection(seen.status.codes)
            if is_timed and seen.touch_rad.is_known:
                yield from _forward(name, seen, felt, clock_s)
        if result.seen.back:
            yield from _backward(name, result.seen.back, result.felt, clock_s)


def _forward(trial: str, seen: SeenWhisk, felt: FeltWhisk, clock_s: float) -> Iterator[_Stroke]:
    """Yield the forward stroke of a whisk, if all of it is known. clock_s: sigma of the frames' clock."""
    speed = motor_speed(seen.frames)
    left_out = np.hypot(seen.touch_shared_rad, clock_s * speed)
    touch = Value(felt.touch_felt_rad.value, felt.theta_sigma_rad)
    delay_s = math.hypot(clock_s, felt.delay_s.sigma)
    shared = None if seen.truth.shared is None else seen.truth.shared.touch_rad
    yield from _known(trial, seen.touch_rad, shared, left_out, touch, speed, delay_s)


def _backward(trial: str, back: BackStroke, felt: FeltTrial, clock_s: float) -> Iterator[_Stroke]:
    """Yield the back stroke of a trial, if all of it is known. clock_s: sigma of the frames' clock."""
    speed = back.speed_rad_s
    filters_s = [whisk.delay_s.sigma for whisk in felt.whisks]
    delay_s = math.hypot(clock_s, max(filters_s, default=np.nan))
    touch = felt.back_touch_rad
    yield from _known(trial, back.touch_rad, None, clock_s * speed, touch, speed, delay_s)


def _known(
    trial: str,
    seen: Value,
    shared_rad: float | None,
    left_out_rad: float,
    felt: Value,
    speed_rad_s: float,
    delay_s: float,
) -> Iterator[_Stroke]:
    """Yield a stroke, unless a touch is unknown.

    shared_rad: part of seen's sigma that all whisks share. Where it is not known (None), what moves the
    seen touch of one whisk (light, lenses, diameters) may move all, and its sigma counts as both.
    left_out_rad: part of both that is counted elsewhere.
    """
    left_out = np.array([left_out_rad])
    without = sigma_without(seen.sigma, left_out)
    if not np.isfinite([felt.value - seen.value, without, felt.sigma]).all():
        return
    own = shared = without
    if shared_rad is not None:
        shared = min(sigma_without(shared_rad, left_out), without)
        own = sigma_without(without, np.array([shared]))
    yield _Stroke(
        trial,
        float(felt.value - seen.value),
        without,
        own,
        shared,
        float(felt.sigma),
        float(speed_rad_s),
        delay_s,
    )


def with_shared_touch(
    results: Sequence[TrialResult], shared: SharedTouch | None
) -> tuple[TrialResult, ...]:
    """Return the results with a shared error of touch in the sigma of touch seen."""
    if shared is None or not shared.is_error:
        return tuple(results)
    widened = []
    for result in results:
        seen = tuple(_with_error(whisk, shared) for whisk in result.seen.whisks)
        widened.append(replace(result, seen=replace(result.seen, whisks=seen)))
    return tuple(widened)


def _with_error(seen: SeenWhisk, shared: SharedTouch) -> SeenWhisk:
    """Return the whisk with the shared error in the sigma of its touch."""
    touch = seen.touch_rad
    if not touch.is_known:
        return seen
    error = abs(shared.at(motor_speed(seen.frames))[0])
    sigma = math.hypot(touch.sigma, error)
    shared_sigmas = seen.truth.shared
    if shared_sigmas is not None:
        touch_rad = math.hypot(shared_sigmas.touch_rad, error)
        shared_sigmas = replace(shared_sigmas, touch_rad=touch_rad)
    truth = replace(seen.truth, touch_rad=Value(touch.value, sigma), shared=shared_sigmas)
    return replace(seen, truth=truth, touch_shared_rad=error)


def shared_touch_warning(shared: SharedTouch | None) -> Reason:
    """Return what to say of an error that all whisks share, with its most probable causes.

    Nothing is said where there is no such error.
    """
    if shared is None or not shared.is_error:
        return NO_REASON
    forward = [shared.at(speed) for speed in shared.speeds_rad_s if speed > 0]
    late, sigma = np.degrees(max(forward, key=lambda one: abs(one[0])))
    return Reason(
        "touch_apart",
        f"touch felt less seen is {late:+.3f} ± {sigma:.3f}° by {shared.strokes} together (chance "
        f"makes it so large in {shared.chance:.0e} of sessions); {_probable_cause(shared)}. It is "
        "in the sigma of touch seen",
    )


def _probable_cause(shared: SharedTouch) -> str:
    """Return the sentence on clock or zero, whichever explains the error."""
    if shared.clock_preference > _CLEAR_PREFERENCE:
        clock_ms = 1e3 * shared.values[1]
        where = "behind" if clock_ms > 0 else "ahead of"
        return (
            f"it grows with the motor's speed, as if the frames' clock ran {abs(clock_ms):.1f} ms {where} the "
            "signals': check how frames are stamped"
        )
    if shared.clock_preference < -_CLEAR_PREFERENCE:
        return (
            "it does not grow with the motor's speed, so no clock explains it: check the diameters of bar and whisker, and "
            "that nothing touches the whisker or its gauges earlier"
        )
    return (
        "likeliest the clock of frames or signals, or one camera's pictures counted from another frame, else diameters "
        "or the gauges' onset: strokes of one speed and direction do not tell which; record back strokes with frames, "
        "or another speed, or a third camera"
    )
