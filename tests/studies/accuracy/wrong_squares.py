"""Of how many sessions is a square named that is stated too large, by where the whisker turns?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/wrong_squares.py [SESSION]

The board stands where SESSION's stands (the small session's), placed to 0.2 mm and 0.2°; free strokes of 1.5° of five trials
place the rig with the covariance below. Both are drawn, and the square's error with its assumed ± 0.1 % about each share.
Prints by share how often the square is named, with the scale's sigma, and how often it would be by the weighted mean of
this scale with all else that knows it: the bars' widths and the whisker's end.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.session.session import load_session
from vision.calibration import Placement, by_board, combine

ROOT = Path(__file__).resolve().parents[3]
# [rad, mm] Of free strokes of five trials; those of one have root 5 of it (tests/bench/trials/test_consistency.py).
STROKE_SIGMAS = np.array([0.02, 0.1, 0.0043, 0.13, 0.18, 0.18]) / np.sqrt(5)
SQUARE_SIGMA = 1e-3
# [1] Of the scale by the widths of the bars and by where the whisker ends, of two cameras.
OTHER_SIGMAS = np.array([0.012, 0.02])
NAMED_SIGMAS = 3.0
SHARES = (0.0, 0.005, 0.01, 0.012, 0.015, 0.02)
DRAWS = 4000


def share_named(
    T_rig_board: np.ndarray, off: float, rng: np.random.Generator
) -> tuple[float, float, float, float]:
    """Return the share of sessions in which a square off by a share is named, and the scale's sigma; then both by all."""
    swing_covariance = np.diag(STROKE_SIGMAS**2)
    board = by_board(T_rig_board, 0.2, np.radians(0.2), SQUARE_SIGMA)
    root = np.linalg.cholesky(board.covariance + swing_covariance)
    named = 0
    named_by_all = 0
    for _ in range(DRAWS):
        share = off + SQUARE_SIGMA * rng.standard_normal()
        step = root @ rng.standard_normal(6) + share * board.scale.by_share
        placed = combine(board, Placement(step, swing_covariance))
        named += placed.scale.is_why
        sigmas = np.append(OTHER_SIGMAS, placed.scale.sigma)
        others = share + OTHER_SIGMAS * rng.standard_normal(len(OTHER_SIGMAS))
        sigma = 1.0 / np.sqrt(np.sum(sigmas**-2))
        mean = sigma**2 * np.sum(np.append(others, placed.scale.share) * sigmas**-2)
        named_by_all += abs(mean) > NAMED_SIGMAS * np.hypot(sigma, SQUARE_SIGMA)
    return named / DRAWS, placed.scale.sigma, named_by_all / DRAWS, sigma


def main() -> None:
    folder = Path(sys.argv[1]) if sys.argv[1:] else ROOT / "fixtures" / "small-session"
    T_rig_board = load_session(folder).T_rig_board
    rng = np.random.default_rng(3)
    for off in SHARES:
        named, sigma, by_all, sigma_of_all = share_named(T_rig_board, off, rng)
        print(
            f"{100 * off:.1f} % off: named in {100 * named:.1f} %, the scale ± {100 * sigma:.2f} %; "
            f"by all {100 * by_all:.1f} %, ± {100 * sigma_of_all:.2f} %"
        )


if __name__ == "__main__":
    main()
