"""Distance from the whisker's natural frequencies, free and with the contact on it.

Ueno et al. [35] find a contact by the frequency of a flexible beam. Their equations are not at hand: those
here are derived from the beam's own, EI w'''' = m ω² w, for a clamped cylinder that the contact props at a
share a of its length and whose end is free. With kL the wave number times the length, x = kL a and
y = kL (1 − a), slope and curvature on both sides of the prop agree where

    (cosh x cos x − 1)(sin y cosh y − sinh y cos y) = (1 + cosh y cos y)(sinh x cos x − sin x cosh x).

Frequencies go with (kL)², so that the ratio of both depends on a alone: neither stiffness nor mass need be
known. It rises from 1 at the base to 6.27 at 0.783 of the length, the node of the second free mode,
and falls to 4.39 at the tip: a ratio above 4.39 has two distances. Angles in rad, lengths in mm, times in s.
"""

from dataclasses import dataclass
from functools import cached_property
from math import cos, cosh, hypot, nan, pi, sin, sinh, sqrt

import numpy as np
from scipy.optimize import OptimizeResult, brentq, least_squares

from estimator.reasons import NamedReason
from estimator.uncertainty import Z_95
from estimator.whisk import Estimate, EstimatorSettings, Whisk

# [1] Wave number times length of the first free mode: the least root of 1 + cosh cos. Derived.
FREE_WAVE_NUMBER = 1.8751040687119611
# [1] Of the second: the next root. Derived.
SECOND_WAVE_NUMBER = 4.694091132974175
# [1] Node of the second free mode, as a share of the length: there the ratio is highest. Derived.
NODE = 0.7834442
# [1] Nearest prop: nearer the ratio changes by less than 1e-4 a thousandth. Derived.
_NEAREST = 0.02
# [1] Farthest prop: farther the ratio changes as little. Derived.
_FARTHEST = 0.9999
# [1] Of the steady speed: below it the motor speeds up or slows down. Stated.
_STEADY_SHARE = 0.9
# [samples] Fewest of a ring: twice as many as there are unknowns. Derived.
_FEWEST_SAMPLES = 20
# [1] Of the sampling rate: the fastest ring that is looked for, below half of it. Stated.
_FASTEST_SHARE = 0.4
# [Hz] Mains hum is between these. Stated.
_MAINS_HZ = (45.0, 65.0)
# [periods] Fewest of the slowest ring in a window, so that it is told from the rise of a push. Stated.
_FEWEST_PERIODS = 1.5
# [1] Damping of the ring, as a share of the critical one: between these. Stated.
_DAMPING = (1e-3, 0.1)
# [1] Damping from which a ring is looked for: that of a steel or Nitinol wire in air, clamped. Stated.
_TYPICAL_DAMPING = 0.02
# [1] Over the span: frequencies farther apart are another ring's, nearer they share a peak. Derived.
_APART = 1.5
# [1] Share of the slowest frequency down to which a fit may go: noise moves it by less. Stated.
_SLOWER = 0.9
# [1] Of each channel: a cubic, a hum and a ring. Derived.
_LINEAR_UNKNOWNS = 8
# [sigma] Amplitude below which a ring is noise: in 100 independent frequencies one of 1000, by χ² of the
# six unknowns of a ring in two channels. Derived.
_LEAST_AMPLITUDE_SIGMAS = 5.8
# [sigma] Margin below which another frequency may be the ring's: one in 400. Derived.
_LEAST_MARGIN_SIGMAS = 3.0
NO_RING = NamedReason("whisker_does_not_ring", "no ringing stands out of the noise {}")
NOT_PROPPED = NamedReason(
    "ring_not_of_a_prop", "the frequencies' ratio is {:.2f}: a contact gives 1 to 6.27"
)
NOT_A_CYLINDER = NamedReason(
    "not_a_straight_cylinder", "natural frequencies are solved for straight cylinders alone"
)
NO_SAMPLES = NamedReason("no_unfiltered_samples", "no samples as recorded are kept")
TWO_PLACES = NamedReason(
    "two_places_ring_alike", "{:.1f} and {:.1f} mm give this frequency; the nearer is stated"
)


