"""Sweeps: one scene at many points, each a row of one table.

No engine is used here: the caller passes a function that runs a scene, and an executor of runs.
"""

from exudyn_flexlink.sweeps.plan import (
    Design,
    Sweep,
    ValuesError,
    Varied,
    column_of,
    column_of_contact,
    drawn,
    grid,
    in_si,
    label_of,
    listed,
    planned,
    quantity_at,
    range_of,
    si_unit,
    symbol_of,
    versions,
)
from exudyn_flexlink.sweeps.rows import (
    DOUBTFUL,
    FAILED,
    Observe,
    OneRun,
    Row,
    Scalar,
    Simulate,
    Work,
    shortened,
    standard_row,
    work_of,
)
from exudyn_flexlink.sweeps.study import (
    CannotStartError,
    Executor,
    SweepTable,
    carried_out,
    executor_of,
    in_this_process,
    local_processes,
    read_study,
    table_of,
)
