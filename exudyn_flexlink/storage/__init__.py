"""A run on disk: a folder with everything in it.

``manifest.json`` names the files that a run wrote: a later one replaces these, and no others.
``result.nc`` is the run: the arrays as netCDF, with names, dimensions and units, and all else as
text. `load` gives the Result back exactly. ``summary.json`` and CSV files are printed from it, for
readers.
"""

from exudyn_flexlink.storage.arrays import Array, arrays_of, attributes_of
from exudyn_flexlink.storage.errors import StorageError
from exudyn_flexlink.storage.manifest import own_files
from exudyn_flexlink.storage.replacing import (
    KeptBesideError,
    replace_file,
    staged_files,
    staged_folder,
)
from exudyn_flexlink.storage.run import load, save
from exudyn_flexlink.storage.studies import (
    save_accuracy,
    save_against,
    save_comparison,
    save_fit,
    save_stability,
)
from exudyn_flexlink.storage.sweep import (
    SeriesKeeper,
    is_sweep,
    load_sweep,
    open_journal,
    save_table,
)
from exudyn_flexlink.storage.tables import (
    all_columns,
    lever_columns,
    touch_columns,
    trajectory_columns,
)