@dataclass(frozen=True)
class Ring:
    """A damped oscillation: frequency with its standard deviation, Hz, and amplitude in its sigmas.

    damping: share of the critical one. margin_sigmas: by how much it explains more than a ring of any
    other frequency. mains_Hz: frequency of the hum with it.
    """

    frequency_Hz: float
    damping: float
    sigma_Hz: float
    amplitude_sigmas: float
    margin_sigmas: float
    mains_Hz: float

    @property
    def is_heard(self) -> bool:
        """Return whether it stands out of the noise, and no other frequency explains as much."""
        stands_out = self.amplitude_sigmas > _LEAST_AMPLITUDE_SIGMAS
        return stands_out and self.margin_sigmas > _LEAST_MARGIN_SIGMAS


def frequency_ratio(share: float) -> float:
    """Return the first natural frequency with a prop at a share of the length, over the free one.

    >>> round(frequency_ratio(0.6), 4)
    3.858
    """
    root = brentq(
        _characteristic, FREE_WAVE_NUMBER, SECOND_WAVE_NUMBER, args=(share,), xtol=1e-13, rtol=1e-13
    )
    return (root / FREE_WAVE_NUMBER) ** 2


def _characteristic(wave_number: float, share: float) -> float:
    """Return the difference of both sides of the module's equation."""
    x = wave_number * share
    y = wave_number * (1 - share)
    clamped = cosh(x) * cos(x) - 1
    tip = sin(y) * cosh(y) - sinh(y) * cos(y)
    free = 1 + cosh(y) * cos(y)
    base = sinh(x) * cos(x) - sin(x) * cosh(x)
    return clamped * tip - free * base


def shares_of_ratio(ratio: float) -> tuple[float, ...]:
    """Return the shares of the length at which a prop gives this ratio: none, one, or two."""
    found = []
    for low, high in ((_NEAREST, NODE), (NODE, _FARTHEST)):
        ends = (frequency_ratio(low) - ratio, frequency_ratio(high) - ratio)
        if ends[0] * ends[1] <= 0:
            found.append(brentq(lambda share: frequency_ratio(share) - ratio, low, high, xtol=1e-9))
    return tuple(found)


def vibration(whisk: Whisk, settings: EstimatorSettings) -> Estimate:
    """Estimate from the frequencies with which the whisker rings before touch and after it.

    Where two distances ring alike, the nearer is stated, the status names the other, and the interval
    holds both.
    """
    if whisk.beam.taper or whisk.beam.is_curved:
        return Estimate(nan, nan, NOT_A_CYLINDER)
    if whisk.unfiltered_Nmm is None:
        return Estimate(nan, nan, NO_SAMPLES)
    steady = moves_steadily(whisk.theta_rad)
    free = ring_of(whisk, steady & (whisk.theta_rad < 0))
    if free is None or not free.is_heard:
        return Estimate(nan, nan, NO_RING.format("before touch"))
    propped = ring_of(whisk, steady & (whisk.theta_rad >= 0), beside=free)
    if propped is None or not propped.is_heard:
        return Estimate(nan, nan, NO_RING.format("after touch"))
    ratio = propped.frequency_Hz / free.frequency_Hz
    sigma = ratio * hypot(
        free.sigma_Hz / free.frequency_Hz, propped.sigma_Hz / propped.frequency_Hz
    )
    return _by_ratio(ratio, sigma, whisk.beam.length_mm)


