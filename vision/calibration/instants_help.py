"""Whether instants of their own for pictures help on views that were held out.

Cameras that disagree about a board held by hand may have taken their pictures late, while the board
moved along its neighbouring views; or the neighbours say nothing of its motion (single shots), and
a fitted instant takes up what it should not. Both models are adjusted without some of the views and
predict these, of which nothing is fitted but the board's pose.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from vision.calibration.adjust import Solution, adjust_bundle
from vision.calibration.bundle import N_VIEW, BundleState, Priors, Sightings, predict
from vision.calibration.corner_noise import ROBUST_WIDTH
from vision.calibration.layout import Layout
from vision.calibration.normal_equations import cauchy
from vision.geometry.board import Board

# [turns] In which views are held out, each view in one of them. Stated.
TURNS = 4
# [views] The scatter of fewer is not known. Derived.
_FEWEST_VIEWS = 4
# [sigma] By which the residuals must fall. Four webcams without a trigger gain 5, single shots of a
# hand-held board −0.3 and −0.3. Study: real_calibration.py.
_LEAST_GAIN = 2.0


@dataclass(frozen=True, eq=False)
class Comparison:
    """Root mean square residuals of held-out views, (n,) px each, by either model."""

    at_once_px: np.ndarray
    instants_px: np.ndarray

    @property
    def gain(self) -> float:
        """Return by how many sigmas instants lower the logarithm of the residuals, by a jackknife
        over the views; 0 of too few.
        """
        count = len(self.at_once_px)
        if count < _FEWEST_VIEWS:
            return 0.0
        at_once = np.sum(self.at_once_px**2)
        instants = np.sum(self.instants_px**2)
        without = np.log((at_once - self.at_once_px**2) / (instants - self.instants_px**2))
        variance = (count - 1) * np.var(without)
        return float(np.log(at_once / instants) / np.sqrt(variance))

    @property
    def instants_help(self) -> bool:
        """Return whether instants lower the residuals beyond chance."""
        return self.gain > _LEAST_GAIN

    @property
    def in_words(self) -> str:
        """Return both residuals over all held-out views."""
        if not len(self.at_once_px):
            return "no view can be held out to compare"
        instants_px = np.sqrt(np.mean(self.instants_px**2))
        at_once_px = np.sqrt(np.mean(self.at_once_px**2))
        return (
            f"{len(self.at_once_px)} held-out views are {instants_px:.3f} px off with offsets, "
            f"{at_once_px:.3f} px as of one instant"
        )


def chance_of_one_instant(solution: Solution, seen: Sightings, board: Board) -> float:
    """Return with what chance the pictures of each view, as of one instant, differ as much about the board's
    pose as they do.

    It is by χ² of what a pose of each picture's own explains of the residuals, weighted by Cauchy's loss: a
    wrong corner says little. seen: with the sigmas that cameras by themselves have.
    """
    _, J = predict(solution.state, seen, board)
    residual = solution.residual_px / seen.sigma_px[:, None]
    _, weight = cauchy(np.sum(residual**2, axis=1), ROBUST_WIDTH)
    residual *= np.sqrt(weight)[:, None]
    by_pose = J[:, :, -N_VIEW:] * (np.sqrt(weight) / seen.sigma_px)[:, None, None]
    pictures = seen.pictures_by_view(len(solution.state.T_world_board))
    squared = 0.0
    for rows in seen.rows_by_shot():
        if pictures[seen.view[rows[0]]] > 1:
            basis, _ = np.linalg.qr(by_pose[rows].reshape(-1, N_VIEW))
            squared += np.sum((basis.T @ residual[rows].ravel()) ** 2)
    shared = pictures > 1
    freedom = N_VIEW * np.sum(pictures[shared] - 1)
    return float(chdtrc(freedom, squared / _weighted_variance())) if freedom else 1.0


def _weighted_variance() -> float:
    """Return the mean square, over that of least squares, of what weighted Gaussian residuals make of a parameter.

    It is E[w² u²] / (2 E[w]) of Cauchy's weights w, u²/2 having an exponential distribution (two axes).
    """
    half_squared, share = np.polynomial.laguerre.laggauss(30)
    _, weight = cauchy(2.0 * half_squared, ROBUST_WIDTH)
    return float(share @ (weight**2 * half_squared) / (share @ weight))


def residuals_by_view(
    cameras: BundleState, layout: Layout, is_held: Mapping[int, bool], board: Board, priors: Priors
) -> dict[int, float]:
    """Return the root mean square residual, px, of each held-out view that two cameras have.

    cameras: as adjusted without them. layout: of all views, without a board on the rig, its
    trajectory None where all pictures of a view are of one instant. is_held: by a view's index.
    priors: with nothing free but the board's poses.
    """
    state = replace(
        layout.first,
        board=cameras.board,
        points_mm=cameras.points_mm,
        clock=cameras.clock,
        trajectory=layout.trajectory,
    )
    seen = layout.seen.with_equal_sigmas()
    fitted = adjust_bundle(state, seen, board, priors)
    squared = np.sum(fitted.residual_px**2, axis=1)
    pictures = seen.pictures_by_view(len(layout.index))
    found = {}
    for view, index in enumerate(layout.index):
        if is_held.get(int(index)) and pictures[view] > 1:
            found[int(index)] = float(np.sqrt(np.mean(squared[seen.view == view])))
    return found
