"""A run on disk: a folder with all its files.

``manifest.json`` names the files that a run wrote: a later run replaces these, and no others.
``result.nc`` is the run: its arrays as netCDF, with names, dimensions and units, and the rest as
text. `load` returns the same Result. ``summary.json`` and CSV files repeat parts of it for
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
