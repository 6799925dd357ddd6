"""Touch where cameras do not know whisker and bar well enough in space: by when the whisker begins
to bend.
"""

from dataclasses import replace

import numpy as np

from vision.fit.bend_onset import Onset, onset, seen_bend
from vision.fit.problem import Problem, State, bends
from vision.fit.touch import FEWEST_FREE, frames_by_touch
from vision.geometry.refusals import Refused

# [rad] An onset with a larger sigma leaves no truth: one known to 2.4° had free frames touch, and
# the bar 10 mm off. Study: coverage.py alone.
_MOST_ONSET_RAD = np.radians(0.5)


def touch_by_onset(problem: Problem, state: State, covariance: np.ndarray) -> tuple[Problem, State]:
    """Return the problem with the onset of bending that its fitted frames show, and a state to go
    on from.

    covariance (size, size): of the fit's parameters. Raises Refused where no bend is seen, or fewer
    than two frames before it.
    """
    bend = bends(problem, state.vector)
    begins = _onset_of_fit(problem, bend, covariance)
    touching, free = frames_by_touch(problem.motor_rad, begins.motor_rad, 0.5 * begins.sigma_rad)
    if np.sum(free) < FEWEST_FREE:
        at_deg = np.degrees(begins.motor_rad)
        sigma_deg = np.degrees(begins.sigma_rad)
        raise Refused(
            f"the whisker is seen to bend from {at_deg:.1f} deg on, known to {sigma_deg:.1f} deg: "
            "fewer than two frames of free stroke",
            code="bends_from_start",
        )
    vector = np.concatenate([state.vector[: problem.first_bend], bend[~free].ravel()])
    with_onset = replace(problem, onset=begins, touching=touching, bent=~free)
    return with_onset, replace(state, vector=vector)


def _onset_of_fit(problem: Problem, bend_rad: np.ndarray, covariance: np.ndarray) -> Onset:
    """Return the onset that fitted bends (f, 2) show; raise Refused where none is, or vaguely."""
    bent = problem.bent
    of_bends = problem.blocks.bends.slice
    component, spread = seen_bend(bend_rad[bent], covariance[of_bends, of_bends])
    values = np.zeros(len(bend_rad))
    values[bent] = component
    variances = np.eye(len(bend_rad)) * np.median(np.diag(spread))
    variances[np.ix_(bent, bent)] = spread
    begins = onset(problem.motor_rad, values, variances)
    if begins is None:
        raise Refused(
            "no bend of the whisker is seen: it never touches, or bends along the sight of all "
            "cameras",
            code="no_bend_seen",
        )
    if begins.sigma_rad > _MOST_ONSET_RAD:
        raise Refused(
            "when the whisker begins to bend is known to "
            f"{np.degrees(begins.sigma_rad):.1f} deg only, {np.degrees(_MOST_ONSET_RAD):g} is "
            "allowed: which frames touch is not known",
            code="bend_onset_vague",
        )
    return begins