def _by_ratio(ratio: float, ratio_sigma: float, length_mm: float) -> Estimate:
    """Estimate from the ratio of frequencies and its standard deviation."""
    shares = shares_of_ratio(ratio)
    if not shares:
        return Estimate(nan, nan, NOT_PROPPED.format(ratio))
    lows = shares_of_ratio(ratio - Z_95 * ratio_sigma) or (_NEAREST,)
    highs = shares_of_ratio(ratio + Z_95 * ratio_sigma) or (NODE,)
    near_mm = shares[0] * length_mm
    low_mm = lows[0] * length_mm
    high_mm = highs[0] * length_mm
    sigma_mm = hypot(near_mm - low_mm, high_mm - near_mm) / (sqrt(2) * Z_95)
    if len(shares) == 1:
        return Estimate(near_mm, sigma_mm, "", low_mm, high_mm)
    status = TWO_PLACES.format(near_mm, shares[1] * length_mm)
    farthest_mm = (lows[1] if len(lows) > 1 else 1.0) * length_mm
    return Estimate(near_mm, sigma_mm, status, low_mm, farthest_mm)


def moves_steadily(motor_rad: np.ndarray) -> np.ndarray:
    """Return the mask (n,) of samples between the motor's ramps, where it is as fast as in the middle.

    The speed is that over eleven samples, so that the encoder's steps are small in it.
    """
    speed = np.convolve(np.gradient(motor_rad), np.ones(11) / 11, mode="same")
    return speed > _STEADY_SHARE * np.median(speed)


def ring_of(whisk: Whisk, part: np.ndarray, beside: Ring | None = None) -> Ring | None:
    """Return the ring in a part of the samples; None where the part is too short for one."""
    part = part & np.isfinite(whisk.unfiltered_Nmm).all(axis=1)
    time_s = whisk.time_s[part]
    if len(time_s) < _FEWEST_SAMPLES:
        return None
    return ringing(time_s - time_s[0], whisk.unfiltered_Nmm[part], beside)


def ringing(time_s: np.ndarray, moments: np.ndarray, beside: Ring | None = None) -> Ring:
    """Find the strongest damped oscillation of moments (n, k) at times (n,) from its beginning on.

    beside: the free ring; one on a contact is no slower, and in the short while of a push it resembles
    the hum, whose frequency then is known. A cubic stands for the push, a sinusoid for the hum.
    Frequency and damping are those of least squares, all else being linear; the sigma is that of the
    residuals' scatter. Raises ArithmeticError where the fit does not converge.
    """
    record = _Record(time_s, moments)
    slowest_Hz = _FEWEST_PERIODS / record.span_s
    if beside is None:
        mains_Hz = record.mains_beside_ring(slowest_Hz)
        free = 3
    else:
        mains_Hz = beside.mains_Hz
        slowest_Hz = max(slowest_Hz, beside.frequency_Hz)
        free = 2
    best_Hz, runner_up = record.strongest(slowest_Hz, mains_Hz)
    start = np.log([best_Hz, _TYPICAL_DAMPING, mains_Hz])
    fit = _refined(record, slowest_Hz, start, free)
    frequency, damping, mains_Hz = np.exp([*fit.x, *start[free:]]).tolist()
    left = 2 * fit.cost
    known = moments.size - _LINEAR_UNKNOWNS * moments.shape[1] - free
    variance = left / known
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac) * variance
    without = record.left(None, mains_Hz)
    return Ring(
        frequency,
        damping,
        sigma_Hz=frequency * sqrt(covariance[0, 0]),
        amplitude_sigmas=sqrt(max(without - left, 0.0) / variance),
        margin_sigmas=sqrt(max(runner_up - left, 0.0) / variance),
        mains_Hz=mains_Hz,
    )


