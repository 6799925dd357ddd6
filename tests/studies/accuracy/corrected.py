"""What (10) corrected takes out of the error of (10), by exact mechanics and with the true friction angle.

    python tests/studies/accuracy/corrected.py

RMS and largest error over slopes from 0 to 75 degrees, % of d_x (docs/maps.md).
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.theory.model_error import Push, errors_percent

PUSHES = (Push(), Push(d_x_mm=30.0, bar_radius_mm=10.0), Push(theta_deg=6.0))
ALPHAS_DEG, BETAS_DEG = (0.0, 10.5, 23.3), np.arange(0.0, 76.0, 5.0)


def over_slopes(push: Push) -> tuple[np.ndarray, np.ndarray]:
    """RMS (2,) and largest (2,) error of (10) and of (10) corrected."""
    errors = np.array([errors_percent(replace(push, beta_deg=float(beta))) for beta in BETAS_DEG])
    return np.sqrt(np.mean(errors**2, axis=0)), np.abs(errors).max(axis=0)


def lines() -> Iterator[str]:
    for push in PUSHES:
        for alpha in ALPHAS_DEG:
            rms, most = over_slopes(replace(push, alpha_deg=alpha))
            yield (
                f"d_x {push.d_x_mm:g} mm, radius {push.bar_radius_mm:g} mm, theta {push.theta_deg:g} deg, alpha "
                f"{alpha:4.1f} deg: (10) {rms[0]:.2f} {most[0]:.2f} %, corrected {rms[1]:.2f} {most[1]:.2f} %"
            )


if __name__ == "__main__":
    print(*lines(), sep="\n")
