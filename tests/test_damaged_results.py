"""Saved runs and time series that still load as files, but whose values can't be a run's."""

import io
import json
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
import results

from exudyn_flexlink import storage
from exudyn_flexlink.cli import main
from exudyn_flexlink.storage import StorageError, load, read_series

NAN, INF = float("nan"), float("inf")
HUGE = 10**400  # an integer of JSON that no float can hold


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    storage.save(results.rigid_link(samples=101), folder / "rigid")
    storage.save(results.tilting_link(801), folder / "tilting")
    return folder


@pytest.fixture(autouse=True)
def run(saved, tmp_path, monkeypatch):
    """Copies of a run with events and contacts, and of one with touches of walls."""
    monkeypatch.chdir(tmp_path)
    for name in ("rigid", "tilting"):
        shutil.copytree(saved / name, name)
    # Whatever is drawn after all is nonsense.
    monkeypatch.setattr("exudyn_flexlink.plots.save_figures", None)


def change_array(run, key, change):
    file = Path(run, "result.npz")
    with np.load(file) as read:
        arrays = dict(read)
    arrays[key] = change(arrays[key])
    if arrays[key] is None:
        del arrays[key]
    np.savez(file, **arrays)


def refused(run, capsys, file):
    """What `plot` says of a damaged run: one sentence, with the name of the file."""
    assert main(["plot", run]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"{Path(run, file)} is damaged")
    assert said.err.count("\n") == 1
    assert not list(Path(run).glob("*.png"))
    return said.err


def put(index, value):
    def change(array):
        array.flat[index] = value
        return array

    return change


ARRAYS = [
    "time", "poses", "rates", "drive_torques_0", "joint_forces_0", "slot_forces_0",
    "contacts_0_gap", "contacts_0_force", "energy_kinetic",
]  # fmt: skip
DAMAGE = {
    "a nan": put(50, NAN),
    "an infinity": put(50, INF),
    "beyond all bounds": lambda array: 1e200 * (array + 1),
    "nothing but nan": lambda array: NAN * array,
    "single precision": lambda array: array.astype(np.float32),
    "integers": lambda array: array.astype(int),
    "complex": lambda array: array.astype(complex),
    "text": lambda array: array.astype(str),
    "objects": lambda array: array.astype(object),
    "one short": lambda array: array[:-1],
    "another shape": lambda array: array[..., None],
    "a number": lambda array: np.float64(1.0),
    "missing": lambda array: None,
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_arrays(damage, saved, capsys):
    for key in ARRAYS:
        shutil.copy(saved / "rigid" / "result.npz", "rigid")
        change_array("rigid", key, DAMAGE[damage])
        said = refused("rigid", capsys, "result.npz")
        assert f"'{key}'" in said or damage == "objects"


@pytest.mark.parametrize(
    "change",
    [
        lambda time: time[::-1].copy(),
        lambda time: time - 1,
        lambda time: 0 * time,
        put(50, 0.0),
    ],
)
def test_time_that_does_not_go_on(change, capsys):
    change_array("rigid", "time", change)
    assert "'time' does not increase from 0 on" in refused("rigid", capsys, "result.npz")


def test_samples_at_one_instant_are_no_damage(capsys):
    change_array("rigid", "time", lambda time: put(50, time[49])(time))
    assert np.diff(load(Path("rigid")).time)[49] == 0


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("extremes_0_value", put(1, NAN)),
        ("extremes_0_value", lambda value: value[:-1]),
        ("extremes_0_time", lambda time: time[::-1]),
    ],
)
def test_damaged_extremes(key, change):
    change_array("rigid", key, change)
    with pytest.raises(StorageError, match="is damaged"):
        load(Path("rigid"))


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("sleeves_0_force", put(50, NAN)),
        ("sleeves_0_touches_begin", put(1, NAN)),
        ("sleeves_0_touches_begin", lambda begin: begin + 100),
        ("sleeves_0_touches_begin", lambda begin: begin[::-1]),
        ("sleeves_0_touches_end", put(1, NAN)),
        ("sleeves_0_touches_impulse", put(1, INF)),
        ("sleeves_0_touches_peak_force", lambda force: force[:-1]),
        ("sleeves_0_touches_pair", lambda pair: pair + 100),
    ],
)
def test_damaged_touches(key, change):
    change_array("tilting", key, change)
    with pytest.raises(StorageError, match="is damaged"):
        load(Path("tilting"))


@pytest.mark.parametrize("part", [0.0, 0.3, 0.9, 0.999])
def test_truncated_arrays(part, capsys):
    file = Path("rigid/result.npz")
    whole = file.read_bytes()
    file.write_bytes(whole[: int(part * len(whole))])
    refused("rigid", capsys, "result.npz")


def other(**changes):
    return lambda summary: summary | changes


def within(entry, **changes):
    return lambda summary: summary | {entry: summary[entry] | changes}


def a_lap(**changes):
    lap = {"time": 0.5, "kind": "lap", "name": "pin", "details": {"lap": 2.0}}
    return lambda summary: summary | {"laps": [lap | changes]}


def first_part(name):
    return lambda summary: summary | {"part_names": [name, *summary["part_names"][1:]]}


