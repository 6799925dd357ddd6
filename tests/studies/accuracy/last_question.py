"""Whether pictures contradict a bar that is drawn elsewhere, in path-traced scenes.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/last_question.py SCENES [PATTERN] [COUNT]

SCENES as for path_traced.py. A row a scene: d_x's error and sigma (mm) as fitted from the place found, by how much more
of the bar's width has changed under another place, its sigma, how far away it is (px), how far the fit ended from
where it began (px), the milliseconds that the question took, and d_x's error after it. With COUNT each scene is fitted
COUNT times more from each of places moved from the true one in a random direction: a row each where d_x ends
elsewhere; then of each amount how many fits, how many are wrong (by more than 4 sigma, or the bar by more than 2 px),
how many of these were asked about again, how many are right after that, and the largest error of d_x that stays
without a word.
"""

import sys
import time
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.error_parts import read_whisk
from vision.geometry.contact import BarAxis, axis_frame
from vision.geometry.refusals import Refused
from vision.touched.search import SeenBar
from vision.truth.explanations import Explanation, best_explanation
from vision.truth.whisk_fit import fit_whisk
from vision.truth.whisk_pictures import WhiskPictures

MOVED = ((0.5, 0.0), (1.0, 0.0), (2.0, 0.0), (0.0, 2.0), (0.0, 5.0))  # mm, degrees
MOST_SIGMAS = 4.0
MOST_PX = 2.0


@dataclass(frozen=True)
class Row:
    """One whisk before and after the question. off_px: of the bar from the true one. word: a status, if there is one."""

    error_mm: float
    sigma_mm: float
    off_px: float
    gain: float
    gain_sigma: float
    apart_px: float
    went_px: float
    asked_ms: float
    after_mm: float
    after_sigma_mm: float
    word: str

    @property
    def is_wrong(self) -> bool:
        return abs(self.error_mm) > MOST_SIGMAS * self.sigma_mm or self.off_px > MOST_PX

    @property
    def is_asked_again(self) -> bool:
        return bool(self.word) or self.after_mm != self.error_mm

    @property
    def is_right_after(self) -> bool:
        return abs(self.after_mm) < MOST_SIGMAS * self.after_sigma_mm

    def __str__(self) -> str:
        before = f"{self.error_mm:+.3f} ± {self.sigma_mm:.3f} mm, bar off {self.off_px:.1f} px"
        asked = f"gain {self.gain:+.3f} ± {self.gain_sigma:.3f} {self.apart_px:.1f} px away"
        cost = f"went {self.went_px:.1f} px, {self.asked_ms:.0f} ms"
        return f"{before}; {asked}, {cost}; {self.after_mm:+.3f} ± {self.after_sigma_mm:.3f} mm {self.word}"


def ask(whisk: WhiskPictures, true: BarAxis, d_x_mm: float) -> Row:
    """A whisk fitted from its bar's place, and asked about. Raises Refused where there is no first fit."""
    first = Explanation(whisk, fit_whisk(whisk))
    begin = time.process_time()
    question = first.place_comparison
    best = question.best
    gain, gain_sigma = question.gain(best, first.axis)
    asked_ms = 1e3 * (time.process_time() - begin)
    try:
        best_fit = best_explanation(first)
        word = ", ".join(best_fit.warning.codes)
        after = best_fit.fitted.of_whisk("d_x")
        after_mm, after_sigma_mm = after.value - d_x_mm, after.sigma
    except Refused as reason:
        after_mm, after_sigma_mm, word = np.nan, np.nan, reason.code
    d_x = first.fitted.of_whisk("d_x")
    return Row(
        d_x.value - d_x_mm,
        d_x.sigma,
        question.apart_px(true, first.axis),
        gain,
        gain_sigma,
        question.apart_px(best, first.axis),
        question.apart_px(whisk.bar.axis, first.axis),
        asked_ms,
        after_mm,
        after_sigma_mm,
        word,
    )


def moved(axis: BarAxis, by: tuple[float, float], rng: np.random.Generator) -> BarAxis:
    """An axis shifted by mm and turned by degrees, both in one random direction."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    way = np.array([np.cos(angle), np.sin(angle)])
    return axis.shifted(
        axis_frame(axis.direction), np.concatenate([by[0] * way, np.radians(by[1]) * way])
    )


def ask_moved(
    name: str, whisk: WhiskPictures, true: BarAxis, d_x_mm: float, count: int
) -> dict[tuple[float, float], list[Row]]:
    """By amount the rows of fits that begin from places moved from the true one."""
    rng = np.random.default_rng(list(name.encode()))
    rows = {by: [] for by in MOVED}
    for by in MOVED:
        for _ in range(count):
            begin = replace(whisk, bar=SeenBar(moved(true, by, rng), {}))
            try:
                row = ask(begin, true, d_x_mm)
            except (Refused, np.linalg.LinAlgError):
                continue
            rows[by].append(row)
            if row.is_wrong or row.is_asked_again:
                print(f"       {by[0]:g} mm {by[1]:g}°: {row}", flush=True)
    return rows


def print_sums(by: tuple[float, float], rows: list[Row]) -> None:
    """Print what became of all fits from places moved by one amount."""
    wrong = [row for row in rows if row.is_wrong]
    again = [row for row in wrong if row.is_asked_again]
    right = [row for row in again if row.is_right_after]
    kept = [abs(row.after_mm) for row in rows if not row.word]
    print(
        f"{by[0]:g} mm {by[1]:g}°: {len(rows)} fits, {len(wrong)} wrong, of these {len(again)} asked again, "
        f"{len(right)} then right; d_x without a word at most {max(kept, default=0.0):.3f} mm off"
    )


def main() -> None:
    pattern = sys.argv[2] if len(sys.argv) > 2 else "*"
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    everything = {by: [] for by in MOVED}
    for folder in sorted(Path(sys.argv[1]).glob(pattern)):
        truth = folder / "trials/w/truth.toml"
        if not truth.exists():
            continue
        d_x_mm = tomllib.loads(truth.read_text())["d_x_mm"]
        try:
            whisk, true = read_whisk(folder)
            print(f"{folder.name:<6} {ask(whisk, true, d_x_mm)}", flush=True)
        except Refused as reason:
            print(f"{folder.name:<6} {reason}", flush=True)
            continue
        for by, rows in ask_moved(folder.name, whisk, true, d_x_mm, count).items():
            everything[by] += rows
    for by, rows in everything.items():
        if rows:
            print_sums(by, rows)


if __name__ == "__main__":
    main()
