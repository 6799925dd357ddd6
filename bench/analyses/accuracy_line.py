"""The sentences on one estimator: what it assumes, how far off it is, what it states and why."""

import math
from collections.abc import Sequence

from bench.analyses.estimates_again import FITTED, KINETIC, SEEN
from bench.analyses.estimator_accuracy import Accuracy
from bench.base.settings import Settings
from bench.trials.estimate_errors import Judged
from vision.geometry import counted

_ASSUMPTIONS = {
    "no_slip": "that the contact does not slip sideways",
    "with_friction": "a friction angle of {alpha_est_deg:g}°",
    "frictionless": "a surface without friction",
    "corrected": "a friction angle of {alpha_est_deg:g}°, and corrects for the object's thickness",
    "exact_rod": "a friction angle of {alpha_est_deg:g}°, and the stated unloaded shape",
    FITTED: "the friction angle fitted to the other whisks of the surface",
    SEEN: "the friction angle that the cameras saw, which no robot has",
    KINETIC: "a friction angle of {alpha_est_deg:g}° where the moments show that the contact slides",
}


def accuracy_line(accuracy: Accuracy, settings: Settings) -> str:
    """Return what an estimator assumes, how far off it is, and what it states of that itself."""
    name = f"Equation {accuracy.label}" if accuracy.label.startswith("(") else accuracy.label
    if accuracy.estimator in _ASSUMPTIONS:
        assumed = _ASSUMPTIONS[accuracy.estimator].format(alpha_est_deg=settings.alpha_est_deg)
        name = f"{name} assumes {assumed}"
    missing = _missing(accuracy)
    if accuracy.judged:
        errors = _errors(accuracy, settings.theta_deg)
        return f"{name}: {errors} {_stated(accuracy)}{missing}"
    if accuracy.left_out:
        errors = _error_range(accuracy.left_out)
        return f"{name}: no verdict, all {len(accuracy.left_out)} whisks have warnings ({errors}).{missing}"
    return f"{name}: it gave no distance.{missing}"


def _errors(accuracy: Accuracy, theta_deg: float) -> str:
    """Return RMS and worst error in per cent and mm, and where the worst is."""
    worst = accuracy.worst
    text = f"at θ = {theta_deg:g}° off by"
    if len(accuracy.judged) > 1:
        text += (
            f" {accuracy.rms_percent:.1f} % ({accuracy.rms_mm:.2f} mm) RMS over "
            f"{len(accuracy.judged)} whisks, at worst"
        )
    return (
        f"{text} {worst.error_percent:+.1f} ± {worst.error_sigma_percent:.1f} % "
        f"({worst.error_mm:+.2f} mm) on a slope of {worst.beta_deg:.1f}° ({worst.trial})."
    )


def _stated(accuracy: Accuracy) -> str:
    """Return what the estimator states of its error, how much of that is the assumed friction, and
    whether the stated 95 % intervals hold the truth as often as they should."""
    if not math.isfinite(accuracy.stated_percent):
        return "It states no uncertainty."
    text = f"It states ± {accuracy.stated_percent:.1f} %"
    if accuracy.stated_for_friction_percent:
        text += (
            f" (± {accuracy.stated_for_friction_percent:.1f} % for the friction angle, "
            f"± {accuracy.stated_alpha_exact_percent:.1f} % for all else)"
        )
    if not accuracy.intervals:
        return f"{text}."
    if not accuracy.is_covered:
        text += ", which is too little"
    return f"{text}: its 95 % interval holds the truth in {accuracy.intervals_holding} of {accuracy.intervals}."


def _missing(accuracy: Accuracy) -> str:
    """Return how many whisks have no distance, a warning, or are left out for one."""
    parts = []
    if accuracy.without_distance:
        why = accuracy.without_distance[0].status
        parts.append(f"no distance for {len(accuracy.without_distance)} ({why})")
    if accuracy.warned:
        parts.append(f"a warning for {len(accuracy.warned)} ({accuracy.warned[0].status})")
    if accuracy.judged and accuracy.left_out:
        errors = _error_range(accuracy.left_out)
        parts.append(f"{len(accuracy.left_out)} left out for a warning of the whisk ({errors})")
    if not parts:
        return ""
    return f" Of {counted(accuracy.with_truth, 'whisk')}: {'; '.join(parts)}."


def _error_range(judged: Sequence[Judged]) -> str:
    """Return the least and the largest error in per cent, each with its standard deviation."""
    least = min(judged, key=lambda one: one.error_percent)
    largest = max(judged, key=lambda one: one.error_percent)
    ends = [least] if least is largest else [least, largest]
    texts = [f"{one.error_percent:+.1f} ± {one.error_sigma_percent:.1f}" for one in ends]
    return f"{' to '.join(texts)} %"
