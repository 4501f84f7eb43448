"""The file of a run's arrays, as a stranger opens it: names, units, dimensions, inf."""

import json
from dataclasses import fields

import numpy as np
import pytest
import results
from scipy.io import netcdf_file
from test_storage import assert_same

import exudyn_flexlink as fl
from exudyn_flexlink.api.results import api_result
from exudyn_flexlink.result import Interval, Result
from exudyn_flexlink.storage import Array, arrays_of, load, save
from exudyn_flexlink.storage.run import read_netcdf, write_netcdf

INF = float("inf")
MADE = {
    "pendulum": results.pendulum,
    "slider": results.slider,
    "tilting link": lambda: results.tilting_link(samples=801),
    "rigid link": lambda: results.rigid_link(samples=401),
    "nothing touches": lambda: results.first_samples(results.tilting_link(801), 100),
}


def opened(folder):
    return pytest.importorskip("xarray").open_dataset(folder / "result.nc").load()


@pytest.mark.parametrize("made", MADE)
def test_the_file_is_the_dataset_of_python(made, tmp_path):
    """Names, dimensions, values, units: but for arrays without elements, which are only named."""
    xarray = pytest.importorskip("xarray")
    result = MADE[made]()
    save(result, tmp_path)
    assert_same(result, load(tmp_path))
    seen, own = opened(tmp_path), api_result(result).to_xarray()
    assert len(seen.attrs.pop("sha256")) == 64
    assert json.loads(seen.attrs.pop("run"))["engine"] == result.engine
    xarray.testing.assert_identical(seen, own[[n for n, a in own.data_vars.items() if a.size]])


def test_names_units_and_dimensions(tmp_path):
    save(results.rigid_link(samples=401), tmp_path)
    seen = opened(tmp_path)
    told = {
        "time": ("s", ("time",)),
        "poses.x": ("m", ("time", "part")),
        "rates.angle": ("rad/s", ("time", "part")),
        "drive_torques.motor": ("N m", ("time",)),
        "slot_forces.pin.y": ("N", ("time",)),
        "contacts.strike.gap": ("m", ("time",)),
        "contacts.strike.touches.begin": ("s", ("contacts.strike.touches",)),
        "contacts.strike.touches.impulse": ("N s", ("contacts.strike.touches",)),
        "extremes.lever.angle_rad.value": ("rad", ("extremes.lever.angle_rad",)),
        "extremes.lever.rate_rad_per_s.value": ("rad/s", ("extremes.lever.rate_rad_per_s",)),
        "energy.kinetic": ("J", ("time",)),
    }
    assert {name: (seen[name].attrs["units"], seen[name].dims) for name in told} == told
    assert all(seen[name].attrs["long_name"] for name in seen.variables)
    assert seen.attrs["outcome"] == "completed, at 2.51327412287 s"
    assert seen["contacts.strike.touches.slides_off"].dtype == bool
    result = load(tmp_path)
    tip = seen["poses.angle"].sel(part="lever")
    np.testing.assert_array_equal(tip, result.poses[:, -1, 2])


def test_what_has_no_bound_is_inf(tmp_path):
    """An impact's force, and the end of a contact that lasts."""
    made = results.rigid_link(samples=401)
    impact = Interval(0.2, 0.2, impulse=1e-3, peak_force=INF)
    result = results.touched(made, impact, Interval(2.4))
    save(result, tmp_path)
    with netcdf_file(tmp_path / "result.nc", mmap=False) as file:
        assert file.variables["contacts.strike.touches.end"].data.tolist() == [0.2, INF]
        assert file.variables["contacts.strike.touches.peak_force"].data.tolist() == [INF, 0.0]
    text = (tmp_path / "summary.json").read_text(encoding="utf-8")
    assert "inf" not in text.lower().replace("infinit", "")
    assert "nan" not in text.lower()
    assert_same(result, load(tmp_path))


@pytest.mark.parametrize("size", [0, 3])
def test_kinds_of_arrays(size, tmp_path):
    given = {
        "floats": np.array([-0.0, INF, 1e-300])[:size],
        "numbers": np.arange(3)[:size],
        "marks": np.array([True, False, True])[:size],
        "texts": np.array(["", "β", "letters"])[:size],
        "none at all": np.zeros((size, 0)),
    }
    arrays = {key: Array(("a", "b")[: value.ndim], value, {}) for key, value in given.items()}
    write_netcdf(tmp_path / "a.nc", arrays | {"one": Array((), np.array(2.0), {})}, {})
    read = read_netcdf(tmp_path / "a.nc")
    assert read.lengths.get("a", 0) == size
    assert read.arrays["one"] == 2.0
    filled = ["floats", "numbers", "marks", "texts"] if size else []
    assert sorted(read.arrays) == sorted([*filled, "one"])
    for key in filled:
        np.testing.assert_array_equal(read.arrays[key], given[key])


# --- what engines write


@pytest.mark.parametrize(
    ("model", "engine"), [("no_clearance", "lagrangian"), ("clearance", "exudyn")]
)
def test_what_an_engine_writes_comes_back(model, engine, tmp_path):
    scene = fl.load_scene(model, turns=0.55, tolerance=1e-4)
    result = fl.simulate(scene, engine, measure=False)
    result.save(tmp_path / "run")
    back = fl.load(tmp_path / "run")
    for field in fields(Result):
        if field.name != "scene":
            assert_same(getattr(result, field.name), getattr(back, field.name), field.name)
    assert set(arrays_of(back)) == set(arrays_of(result))
