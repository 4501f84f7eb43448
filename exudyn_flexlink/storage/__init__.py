"""A run on disk: a folder with everything in it, written whole or not at all.

``result.npz`` holds the arrays, ``summary.json`` everything else, readable; CSV files hold what a
reader plots first. `load` gives the Result back exactly.
"""

from exudyn_flexlink.storage.errors import PROGRAM, StorageError
from exudyn_flexlink.storage.reading import load, read_summary
from exudyn_flexlink.storage.staging import staged_folder
from exudyn_flexlink.storage.tables import lever_columns, trajectory_columns, write_csv
from exudyn_flexlink.storage.writing import save

__all__ = [
    "PROGRAM",
    "StorageError",
    "lever_columns",
    "load",
    "read_summary",
    "save",
    "staged_folder",
    "trajectory_columns",
    "write_csv",
]
