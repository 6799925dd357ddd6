"""A plan in files: plan.csv, changes.csv, plan.json, and plan.txt to read."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bench.base.atomic import write_whole
from bench.base.results import write_result
from bench.base.tables import (
    SPEED,
    SURFACE,
    TRIAL,
    WHISK,
    Column,
    Kind,
    Table,
    alike,
    sigma_name,
    status,
)
from bench.plan.outlook import QUANTITIES, WORDS
from bench.plan.plan_rows import Row
from bench.plan.tries import Try

FACTS = ("trial", "whisk", "purpose", "surface", "speed_deg_s", "beta_deg", "psi_deg", "d_x_mm")
SIGMAS = tuple(sigma_name(name) for name in QUANTITIES)
STATED = tuple(name.replace("_sigma_", "_stated_sigma_") for name in SIGMAS)
LIMITS = tuple(f"{name.rpartition('_')[0]}_limited_by" for name in QUANTITIES)
_EXPECTED = "standard deviations expected; of slip, φ and α at the wanted angle"
PLAN = Table(
    "plan",
    "A row a trial of `whisker-bench plan RIG.toml`, or a whisk of `plan SESSION` "
    "([plan.md](plan.md)).",
    (
        TRIAL,
        WHISK,
        Column("purpose", "as the manifest has it", Kind.TEXT),
        SURFACE,
        SPEED,
        *alike(("beta_deg", "psi_deg", "d_x_mm"), "as wanted, or as seen of a recorded whisk"),
        *alike(SIGMAS, _EXPECTED),
        *alike(STATED, "of a recorded session: as `evaluate` states them"),
        *alike(
            LIMITS,
            "the cause of the largest part of the variance, and how large that part is",
            Kind.TEXT,
        ),
        Column("best_change", "the change that leaves least of d_x's sigma", Kind.TEXT),
        Column(
            "best_share",
            "what part of d_x's sigma it leaves; 0 where there is a truth only with it",
        ),
        Column("obstacles", "what stands in a camera's way", Kind.TEXT),
        status("why there is no truth, or what is doubtful"),
    ),
)
CHANGES = Table(
    "changes",
    "A row a trial and change tried; sigmas are empty where there is no truth.",
    (
        TRIAL,
        WHISK,
        Column("kind", "move, lens, views, board, third or light", Kind.TEXT),
        Column("change", "the change in words", Kind.TEXT),
        *alike(SIGMAS, f"{_EXPECTED}, with that change"),
    ),
)
_SHOWN = {
    "d_x_mm": "d_x mm",
    "touch_deg": "touch °",
    "beta_deg": "β °",
    "slip_mm": "slip mm",
    "phi_deg": "φ °",
    "alpha_deg": "α °",
}
# Where the stated sigma is this many times the expected one or more, a whisk was seen worse than its place allows.
_WORSE = 1.25
_MOST_NAMED = 8


@dataclass(frozen=True, eq=False)
class Plan:
    """What a plan says. title: of what; cameras: a line each; rows; assumed: sentences on what it takes for granted;
    tried: the changes that were."""

    title: str
    cameras: tuple[str, ...]
    rows: tuple[Row, ...]
    theta_deg: float
    assumed: tuple[str, ...] = ()
    tried: tuple[Try, ...] = field(default=())

    @property
    def recorded(self) -> bool:
        """Whether it is of a session that was recorded."""
        return any(row.stated is not None for row in self.rows)

    @property
    def doubtful(self) -> bool:
        """Whether a trial has no truth."""
        return not all(row.outlook.has_truth for row in self.rows)


def write_plan(out: Path, plan: Plan) -> str:
    """All but the pictures. The text."""
    PLAN.write(out, map(_cells, plan.rows))
    changes = (
        {
            "trial": row.facts.trial,
            "whisk": row.facts.whisk,
            "kind": one.kind,
            "change": one.words,
            **_named(one.sigma, SIGMAS),
        }
        for row in plan.rows
        for one in row.tried
    )
    CHANGES.write(out, changes)
    write_result(out / "plan.json", _plain(plan))
    text = "\n".join(lines_of(plan)) + "\n"
    write_whole(out / "plan.txt", text)
    return text


def _named(sigma, columns: Sequence[str]) -> dict[str, float]:
    return {column: sigma[name] for column, name in zip(columns, QUANTITIES) if name in sigma}


def _cells(row: Row) -> dict:
    best, found = row.best(), row.outlook.limits
    limits = {
        column: f"{WORDS[found[name][0]]} {100 * found[name][1]:.0f} %"
        for column, name in zip(LIMITS, QUANTITIES)
        if name in found
    }
    return {
        **{name: getattr(row.facts, name) for name in FACTS},
        **_named(row.outlook.sigma, SIGMAS),
        **_named(row.stated or {}, STATED),
        **limits,
        "best_change": best[0].words if best else None,
        "best_share": best[1] if best else None,
        "obstacles": "; ".join(row.outlook.obstacles),
        "status": row.outlook.status,
    }


def _plain(plan: Plan) -> dict:
    """As JSON has it."""
    rows = [
        {
            **{name: getattr(row.facts, name) for name in FACTS},
            "sigma": dict(row.outlook.sigma),
            "stated_sigma": row.stated,
            "status": row.outlook.status,
            "obstacles": list(row.outlook.obstacles),
            "limits": {
                name: {"cause": cause, "share": part}
                for name, (cause, part) in row.outlook.limits.items()
            },
            "lines": {
                name: {"wire_px": noise.wire_px, "bar_px": noise.bar_px}
                for name, noise in row.lines.items()
            },
            "tried": [
                {"kind": one.kind, "change": one.words, "sigma": dict(one.sigma)}
                for one in row.tried
            ],
        }
        for row in plan.rows
    ]
    return {
        "title": plan.title,
        "theta_deg": plan.theta_deg,
        "cameras": list(plan.cameras),
        "assumed": list(plan.assumed),
        "rows": rows,
    }


def lines_of(plan: Plan) -> Iterator[str]:
    """plan.txt."""
    yield plan.title
    yield from plan.cameras
    yield ""
    yield from _table(plan)
    yield from filter(None, map(_no_truth, plan.rows))
    yield ""
    yield from _limited(plan.rows)
    yield from _changes(plan.rows)
    if plan.recorded:
        yield from _beside_stated(plan.rows)
    said = dict.fromkeys(sentence for row in plan.rows for sentence in row.outlook.obstacles)
    yield from (f"In the way: {sentence}." for sentence in said)
    yield from plan.assumed


def _table(plan: Plan) -> Iterator[str]:
    kind = "expected / stated sigma" if plan.recorded else "expected sigma"
    yield f"{kind}; slip, φ, α at {plan.theta_deg:g}°"
    names = [_name(row) for row in plan.rows]
    wide = max(map(len, names), default=5)
    each = 17 if plan.recorded else 9
    yield "  ".join(
        [f"{'trial':<{wide}}", "  β °", " d_x", *(f"{_SHOWN[name]:>{each}}" for name in QUANTITIES)]
    )
    for name, row in zip(names, plan.rows):
        cells = [_cell(row, column) for column in QUANTITIES]
        yield "  ".join(
            [
                f"{name:<{wide}}",
                f"{row.facts.beta_deg:5.1f}",
                f"{row.facts.d_x_mm:4.0f}",
                *(f"{cell:>{each}}" for cell in cells),
            ]
        )


def _name(row: Row) -> str:
    return row.facts.trial + (f" {row.facts.whisk}" if row.facts.whisk else "")


def _cell(row: Row, column: str) -> str:
    shown = f"{row.outlook.sigma[column]:.4f}" if row.outlook.has_truth else "-"
    if row.stated is None:
        return shown
    return f"{shown} / {row.stated[column]:.4f}" if row.stated else f"{shown} / -"


def _no_truth(row: Row) -> str:
    if row.outlook.has_truth:
        return f"{_name(row)}: {row.outlook.status}." if row.outlook.status else ""
    why = [row.outlook.status, *row.outlook.obstacles]
    return f"{_name(row)} has no truth: {'; '.join(filter(None, why))}."


def _limited(rows: Sequence[Row]) -> Iterator[str]:
    """What limits each quantity, over all rows."""
    known = [row for row in rows if row.outlook.limits]
    for name in QUANTITIES if known else ():
        shares: dict[str, list[float]] = {}
        for row in known:
            cause, part = row.outlook.limits[name]
            shares.setdefault(cause, []).append(part)
        told = ", ".join(
            f"{WORDS[cause]} in {len(parts)} ({100 * np.median(parts):.0f} % of the variance)"
            for cause, parts in sorted(shares.items(), key=lambda one: -len(one[1]))
        )
        yield f"{_SHOWN[name].split()[0]} is limited by {told}."


def _changes(rows: Sequence[Row]) -> Iterator[str]:
    """What changes would do: by trial the best, then the best few over all."""
    tried = [row for row in rows if row.tried]
    if not tried:
        return
    yield ""
    yield "Which one change would halve d_x's sigma?"
    for row in tried:
        best = row.best()
        if best is None:
            yield f"  {_name(row)}: none of {len(row.tried)} that were tried gives a truth."
        elif not row.outlook.has_truth:
            yield f"  {_name(row)}: {best[0].words} gives a truth, ± {best[0].sigma['d_x_mm']:.4f} mm."
        else:
            says = "" if row.halved() else "none; most helps "
            yield f"  {_name(row)}: {says}{best[0].words}, to {100 * best[1]:.0f} %."
    yield from _over_all(tried)


def _over_all(rows: Sequence[Row]) -> Iterator[str]:
    """Each change's median effect on each sigma, the best of each kind."""
    known = [row for row in rows if row.outlook.has_truth]
    if not known:
        return
    yield ""
    yield f"What is left of each sigma, %, median over {len(known)} whisks (- where a change costs the truth of more)"
    yield "  ".join([*(f"{_SHOWN[name].split()[0]:>5}" for name in QUANTITIES), "change"])
    shares = [
        (one.words, one.kind, _shares(known, number)) for number, one in enumerate(known[0].tried)
    ]
    best = {}
    for words, kind, share in sorted(
        shares, key=lambda one: one[2][0] if np.isfinite(one[2][0]) else np.inf
    ):
        best.setdefault(kind, (words, share))
    for words, share in best.values():
        yield "  ".join([*(f"{100 * x:5.0f}" if np.isfinite(x) else "    -" for x in share), words])


