"""A contact whose distance from the base was measured, as a placement of the rig frame.

Free strokes fix the centre of rotation badly along the whisker; a contact that stands at a known
distance from it fixes it there, and nowhere else.
"""

from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from vision.calibration.place import FALSE_ALARM, Placement, gain_of


def with_distance(
    placement: Placement, contact_mm: np.ndarray, distance_mm: float, sigma_mm: float
) -> Placement:
    """Return a placement corrected by a contact's known distance from the centre of rotation; with an
    alarm where they disagree by more than chance allows.

    contact_mm (3,): where it is seen, in the frame from which the placement steps. sigma_mm: of the
    distance, and of where the contact is seen there, together.
    """
    from_centre_mm = contact_mm - placement.step[3:]
    seen_mm = float(np.linalg.norm(from_centre_mm))
    by_step = np.append(np.zeros(3), -from_centre_mm / seen_mm)  # of the distance
    gain, covariance = gain_of(placement.covariance, by_step[None], np.array([[sigma_mm**2]]))
    kept = np.eye(6) - gain @ by_step[None]
    variance = float(by_step @ placement.covariance @ by_step) + sigma_mm**2
    return replace(
        placement,
        step=placement.step + gain[:, 0] * (distance_mm - seen_mm),
        covariance=covariance,
        shared=None if placement.shared is None else kept @ placement.shared @ kept.T,
        alarm=placement.alarm or _alarm(placement.source, distance_mm, seen_mm, variance),
    )


def _alarm(source: str, stated_mm: float, seen_mm: float, variance_mm2: float) -> str | None:
    """Return how a stated distance and the one that is seen disagree; None where chance explains it."""
    if (stated_mm - seen_mm) ** 2 / variance_mm2 <= chdtri(1, FALSE_ALARM):
        return None
    return (
        f"{source} and a stated distance disagree: d_x is stated as {stated_mm:g} mm, and seen as "
        f"{seen_mm:.2f} ± {np.sqrt(variance_mm2):.2f} mm; check d_x_mm, which goes from the base to the contact, and square_mm"
    )
