"""A plan in files: plan.csv, changes.csv, plan.json, and plan.txt to read."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from bench.base.atomic import write_whole
from bench.base.results import plain, write_result
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
from bench.plan.plan_rows import Plan, Row
from bench.plan.plan_text import lines_of

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
            "the cause of the largest part of the variance, and that part",
            Kind.TEXT,
        ),
        Column("best_change", "the change that leaves least of d_x's sigma", Kind.TEXT),
        Column(
            "best_share",
            "what part of d_x's sigma it leaves; 0 where there is a truth only with it",
        ),
        Column("obstacles", "what stands in a camera's way", Kind.TEXT),
        status("why there is no truth, or its warnings"),
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
        *alike(SIGMAS, "standard deviations expected, with that change"),
    ),
)


def write_plan(out: Path, plan: Plan) -> str:
    """Write all of a plan but its drawing. Returns the text of plan.txt."""
    PLAN.write(out, map(_plan_cells, plan.rows))
    CHANGES.write(out, _changes_cells(plan))
    write_result(out / "plan.json", plain(_as_json(plan)))
    text = "\n".join(lines_of(plan)) + "\n"
    write_whole(out / "plan.txt", text)
    return text


def _plan_cells(row: Row) -> dict:
    """Return a row of plan.csv."""
    cells = _fact_cells(row)
    cells |= _sigma_cells(row.outlook.sigma, SIGMAS)
    cells |= _sigma_cells(row.stated or {}, STATED)
    for column, name in zip(LIMITS, QUANTITIES):
        if name in row.outlook.limits:
            cause, share = row.outlook.limits[name]
            cells[column] = f"{WORDS[cause]} {100 * share:.0f} %"
    best = row.best()
    cells["best_change"] = best[0].words if best else None
    cells["best_share"] = best[1] if best else None
    cells["obstacles"] = "; ".join(row.outlook.obstacles)
    cells["status"] = row.outlook.status
    return cells


def _changes_cells(plan: Plan) -> Iterator[dict]:
    """Yield the rows of changes.csv."""
    for row in plan.rows:
        for change in row.changes:
            cells = {
                "trial": row.facts.trial,
                "whisk": row.facts.whisk,
                "kind": change.kind,
                "change": change.words,
            }
            yield cells | _sigma_cells(change.sigma, SIGMAS)


def _fact_cells(row: Row) -> dict:
    """Return what is wanted of a trial, or was seen, by column."""
    return {name: getattr(row.facts, name) for name in FACTS}


def _sigma_cells(sigma: Mapping[str, float], columns: tuple[str, ...]) -> dict[str, float]:
    """Return sigmas by quantity as cells of these columns, in the order of QUANTITIES."""
    return {column: sigma[name] for column, name in zip(columns, QUANTITIES) if name in sigma}


def _as_json(plan: Plan) -> dict:
    """Return a plan as JSON has it."""
    return {
        "title": plan.title,
        "theta_deg": plan.theta_deg,
        "cameras": list(plan.cameras),
        "assumed": list(plan.assumptions),
        "rows": [_row_as_json(row) for row in plan.rows],
    }


def _row_as_json(row: Row) -> dict:
    """Return a row of a plan as JSON has it."""
    limits = {}
    for name, (cause, share) in row.outlook.limits.items():
        limits[name] = {"cause": cause, "share": share}
    lines = {}
    for name, noise in row.noise.items():
        lines[name] = {"wire_px": noise.wire_px, "bar_px": noise.bar_px}
    changes = []
    for change in row.changes:
        entry = {"kind": change.kind, "change": change.words, "sigma": dict(change.sigma)}
        changes.append(entry)
    return {
        **_fact_cells(row),
        "sigma": dict(row.outlook.sigma),
        "stated_sigma": row.stated,
        "status": row.outlook.status,
        "obstacles": list(row.outlook.obstacles),
        "limits": limits,
        "lines": lines,
        "tried": changes,
    }
