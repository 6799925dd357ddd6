"""The scale of the board, checked by lengths that are known and that the cameras measure."""

from collections.abc import Mapping

import numpy as np

from vision.geometry.refusals import Refused

# [sigma] One right board in 16 000 is further off. Derived.
_SCALE_SIGMAS = 4.0
# [1] A print's distortion: less is no wrong entry. Stated.
_SCALE_TOLERANCE = 0.005


def check_known_lengths(lengths: Mapping[str, tuple[float, float, float, float]]) -> None:
    """Raise Refused for a board at the wrong scale, by lengths known otherwise (bar diameter,
    whisker length).

    lengths: name to (seen mm, its sigma, known mm, its sigma). Everything in space scales with the
    square's size, so one factor must explain all; the factor is named, never applied.
    """
    seen, seen_sigma, known, known_sigma = np.array(list(lengths.values())).T  # (n,) mm each
    ratio = seen / known
    weight = (np.hypot(seen_sigma / seen, known_sigma / known) * ratio) ** -2.0
    factor = float(weight @ ratio / weight.sum())
    factor_sigma = float(weight.sum() ** -0.5)
    if abs(factor - 1) < max(_SCALE_SIGMAS * factor_sigma, _SCALE_TOLERANCE):
        return
    compared = []
    for name, (seen_mm, _, known_mm, _) in lengths.items():
        compared.append(f"{name} seen as {seen_mm:.3f} mm, known as {known_mm:.3f} mm")
    raise Refused(
        f"the board's squares seem to be {1 / factor:.4f} ± {factor_sigma:.4f} times as large as square_mm says "
        f"({', '.join(compared)}): measure a square and enter it"
    )
