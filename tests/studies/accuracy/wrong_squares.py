"""Of how many sessions is a square named that is stated too large, by where the whisker turns?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/wrong_squares.py [SESSION]

The board stands where SESSION's stands (the small session's), placed to 0.2 mm and 0.2°; free strokes of 1.5° of five trials
place the rig with the covariance below. Both are drawn, and the square's error with its assumed ± 0.1 % about each share.
Prints by share how often the square is named, with the scale's sigma, and how often it would be by the weighted mean of
this scale with all else that knows it: the bars' widths and the whisker's end; then with an end that is seen to 0.3 mm of a
whisker whose 100 mm are measured to 0.1 mm, or to the 0.5 mm that are assumed.
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
OTHER_SIGMAS = {
    "all": np.array([0.012, 0.02]),
    "all, the end to 0.3 mm": np.array([0.012, np.hypot(0.003, 0.001)]),
    "all, the end to 0.3 mm of a length to 0.5 mm": np.array([0.012, np.hypot(0.003, 0.005)]),
}
NAMED_SIGMAS = 3.0
SHARES = (0.0, 0.005, 0.01, 0.012, 0.015, 0.02)
DRAWS = 4000


def shares_named(
    T_rig_board: np.ndarray, off: float, rng: np.random.Generator
) -> dict[str, tuple[float, float]]:
    """Return by what knows the scale the share of sessions in which a square off by a share is named, and the scale's sigma."""
    swing_covariance = np.diag(STROKE_SIGMAS**2)
    board = by_board(T_rig_board, 0.2, np.radians(0.2), SQUARE_SIGMA)
    root = np.linalg.cholesky(board.covariance + swing_covariance)
    named = dict.fromkeys(("strokes", *OTHER_SIGMAS), 0)
    sigma_of = {}
    for _ in range(DRAWS):
        share = off + SQUARE_SIGMA * rng.standard_normal()
        step = root @ rng.standard_normal(6) + share * board.scale.by_share
        placed = combine(board, Placement(step, swing_covariance))
        named["strokes"] += placed.scale.is_why
        sigma_of["strokes"] = placed.scale.sigma
        for name, of_others in OTHER_SIGMAS.items():
            others = share + of_others * rng.standard_normal(len(of_others))
            sigmas = np.append(of_others, placed.scale.sigma)
            sigma = 1.0 / np.sqrt(np.sum(sigmas**-2))
            mean = sigma**2 * np.sum(np.append(others, placed.scale.share) * sigmas**-2)
            named[name] += abs(mean) > NAMED_SIGMAS * np.hypot(sigma, SQUARE_SIGMA)
            sigma_of[name] = sigma
    return {name: (count / DRAWS, sigma_of[name]) for name, count in named.items()}


def main() -> None:
    folder = Path(sys.argv[1]) if sys.argv[1:] else ROOT / "fixtures" / "small-session"
    T_rig_board = load_session(folder).T_rig_board
    rng = np.random.default_rng(3)
    for off in SHARES:
        found = shares_named(T_rig_board, off, rng).items()
        by = [
            f"by {name} {100 * named:.1f} % (scale ± {100 * sigma:.2f} %)"
            for name, (named, sigma) in found
        ]
        print(f"{100 * off:.1f} % off is named: {'; '.join(by)}")


if __name__ == "__main__":
    main()
