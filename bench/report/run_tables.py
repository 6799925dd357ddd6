"""All tables that every evaluated session has, apart from a track a trial.

A table of which nothing is known has its header alone.
"""

from bench.analyses.against_theta import AGAINST_THETA
from bench.analyses.curved import CURVATURE
from bench.analyses.error_map import ERROR_MAP
from bench.analyses.explained import EXPLAINED
from bench.analyses.friction_tables import FRICTION, PHASES, SURFACES
from bench.analyses.ledger import LEDGER
from bench.analyses.soft import COMPLIANCE_SEEN
from bench.analyses.table_i_sensors import SENSORS
from bench.analyses.tilted import TILTS
from bench.report.whisk_tables import BEAM, BUDGET, ESTIMATES, WHISKS

# In the order in which the summary names them.
_TABLES = (
    WHISKS,
    ESTIMATES,
    BUDGET,
    BEAM,
    FRICTION,
    PHASES,
    SURFACES,
    EXPLAINED,
    ERROR_MAP,
    AGAINST_THETA,
    COMPLIANCE_SEEN,
    CURVATURE,
    TILTS,
    SENSORS,
    LEDGER,
)
RUN_TABLES = {table.name: table for table in _TABLES}
