"""What a recording says twice, and what is likely wrong where both do not agree.

A difference of two records of one thing has a covariance: χ² tells whether it is more than chance. Each cause leaves a
trace of its own; the one that leaves the least χ² when its trace is taken away is named.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from bench.session.trial import Trial
from bench.session.whisker import Whisker
from vision.fit.turns import Turns
from vision.geometry.board import Board
from vision.geometry.reasons import NO_REASON, Reason
from vision.touched.width import combine_widths
from vision.truth.value import UNKNOWN, Value

# Once in ten thousand whisks by chance. 51 path-traced scenes show 1.3 times their degrees of freedom at most.
LEAST_CHANCE = 1e-4
_EXPLAINED = 0.001  # of the chance that a cause must leave: its trace is that of an ideal fault
_PER_PARAMETER = 2.0  # of χ², for each number that a cause is free to choose (Akaike)
# Of a nominal slope that states no sigma: a bar set by eye and a protractor, written in steps of 5°.
_NOMINAL_SLOPE_SIGMA_RAD = np.radians(3.0)
# A whisker leans on a bar within its friction angle of the bar's normal. μ = 1 is more than rubber or coarse sandpaper
# does to metal or plastic; the paper's is 0.43 (Fig. 8, sandpaper).
_STEEPEST_FRICTION_RAD = np.radians(45.0)


@dataclass(frozen=True)
class Cause:
    """A trace (n,) of known size, one of free size or None, how many numbers are free to choose, and what to say, given
    the size found."""

    said: Callable[[float], str]
    fixed: np.ndarray
    trace: np.ndarray | None
    free: int


@dataclass(frozen=True, eq=False)
class Difference:
    """Of two records: values (n,), their information (inverse covariance) (n, n), and degrees of freedom."""

    values: np.ndarray
    information: np.ndarray
    freedom: int

    @property
    def chi2(self) -> float:
        """Of no difference."""
        return float(self.values @ self.information @ self.values)

    @property
    def is_chance(self) -> bool:
        """Whether both agree."""
        return chdtrc(self.freedom, self.chi2) >= LEAST_CHANCE

    def without(self, cause: Cause) -> tuple[float, float]:
        """χ² that is left when the cause's trace is taken away, and the trace's size."""
        left = self.values - cause.fixed
        if cause.trace is None:
            return float(left @ self.information @ left), 0.0
        weighed = self.information @ cause.trace
        size = float(weighed @ left) / max(float(weighed @ cause.trace), 1e-300)
        left = left - size * cause.trace
        return float(left @ self.information @ left), size

    def likeliest(
        self, causes: Sequence[Cause], otherwise: str = "no single cause explains it"
    ) -> str:
        """The cause that leaves the least χ², two for each number that it may choose; of those that explain all."""
        left = [self.without(cause) for cause in causes]
        explains = [
            chdtrc(max(self.freedom - c.free, 1), x2) > _EXPLAINED
            for (x2, _), c in zip(left, causes)
        ]
        costs = [
            x2 + _PER_PARAMETER * c.free if ok else np.inf
            for (x2, _), c, ok in zip(left, causes, explains)
        ]
        best = int(np.argmin(costs))
        return causes[best].said(left[best][1]) if np.isfinite(costs[best]) else otherwise


def turns_doubt(turns: Turns | None, speed_rad_s: float) -> Reason:
    """The encoder against the pictures: a sentence where the whisker does not turn from frame to frame as the motor
    does, '' where it does. speed_rad_s: of the motor."""
    if turns is None or len(turns.index) < 3:
        return NO_REASON
    difference = Difference(turns.turn_rad, _without_mean(turns.covariance), len(turns.index) - 1)
    if difference.is_chance:
        return NO_REASON
    found = f"(χ² {difference.chi2:.0f}, {difference.freedom} degrees of freedom)"
    cause = difference.likeliest(list(_turn_causes(turns, speed_rad_s)))
    return Reason(
        "turns_unlike_motor", f"the whisker is not seen to turn as the motor does {found}: {cause}"
    )


def _without_mean(covariance: np.ndarray) -> np.ndarray:
    """Information on all but a common shift, (n, n): the whisker's clamp, which nothing tells."""
    whole = np.linalg.inv(covariance)
    common = whole.sum(axis=1)
    return whole - np.outer(common, common) / common.sum()


def _agree(values: np.ndarray, variances: np.ndarray) -> bool:
    """Whether values (n,) are one but for chance; a single one is."""
    return (
        len(values) == 1
        or Difference(values, _without_mean(np.diag(variances)), len(values) - 1).is_chance
    )


