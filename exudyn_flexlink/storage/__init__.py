"""A run on disk: a folder with everything in it.

``manifest.json`` names the files that a run wrote: a later one replaces these, and no others.
``result.nc`` is the run: the arrays as netCDF, with names, dimensions and units, and all else as
text. `load` gives the Result back exactly. ``summary.json`` and CSV files are printed from it, for
readers.
"""

from exudyn_flexlink.storage.replacing import (
    KeptBesideError,
    StorageError,
    replace_file,
    staged_files,
    staged_folder,
    written_files,
)
from exudyn_flexlink.storage.run import (
    Array,
    all_columns,
    arrays_of,
    attributes_of,
    bending_columns,
    happening_columns,
    lever_columns,
    load,
    save,
    strike_columns,
    touch_columns,
    trajectory_columns,
)
from exudyn_flexlink.storage.studies import (
    SeriesKeeper,
    is_sweep,
    load_sweep,
    open_journal,
    save_study,
    save_table,
)
