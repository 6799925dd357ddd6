"""Quantities that a recording holds twice: a warning with the probable cause where both disagree.

Each check returns NO_REASON where both agree or one of them is unknown.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from scipy.special import ndtr

from bench.base.combined import harmonic_mean_chance
from bench.session.signals import read_signals, stroke_speed_rad_s
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from bench.trials.differences import (
    LEAST_CHANCE,
    Cause,
    Difference,
    agree,
    are_alike,
    constant_message,
    without_mean,
)
from vision import UNKNOWN, Turns, Value, combine_widths
from vision.geometry import NO_REASON, Board, Reason, counted

# [rad] Of a nominal slope that states no sigma: a bar set by eye and a protractor, written in steps of 5°. Stated.
_NOMINAL_SLOPE_SIGMA_RAD = np.radians(3.0)
# A whisker leans on a bar within its friction angle of the bar's normal. μ = 1 is more than rubber or coarse sandpaper
# does to metal or plastic; the paper's is 0.43 (Fig. 8, sandpaper).
_STEEPEST_FRICTION_RAD = np.radians(45.0)

# [1] Of the other's distance from the stated speed: a cause that is so much nearer to it is named. Stated.
_CLEARLY_NEARER = 0.5
# [frames] A camera that is late by one looks so by a third at least: the fit takes the rest for an
# offset of its lines. Study: tests/vision/fit/test_camera_delays.py.
_LEAST_DELAY_FRAMES = 0.25

_LOST = "a frame before frame {} looks lost; pictures after it have the times of the one before"
_ADDED = "a frame too many before frame {}; pictures after it have the times of the next"
_REPEATED = "frame {} looks the same as the one before it"


def check_turns(
    turns: Turns | None, speed_rad_s: float, stated_speed_rad_s: float | None = None
) -> Reason:
    """Compare the whisker's turn from frame to frame with the motor's (encoder).

    speed_rad_s: of the motor by the signals; stated_speed_rad_s: the one that trial.toml states.
    """
    if turns is None or len(turns.index) < 3:
        return NO_REASON
    # Without the mean: the angle at which the whisker is clamped is unknown.
    difference = Difference(turns.turn_rad, without_mean(turns.covariance), len(turns.index) - 1)
    if difference.is_chance:
        return NO_REASON
    found = f"(χ² {difference.chi2:.0f}, {difference.freedom} degrees of freedom)"
    cause = difference.explained_by(list(_turn_causes(turns, speed_rad_s, stated_speed_rad_s)))
    cause = cause or "no single cause explains it"
    sentence = f"the whisker is not seen to turn as the motor does {found}: {cause}"
    return Reason("turns_unlike_motor", sentence)


def _turn_causes(
    turns: Turns, speed_rad_s: float, stated_speed_rad_s: float | None
) -> Iterator[Cause]:
    """Yield the faults of encoder and frame times that would turn the whisker unlike the motor."""
    motor = turns.motor_rad
    scale_message = partial(_scale_message, speed_rad_s, stated_speed_rad_s)
    yield Cause(scale_message, np.zeros(len(motor)), motor - motor.mean(), 1)
    for k in range(1, len(motor)):
        yield from _causes_at(k, turns, speed_rad_s)


def _steps_to_neighbours(motor_rad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps (n,) from each frame's motor angle (n,) to the next and to the one before.

    The first and the last step continue as their neighbours.
    """
    ahead = np.diff(motor_rad, append=2.0 * motor_rad[-1] - motor_rad[-2])
    behind = -np.diff(motor_rad, prepend=2.0 * motor_rad[0] - motor_rad[1])
    return ahead, behind


def _causes_at(k: int, turns: Turns, speed_rad_s: float) -> Iterator[Cause]:
    """Yield the faults of encoder and frame times that begin at, or are of, the k-th frame seen."""
    motor = turns.motor_rad
    ahead, behind = _steps_to_neighbours(motor)
    number = np.arange(len(motor))
    nothing = np.zeros(len(motor))
    later = (number >= k).astype(float)
    alone = (number == k).astype(float)
    frame = int(turns.index[k])
    yield Cause(constant_message(_LOST.format(frame)), ahead * later, None, 1)
    yield Cause(constant_message(_ADDED.format(frame)), behind * later, None, 1)
    yield Cause(constant_message(_REPEATED.format(frame)), behind * alone, None, 1)
    yield Cause(_jump_message(motor[k]), nothing, later, 2)
    yield Cause(_time_message(frame, speed_rad_s), nothing, alone, 2)


