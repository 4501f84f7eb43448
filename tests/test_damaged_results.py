"""Saved runs that still load as files, but whose values can't be a run's."""

import json
import shutil
import struct
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import results
from netcdf_runs import change_array, change_bytes

from exudyn_flexlink import storage
from exudyn_flexlink.cli import main
from exudyn_flexlink.storage import StorageError, load
from exudyn_flexlink.storage.errors import FORMAT

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
    "time", "poses.x", "rates.angle", "drive_torques.motor", "joint_forces.crank.x",
    "slot_forces.pin.y", "contacts.strike.gap", "contacts.strike.force", "energy.kinetic",
]  # fmt: skip
DAMAGE = {
    "a nan": put(50, NAN),
    "an infinity": put(50, INF),
    "beyond all bounds": lambda array: 1e200 * (array + 1),
    "nothing but nan": lambda array: NAN * array,
    "single precision": lambda array: array.astype(np.float32),
    "integers": lambda array: array.astype(int),
    "text": lambda array: array.astype(str),
    "one short": lambda array: array[:-1],
    "another shape": lambda array: array[..., None],
    "a number": lambda array: np.float64(1.0),
    "missing": lambda array: None,
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_arrays(damage, saved, capsys):
    for key in ARRAYS:
        shutil.copytree(saved / "rigid", "rigid", dirs_exist_ok=True)
        change_array("rigid", key, DAMAGE[damage])
        assert f"'{key}'" in refused("rigid", capsys, "result.nc")


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
    assert "'time' does not increase from 0 on" in refused("rigid", capsys, "result.nc")


def test_samples_at_one_instant_are_no_damage(capsys):
    change_array("rigid", "time", lambda time: put(50, time[49])(time))
    assert np.diff(load(Path("rigid")).time)[49] == 0


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("extremes.lever.angle_rad.value", put(1, NAN)),
        ("extremes.lever.angle_rad.value", lambda value: value[:-1]),
        ("extremes.lever.angle_rad.time", lambda time: time[::-1]),
    ],
)
def test_damaged_extremes(key, change):
    change_array("rigid", key, change)
    with pytest.raises(StorageError, match="is damaged"):
        load(Path("rigid"))


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("sleeves.sleeve.force", put(50, NAN)),
        ("sleeves.sleeve.touches.begin", put(1, NAN)),
        ("sleeves.sleeve.touches.begin", lambda begin: begin + 100),
        ("sleeves.sleeve.touches.begin", lambda begin: begin[::-1]),
        ("sleeves.sleeve.touches.end", put(1, NAN)),
        ("sleeves.sleeve.touches.impulse", put(1, INF)),
        ("sleeves.sleeve.touches.peak_force", lambda force: force[:-1]),
        ("sleeves.sleeve.touches.pair", lambda pair: pair + 100),
    ],
)
def test_damaged_touches(key, change):
    change_array("tilting", key, change)
    with pytest.raises(StorageError, match="is damaged"):
        load(Path("tilting"))


@pytest.mark.parametrize("part", [0.0, 0.3, 0.9, 0.999])
def test_truncated_arrays(part, capsys):
    file = Path("rigid/result.nc")
    whole = file.read_bytes()
    file.write_bytes(whole[: int(part * len(whole))])
    refused("rigid", capsys, "result.nc")


def other(**changes):
    return lambda summary: summary | changes


def within(entry, **changes):
    return lambda summary: summary | {entry: summary[entry] | changes}


def a_lap(**changes):
    lap = {"time": 0.5, "kind": "lap", "name": "pin", "details": {"lap": 2.0}}
    return lambda summary: summary | {"laps": [lap | changes]}


def measured(**changes):
    error = {"points": ["link.end"], "limit": 1e-6, "largest": 1e-3, "exceeds_from": 0.5,
             "stopped": None, "neighbour": {}, "missing": ""}  # fmt: skip
    return other(error=error | changes)


SUMMARIES = [
    ("samples", other(samples=101.5)),
    ("samples", other(samples=INF)),
    ("samples", other(samples=0)),
    ("samples", other(samples=-1)),
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


@pytest.mark.parametrize(
    "change",
    [
        lambda names: np.full(names.shape, b"x"),
        lambda names: np.full(names.shape, b"\xff"),
        lambda names: np.zeros(len(names)),
        lambda names: None,
    ],
)
def test_damaged_names_of_parts(change):
    change_array("tilting", "part", change)
    with pytest.raises(StorageError, match="is damaged"):
        load(Path("tilting"))


def test_an_array_whose_header_claims_more_than_there_is(capsys):
    """The file is to blame, not the length of the run."""
    length = struct.pack(">i4s", 4, b"time")
    claimed = length + struct.pack(">i", 2**31 - 1)
    change_bytes("rigid", lambda old: old.replace(length + struct.pack(">i", 101), claimed))
    said = refused("rigid", capsys, "result.nc")
    assert "shorten" not in said


def test_no_memory_for_the_arrays(capsys, monkeypatch):
    def read(file):
        raise MemoryError("Unable to allocate 728. TiB")

    monkeypatch.setattr("exudyn_flexlink.storage.reading.read_netcdf", read)
    assert "too large for this machine: Unable to" in refused("rigid", capsys, "result.nc")


@pytest.mark.parametrize(
    "content", [b"", b"CDF", b"CDF\x02", b"CDF\x02" + bytes(99), b"\x89HDF\r\n\x1a\n", b"PK\3\4npz"]
)
def test_arrays_of_another_kind(content, capsys):
    change_bytes("rigid", lambda old: content)
    refused("rigid", capsys, "result.nc")


@pytest.mark.parametrize("flip", [0x01, 0x80, 0xFF])
def test_a_byte_of_the_header_that_is_flipped(flip, saved):
    """Even if nothing told that the file has changed: refused, or read with a text that differs."""
    whole = (saved / "rigid" / "result.nc").read_bytes()
    for at in range(4, 3000, 41):
        flipped = whole[:at] + bytes([whole[at] ^ flip]) + whole[at + 1 :]
        change_bytes("rigid", lambda _, flipped=flipped: flipped)
        with suppress(StorageError):
            load(Path("rigid"))


def test_an_array_that_was_changed_since(capsys):
    """A flipped byte of a number leaves a number: the SHA-256 in the summary tells."""
    file = Path("rigid/result.nc")
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)
    assert "not what was written" in refused("rigid", capsys, "result.nc")


def test_a_run_of_an_earlier_version(capsys):
    summary = json.loads(Path("rigid/summary.json").read_text(encoding="utf-8"))
    Path("rigid/summary.json").write_text(
        json.dumps(summary | {"format": FORMAT - 1}), encoding="utf-8"
    )
    Path("rigid/result.nc").rename("rigid/result.npz")
    assert main(["plot", "rigid"]) == 2
    assert capsys.readouterr().err == (
        "rigid/summary.json was written by an earlier version of this program "
        f"(format {FORMAT - 1}, this one reads {FORMAT}); run the model again\n"
    )
