"""Known lengths against those that the cameras see: is the board at the right scale?"""

from collections.abc import Mapping

import numpy as np

from vision.geometry.refusals import Refused

# [sigma] One right board in 16 000 is further off. Derived.
_SCALE_SIGMAS = 4.0
# [1] A print's stretch: less is no wrong entry. Stated.
_SCALE_TOLERANCE = 0.005


def check_known_lengths(lengths: Mapping[str, tuple[float, float, float, float]]) -> None:
    """Refuses a board at the wrong scale, by lengths known otherwise (bar diameter, whisker length).

    lengths: name to (seen mm, its sigma, known mm, its sigma). Everything in space scales with the square's size, so
    one factor must explain all; the factor is named, never applied. Raises Refused.
    """
    ratio = np.array([seen / known for seen, _, known, _ in lengths.values()])
    sigma = (
        np.array([np.hypot(s / seen, k / known) for seen, s, known, k in lengths.values()]) * ratio
    )
    weight = sigma**-2.0
    factor, factor_sigma = float(weight @ ratio / weight.sum()), float(weight.sum() ** -0.5)
    if abs(factor - 1) < _SCALE_SIGMAS * factor_sigma or abs(factor - 1) < _SCALE_TOLERANCE:
        return
    seen = ", ".join(
        f"{name} seen as {s:.3f} mm, known as {k:.3f} mm" for name, (s, _, k, _) in lengths.items()
    )
    raise Refused(
        f"the board's squares seem to be {1 / factor:.4f} ± {factor_sigma:.4f} times as large as square_mm says "
        f"({seen}): measure a square and enter it"
    )