def _scale_message(speed_rad_s: float, stated_speed_rad_s: float | None, size: float) -> str:
    """Return the sentence on a whisker that turns farther than the motor by this share."""
    share = 1.0 + size
    cause = rate_or_encoder(share, speed_rad_s, stated_speed_rad_s)
    return f"it turns {share:.3f} times as far; {cause}"


def turn_cause(share: float, trials: Iterable[Trial]) -> str:
    """Return the sentence on a whisker that turns `share` times as far as the motor in all trials.

    It follows the alarm of an axis that leans, which gives the same pictures.
    """
    ratios = []  # of the motor's speed by the signals to the stated one
    stated_rad_s = []
    for trial in trials:
        if trial.speed_deg_s is None:
            continue
        speed_rad_s = stroke_speed_rad_s(read_signals(trial))
        if np.isfinite(speed_rad_s):  # NaN without a forward stroke
            stated_rad_s.append(math.radians(trial.speed_deg_s))
            ratios.append(speed_rad_s / stated_rad_s[-1])
    if ratios:
        speed_rad_s = float(np.median(ratios)) * stated_rad_s[0]
        cause = rate_or_encoder(share, speed_rad_s, stated_rad_s[0])
    else:
        cause = rate_or_encoder(share, np.nan, None)
    return f". So looks, too, a whisker that turns {share:.3f} times as far as the motor: {cause}"


def rate_or_encoder(share: float, speed_rad_s: float, stated_speed_rad_s: float | None) -> str:
    """Return which of frame times and encoder needs a factor, by the speed of the motor.

    share: how many times as far as the motor the whisker is seen to turn. speed_rad_s: of the motor
    by the signals alone, which an encoder's scale changes and a frame rate does not.
    """
    both = "check the encoder's scale and the rate of the frames' times, one of them looks to need that factor"
    if not stated_speed_rad_s:
        return both
    by_encoder = abs(np.log(share * speed_rad_s / stated_speed_rad_s))
    by_rate = abs(np.log(speed_rad_s / stated_speed_rad_s))
    speed = f"by the signals the motor goes at {np.degrees(speed_rad_s):.4g}°/s"
    stated = f"speed_deg_s says {np.degrees(stated_speed_rad_s):.4g}"
    if by_rate < _CLEARLY_NEARER * by_encoder:
        return f"{speed} and {stated}, so the rate of the frames' times looks to need that factor"
    if by_encoder < _CLEARLY_NEARER * by_rate:
        return f"{speed}, {stated}, so motor_deg looks to need that factor"
    return both


def _jump_message(at_rad: float) -> Callable[[float], str]:
    """Return the message on an encoder that jumps at a motor angle."""
    where = f"before {np.degrees(at_rad):.2f}°, the whisker does not"
    return lambda size: f"motor_deg jumps by {-np.degrees(size):+.2f}° {where}"


def _time_message(frame: int, speed_rad_s: float) -> Callable[[float], str]:
    """Return the message on a frame with a wrong time."""
    return lambda size: (
        f"frame {frame} looks taken {1e3 * size / speed_rad_s:+.1f} ms from its time"
    )


def check_camera_delays(of_whisks: Iterable[Mapping[str, Value]]) -> Reason:
    """Compare the cameras with each other: does one show each frame some frames later than the rest?

    of_whisks: for each whisk of a trial, the delay of each camera in frames if the others have none. A
    camera's clock is the trial's, and so is the light that misleads it: the whisks are tested together,
    their errors being dependent to an unknown degree (`harmonic_mean_chance`).
    """
    by_camera: dict[str, list[Value]] = {}
    for delays in of_whisks:
        for name, delay in delays.items():
            by_camera.setdefault(name, []).append(delay)
    if len(by_camera) < 2:
        return NO_REASON
    chances = {name: _chance_of_no_delay(delays) for name, delays in by_camera.items()}
    name = min(chances, key=chances.__getitem__)
    late = max(by_camera[name], key=_over_sigma).value
    if abs(late) < _LEAST_DELAY_FRAMES or chances[name] >= LEAST_CHANCE:
        return NO_REASON
    return Reason("camera_late", _late_camera_message(name, late, list(by_camera)))