def _shares(rows: Sequence[Row], number: int) -> list[float]:
    """What a change leaves of each sigma, in the median; NaN where it costs the truth of half of them."""
    left = [
        [row.tried[number].sigma.get(name, np.inf) / row.outlook.sigma[name] for name in QUANTITIES]
        for row in rows
    ]
    median = np.median(left, axis=0)
    return [float(x) if np.isfinite(x) else float("nan") for x in median]


def _beside_stated(rows: Sequence[Row]) -> Iterator[str]:
    """How expected and stated compare, and the whisks that were seen worse than their place allows."""
    both = [row for row in rows if row.stated and row.outlook.has_truth]
    if not both:
        return
    yield ""
    ratios = {
        name: np.array([row.outlook.sigma[name] / row.stated[name] for row in both])
        for name in QUANTITIES
    }
    told = ", ".join(
        f"{_SHOWN[name].split()[0]} {np.median(one):.2f}" for name, one in ratios.items()
    )
    yield f"Expected over stated, median over {len(both)} whisks: {told}."
    for name, one in ratios.items():
        worse = [_name(row) for row, ratio in zip(both, one) if ratio < 1.0 / _WORSE]
        if worse:
            named = ", ".join([*worse[:_MOST_NAMED], *["…"] * (len(worse) > _MOST_NAMED)])
            yield (
                f"{_SHOWN[name].split()[0]} of {named} is stated wider than rods, cameras and lines ask for: look "
                "at the frames (a slip in jumps, a lost frame)."
            )
