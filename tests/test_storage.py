import json
import shutil
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest
import results

from exudyn_flexlink.storage import (
    StorageError,
    load,
    save,
    staged_folder,
    trajectory_columns,
)
from exudyn_flexlink.storage.run import read_netcdf, write_netcdf


@pytest.fixture(scope="module")
def saved(rigid, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "rigid"
    with staged_folder(folder) as staged:
        save(rigid, staged)
    return folder


@pytest.fixture
def copy(saved, tmp_path):
    return Path(shutil.copytree(saved, tmp_path / "copy"))


def assert_same(one, other, where="result"):
    """Equal to the last bit, and of the same kind."""
    if isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, where
        np.testing.assert_array_equal(one, other, where)
    elif is_dataclass(one):
        for field in fields(one):
            here = f"{where}.{field.name}"
            assert_same(getattr(one, field.name), getattr(other, field.name), here)
    elif isinstance(one, dict):
        assert list(one) == list(other), where
        for key in one:
            assert_same(one[key], other[key], f"{where}.{key}")
    elif isinstance(one, tuple):
        assert len(one) == len(other), where
        for i, pair in enumerate(zip(one, other, strict=True)):
            assert_same(*pair, f"{where}.{i}")
    else:
        assert one == other, where


# --- round trip


def test_summary_is_for_reading(saved):
    text = (saved / "summary.json").read_text(encoding="utf-8")
    summary = json.loads(text, parse_constant=pytest.fail)  # JSON has no inf
    assert summary["program"] == "exudyn-flexlink"
    assert summary["outcome"]["completed"] is True
    first, second = summary["strikes"]["strike"]
    assert first["impulse_N_s"] == pytest.approx(4e-4)
    assert (first["lap"], second["lap"]) == (1, 3)
    assert summary["checks"]["steps_per_contact"] is None  # without bound


def test_tables(saved, tmp_path):
    table = np.genfromtxt(saved / "trajectory_link.end.csv", delimiter=",", names=True)
    axes = ("x_m", "y_m", "vx_m_per_s", "vy_m_per_s")
    assert table.dtype.names == ("t_s", "crank_angle_rad", *axes)
    np.testing.assert_allclose([table["x_m"][0], table["y_m"][0]], [0.11, 0], atol=1e-12)
    lever = np.genfromtxt(saved / "lever_lever.csv", delimiter=",", names=True)
    told = ("angle_rad", "rate_rad_per_s", "tip_displacement_m")
    assert lever.dtype.names == ("t_s", "crank_angle_rad", *told)
    save(results.slider(), tmp_path)  # which has no crank
    header = (tmp_path / "trajectory_block.nose.csv").read_text().splitlines()[0]
    assert header == ",".join(("t_s", *axes))


# --- sleeves


@pytest.fixture
def tilted(tilting, tmp_path):
    save(tilting, tmp_path / "tilted")
    return tmp_path / "tilted"


def test_summary_tells_how_much_a_link_touched(tilting, tilted):
    told = json.loads((tilted / "summary.json").read_text(encoding="utf-8"))["clearances"]["sleeve"]
    touches = tilting.sleeves["sleeve"].touches
    assert told["touches"] == len(touches.begin) == 10
    assert told["impacts"] == 6
    assert told["impulse_N_s"] == pytest.approx(touches.impulse.sum())
    assert told["energy_lost_J"] == pytest.approx(touches.energy_lost.sum())
    parts = [value for key, value in told.items() if key.startswith("part_of_time")]
    assert len(parts) == 4
    assert sum(parts) == pytest.approx(1)


def test_a_row_for_every_touch(tilting, tilted):
    table = np.genfromtxt(tilted / "touches_sleeve.csv", delimiter=",", names=True)
    assert ",".join(table.dtype.names) == (
        "begin_s,end_s,crank_angle_rad,pair,impulse_N_s,energy_lost_J,peak_force_N,"
        "approach_speed_m_per_s,place_m,penetration_m,tangential_impulse_N_s,ended"
    )
    sleeve = tilting.sleeves["sleeve"]
    np.testing.assert_allclose(table["begin_s"], sleeve.touches.begin, rtol=1e-11)
    np.testing.assert_allclose(table["crank_angle_rad"], results.SPEED * sleeve.touches.begin)
    assert np.all(table["ended"] == 1)
    first = sleeve.pairs[int(table["pair"][0]) - 1]  # in lap 2 the link tilts upwards first
    assert first == "sleeve: rod 1 on upper corner of the end"


def test_a_touch_that_lasts_has_no_end_and_comes_back_so(tilting, tmp_path):
    """Its row in the table ends with the run, and says that the touch does not."""
    before = len(tilting.time) * 13 // 32  # a quarter of lap 2, in which a corner is touched
    part = results.first_samples(tilting, before)
    save(part, tmp_path)
    back = load(tmp_path)
    assert_same(part, back)
    assert np.isinf(back.sleeves["sleeve"].touches.end).tolist() == [False, True]
    table = np.genfromtxt(tmp_path / "touches_sleeve.csv", delimiter=",", names=True)
    assert table["ended"].tolist() == [1, 0]
    assert table["end_s"][-1] == pytest.approx(part.time[-1])


# --- missing and foreign files


@pytest.mark.parametrize(
    ("folder", "why"), [("nowhere", "nowhere is no folder"), (".", r"has no result\.nc")]
)
def test_a_place_without_a_run(folder, why, tmp_path):
    with pytest.raises(StorageError, match=why):
        load(tmp_path / folder)


def test_one_file_is_the_run(copy, rigid, tmp_path):
    """Tables and the summary are printed from it: nothing is read back from them."""
    alone = shutil.copy(copy / "result.nc", tmp_path / "alone.nc")
    assert_same(rigid, load(alone))
    for file in copy.iterdir():
        if file.name != "result.nc":
            file.unlink()
    assert_same(rigid, load(copy))


def written_as(folder, **changes):
    """Write the file of a run whole, with something else in it."""
    file = folder / "result.nc"
    told = json.loads(read_netcdf(file).attributes["run"]) | changes
    write_netcdf(file, {}, {"run": json.dumps(told)})


@pytest.mark.parametrize(
    "changes",
    [
        {"scene": {"title": "nothing else"}},
        {"scene": None},
        {"contacts": None},
        {"checks": {"steps": 1}},
        {"outcome": {}},
        {"laps": [{"time": 1}]},
    ],
)
def test_what_is_no_run(copy, changes):
    written_as(copy, **changes)
    with pytest.raises(StorageError, match=r"result\.nc"):
        load(copy)


# --- whole or not at all


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, SystemExit])
def test_nothing_is_left_of_what_is_interrupted(error, tmp_path):
    """Of a run that is not interrupted nothing is there before it is whole."""

    def write():
        with staged_folder(tmp_path / "deep" / "run") as folder:
            (folder / "half").write_text("half")
            raise error

    with pytest.raises(error):
        write()
    assert list(tmp_path.iterdir()) == []


def test_velocities_of_a_trajectory_are_the_slopes_of_its_places(rigid):
    columns = trajectory_columns(rigid, "link.end")
    for axis in "xy":
        slopes = np.gradient(columns[f"{axis}_m"], rigid.time)[1:-1]
        told = columns[f"v{axis}_m_per_s"][1:-1]
        assert np.abs(slopes - told).max() < 0.02 * np.abs(told).max()
        assert np.sign(slopes @ told) == 1


def test_a_loaded_run_cites_no_place_in_its_file(copy):
    """Its scene is one line of thousands of letters, which nobody has written."""
    document = load(copy).scene.document
    assert document.data
    assert not document.text
    assert not document.places