def _late_camera_message(name: str, late_frames: float, cameras: Sequence[str]) -> str:
    """Return the message on a camera that shows each frame later than the others; earlier if negative."""
    others = "the others"
    if len(cameras) == 2:
        others = f"camera {next(other for other in cameras if other != name)}"
    frames = counted(max(1, round(abs(late_frames))), "frame")
    order = "later" if late_frames > 0 else "earlier"
    return (
        f"camera {name} looks {frames} {order} than {others}: one of them lost a frame,"
        " or its pictures are numbered from another one, or it was moved"
    )


def _chance_of_no_delay(delays: Sequence[Value]) -> float:
    """Return the chance of delays as large as a camera's in the whisks of a trial, if it has none."""
    return harmonic_mean_chance([2.0 * ndtr(-_over_sigma(delay)) for delay in delays])


def _over_sigma(delay: Value) -> float:
    """Return the size of a delay in its sigmas."""
    return abs(delay.value) / delay.sigma


def check_bar_width(bar_looks: Mapping[str, Value], trial: Trial, board: Board | None) -> Reason:
    """Compare the bar's apparent diameter with the stated one.

    bar_looks: ratio of the apparent to the stated diameter, by camera.
    """
    if not bar_looks:
        return NO_REASON
    logs, variances = _logarithms(bar_looks)
    if not are_alike(logs, variances):
        low = np.exp(logs.min())
        high = np.exp(logs.max())
        found = f"the bar looks {low:.2f} to {high:.2f} times as thick as stated"
        sentence = f"{found}: check its diameter_mm, or something else is taken for it"
        return Reason("bar_width_unlike_stated", sentence)
    pairs = {name: (one.value, one.sigma) for name, one in bar_looks.items()}
    factor, factor_sigma = combine_widths(pairs)
    stated = trial.bar_diameter_mm
    sigma = math.hypot(factor_sigma / factor, trial.bar_diameter_sigma_mm / stated)
    if Difference.scalar(np.log(factor), sigma).is_chance:
        return NO_REASON
    return _bar_width_reason(factor, sigma, stated, board)


def _bar_width_reason(factor: float, sigma: float, stated: float, board: Board | None) -> Reason:
    """Return the reason of a bar that appears `factor` times as thick as stated, mm.

    sigma: of the factor, relative.
    """
    found = f"the bar looks {factor:.2f} ± {sigma * factor:.2f} times as thick as stated"
    cure = f"its diameter_mm would have to be some {stated * factor:.3g} for {stated:g}"
    if board is None:
        sentence = f"{found}: {cure}, or the cameras' scale"
        return Reason("bar_width_unlike_stated", sentence)
    square = f"square_mm some {board.square_mm / factor:.3g} for {board.square_mm:g}"
    return Reason("bar_width_unlike_board", f"{found}: {cure}, or {square}")


def check_wire_width(ratios: Mapping[str, Value], whisker: Whisker) -> Reason:
    """Compare the whisker's apparent diameter with the stated one.

    A warning is given only where the whisker appears thinner, to cameras that agree with each
    other: shadows next to a wire, bloom and movement make it appear thicker in all cameras alike.
    ratios: of the apparent to the stated diameter, by camera.
    """
    if not ratios:
        return NO_REASON
    logs, variances = _logarithms(ratios)
    stated = (whisker.diameter_sigma_mm / whisker.diameter_mm) ** 2
    of_all = Difference(logs, np.linalg.inv(np.diag(variances) + stated), len(ratios))
    if of_all.is_chance or not are_alike(logs, variances):
        return NO_REASON
    factor = float(np.exp(np.average(logs, weights=1.0 / variances)))
    if factor > 1.0:
        return NO_REASON
    sigma = float(np.sum(1.0 / variances) ** -0.5)
    found = f"the whisker looks {factor:.2f} ± {sigma * factor:.2f} times as thick as stated"
    diameter_mm = whisker.diameter_mm
    cure = f"its diameter_mm would have to be some {diameter_mm * factor:.2g} for {diameter_mm:g}"
    return Reason("wire_width_unlike_stated", f"{found}: {cure}")


