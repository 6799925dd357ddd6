"""plan.txt: a plan to read."""

from collections.abc import Iterator, Sequence

import numpy as np

from bench.base.numbers import first_names
from bench.plan.outlook import QUANTITIES, WORDS
from bench.plan.plan_rows import Plan, Row
from vision.geometry import counted

_HEADINGS = {
    "d_x_mm": "d_x mm",
    "touch_deg": "touch °",
    "beta_deg": "β °",
    "slip_mm": "slip mm",
    "phi_deg": "φ °",
    "alpha_deg": "α °",
}
_SYMBOLS = {name: heading.split()[0] for name, heading in _HEADINGS.items()}
# [1] Where the stated sigma is this many times the expected one or more, a whisk was seen worse
# than its place allows. Stated.
_WORSE = 1.25
# [whisks] That a line names, at most. A layout.
_MOST_NAMED = 8


def lines_of(plan: Plan) -> Iterator[str]:
    """Yield the lines of plan.txt."""
    yield plan.title
    yield from plan.cameras
    yield ""
    yield from _table(plan)
    for row in plan.rows:
        if row.outlook.status or not row.outlook.has_truth:
            yield _status_line(row)
    yield ""
    yield from _limit_lines(plan.rows)
    with_changes = [row for row in plan.rows if row.changes]
    if with_changes:
        yield from _change_lines(with_changes)
    if plan.is_recorded:
        yield from _stated_lines(plan.rows)
    obstacles: list[str] = []
    for row in plan.rows:
        obstacles += row.outlook.obstacles
    for sentence in dict.fromkeys(obstacles):
        yield f"In the way: {sentence}."
    yield from plan.assumptions


def _table(plan: Plan) -> Iterator[str]:
    """Yield the table of sigmas."""
    kind = "expected / stated sigma" if plan.is_recorded else "expected sigma"
    yield f"{kind}; slip, φ, α at {plan.theta_deg:g}°"
    name_width = max((len(row.name) for row in plan.rows), default=5)
    width = 17 if plan.is_recorded else 9
    headings = [f"{_HEADINGS[name]:>{width}}" for name in QUANTITIES]
    yield "  ".join([f"{'trial':<{name_width}}", "  β °", " d_x", *headings])
    for row in plan.rows:
        cells = [f"{row.name:<{name_width}}"]
        cells += [f"{row.facts.beta_deg:5.1f}", f"{row.facts.d_x_mm:4.0f}"]
        cells += [f"{_sigma_text(row, name):>{width}}" for name in QUANTITIES]
        yield "  ".join(cells)


def _sigma_text(row: Row, name: str) -> str:
    """Return a quantity's sigma, and the stated one of a recorded whisk."""
    expected = f"{row.outlook.sigma[name]:.4f}" if row.outlook.has_truth else "-"
    if row.stated is None:
        return expected
    return f"{expected} / {row.stated[name]:.4f}" if row.stated else f"{expected} / -"


def _status_line(row: Row) -> str:
    """Return why a row has no truth, or its warning."""
    if row.outlook.has_truth:
        return f"{row.name}: {row.outlook.status}."
    reasons = filter(None, [row.outlook.status, *row.outlook.obstacles])
    return f"{row.name} has no truth: {'; '.join(reasons)}."


def _limit_lines(rows: Sequence[Row]) -> Iterator[str]:
    """Yield what limits each quantity, the most frequent cause first."""
    known = [row for row in rows if row.outlook.limits]
    for name in QUANTITIES if known else ():
        shares: dict[str, list[float]] = {}
        for row in known:
            cause, share = row.outlook.limits[name]
            shares.setdefault(cause, []).append(share)
        causes = []
        for cause, own in sorted(shares.items(), key=lambda item: -len(item[1])):
            median = 100 * np.median(own)
            causes.append(f"{WORDS[cause]} in {len(own)} ({median:.0f} % of the variance)")
        yield f"{_SYMBOLS[name]} is limited by {', '.join(causes)}."


def _change_lines(rows: Sequence[Row]) -> Iterator[str]:
    """Yield what changes would do: of each trial the best, then the best few over all."""
    yield ""
    yield "Which one change would halve d_x's sigma?"
    for row in rows:
        yield f"  {row.name}: {_best_change(row)}"
    known = [row for row in rows if row.outlook.has_truth]
    if known:
        yield from _changes_over_all(known)


def _best_change(row: Row) -> str:
    """Return what the best change leaves of the sigma of d_x."""
    best = row.best()
    if best is None:
        return f"none of {len(row.changes)} that were tried gives a truth."
    change, share = best
    if not row.outlook.has_truth:
        return f"{change.words} gives a truth, ± {change.sigma['d_x_mm']:.4f} mm."
    most = "" if row.is_halved else "none; most helps "
    return f"{most}{change.words}, to {100 * share:.0f} %."


def _changes_over_all(rows: Sequence[Row]) -> Iterator[str]:
    """Yield what changes leave of each sigma in the median, of each kind the best."""
    yield ""
    yield f"What is left of each sigma, %, median over {len(rows)} whisks (- where a change costs the truth of more)"
    yield "  ".join([*(f"{_SYMBOLS[name]:>5}" for name in QUANTITIES), "change"])
    changes = list(enumerate(rows[0].changes))
    changes.sort(key=lambda item: _median_share(rows, item[0], "d_x_mm"))
    best = {}
    for number, change in changes:
        best.setdefault(change.kind, number)
    for number in best.values():
        cells = []
        for name in QUANTITIES:
            share = _median_share(rows, number, name)
            cells.append(f"{100 * share:5.0f}" if np.isfinite(share) else "    -")
        yield "  ".join([*cells, rows[0].changes[number].words])


def _median_share(rows: Sequence[Row], number: int, name: str) -> float:
    """Return what a change leaves of a sigma, in the median.

    It is infinite where the change costs the truth of half the rows.
    """
    left = []
    for row in rows:
        left.append(row.changes[number].sigma.get(name, np.inf) / row.outlook.sigma[name])
    return float(np.median(left))


def _stated_lines(rows: Sequence[Row]) -> Iterator[str]:
    """Yield how planned and evaluated sigmas compare, and which whisks were seen worse than expected."""
    both = [row for row in rows if row.stated and row.outlook.has_truth]
    if not both:
        return
    ratios = {}  # by quantity, planned over evaluated (rows,)
    medians = []
    for name in QUANTITIES:
        ratio = np.array([row.outlook.sigma[name] / row.stated[name] for row in both])
        ratios[name] = ratio
        medians.append(f"{_SYMBOLS[name]} {np.median(ratio):.2f}")
    yield ""
    count = counted(len(both), "whisk")
    yield f"Sigmas as planned over those of the evaluated run, median of {count}: {', '.join(medians)}."
    for name, ratio in ratios.items():
        worse = [row.name for row, own in zip(both, ratio) if own < 1.0 / _WORSE]
        if not worse:
            continue
        yield (
            f"{_SYMBOLS[name]} of {first_names(worse, _MOST_NAMED)} is known less well than rods, cameras and lines allow: look "
            "at the frames (a slip in jumps, a lost frame)."
        )
