"""Touch by a stage's place against touch felt, over all whisks: a place that is another trial's.

    felt − stage = zero + late · speed + what all whisks share of place and whisker + their own

zero: of the motor's angle in the stage's frame. late: the gauges' filter. Both are free, so that the whisks are held
against each other alone. No truth is moved by what is felt: a whisk that is off has a status.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.base.statuses import reason
from bench.records.trial_result import FeltWhisk, StageTouch, TrialResult
from bench.trials.differences import Difference
from vision.geometry import NO_REASON, Reason

# [rad] One sigma of the zero: wider than any bench has it. Stated.
_ZERO_RAD = np.radians(10.0)
# [whisks] Fewer do not say which of them is off. Derived.
_FEWEST_TO_NAME = 3


@dataclass(frozen=True, eq=False)
class _Touched:
    """A whisk, by trial and number, whose touch is felt and stated.

    apart_rad: felt − stage. felt_rad: sigma of felt. late_rad: by one sigma of the filter's delay.
    """

    key: tuple[str, int]
    stage: StageTouch
    apart_rad: float
    felt_rad: float
    late_rad: float


def with_stage_touches(results: Iterable[TrialResult]) -> tuple[TrialResult, ...]:
    """Return the results, in which a whisk that touches elsewhere than its stage says has a status."""
    results = tuple(results)
    elsewhere = _elsewhere(list(_touched(results)))
    if not elsewhere:
        return results
    named = []
    for result in results:
        whisks = []
        for whisk in result.seen.whisks:
            found = elsewhere.get((result.trial.name, whisk.whisk), NO_REASON)
            whisks.append(whisk.with_contradiction(found))
        named.append(replace(result, seen=replace(result.seen, whisks=tuple(whisks))))
    return tuple(named)


def _touched(results: Iterable[TrialResult]) -> Iterator[_Touched]:
    """Yield each whisk whose touch is both felt and stated."""
    for result in results:
        for seen, felt in zip(result.seen.whisks, result.felt.whisks):
            speed_rad_s = np.radians(result.trial.speed_deg_s or 0.0)
            one = _of_whisk((result.trial.name, seen.whisk), seen.stage_touch, felt, speed_rad_s)
            if one is not None:
                yield one


def _of_whisk(
    key: tuple[str, int], stage: StageTouch | None, felt: FeltWhisk, speed_rad_s: float
) -> _Touched | None:
    """Return a whisk whose touch is both felt and stated; None of another."""
    if stage is None:
        return None
    apart_rad = felt.touch_felt_rad.value - stage.motor_rad
    late_rad = felt.delay_s.sigma * speed_rad_s
    numbers = [apart_rad, felt.theta_sigma_rad, late_rad, stage.own_rad, *stage.shared_rad]
    if not np.isfinite(numbers).all():
        return None
    return _Touched(key, stage, float(apart_rad), felt.theta_sigma_rad, float(late_rad))


def _elsewhere(whisks: Sequence[_Touched]) -> dict[tuple[str, int], Reason]:
    """Return the whisks whose touch the others contradict, one after another, the worst first."""
    found = {}
    left = list(whisks)
    while len(left) > 1:
        apart_rad, sigma_rad = _against_others(left)
        over_sigma = np.abs(apart_rad / sigma_rad)
        worst = int(np.argmax(over_sigma))
        if Difference.scalar(over_sigma[worst], 1.0).is_chance:
            break
        off = [left[worst]] if len(left) >= _FEWEST_TO_NAME else list(left)
        for one in off:
            k = left.index(one)
            found[one.key] = reason(
                "stage_unlike_felt",
                apart=f"{np.degrees(apart_rad[k]):+.2f} ± {np.degrees(sigma_rad[k]):.2f}",
            )
        left = [one for one in left if one not in off]
    return found


def _against_others(whisks: Sequence[_Touched]) -> tuple[np.ndarray, np.ndarray]:
    """Return felt − stage (n,) of each whisk less what the others predict of it, and its sigma (n,), rad."""
    apart_rad = np.array([one.apart_rad for one in whisks])
    own_rad = np.array([np.hypot(one.stage.own_rad, one.felt_rad) for one in whisks])
    shared = [[*one.stage.shared_rad, one.late_rad, _ZERO_RAD] for one in whisks]
    shared_rad = np.array(shared)  # (n, p + 2)
    information = np.linalg.inv(np.diag(own_rad**2) + shared_rad @ shared_rad.T)
    alone = np.diag(information)
    return information @ apart_rad / alone, 1.0 / np.sqrt(alone)
