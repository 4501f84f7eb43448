"""Files of arrays of saved runs, changed as a damage or a stranger would change them."""

import hashlib
import json
from pathlib import Path

import numpy as np
from scipy.io import netcdf_file


def change_array(run, key, change):
    """Put what `change` makes of an array in its place; None leaves it out. The seal fits again."""
    file = Path(run, "result.nc")
    with netcdf_file(file, mmap=False) as old:
        variables = dict(old.variables)
        dimensions, attributes = dict(old.dimensions), dict(old._attributes)
    with netcdf_file(file, "w", version=2) as new:
        for name, text in attributes.items():
            setattr(new, name, text)
        for name, size in dimensions.items():
            new.createDimension(name, size)
        assert key in variables
        for name, own in variables.items():
            values = own.data.astype(own.data.dtype.newbyteorder("="))
            _put(new, name, own, change(values) if name == key else values)
    seal(run)


def _put(new, name, own, values):
    if values is None:
        return
    values = np.asarray(values)
    if values.dtype.kind == "U":
        values = values.astype("S9").view("S1").reshape(*values.shape, -1)
    if values.dtype == np.int64:
        values = values.astype(np.int32)
    dimensions = own.dimensions
    if values.shape != own.data.shape:
        dimensions = [f"changed {i}" for i in range(values.ndim)]
        for dimension, size in zip(dimensions, values.shape, strict=True):
            new.createDimension(dimension, size)
    made = new.createVariable(name, values.dtype.newbyteorder("="), dimensions)
    made[...] = values
    for key, text in own._attributes.items():
        setattr(made, key, text)


def change_bytes(run, change):
    """Put other bytes in place of those of the file. The seal fits again."""
    file = Path(run, "result.nc")
    file.write_bytes(change(file.read_bytes()))
    seal(run)


def seal(run):
    """Write the file's SHA-256 into the summary, so that a reader looks at what is in it."""
    summary = Path(run, "summary.json")
    data = json.loads(summary.read_text(encoding="utf-8"))
    data["sha256"] = {"result.nc": hashlib.sha256(Path(run, "result.nc").read_bytes()).hexdigest()}
    summary.write_text(json.dumps(data), encoding="utf-8")
