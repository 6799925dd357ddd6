"""The transfer curve and the lens blur of a camera, as far as they are known before a rod is
measured.

The curve is a power law, grey = full scale · light^(1 / gamma); the blur is the sigma of a
Gaussian, the pixel's own width included. Both are the same in all pictures that a camera takes.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.special import softmax

# [1] Gammas of transfer curves: of a sensor itself, and of a picture that was encoded for a
# screen (sRGB, nearly). Stated.
GAMMAS = (1.0, 2.2)
# [probability] Least one of a transfer curve that is used. Study: chosen.
LEAST_PROBABILITY = 1e-3


def light_of(grey: np.ndarray, full_scale: float, gamma: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the light of grey levels in parts of full scale, and its derivative by the grey level.

    Grey levels below 1 count as 1: noise makes some negative.
    """
    share = np.maximum(grey, 1.0) / full_scale
    return share**gamma, gamma / full_scale * share ** (gamma - 1.0)


@dataclass(frozen=True)
class Optics:
    """What is known of a camera's transfer curve and lens blur; by default nothing.

    gamma, blur_px: the most probable ones. log_gamma_sigma, log_blur_sigma: sigmas of their
    logarithms, infinite where nothing is known.
    """

    gamma: float = 1.0
    log_gamma_sigma: float = np.inf
    blur_px: float = 1.0
    log_blur_sigma: float = np.inf

    @property
    def is_known(self) -> bool:
        """Return whether anything is known of curve and blur."""
        return np.isfinite(self.log_gamma_sigma) or np.isfinite(self.log_blur_sigma)

    def deviance_of_gammas(self) -> np.ndarray:
        """Return −2 log prior probability (g,) of each of GAMMAS, up to a constant."""
        return (np.log(np.array(GAMMAS) / self.gamma) / self.log_gamma_sigma) ** 2

    def deviance_of_blurs(self, log_blurs: np.ndarray) -> np.ndarray:
        """Return −2 log prior density (b,) of the blur's logarithm, up to a constant."""
        return ((log_blurs - np.log(self.blur_px)) / self.log_blur_sigma) ** 2

    def blur_with(self, blur_px: float, log_sigma: float) -> tuple[float, float]:
        """Return the blur in px, and sigma of its logarithm, where another prior holds as well."""
        precisions = np.array([self.log_blur_sigma, log_sigma]) ** -2.0
        log_blur = np.average(np.log([self.blur_px, blur_px]), weights=precisions)
        return float(np.exp(log_blur)), float(np.sum(precisions) ** -0.5)


UNKNOWN = Optics()


def probable_gammas(cameras: Iterable[Optics]) -> dict[float, float]:
    """Return the prior probability of each transfer curve that is probable, by its gamma.

    The cameras of a bench are of one kind, and one print errs alike for all that saw it: deviances
    are averaged over the cameras that know their curve. The probabilities add up to 1.
    """
    known = [one.deviance_of_gammas() for one in cameras if np.isfinite(one.log_gamma_sigma)]
    deviance = np.mean(known, axis=0) if known else np.zeros(len(GAMMAS))
    return probable(GAMMAS, deviance, LEAST_PROBABILITY)


def probable(gammas: Iterable[float], deviance: np.ndarray, least: float) -> dict[float, float]:
    """Return the probability of each transfer curve (n,) that has more than `least`, by its gamma; they
    add up to 1.

    deviance (n,): minus twice its log likelihood.
    """
    probabilities = softmax(-0.5 * deviance)
    kept = np.where(probabilities > least, probabilities, 0.0)
    kept = kept / kept.sum()
    return {gamma: float(share) for gamma, share in zip(gammas, kept) if share > 0.0}


def known_gamma(cameras: Iterable[Optics]) -> float:
    """Return the gamma of the one probable transfer curve; 1, grey taken as light, of several."""
    gammas = list(probable_gammas(cameras))
    return gammas[0] if len(gammas) == 1 else 1.0
