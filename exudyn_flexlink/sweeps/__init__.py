"""Sweeps: one scene at many points, each a row of one table.

No engine here: whoever starts a sweep hands in what runs a scene, and who makes the runs.
"""

from exudyn_flexlink.sweeps.designs import Design, drawn, grid, listed
from exudyn_flexlink.sweeps.dimensions import (
    column_of,
    in_si,
    label_of,
    quantity_at,
    si_unit,
    symbol_of,
)
from exudyn_flexlink.sweeps.executors import (
    CannotStartError,
    Executor,
    executor_of,
    in_this_process,
    local_processes,
)
from exudyn_flexlink.sweeps.plan import Sweep, Varied, planned, versions
from exudyn_flexlink.sweeps.rows import (
    DOUBTFUL,
    FAILED,
    Observe,
    OneRun,
    Row,
    Scalar,
    Simulate,
    standard_row,
)
from exudyn_flexlink.sweeps.study import read_study
from exudyn_flexlink.sweeps.table import SweepTable, carried_out, table_of
from exudyn_flexlink.sweeps.values import ValuesError, range_of
from exudyn_flexlink.sweeps.work import Work, shortened, work_of