def _logs(looks: Mapping[str, Value]) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms (n,) of what cameras see, and their variances."""
    values, sigmas = np.array([(one.value, one.sigma) for one in looks.values()]).T
    return np.log(values), (sigmas / values) ** 2


def _turn_causes(turns: Turns, speed_rad_s: float) -> Iterator[Cause]:
    motor, index, n = turns.motor_rad, turns.index, len(turns.index)
    none, ahead = np.zeros(n), np.diff(motor, append=2.0 * motor[-1] - motor[-2])
    behind = -np.diff(motor, prepend=2.0 * motor[0] - motor[1])

    def scale(size: float) -> str:
        return (
            f"it turns {1.0 + size:.3f} times as far; check the encoder's scale and the rate of the frames' times, one "
            "of them looks to need that factor"
        )

    yield Cause(scale, none, motor - motor.mean(), 1)
    for k in range(1, n):
        later, alone = np.arange(n) >= k, np.arange(n) == k
        frame = int(index[k])
        yield Cause(
            _words(
                f"a frame before frame {frame} looks lost; pictures after it have the times of the one "
                "before"
            ),
            ahead * later,
            None,
            1,
        )
        yield Cause(
            _words(
                f"a frame too many before frame {frame}; pictures after it have the times of the next"
            ),
            behind * later,
            None,
            1,
        )
        yield Cause(
            _words(f"frame {frame} looks the same as the one before it"), behind * alone, None, 1
        )
        yield Cause(_jump(motor[k]), none, later.astype(float), 2)
        yield Cause(_another_time(frame, speed_rad_s), none, alone.astype(float), 2)


def _words(text: str) -> Callable[[float], str]:
    return lambda size: text


def _jump(at_rad: float) -> Callable[[float], str]:
    where = f"before {np.degrees(at_rad):.2f}°, the whisker does not"
    return lambda size: f"motor_deg jumps by {-np.degrees(size):+.2f}° {where}"


def _another_time(frame: int, speed_rad_s: float) -> Callable[[float], str]:
    return lambda size: (
        f"frame {frame} looks taken {1e3 * size / speed_rad_s:+.1f} ms from its time"
    )


def width_doubt(bar_looks: Mapping[str, Value], trial: Trial, board: Board | None) -> Reason:
    """The bar against its diameter: a sentence where it looks thicker or thinner than said, '' where it does not, or
    where no camera tells. bar_looks: how thick over how thick it is said to be, by camera."""
    if not bar_looks:
        return NO_REASON
    looks, looks_sigma = combine_widths(
        {name: (one.value, one.sigma) for name, one in bar_looks.items()}
    )
    logs, variances = _logs(bar_looks)
    if not _agree(logs, variances):
        low, high = (limit(one.value for one in bar_looks.values()) for limit in (min, max))
        found = f"the bar looks {low:.2f} to {high:.2f} times as thick as said"
        sentence = f"{found}: check its diameter_mm, or something else is taken for it"
        return Reason("bar_width_unlike_stated", sentence)
    sigma = float(
        np.hypot(looks_sigma / looks, trial.bar_diameter_sigma_mm / trial.bar_diameter_mm)
    )
    difference = Difference(np.array([np.log(looks)]), np.array([[sigma**-2.0]]), 1)
    if difference.is_chance:
        return NO_REASON
    factor = float(np.exp(difference.values[0]))
    scale = (
        f"square_mm some {board.square_mm / factor:.3g} for {board.square_mm:g}"
        if board
        else "the cameras' scale"
    )
    bar = f"some {trial.bar_diameter_mm * factor:.3g} for {trial.bar_diameter_mm:g}"
    found = f"{factor:.2f} ± {sigma * factor:.2f} times as thick as said"
    sentence = f"the bar looks {found}: its diameter_mm would have to be {bar}, or {scale}"
    return Reason("bar_width_unlike_board" if board else "bar_width_unlike_stated", sentence)


def wire_doubt(looks: Mapping[str, Value], whisker: Whisker) -> Reason:
    """The whisker's diameter as seen against its own: a sentence where cameras that agree with each other see a thinner
    one, or the only one that tells; '' where they do not, or none tells. Shadows beside a wire, bloom and movement make
    it look thicker, in all cameras alike, and nothing thinner. looks: how thick over how thick it is said to be, by
    camera."""
    if not looks:
        return NO_REASON
    logs, variances = _logs(looks)
    stated = (whisker.diameter_sigma_mm / whisker.diameter_mm) ** 2
    of_all = Difference(logs, np.linalg.inv(np.diag(variances) + stated), len(looks))
    if of_all.is_chance or not _agree(logs, variances):
        return NO_REASON
    factor, sigma = (
        float(np.exp(np.average(logs, weights=1.0 / variances))),
        float(np.sum(1.0 / variances) ** -0.5),
    )
    if factor > 1.0:
        return NO_REASON
    found = f"{factor:.2f} ± {sigma * factor:.2f} times as thick as said"
    cure = f"its diameter_mm would have to be some {whisker.diameter_mm * factor:.2g} for {whisker.diameter_mm:g}"
    return Reason("wire_width_unlike_stated", f"the whisker looks {found}: {cure}")


def length_doubt(ends: Mapping[str, Value], whisker: Whisker) -> Reason:
    """The whisker's end as seen against its length: a sentence where they are apart, '' where they are not, or where
    no two cameras see it end in one place: before something dark a dark wire seems to end. ends: by camera, mm from
    the base."""
    if len(ends) < 2:
        return NO_REASON
    places, sigmas = (
        np.array([getattr(end, name) for end in ends.values()]) for name in ("value", "sigma")
    )
    if not _agree(places, sigmas**2):
        return NO_REASON
    sigma = float(np.hypot(np.max(sigmas), whisker.length_sigma_mm))
    seen_mm = float(np.average(places, weights=sigmas**-2.0))
    if Difference(np.array([seen_mm - whisker.length_mm]), np.array([[sigma**-2.0]]), 1).is_chance:
        return NO_REASON
    found = f"{seen_mm:.0f} ± {sigma:.0f} mm from its base"
    return Reason(
        "length_unlike_stated",
        f"the whisker is seen to end {found}, length_mm says {whisker.length_mm:g}",
    )


def slope_doubt(beta: Value, trial: Trial) -> Reason:
    """The bar's slope as seen against trial.toml's: a sentence where they are apart, '' where they are not, or where
    one of them is not known."""
    nominal = nominal_slope(trial)
    apart = beta.value - nominal.value
    if not np.isfinite(apart):
        return NO_REASON
    difference = Difference(
        np.array([apart]), np.array([[1.0 / (beta.sigma**2 + nominal.sigma**2)]]), 1
    )
    if difference.is_chance:
        return NO_REASON
    seen = f"{np.degrees(beta.value):.1f} ± {np.degrees(beta.sigma):.1f}°"
    mirrored = replace(difference, values=np.array([beta.value + nominal.value]))
    cause = (
        "its sign looks turned"
        if mirrored.is_chance
        else "check it, or something else is taken for the bar"
    )
    return Reason(
        "slope_unlike_stated",
        f"the bar's slope is seen as {seen}, beta_deg says {trial.beta_deg:g}: {cause}",
    )


def cone_doubt(phi: Value, beta: Value, what: str) -> Reason:
    """Direction of deflection or force against the cone of friction about the bar's normal: a sentence where it leaves
    even the widest cone, with what would bring it back; '' where it does not, or where one of them is not known."""
    sigma = float(np.hypot(phi.sigma, beta.sigma))
    off = _from_normal(phi.value, beta)
    if not np.isfinite(off) or off <= _STEEPEST_FRICTION_RAD:
        return NO_REASON
    beyond = Difference(np.array([off - _STEEPEST_FRICTION_RAD]), np.array([[sigma**-2.0]]), 1)
    if beyond.is_chance:
        return NO_REASON
    angles = f"φ {what} is {np.degrees(phi.value):.0f}°, {np.degrees(off):.0f}° from the normal of a bar at β = "
    others = {"y": -phi.value, "z": np.pi - phi.value, "y and z": np.pi + phi.value}
    within = [
        name
        for name, other in others.items()
        if _from_normal(other, beta) <= _STEEPEST_FRICTION_RAD
    ]
    cause = f"; {' or '.join(within)} reversed would be within" if within else ""
    sentence = f"{angles}{np.degrees(beta.value):.0f}°, where no friction holds a whisker (up to μ = 1){cause}"
    return Reason("force_reversed" if within else "friction_too_large", sentence)


def _from_normal(phi_rad: float, beta: Value) -> float:
    """How far φ is from the bar's normal, rad, 0 to π."""
    return abs(float(np.arctan2(np.sin(phi_rad - beta.value), np.cos(phi_rad - beta.value))))


def nominal_slope(trial: Trial) -> Value:
    """β of trial.toml, with a protractor's sigma where none is stated; UNKNOWN where it says nothing."""
    if trial.beta_deg is None:
        return UNKNOWN
    return Value(
        float(np.radians(trial.beta_deg)),
        float(np.radians(trial.beta_sigma_deg) or _NOMINAL_SLOPE_SIGMA_RAD),
    )
