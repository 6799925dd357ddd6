"""All tables that every evaluated session has, apart from a track a trial.

A table of which nothing is known has its header alone.
"""

from bench.analyses.catalogue import ANALYSES
from bench.base.tables import Table
from bench.report.whisk_tables import BEAM, BUDGET, ESTIMATES, WHISKS


def _run_tables() -> dict[str, Table]:
    """Return the tables by their names, in the order in which the summary names them."""
    tables = [WHISKS, ESTIMATES, BUDGET, BEAM]
    for analysis in ANALYSES:
        if analysis.in_every_run:
            tables += analysis.tables
    return {table.name: table for table in tables}


RUN_TABLES = _run_tables()