def _logarithms(ratios: Mapping[str, Value]) -> tuple[np.ndarray, np.ndarray]:
    """Return the logarithms (n,) of ratios by camera, and their variances."""
    values = np.array([one.value for one in ratios.values()])
    sigmas = np.array([one.sigma for one in ratios.values()])
    return np.log(values), (sigmas / values) ** 2


def check_length(ends: Mapping[str, Value], whisker: Whisker) -> Reason:
    """Compare the distance of the whisker's visible end from its base with the stated length.

    Two cameras must see the end in the same place: before something dark a dark wire seems to end. The
    end of a whisker that tapers is not seen; a cylinder's bends as it does however long it is, and no
    number rests on its length but where estimates end. So this is a note.
    ends: by camera, mm from the base.
    """
    if len(ends) < 2:
        return NO_REASON
    places = np.array([end.value for end in ends.values()])
    sigmas = np.array([end.sigma for end in ends.values()])
    if not are_alike(places, sigmas**2):
        return NO_REASON
    end = Value(float(np.average(places, weights=sigmas**-2.0)), float(np.max(sigmas)))
    if agree(end, Value(whisker.length_mm, whisker.length_sigma_mm)):
        return NO_REASON
    sigma = math.hypot(end.sigma, whisker.length_sigma_mm)
    found = f"the whisker is seen to end {end.value:.0f} ± {sigma:.0f} mm from its base"
    sentence = f"{found}, length_mm says {whisker.length_mm:g}"
    return Reason("length_unlike_stated", sentence)


def check_slope(
    beta: Value,
    trial: Trial,
    how: str = "is seen as",
    cause: str = "check it, or something else is taken for the bar",
) -> Reason:
    """Compare the bar's slope with the one that trial.toml states.

    how, cause: how the slope is known, and what may be wrong, in words.
    """
    nominal = nominal_slope(trial)
    if agree(beta, nominal):
        return NO_REASON
    if agree(Value(-beta.value, beta.sigma), nominal):
        cause = "its sign looks turned"
    slope = f"{np.degrees(beta.value):.1f} ± {np.degrees(beta.sigma):.1f}°"
    found = f"the bar's slope {how} {slope}, beta_deg says {trial.beta_deg:g}"
    return Reason("slope_unlike_stated", f"{found}: {cause}")


def check_friction_cone(phi: Value, beta: Value, source: str) -> Reason:
    """Check that deflection or force lies within the widest friction cone about the bar's normal.

    phi: its direction, seen or felt as `source` says. Where it lies outside, the warning says which
    reversed axis would bring it back.
    """
    angle = _from_normal(phi.value, beta)
    if not np.isfinite(angle) or angle <= _STEEPEST_FRICTION_RAD:
        return NO_REASON
    sigma = math.hypot(phi.sigma, beta.sigma)
    if Difference.scalar(angle - _STEEPEST_FRICTION_RAD, sigma).is_chance:
        return NO_REASON
    reversed_phi = {"y": -phi.value, "z": np.pi - phi.value, "y and z": np.pi + phi.value}
    within = []
    for axes, other in reversed_phi.items():
        if _from_normal(other, beta) <= _STEEPEST_FRICTION_RAD:
            within.append(axes)
    found = f"φ {source} is {np.degrees(phi.value):.0f}°, {np.degrees(angle):.0f}° from the normal"
    where = f"of a bar at β = {np.degrees(beta.value):.0f}°"
    sentence = f"{found} {where}, where no friction holds a whisker (up to μ = 1)"
    if not within:
        return Reason("friction_too_large", sentence)
    return Reason("force_reversed", f"{sentence}; {' or '.join(within)} reversed would be within")


def _from_normal(phi_rad: float, beta: Value) -> float:
    """Return the angle of φ with the bar's normal, 0 to π rad."""
    difference = phi_rad - beta.value
    return abs(float(np.arctan2(np.sin(difference), np.cos(difference))))


def nominal_slope(trial: Trial) -> Value:
    """Return β of trial.toml, with a protractor's sigma where none is stated; UNKNOWN without β."""
    if trial.beta_deg is None:
        return UNKNOWN
    return Value(math.radians(trial.beta_deg), nominal_slope_sigma_rad(trial))


def nominal_slope_sigma_rad(trial: Trial) -> float:
    """Return the stated sigma of β, rad; a protractor's where none is stated."""
    return float(np.radians(trial.beta_sigma_deg) or _NOMINAL_SLOPE_SIGMA_RAD)