def measured(**changes):
    error = {"points": ["link.end"], "limit": 1e-6, "largest": 1e-3, "exceeds_from": 0.5,
             "stopped": None, "neighbour": {}, "missing": ""}  # fmt: skip
    return other(error=error | changes)


SUMMARIES = [
    ("samples", other(samples=101.5)),
    ("samples", other(samples=INF)),
    ("samples", other(samples=0)),
    ("samples", other(samples=-1)),
    ("part_names", first_part("other")),
    ("part_names", first_part("link 1")),
    ("part_names", first_part("")),
    ("names", within("names", contacts=["other"])),
    ("names", within("names", contacts=[])),
    ("names", within("names", drive_torques=["other"])),
    ("names", within("names", slot_forces=["other"])),
    ("laps", a_lap(time="soon")),
    ("laps", a_lap(time="nan")),
    ("laps", a_lap(time=-1)),
    ("laps", a_lap(kind=1)),
    ("laps", a_lap(name="other")),
    ("laps", a_lap(details={"place": "here"})),
    ("checks", within("checks", steps="many")),
    ("checks", within("checks", energy_residual=[])),
    ("outcome", within("outcome", completed="yes")),
    ("outcome", within("outcome", time="late")),
    ("outcome", within("outcome", reason=None)),
    ("timings", within("timings", solve="long")),
    ("settings", within("settings", step=[])),
    ("warnings", other(warnings=[1])),
    ("engine", other(engine=1)),
    ("versions", within("versions", numpy=2)),
    ("outcome", within("outcome", time=HUGE)),
    ("outcome", within("outcome", time=1e300)),
    ("laps", a_lap(time=HUGE)),
    ("laps", a_lap(time=1e20)),  # long after the run
    ("laps", a_lap(details={"place": HUGE})),
    ("checks", within("checks", largest_kinetic_energy=HUGE)),
    ("checks", within("checks", steps=HUGE)),
    ("timings", within("timings", solve=HUGE)),
    ("settings", within("settings", elements=HUGE)),
    ("settings", within("settings", elements="many")),
    ("error", measured(largest=HUGE)),
    ("error", measured(limit="little")),
    ("error", measured(limit=-1)),
    ("error", measured(exceeds_from="nan")),
    ("error", measured(stopped=-0.5)),
    ("error", measured(points=[1])),
]


@pytest.mark.parametrize(("entry", "change"), SUMMARIES)
def test_damaged_summaries(entry, change, capsys):
    file = Path("rigid/summary.json")
    file.write_text(json.dumps(change(json.loads(file.read_text()))))
    assert f"'{entry}'" in refused("rigid", capsys, "summary.json")


def test_a_summary_with_the_scene_of_another_run(capsys):
    """As many samples, and a scene that is whole: names tell."""
    file = Path("rigid/summary.json")
    summary = json.loads(file.read_text()) | {"scene": results.pendulum().scene.to_data()}
    file.write_text(json.dumps(summary))
    refused("rigid", capsys, "summary.json")


HEAD = "# made up\nt_s,S_x_m,S_y_m,lever_angle_rad\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEAD, "it has no rows"),
        (HEAD + "0,0,0\n1,0,0\n", "row 1 has 3 numbers instead of 4"),
        (HEAD + "0,0,0,0\n1,0,0\n", "row 2 has 3 numbers"),
        (HEAD + "0,0,0,nan\n", "not all of its numbers are finite"),
        (HEAD + "0,1e999,0,0\n", "not all of its numbers are finite"),
        (HEAD + "1,0,0,0\n0,0,0,0\n", "its time does not increase"),
        (HEAD + "0,0,zero,0\n", "could not convert"),
        ("", "can't be read"),
        ("# only notes\n", "can't be read"),
        ("t_s,x\n0,0\n", "its columns are not t_s,"),
    ],
)
def test_damaged_series(text, said):
    file = Path("series.csv")
    file.write_text(text, encoding="utf-8")
    with pytest.raises(StorageError, match=f"^{file}: can't be read as a time series.*") as told:
        read_series(file)
    assert said in str(told.value)


def test_a_series_of_bytes_that_are_no_text():
    file = Path("series.csv")
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(StorageError, match="can't be read as a time series"):
        read_series(file)


def test_a_series_that_is_whole():
    file = Path("series.csv")
    file.write_text(HEAD + "0,1,2,3\n0.5,4,5,6\n", encoding="utf-8")
    series = read_series(file)
    np.testing.assert_array_equal(series.time, [0, 0.5])
    np.testing.assert_array_equal(series.position, [[1, 2], [4, 5]])
    np.testing.assert_array_equal(series.lever_angle, [3, 6])


def test_an_array_whose_header_claims_more_than_there_is_memory(capsys):
    """The file is to blame, not the length of the run."""
    file = Path("rigid/result.npz")
    with zipfile.ZipFile(file) as read:
        members = {name: read.read(name) for name in read.namelist()}
    header = io.BytesIO()
    claimed = {"descr": "<f8", "fortran_order": False, "shape": (10**14,)}
    np.lib.format.write_array_header_1_0(header, claimed)
    with zipfile.ZipFile(file, "w") as written:
        for name, content in members.items():
            written.writestr(name, header.getvalue() if name == "time.npy" else content)
    said = refused("rigid", capsys, "result.npz")
    assert "too large for this machine: Unable to allocate" in said
    assert "shorten" not in said