@dataclass(frozen=True)
class _Record:
    """Moments (n, k) of a part of a whisk at times (n,) from its beginning on, in which a ring is sought."""

    time_s: np.ndarray
    moments: np.ndarray

    @property
    def span_s(self) -> float:
        """Return the time from the first sample to the last."""
        return float(self.time_s[-1])

    @cached_property
    def step_s(self) -> float:
        """Return the time between samples."""
        return float(np.median(np.diff(self.time_s)))

    def residuals(
        self, frequency_Hz: float | None, damping: float, mains_Hz: float | None
    ) -> np.ndarray:
        """Return what push, hum and ring leave of the moments (n k,)."""
        columns = ring_columns(self.time_s, frequency_Hz, damping, mains_Hz)
        orthonormal, _ = np.linalg.qr(columns)
        explained = orthonormal @ (orthonormal.T @ self.moments)
        return (self.moments - explained).ravel()

    def left(self, frequency_Hz: float | None, mains_Hz: float | None) -> float:
        """Return the sum of squares that push, hum and a ring of the typical damping leave."""
        residuals = self.residuals(frequency_Hz, _TYPICAL_DAMPING, mains_Hz)
        return float(residuals @ residuals)

    def strongest(self, slowest_Hz: float, mains_Hz: float | None) -> tuple[float, float]:
        """Return the frequency that explains most, and the sum of squares that any other leaves.

        The frequencies tried are a quarter of what the span resolves apart.
        """
        apart_Hz = 0.25 / self.span_s
        frequencies = np.arange(slowest_Hz, _FASTEST_SHARE / self.step_s, apart_Hz)
        sums = np.array([self.left(frequency, mains_Hz) for frequency in frequencies])
        best_Hz = float(frequencies[np.argmin(sums)])
        is_other = np.abs(frequencies - best_Hz) > _APART / self.span_s
        return best_Hz, float(min(sums[is_other], default=np.inf))

    def best_mains(self, ring_Hz: float | None) -> float:
        """Return the frequency of mains that explains most beside a ring, if there is one, Hz."""
        candidates = np.arange(_MAINS_HZ[0], _MAINS_HZ[1] + 0.5, 1.0)
        return float(min(candidates, key=lambda mains_Hz: self.left(ring_Hz, mains_Hz)))

    def mains_beside_ring(self, slowest_Hz: float) -> float:
        """Return the frequency of mains that explains most together with a ring, Hz.

        A hum alone would stand for a louder ring near it, so either is looked for first, and the pair
        that leaves less counts.
        """
        hum_first_Hz = self.best_mains(None)
        ring_beside_Hz, _ = self.strongest(slowest_Hz, hum_first_Hz)
        ring_first_Hz, _ = self.strongest(slowest_Hz, None)
        hum_beside_Hz = self.best_mains(ring_first_Hz)
        by_hum = self.left(ring_beside_Hz, hum_first_Hz)
        by_ring = self.left(ring_first_Hz, hum_beside_Hz)
        return hum_first_Hz if by_hum < by_ring else hum_beside_Hz


def _refined(record: _Record, slowest_Hz: float, start: np.ndarray, free: int) -> OptimizeResult:
    """Fit the first `free` of the logarithms of frequency, damping and hum's frequency from their start.

    Raises ArithmeticError where the fit does not converge.
    """
    low = np.log([_SLOWER * slowest_Hz, _DAMPING[0], _MAINS_HZ[0]])[:free]
    high = np.log([0.5 / record.step_s, _DAMPING[1], _MAINS_HZ[1]])[:free]

    def residuals(logarithms: np.ndarray) -> np.ndarray:
        """Return what is left of the moments at these logarithms; the others stay at their start."""
        frequency_Hz, damping, mains_Hz = np.exp([*logarithms, *start[free:]])
        return record.residuals(frequency_Hz, damping, mains_Hz)

    fit = least_squares(residuals, np.clip(start[:free], low, high), bounds=(low, high))
    if not fit.success:
        raise ArithmeticError("the frequency of the ringing does not converge")
    return fit


def ring_columns(
    time_s: np.ndarray, frequency_Hz: float | None, damping: float, mains_Hz: float | None
) -> np.ndarray:
    """Return the columns (n, 4 to 8) of push, hum and, last, ring; of what has no frequency none."""
    share = time_s / time_s[-1]
    basis = [share**power for power in range(4)]
    if mains_Hz is not None:
        basis += [np.cos(2 * pi * mains_Hz * time_s), np.sin(2 * pi * mains_Hz * time_s)]
    if frequency_Hz is not None:
        turn = 2 * pi * frequency_Hz * time_s
        decay = np.exp(-damping * turn)
        basis += [decay * np.cos(turn), decay * np.sin(turn)]
    return np.stack(basis, axis=1)
